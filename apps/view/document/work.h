#pragma once

#include <optional>
#include <string>

#include "apps/view/document/figures.h"
#include "apps/view/document/hand_link.h"
#include "apps/view/document/label_export.h"
#include "apps/view/document/mesh_pulling.h"
#include "apps/view/document/mesh_writing.h"
#include "apps/view/document/open_document.h"
#include "apps/view/document/order.h"
#include "apps/view/document/removed_material.h"
#include "apps/view/document/saving.h"
#include "apps/view/document/segmentation.h"

namespace palpate::view {

// A person's work on the document that a window shows: the document, and in parts of its own what
// is done to it.
class Work : public OpenDocument {
 public:
    // threaded: edits are done on a thread of their own, and can be saved; else
    // in settle() alone, and what comes out is a function of what goes in.
    Work(Source source, glm::uvec2 window_px, double text_scale, bool threaded);

    MeshPulling& mesh_pulling() { return mesh_pulling_; }
    const MeshWriting& mesh_writing() const { return mesh_writing_; }
    HandLink& hand() { return hand_; }
    const HandLink& hand() const { return hand_; }
    Segmentation& segmentation() { return segmentation_; }
    const Segmentation& segmentation() const { return segmentation_; }
    const LabelExport& label_export() const { return label_export_; }
    Saving& saving() { return saving_; }
    const Saving& saving() const { return saving_; }
    Figures& figures() { return figures_; }
    RemovedMaterial& removed() { return removed_; }

    void obey(const DocumentOrder& order, const ViewState& state); // by the part whose it is

    // For each frame, after the hand was followed: what has become of all that takes a while.
    void poll();
    // For each frame: notes of the state become steps, and steps that were undone are seen in it.
    // is_busy: a person is in the middle of a change.
    void follow_notes(ViewState& state, bool is_busy);
    // For each frame: numbers that the state asks for, and what of it is kept with the document.
    void watch(const ViewState& state);
    // Rays or the surface in the session's scene, as the state wants it; notes what it has become.
    void show_as_wanted(ViewState& state);

    // Nothing: not known yet.
    std::optional<Measured> measured(const Measure& measure);
    // Whether steps are lost that no project has, or a mesh that was pulled and is not in its
    // label.
    bool leaving_loses_edits();
    // A message that a person should read, once each: a refusal of the editor, or the result of a
    // save.
    Message take_message();

 private:
    void export_measures(const ViewState& state, const std::string& path);
    void step_back(bool is_undo); // or forward
    void tell_step();
    void tell_locked(); // that a stroke has met a locked label: once a stroke

    Figures figures_;
    MeshPulling mesh_pulling_;
    HandLink hand_;
    Segmentation segmentation_;
    LabelExport label_export_;
    MeshWriting mesh_writing_;
    Saving saving_;
    RemovedMaterial removed_;
    struct Stepping { // an undo or a redo that is on its way
        bool is_undo;
        size_t redo_steps; // before it
        uint64_t command;  // its number
    };
    std::optional<Stepping> stepping_;
    size_t met_spared_ = 0;            // EditState::met_spared, of which a person knows
    std::optional<RayCastLayer> rays_; // that the scene has no more
    bool labels_in_3d_ = false;        // as the state has it
};

} // namespace palpate::view
