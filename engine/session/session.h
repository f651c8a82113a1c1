#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "engine/edit/edit_lag.h"
#include "engine/edit/editor.h"
#include "engine/scene/scene.h"
#include "engine/session/kept.h"
#include "engine/surface/block_surface.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/proxy/swept_mesh.h"
#include "haptics/servo/brick_lock.h"
#include "haptics/servo/servo_thread.h"
#include "haptics/sound/milling.h"

namespace palpate {

// The volumes of a document that are seen and felt, and all that is felt beside them.
struct SessionSources {
    std::string grey, labels;  // names of volumes; empty or not in the document: none
    haptics::TouchScene touch; // a field, a mesh, a tool; its grey and labels are not used
    // Seen and not felt: more labels of the document, and grey values that are no part of it.
    std::string overlay{};
    std::optional<Volume> fused{};
};

// The state of a device, for people.
struct DeviceReport {
    std::string name;
    bool running = false;
    haptics::DeviceStatus status = haptics::DeviceStatus::ok; // of the newest tick
    haptics::SoftStart::Mode force = haptics::SoftStart::Mode::disarmed;
    uint32_t faults = 0; // haptics::fault_text() names them
    uint64_t ticks = 0;
};

// The state that a session begins with.
struct SessionSetup {
    Document document;
    std::string grey, labels;  // SessionSources
    Scene scene;               // how they are seen
    haptics::TouchScene touch; // SessionSources
    haptics::TouchParameters parameters;
    Kept kept;
    // Of the felt volume, for an algorithm that feels a mesh: touch.touch_mesh is its mesh, and
    // follows what is edited. Null: that stays as it is.
    std::shared_ptr<haptics::TouchSurface> felt_surface{};
    std::optional<float> mesh_iso; // of the grey volume's surface, kept up to date; none: none
    EditorOptions edit;            // threaded: whether the session has threads at all
};

// A device to touch with, and how.
struct SessionDevice {
    haptics::HapticDevice& device; // outlives its use
    const haptics::AlgorithmEntry& algorithm;
    haptics::Workspace workspace;
    // Its remove_button carves with tool 0, its second_button with tool 1.
    haptics::Servo::Options servo;
    // Threaded: memory that `after` uses, and what is done after each tick on the servo's thread
    // and under its rules; the ticks end where it says no. May be empty.
    std::vector<std::span<const std::byte>> memory;
    std::function<bool(const haptics::ServoTick&)> after;
    bool armed = true; // false: no force until arm()
    // Threaded: ServoThreadOptions::hung.
    std::function<void()> hung{};
};

// One person's work: a document that is seen, touched and carved at once.
//
//     servo --poses--> editor --states--> what is felt, the mesh, pictures
//
// While one of the device's two buttons is pressed its tool follows the proxy and carves: one
// stroke a press, so that operations that read the volume at tool-down take that of the press.
// Where the algorithm decides when to carve (Carving), the button says only which tool it is. The
// servo feels each change of the document as soon as it is published; the mesh follows it on a
// thread of its own; pictures take the newest state when they begin. No thread waits for another.
// lag() reports how far each is behind the hand.
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
    void lay_down(uint8_t tool) { carves_[tool].store(false, std::memory_order_release); }
    bool undo() { return editor_.undo(); }
    bool redo() { return editor_.redo(); }
    bool put(NamedVolume volume, std::string title, Json parameters = Json::object()) {
        return editor_.put(std::move(volume), std::move(title), std::move(parameters));
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
    bool stroke(EditInput::Kind kind, const StrokePose& pose);

    // Takes effect with the next tick; amounts (stiffness, friction, iso, radius) move to it in
    // steps that a hand does not feel, and after a change of tables and switches the force follows
    // without a jump.
    void feel(const haptics::TouchParameters& parameters);
    const haptics::TouchParameters& parameters() const { return parameters_.latest(); }
    // With the next picture: transfer functions, styles, camera. Its surfaces are live ones.
    void show(Scene scene);
    const Scene& scene() const { return scenes_.latest(); }
    // The iso-value of all of it: what is solid to the hand, the mesh, live surfaces, and the first
    // one seen by rays.
    void set_iso(double value);
    // The transfer function of all of it: of rays, and, where a hand feels opacities (a table in
    // TouchParameters::opacity), of the hand. Of more than HapticTransfer::kMostPoints points it
    // feels the function through those that are left when the ones that matter least have gone.
    void set_transfer(TransferFunction function);

    void keep(Kept kept) { kept_ = std::move(kept); }
    const Kept& kept() const { return kept_; }

    // One device at a time. A device that says it is not homed is homed first; it gives no force
    // until that is done. Force begins by a soft start.
    Result<void> start(SessionDevice device);
    void stop(); // ends a stroke under way; no force is sent from now on
    // Of the device that runs, if one does; with its next tick. arm() clears faults and begins a
    // soft start: call it when a person has asked for it. After disarm() there is no force.
    void arm();
    void disarm();
    // Of the device that was started last, where it has stopped (HapticDevice::calibrate()).
    Result<void> calibrate();
    DeviceReport device_report() const; // of the device that was started last

    // Scale, turn and clutch of the device; it moves there at a bounded rate (workspace.h). A start
    // begins with those of its SessionDevice.
    void move_workspace(const haptics::WorkspaceSettings& settings);
    const haptics::WorkspaceSettings& workspace() const { return workspaces_.latest(); }
    // So that the hand's right, up and towards the person are those of a picture by this camera.
    void align_workspace(const Camera& camera);

    // Of the device that was started last, also when it has stopped; null before the first. The
    // thread is null without threads.
    const haptics::Servo* servo() const { return servo_.get(); }
    const haptics::ServoThread* servo_thread() const { return servo_thread_.get(); }

    // Without threads: one tick, what it carves, and what the next one will feel of it.
    haptics::ServoTick tick(int64_t now_ns, int64_t due_ns);
    // Waits until all that was pushed and commanded before is done, felt and meshed.
    void settle();

    EditState state(); // the newest
    // How many inputs of strokes were accepted; EditState::inputs_done of them are done.
    uint64_t inputs_given() const { return pushed_.load(std::memory_order_acquire); }
    uint64_t commands_given() const { return editor_.commands_given(); } // and commands_done
    // Of all steps that can be undone, the oldest first, and behind them those that can be redone.
    std::vector<std::string> step_titles() const { return editor_.step_titles(); }
    // See Editor. Call it until it is empty.
    std::string take_refusal() { return editor_.take_refusal(); }
    haptics::TouchScene felt(); // the newest
    EditLag& lag() { return lag_; }

    // The material that strokes take away, for sound, dust and people: the newest, measured every
    // kMeasure_ms outside the servo, in the volume that is edited. Samples at or above the
    // iso-value are solid, and those of labels above 0. The same number makes the device vibrate.
    // Any thread; never waits.
    haptics::Milling milling() const noexcept;
    static constexpr int64_t kMeasure_ms = 10;

    // The mesh of the newest state that the mesher has got to; without threads, of the newest.
    // Empty without mesh_iso. Any thread.
    Mesh mesh();

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
        explicit Eye(Session& session);
        Session* session_;
        Mailbox<EditState>::Reader states_;
        Mailbox<Scene>::Reader scenes_;
        Mailbox<SessionSources>::Reader sources_;
    };
    Eye add_eye() { return Eye(*this); }

