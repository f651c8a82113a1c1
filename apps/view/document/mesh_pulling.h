#pragma once

#include <memory>
#include <optional>

#include "apps/view/document/label_changes.h"
#include "apps/view/document/open_document.h"
#include "apps/view/document/pulled_mesh.h"

namespace palpate::view {

// The mesh that a person pulls, from its making of a label to its end as one; and changes of
// a label as a whole. What takes a while runs on a thread of its own, one at a time.
class MeshPulling {
 public:
    explicit MeshPulling(OpenDocument& document);
    ~MeshPulling(); // stops what runs, and waits

    void make(uint16_t label);
    void apply(); // puts it into its label, but for locked ones
    void drop();  // or what makes it
    void change(const ViewState& state, const LabelChange& change); // the label that is drawn
    void poll();                                                    // for each frame

    PulledMesh* mesh() { return mesh_ ? &*mesh_ : nullptr; } // null: there is none
    bool is_pulled() const { return mesh_ && mesh_->is_pulled(); }
    std::optional<double> share() const; // of what runs, 0 .. 1; none: nothing does

 private:
    struct MeshRun;
    template <class Make>
    void start(uint16_t label, Make make);

    OpenDocument& document_;
    std::optional<PulledMesh> mesh_;
    std::unique_ptr<MeshRun> run_;
};

} // namespace palpate::view
