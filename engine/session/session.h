#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "engine/edit/edit_lag.h"
#include "engine/edit/editor.h"
#include "engine/scene/scene.h"
#include "engine/session/device_link.h"
#include "engine/session/felt_publisher.h"
#include "engine/session/kept.h"
#include "engine/session/milling_follower.h"
#include "engine/session/session_sources.h"
#include "engine/session/surface_follower.h"

namespace palpate {

// The state that a session begins with.
struct SessionSetup {
    Document document;
    std::string grey, labels;  // SessionSources
    Scene scene;               // how they are seen
    haptics::TouchScene touch; // SessionSources
    haptics::TouchParameters parameters;
    Kept kept;
    // The surface of the felt volume, for an algorithm that feels a mesh: touch.touch_mesh is its
    // mesh, and follows what is edited. Null: that stays as it is.
    std::shared_ptr<haptics::TouchSurface> felt_surface{};
    std::optional<float> mesh_iso; // of the grey volume's surface, kept up to date; none: none
    EditorOptions edit;            // threaded: whether the session has threads at all
};

// One person's work: a document that is seen, touched and carved at once.
//
//     servo --poses--> editor --states--> what is felt, the mesh, pictures
//
// While one of the device's two buttons is pressed its tool follows the proxy and carves: one
// stroke a press, so that operations that read the volume at tool-down take that of the press.
// Where the algorithm decides when to carve (Carving), the button says only which tool it is. The
// servo feels each change of the document as soon as it is published; the mesh follows it on a
// thread of its own; pictures take the newest state when they begin. lag() reports how far each is
// behind the hand. Who publishes wakes those who follow, and they sleep meanwhile; the servo's ring
// alone is polled, while a device's tool is down.
//
// The session joins the parts: Editor, FeltPublisher, SurfaceFollower, MillingFollower, DeviceLink.
//
// With threads (SessionSetup::edit.threaded) the servo ticks by the clock. Without them nothing
// happens but in tick() and settle(), and all that comes out is a function of what goes in, bit for
// bit, processor times apart.
//
// All members are for one thread, the interface's, but where another is named.
class Session {
 public:
    explicit Session(SessionSetup setup);
    ~Session(); // stops the device; what was pushed and commanded and is not done, is dropped
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    // Commands. Those of the document take their turn between strokes; false: too many at once.
    // The tool, what it does, to which volume. Smooth walls in the grey volume without a
    // surface_value take the iso-value that is felt now: the hole is then the tool's own to the
    // hand, and to the eye where set_iso() keeps both at one value. Strokes of stroke() and of the
    // device's first button are done with tool 0, those of its second one with tool 1.
    bool use(EditSetup setup, uint8_t tool = 0);
    // The device's button of this tool carves nothing until use().
    void lay_down(uint8_t tool) { device_.let_carve(tool, false); }
    bool undo() { return editor_.undo(); }
    bool redo() { return editor_.redo(); }
    bool put(NamedVolume volume, std::string title, Json parameters = Json::object(),
             NotePages::Texts notes = {}, EditLimits limits = {}) {
        return editor_.put(std::move(volume), std::move(title), std::move(parameters),
                           std::move(notes), std::move(limits));
    }
    bool note(NotePages::Texts pages, std::string title, bool is_step = true, bool joins = false) {
        return editor_.note(std::move(pages), std::move(title), is_step, joins);
    }
    bool remove(std::string volume) { return editor_.remove(std::move(volume)); }
    // See Editor. It comes to its turn at the end of a stroke under way; without threads a stroke
    // under way refuses it.
    Result<JournalChange> change_journal(Journal journal,
                                         std::optional<Document> from = std::nullopt);

    // Chooses the volumes and the tool that are seen, felt and meshed from now on. The force
    // follows without a jump (haptics/servo/force_fade.h).
    void choose(SessionSources sources);
    const SessionSources& sources() const { return sources_.latest(); }

    // A tool in a hand without a device, as a mouse is: down, moves and up of a stroke. False: the
    // ring is full, a device is running, or the stroke's order is not kept; nothing happened. A
    // move that is left out leaves no gap.
    bool stroke(EditInput::Kind kind, const StrokePose& pose) { return device_.stroke(kind, pose); }

    // Takes effect with the next tick; amounts (stiffness, friction, iso, radius) move to it in
    // steps that a hand does not feel, and after a change of tables and switches the force follows
    // without a jump.
    void feel(const haptics::TouchParameters& parameters);
    const haptics::TouchParameters& parameters() const { return parameters_.latest(); }
    // With the next picture: transfer functions, styles, camera. Its surfaces are live ones.
    void show(Scene scene);
    const Scene& scene() const { return scenes_.latest(); }
    // The iso-value of all of it: what is solid to the hand, the mesh, live surfaces, and of those
    // seen by rays the one that was at the value before, or else the first.
    void set_iso(double value);
    // The transfer function of all of it: of rays, and, where a hand feels opacities (a table in
    // TouchParameters::opacity), of the hand. Of more than HapticTransfer::kMostPoints points it
    // feels the function through those that are left when the ones that matter least have gone.
    void set_transfer(TransferFunction function);

