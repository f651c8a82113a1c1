#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/window/state.h"
#include "engine/base/ring.h"
#include "engine/session/session.h"
#include "haptics/device/hand_path.h"
#include "haptics/device/pointer_hand.h"
#include "haptics/device/registry.h"

namespace palpate::view {

// The device that a window begins with.
struct HandOptions {
    // As find_device() takes it, or kMouse; empty: none runs until a person starts one.
    std::string device;
    std::optional<haptics::HandPath> path; // of a simulated hand; none: the pointer moves it
    std::string algorithm = "swept-tool";
    // The devices of the machine.
    std::function<std::vector<haptics::DeviceEntry>()> list = haptics::list_devices;
};
constexpr const char* kMouse = "mouse";

// A tick of the servo, as the interface shows it.
struct TouchSample {
    bool usable = false; // the tool is known
    ToolPose probe, proxy;
    glm::dvec3 force_n{0.0}; // that was sent, in the world's axes
    double energy_mj = 0.0;
    uint32_t buttons = 0, faults = 0;
    haptics::Contact contact = haptics::Contact::free;
    haptics::PlateTouch plate;
    haptics::DeviceStatus status = haptics::DeviceStatus::ok;
};

// Whether what is felt with an algorithm follows edits: the mesh of swept-mesh is made once.
bool follows_edits(const haptics::AlgorithmEntry& algorithm);

// A device in the window: started and stopped, armed and disarmed by a person, never by itself, and
// what its ticks tell. Where the session has no threads the ticks come with frame(), one a
// millisecond of the frames' time, so that a script gives the same forces each time.
class Touch {
 public:
    // center_mm: of the volume, in the middle of a device's workspace. range_mm: half its size.
    Touch(Session& session, bool threaded, glm::dvec3 center_mm, glm::dvec3 half_size_mm);
    ~Touch(); // stops it

    void set_up(HandOptions options) { options_ = std::move(options); }
    const HandOptions& options() const { return options_; }

    // The device and the algorithm of the options, disarmed. A device that runs is stopped first.
    Result<void> start(const Stylus& stylus);
    void stop(); // there is no force, and no stroke is under way, when it returns
    bool running() const { return running_; }
    bool by_pointer() const { return running_ && pointer_ != nullptr; }
    void arm();
    void disarm() { session_->disarm(); }
    bool armed() const; // or about to be: what the newest tick says

    // Each frame, before the tool is drawn: ticks until time_s (without threads), then the pointer
    // goes to its new place, and what the ticks told is taken. A device that has ended or is gone
    // is stopped.
    void frame(const Stylus& stylus, double time_s);

    // The newest tick with a known tool; none before the first.
    const std::optional<TouchSample>& now() const { return now_; }
    // Each tick's touch of a plate since the last call, as long as one is pressed, and the first
    // without.
    std::vector<haptics::PlateTouch> take_plates() { return std::exchange(plates_, {}); }
    // The largest force and the last energy of each 10 ticks, oldest first; N and mJ.
    static constexpr size_t kPlotted = 400, kTicksAPoint = 10;
    const std::vector<float>& forces_n() const { return forces_n_; }
    const std::vector<float>& energies_mj() const { return energies_mj_; }
    const haptics::Telemetry* telemetry() const;
    std::string servo_text() const; // "SCHED_OTHER", and why; empty without a thread
    std::string take_message() { return std::exchange(message_, {}); }

    // For people: the names of devices that can be started without an argument.
    std::vector<std::string> devices() const;

 private:
    struct Opened {
        std::unique_ptr<haptics::HapticDevice> device;
        std::shared_ptr<haptics::PointerHand> pointer;
        haptics::Workspace workspace;
    };
    Result<Opened> open_device(const Stylus& stylus, int64_t start_ns) const;
    void note(const TouchSample& sample);
    void tick_until(double time_s);

    Session* session_;
    bool threaded_;
    glm::dvec3 center_mm_, half_size_mm_;
    HandOptions options_;
    std::unique_ptr<haptics::HapticDevice> device_; // outlives its use by the session
    std::shared_ptr<haptics::PointerHand> pointer_;
    bool running_ = false;
    std::string message_;
    std::optional<TouchSample> now_;
    haptics::DeviceStatus status_ = haptics::DeviceStatus::ok;
    std::vector<float> forces_n_, energies_mj_;
    std::vector<haptics::PlateTouch> plates_;
    int32_t plate_ = -1;
    float most_n_ = 0.0f; // of the point that is gathered
    size_t gathered_ = 0;
    Ring<TouchSample> samples_{1 << 12}; // from the servo's thread

    // Without threads.
    std::optional<double> time_s_; // of the last frame since the start
    double owed_s_ = 0.0;
    int64_t ticks_ = 0;
};

} // namespace palpate::view
