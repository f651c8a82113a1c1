#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "apps/palpate/open_scene.h"
#include "apps/view/document/dust_cloud.h"
#include "apps/view/document/figures.h"
#include "apps/view/document/hand_tool.h"
#include "apps/view/document/kept_steps.h"
#include "apps/view/document/label_export.h"
#include "apps/view/document/mesh_pulling.h"
#include "apps/view/document/milling_sound_output.h"
#include "apps/view/document/notes_link.h"
#include "apps/view/document/segment_run.h"
#include "apps/view/document/touch.h"
#include "apps/view/tools/palette.h"
#include "apps/view/window/state.h"
#include "engine/base/json.h"
#include "engine/segment/live_wire.h"
#include "engine/session/project.h"
#include "engine/session/session.h"

namespace palpate::view {

// The document that a window shows, as a session, and what a state is about.
class Work : public OpenDocument {
 public:
    // threaded: edits are done on a thread of their own, and can be saved; else
    // in settle() alone, and what comes out is a function of what goes in.
    Work(Source source, glm::uvec2 window_px, double text_scale, bool threaded);

    MeshPulling& mesh_pulling() { return mesh_pulling_; }

    // Does what an event asks for; `open` is the caller's.
    void obey(const Order& order, const ViewState& state);

    // The hand, each frame: gives its buttons their tools, moves a hand that the pointer is, ticks
    // where nothing is threaded, and notes in the state what it has become.
    void follow_hand(ViewState& state, double time_s);
    Touch& touch() { return touch_; }
    const DustCloud& dust() const { return dust_; }
    const MillingSoundOutput& sound() const { return sound_; }
    // How far the document is behind the hand: inputs that it does not have yet, and for how long
    // the oldest of them has waited, to a frame. None is dropped.
    struct Backlog {
        uint64_t inputs = 0;
        double seconds = 0.0;
    };
    const Backlog& backlog() const { return backlog_; }
    static constexpr double kFarBehind_s = 1.0; // a person is told
    // What of a hand lies in the 3D view: its tool at the proxy, and widgets that it can press.
    struct HandSurface {
        SurfaceLayer layer;
        std::shared_ptr<const Mesh> mesh;
    };
    std::vector<HandSurface> hand_surfaces(const ViewState& state);

    // Rays or the surface in the session's scene, as the state wants it; notes what it has become.
    void show_as_wanted(ViewState& state);

    // Saves in the background, to the project that is open or to a new one in
    // `folder`, with the state's camera and window.
    void save(const ViewState& state, const std::string& folder);
    bool has_project() const { return project_.has_value(); }
    // The folder of a project that a save has made: once.
    std::string take_new_project() { return std::exchange(new_project_, {}); }
    // A save to a new project that failed, and why: once.
    struct FailedSave {
        std::string folder, reason;
    };
    std::optional<FailedSave> take_failed_save() {
        return std::exchange(failed_save_, std::nullopt);
    }
    // The folder that a new project is offered, one that is not there: named after the file, or,
    // where names are hidden, not.
    std::string new_folder(bool names_hidden) const;
    // A message without the names of the file and of the project that are open, and without what
    // readers said: other files of the folder have names, too.
    std::string without_names(std::string message) const;
    bool is_saving() const;
    // Whether steps are lost that no project has, or a mesh that was pulled and is not in its
    // label. What cuts and colours the view alone is no loss.
    bool leaving_loses_edits();
    // How far a segmentation is: none under way, or its share, 0 .. 1.
    std::optional<double> segmenting() const;
    // The last method with a strength left this behind: a person may bound its objects anew.
    const std::optional<Strength>& strength() const { return strength_; }
    // The value that a method found from the data for a parameter in its last run; none: not yet.
    std::optional<double> found(const SegmentMethod& method, const char* parameter) const;

    bool is_drawing() const { return down_; } // a stroke of the mouse is under way

    // For each frame: what became of a save, and autosaves.
    void poll();
    // For each frame: notes of the state become steps, and steps that were undone are seen in it.
    // is_busy: a person is in the middle of a change.
    void follow_notes(ViewState& state, bool is_busy);
    // For each frame: numbers that the state asks for, and what of it is kept with the document.
    void watch(const ViewState& state);
    Figures& figures() { return figures_; }
    // Nothing: not known yet.
    std::optional<Measured> measured(const Measure& measure);
    // A message that a person should read, once each: a refusal of the editor, or the result of a
    // save.
    std::string take_message();

    // Everything that a test or a report of a fault wants to know.
    Json dump(const ViewState& state);

    // Seeds are labels, 1 .. kLastSeeded, but for kOutside, the seed of what is no object: label
    // 255 itself is kSeedOf255 there.
    static constexpr uint16_t kOutside = 255, kSeedOf255 = 65535, kLastSeeded = 65534;

