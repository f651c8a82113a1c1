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
#include "apps/view/document/mesh_run.h"
#include "apps/view/document/milling_sound_output.h"
#include "apps/view/document/notes_link.h"
#include "apps/view/document/pulled_mesh.h"
#include "apps/view/document/segment_run.h"
#include "apps/view/document/touch.h"
#include "apps/view/tools/palette.h"
#include "apps/view/window/state.h"
#include "engine/base/json.h"
#include "engine/segment/live_wire.h"
#include "engine/session/project.h"
#include "engine/session/session.h"

namespace palpate::view {

// The document that a window opens.
struct Source {
    OpenedScene scene;
    std::optional<Project::Opened> project{}; // whose volumes the scene shows
    std::optional<KeptSteps> steps{};         // of what is no project
};

// A series of a DICOM folder.
struct SeriesLine {
    uint32_t number = 0;  // from 1, as --series takes it
    std::string text;     // "CT 'head', 30 images of 512 x 512 axial"
    std::string nameless; // the same without the description, which may hold a patient's name
    bool is_open = false;

    const std::string& shown(bool names_hidden) const { return names_hidden ? nameless : text; }
};
// Those that the reader's messages list: "series 1 of 3: CT 'head', 30 images of .., UID (read)".
std::vector<SeriesLine> series_in(const std::vector<std::string>& notes);

// The readers' notes as one message, without the lists of series: warnings first. If they are long,
// the first sentences, and how many more there are on standard error. The volume's path is replaced
// by its title, if it has one.
std::string said_of(const LoadedScene& loaded, const std::string& path, const std::string& title);

// The document that a window shows, as a session, and what a state is about.
class Work {
 public:
    // threaded: edits are done on a thread of their own, and can be saved; else
    // in settle() alone, and what comes out is a function of what goes in.
    Work(Source source, glm::uvec2 window_px, double text_scale, bool threaded);

    Session& session() { return session_; }
    const Session& session() const { return session_; }
    const Subject& subject() const { return subject_; }
    const LoadedScene& loaded() const { return loaded_; }
    const std::string& title() const { return title_; } // the file's name

    const std::string& path() const { return file_.volume; } // of the volume
    const std::vector<SeriesLine>& series() const { return series_; }
    void tell(std::string message) { message_ = std::move(message); }
    void tell_also(const std::string& message); // beside what is to be told already

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
    // How many steps of a window that ended without a word came back.
    size_t recovered_steps() const { return recovered_steps_; }
    // A person wants the steps that no project has no more: they go when this ends.
    void drop_steps() { steps_file_.drop(); }
    bool mesh_is_pulled() const { return mesh_ && mesh_->is_pulled(); }
    // How far a segmentation is: none under way, or its share, 0 .. 1.
    std::optional<double> segmenting() const;
    // The mesh that is pulled; and how far its making, or its end as labels, is: none under way.
    const std::optional<PulledMesh>& mesh() const { return mesh_; }
    std::optional<double> meshing() const;
    // The last method with a strength left this behind: a person may bound its objects anew.
    const std::optional<Strength>& strength() const { return strength_; }
    // The value that a method found from the data for a parameter in its last run; none: not yet.
    std::optional<double> found(const SegmentMethod& method, const char* parameter) const;

    // Labels of a file take the place of those that are there, as one step. On the volume's grid.
    void take_labels(LoadedVolume labels);

    bool is_drawing() const { return down_; } // a stroke of the mouse is under way

    // How another volume is shown over the slices, if no segmentation is seen there.
    void show_fused(FusionLayer layer) { fusion_ = std::move(layer); }

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

    // The newest of what is edited.
    EditState edited() { return session_.state(); }
    bool has_labels();                               // any samples of a label
    std::string name_of_label(uint32_t label) const; // "7", or "7 kidney" where it has a name
    std::optional<double> label_sample_mm3();        // that a sample of labels stands for

    // "(12, 40, 7)  143 HU  kidney"; empty outside the volume.
    std::string text_at(glm::dvec3 point_mm);
    const std::string& unit() const { return unit_; }
    double zero_hu() const { return zero_hu_; } // the value that stands for 0 HU in a CT

    // Everything that a test or a report of a fault wants to know.
    Json dump(const ViewState& state);

    static constexpr const char* kGrey = "volume";
    static constexpr const char* kLabels = "labels";
    // Seeds are labels, 1 .. kLastSeeded, but for kOutside, the seed of what is no object: label
    // 255 itself is kSeedOf255 there.
    static constexpr const char* kSeeds = "seeds";
    static constexpr uint16_t kOutside = 255, kSeedOf255 = 65535, kLastSeeded = 65534;

 private:
    // The value of a sample at a point of the document; none outside, or without the volume.
    std::optional<float> value_at(const std::string& volume, glm::dvec3 point_mm);
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

    bool put_labels();
    bool put_seeds();
    void show_seeds(const ViewState& state); // and the result's preview, over slices
    void clean_label(const Order& order, const ViewState& state);
    void obey_mesh(const Order& order, const ViewState& state);
    template <class Make>
    void run_mesh(uint16_t label, Make make);
    void poll_mesh();
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

    const bool threaded_;
    std::string title_, grey_, labels_, new_folder_, new_project_, message_;
    std::string said_; // of message_, by readers
    SceneFile file_;
    LoadedScene loaded_;
    std::string unit_; // of the values
    double zero_hu_;
    std::vector<SeriesLine> series_;
    StepsFile steps_file_; // outlives the session
    size_t recovered_steps_ = 0;
    Subject subject_;
    Session session_;
    NotesLink noted_;
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
    std::optional<FusionLayer> fusion_;            // of another volume
    std::unique_ptr<SegmentRun> segmenting_;
    std::optional<PulledMesh> mesh_;
    std::unique_ptr<MeshRun> meshing_;
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

// A map on which nothing is drawn yet.
Volume empty_labels(const Grid& grid);

// A text with another in the place of a name, wherever it stands there. An empty name: the text.
std::string without_name(std::string text, const std::string& name, const std::string& instead);

// Maps that a person may draw on are no edits: a project that lacks them gets empty ones, where it
// has no unsaved steps.
Result<void> add_maps(Project::Opened& project);

// Whether a person has locked a label: no tool takes samples away from it.
bool is_locked(const ViewState& state, uint16_t label);

// 1 .. 9: for a CT its usual windows, for others the default one; then all values; then the usual
// ones of a CT where no file says what the values are and they may be HU.
void add_windows(Subject& subject, const LoadedScene& loaded);

} // namespace palpate::view