    void keep(Kept kept) { kept_ = std::move(kept); }
    const Kept& kept() const { return kept_; }

    // One device at a time. A device that says it is not homed is homed first; it gives no force
    // until that is done. Force begins by a soft start.
    Result<void> start(SessionDevice device) { return device_.start(std::move(device)); }
    void stop(); // ends a stroke under way; no force is sent from now on
    // Act on the device that runs, if one does, with its next tick. arm() clears faults and begins
    // a soft start: call it when a person has asked for it. After disarm() there is no force.
    void arm() { device_.arm(); }
    void disarm() { device_.disarm(); }
    // Calibrates the device that was started last, if it has stopped (HapticDevice::calibrate()).
    Result<void> calibrate() { return device_.calibrate(); }
    DeviceReport device_report() const { return device_.report(); } // of the one started last

    // Scale, turn and clutch of the device; it moves there at a bounded rate (workspace.h). A start
    // begins with those of its SessionDevice.
    void move_workspace(const haptics::WorkspaceSettings& settings) {
        device_.move_workspace(settings);
    }
    const haptics::WorkspaceSettings& workspace() const { return device_.workspace(); }
    // So that the hand's right, up and towards the person are those of a picture by this camera.
    void align_workspace(const Camera& camera);

    // The servo of the device that was started last, also when it has stopped; null before the
    // first. The thread is null without threads.
    const haptics::Servo* servo() const { return device_.servo(); }
    const haptics::ServoThread* servo_thread() const { return device_.servo_thread(); }

    // Without threads: one tick, what it carves, and what the next one will feel of it.
    haptics::ServoTick tick(int64_t now_ns, int64_t due_ns);
    // Waits until all that was pushed and commanded before is done, felt and meshed.
    void settle();

    EditState state(); // the newest
    // How many inputs of strokes were accepted; EditState::inputs_done of them are done.
    uint64_t inputs_given() const { return device_.inputs_given(); }
    uint64_t commands_given() const { return editor_.commands_given(); } // and commands_done
    // Of all steps that can be undone, the oldest first, and behind them those that can be redone.
    std::vector<std::string> step_titles() const { return editor_.step_titles(); }
    // See Editor. Call it until it is empty.
    std::string take_refusal() { return editor_.take_refusal(); }
    haptics::TouchScene felt(); // the newest
    EditLag& lag() { return lag_; }

    // The material that strokes take away, for sound, dust and people: the newest, measured outside
    // the servo every kMeasure_ms (milling_follower.h). The same number makes the device vibrate.
    // Any thread; never waits.
    static constexpr int64_t kMeasure_ms = MillingFollower::kMeasure_ms;
    haptics::Milling milling() const noexcept { return milling_.milling(device_.speed_mm_per_s()); }

    // The mesh of the newest state that the mesher has got to; without threads, of the newest.
    // Empty without mesh_iso. Any thread.
    Mesh mesh() { return surface_.mesh(); }

    // For one drawing thread each.
    class Eye {
     public:
        // The contents of one picture. A copy shares all samples.
        struct Sight {
            Scene scene;
            SceneData data;
            EditState state;
        };
        Sight look();
        // When what look() gave had got to the device, and when its picture was done.
        void reached(EditLag::Reader reader, const Sight& sight, int64_t at_ns) {
            session_->lag_.reached(reader, sight.state, at_ns);
        }

     private:
        friend class Session;
        Eye(Session& session, Wake* wake);
        Session* session_;
        Mailbox<EditState>::Reader states_;
        Mailbox<Scene>::Reader scenes_;
        Mailbox<SessionSources>::Reader sources_;
        std::optional<Followers::Place> edits_, choices_;
    };
    // `wake` outlives the eye, and is woken where look() may give something else; null: nobody is.
    Eye add_eye(Wake* wake = nullptr) { return Eye(*this, wake); }

 private:
    void bridge(const std::stop_token& stop);

    const bool threaded_;
    Kept kept_;
    Wake bridge_wake_, settle_wake_; // of the bridge's thread, and of who settles
    Editor editor_;
    EditLag lag_;
    Mailbox<SessionSources> sources_;
    Mailbox<Scene> scenes_;
    Mailbox<haptics::TouchParameters> parameters_;
    Followers choices_; // woken after a publication of sources or of a scene
    FeltPublisher felt_;
    MillingFollower milling_;
    DeviceLink device_;
    SurfaceFollower surface_;
    Editor::Readers::Reader interface_states_;
    Mailbox<haptics::TouchScene>::Reader interface_felt_;
    Mailbox<haptics::TouchParameters>::Reader bridge_parameters_;
    Followers::Place bridge_edits_, bridge_choices_, settle_edits_;
    std::jthread bridge_thread_; // last: ends before the rest goes
};

} // namespace palpate