 private:
    void follow(const haptics::ServoTick& tick) noexcept; // the servo's thread
    // Hands a stroke's pose to the editor. The servo's thread; without a device the interface's.
    bool push(EditInput::Kind kind, const StrokePose& pose, uint8_t tool = 0) noexcept;
    bool publish_felt(); // the bridge's
    void bridge(const std::stop_token& stop);
    void measure_milling(int64_t now_ns); // where the last time is long enough ago
    bool update_mesh();                   // the mesher's
    void mesh_on(const std::stop_token& stop);

    const bool threaded_;
    Kept kept_;
    Editor editor_;
    EditLag lag_;
    Mailbox<SessionSources> sources_;
    Mailbox<Scene> scenes_;
    Mailbox<haptics::TouchScene> felt_;
    Mailbox<haptics::TouchParameters> parameters_;
    Mailbox<haptics::WorkspaceSettings> workspaces_;
    Editor::Readers::Reader interface_states_, bridge_states_, mesher_states_;
    Mailbox<haptics::TouchScene>::Reader interface_felt_;
    Mailbox<haptics::TouchParameters>::Reader bridge_parameters_;
    Mailbox<SessionSources>::Reader bridge_sources_, mesher_sources_;

    // Milling: written by the bridge, or by who ticks without threads; the servo reads removal_.
    struct {
        std::atomic<double> removed_mm3{0.0}, rate_mm3_per_s{0.0}, hardness{0.0};
    } milling_;
    std::atomic<float> removal_{0.0f};
    std::atomic<double> speed_mm_per_s_{0.0}; // of the tool that is down; by who pushes
    haptics::MillingMeter meter_;
    int64_t measured_ns_ = 0;
    uint64_t measured_commands_ = 0; // EditState::commands_done

    // The device.
    Ring<haptics::ToolStamp> stamps_{1 << 15}; // for the bridge, which locks bricks by them
    std::unique_ptr<haptics::Algorithm> algorithm_;
    std::unique_ptr<haptics::Servo> servo_;
    std::unique_ptr<haptics::ServoThread> servo_thread_;
    std::array<std::atomic<bool>, Editor::kTools> carves_{}; // there is such a tool
    // The servo's thread's own while a device is running, else the interface's.
    std::array<uint32_t, Editor::kTools> buttons_{}; // of the tools
    bool down_ = false;
    uint8_t tool_ = 0; // that is down
    StrokePose last_pose_;
    std::atomic<uint64_t> pushed_{0}; // for settle()
    bool running_ = false;            // a device; the interface's

    // The bridge's own.
    std::atomic<uint64_t> bridged_{0};         // the snapshot that felt_ has got to
    std::atomic<uint64_t> bridged_sources_{1}; // and the epoch of sources_
    haptics::BrickLock bricks_;
    std::shared_ptr<haptics::TouchSurface> felt_surface_;
    std::shared_ptr<const haptics::TouchMesh> felt_mesh_, first_felt_mesh_; // of felt_surface_

    std::mutex mesh_mutex_; // of what follows
    std::optional<BlockSurface> surface_;
    std::atomic<float> mesh_iso_;             // NaN: no mesh
    std::atomic<uint64_t> meshed_{0};         // the snapshot that surface_ has got to
    std::atomic<uint64_t> meshed_sources_{0}; // the epoch of sources_
    std::atomic<float> meshed_iso_{0.0f};     // and its iso-value

    std::jthread bridge_thread_, mesher_thread_; // last: end before the rest goes
};

} // namespace palpate