 private:
    void take_project(Project project);
    bool take_tool(const ViewState& state);
    // The edit that a stroke makes; none where seed_brush() has none.
    std::optional<EditSetup> edit_of(Carve carve, TipShape shape, const ViewState& state);
    // None where there are no seeds to paint on yet, or of the label.
    std::optional<EditSetup> seed_brush(const ViewState& state, TipShape shape);
    // An operation on labels: to those, and to the values, that a person lets it change.
    void confine(EditSetup& setup, const ViewState& state);
    // The labels that an operation on labels may change; nothing where none is locked.
    std::optional<std::vector<uint16_t>> free_labels(const ViewState& state);
    void export_measures(const ViewState& state, const std::string& path);
    void begin_export(const ViewState& state, const std::string& path); // of labels
    void poll_export();
    ToolFor tool_for() const;
    void hold_tools(const ViewState& state);
    void measure_backlog(double time_s);
    void press_widgets(ViewState& state);
    uint32_t granted_buttons(const ViewState& state, double time_s);
    void move_by_hand(ViewState& state);
    void follow_milling(const ViewState& state, double time_s);
    void obey_hand(const Order& order, const ViewState& state);
    Json dump_hand(const ViewState& state);
    Json dump_segmenting(const ViewState& state) const;

    bool put_seeds();
    void show_seeds(const ViewState& state); // and the result's preview, over slices
    void begin_segmenting(const ViewState& state);
    void begin_bounding(const ViewState& state);
    void run_segmenting(SegmentJob job);
    std::string told_of(const SegmentJob& job, const SegmentDone& done);
    void step_back(bool is_undo); // or forward
    void tell_step();
    void follow_bound(const std::optional<Notes::Bound>& bound); // where a step has changed it
    void keep_strength();
    void poll_segmenting();
    std::vector<glm::uvec3> wire_path(glm::uvec3 from, glm::uvec3 to, int axis); // Subject::path
    void fill_wire(const ViewState& state);

    std::string new_folder_, new_project_, said_;
    Document opened_; // with the steps that came back
    Figures figures_;
    bool down_ = false;
    StrokePose last_;
    ToolRack rack_;
    Backlog backlog_;
    std::deque<std::pair<uint64_t, double>> given_; // inputs by a frame's time, not all done
    struct Stepping {                               // an undo or a redo that is on its way
        bool is_undo;
        size_t redo_steps; // before it
        uint64_t command;  // its number
    };
    std::optional<Stepping> stepping_;
    bool labels_asked_ = false, seeds_asked_ = false; // an empty map is on its way
    std::optional<Strength> strength_;
    std::deque<Strength>
        strengths_; // of steps, that undo and redo may come back to; the newest last
    std::map<std::string, ParameterValues> found_; // by method
    std::unique_ptr<SegmentRun> segmenting_;
    MeshPulling mesh_pulling_;
    std::unique_ptr<LabelExport> exporting_;
    std::optional<Volume> segment_look_; // what it has come to
    struct WireSlice {                   // of which volume
        uint64_t version;
        int axis;
        uint32_t layer;
        friend bool operator==(const WireSlice&, const WireSlice&) = default;
    };
    std::optional<LiveWire> wire_; // what it knows of wire_slice_, from wire_anchor_
    std::optional<WireSlice> wire_slice_;
    std::optional<glm::uvec3> wire_anchor_;
    Touch touch_; // after the session that it stops
    TipMesh tip_;
    DustCloud dust_;
    MillingSoundOutput sound_;
    std::vector<Widget3d> palette_; // that is felt and drawn
    haptics::PlateTouch pressed_;   // of it, as drawn
    std::shared_ptr<const Mesh> palette_mesh_;
    bool widget_down_ = false;
    uint32_t pressed_buttons_ = 0;       // of the pointer's hand, in the last frame
    uint32_t granted_ = 0;               // of those that are pressed
    std::optional<double> held_since_s_; // the others are not, from when on; infinite: it was told
    std::optional<Volume> before_press_; // the grey values, while it presses
    struct HandPull {                    // of the mesh, by the hand's button
        glm::dvec3 held_mm, from_mm;
    };
    std::optional<HandPull> hand_pull_;
    std::optional<RayCastLayer> rays_; // that the scene has no more
    std::optional<Project> project_;   // after the session that its saves look at
    std::optional<Project::Creation> creation_;
    std::string creating_; // the folder of creation_
    std::optional<FailedSave> failed_save_;
};

// A text with another in the place of a name, wherever it stands there. An empty name: the text.
std::string without_name(std::string text, const std::string& name, const std::string& instead);

// Maps that a person may draw on are no edits: a project that lacks them gets empty ones, where it
// has no unsaved steps.
Result<void> add_maps(Project::Opened& project);

} // namespace palpate::view
