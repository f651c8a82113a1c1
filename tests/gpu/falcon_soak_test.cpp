// A Falcon's driver on the model of one, in real time: the hand drills a head CT while pictures of
// it are drawn, and every 20 s something fails in the middle of it. PALPATE_SECONDS is how long. No
// fault may leave force, and memory stays flat.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include "engine/base/memory.h"
#include "engine/edit/stroke.h"
#include "engine/io/volume_io.h"
#include "engine/session/session.h"
#include "engine/volume/sample.h"
#include "engine/volume/synthetic.h"
#include "haptics/device/falcon/fake_falcon.h"
#include "haptics/device/falcon/falcon.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/flat_memory.h"
#include "tests/support/given.h"

namespace palpate {
namespace {

using namespace haptics;
using falcon::FakeFalcon;

constexpr int64_t kMs = 1'000'000;
constexpr double kRound_s = 20.0;
constexpr double kBone = 300.0;

struct Place {
    Volume volume;
    glm::dvec3 at_mm; // of the bone's surface, met along y
};

// The forehead of a head CT, or where it is not installed of the phantom.
Place forehead() {
    const std::filesystem::path file =
        "/usr/share/doc/invesalius-examples/examples/Cranium.inv3"; // Debian's invesalius-examples
    glm::dvec3 at(108, -220, 114);
    std::optional<Volume> volume;
    if (std::filesystem::exists(file)) {
        if (Result<LoadedVolume> loaded = load_volume(file))
            volume = loaded->volume;
    }
    if (!volume) {
        at = {0, -100, 0};
        volume = synthetic::sample_ct_phantom(
            make_grid(glm::uvec3(256), glm::dvec3(0.8), glm::dvec3(-102.0)));
    }
    while (!(trilinear(*volume, index_point(volume->grid(), at)) >= kBone))
        at.y += 0.1;
    return {*volume, at};
}

// Rests 12 mm in front of the surface, where force is allowed and fades in; from the 4th second on
// presses and moves about, to the 15th; and back. In millimetres of the device.
HandPath drilling(double seconds) {
    std::vector<HandPose> poses;
    const auto add = [&](double time_s, glm::dvec3 at_mm) {
        poses.push_back({.time_s = time_s, .tool = {.position_mm = at_mm}});
    };
    for (double begin_s = 0.0; begin_s < seconds + 2 * kRound_s; begin_s += kRound_s) {
        add(begin_s, {0, -12, 0});
        add(begin_s + 4.0, {0, -12, 0});
        for (int i = 0; i <= 20; ++i)
            add(begin_s + 5.0 + 0.5 * i, {6.0 * std::sin(0.9 * i), 3.0, 6.0 * std::cos(1.3 * i)});
        add(begin_s + 16.0, {0, -12, 0});
    }
    return HandPath(std::move(poses));
}

// The model's end of the cable, whose time begins with the test.
class SinceBegin final : public FakePeer {
 public:
    SinceBegin(FakeFalcon& model, int64_t begin_ns) : model_(model), begin_ns_(begin_ns) {}
    void advance(int64_t to_ns) override { model_.advance(to_ns - begin_ns_); }
    bool control(const UsbSetup& setup, std::span<const std::byte> bytes) override {
        return model_.control(setup, bytes);
    }
    bool out(uint8_t endpoint, std::span<const std::byte> bytes) override {
        return model_.out(endpoint, bytes);
    }
    int in(uint8_t endpoint, std::span<std::byte> room) override {
        return model_.in(endpoint, room);
    }
    void plugged() override { model_.plugged(); }

 private:
    FakeFalcon& model_;
    int64_t begin_ns_;
};

enum class Trouble { silent, failing_reads, garbage, encoder_jump, hang, unplugged, count };

// The driver, with a fault in each round 9 s after it has begun, and what is seen of its force.
// Between construction and destruction only the servo's thread touches model and transport.
class Troubled final : public HapticDevice {
 public:
    // Counts over all of them.
    struct Seen {
        std::atomic<uint64_t> faults{0}, in_contact{0}; // made; while force went out
        std::atomic<uint64_t> missed{0};                // force went out longer than it may
        std::atomic<int64_t> longest_ns{0};             // from a fault to the last force after it
        std::atomic<int64_t> longest_halt_ns{0};        // from a hang to the watchdog's halt
    };

    Troubled(std::unique_ptr<FalconDevice> device, FakeTransport& transport, FakeFalcon& model,
             int64_t begin_ns, Seen& seen)
        : device_(std::move(device)),
          transport_(transport),
          model_(model),
          begin_ns_(begin_ns),
          seen_(seen),
          round_(round_at(monotonic_ns())) {}

    const DeviceCapabilities& capabilities() const noexcept override {
        return device_->capabilities();
    }
    Result<void> home() override { return device_->home(); }
    bool wait(int64_t until_ns) noexcept override { return device_->wait(until_ns); }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override {
        // The button is pressed while the hand is in the bone.
        model_.buttons = at_s(now_ns) > 5.0 && at_s(now_ns) < 15.0 ? 1 : 0;
        if (round_at(now_ns) != round_ && at_s(now_ns) > 9.0) {
            round_ = round_at(now_ns);
            begin(now_ns);
        } else if (faulty_ && at_s(now_ns) > 9.5) {
            end();
        }
        return device_->read(now_ns, sample);
    }
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override {
        const bool pushes = wrench.force_n != glm::dvec3(0.0);
        is_pushing_ = pushes;
        if (fault_ns_ != 0 && pushes && at_s(now_ns) < 15.0) { // then it is allowed anew
            const int64_t late_ns = now_ns - fault_ns_;
            seen_.longest_ns = std::max(seen_.longest_ns.load(), late_ns);
            seen_.missed += ++pushes_ > kMost_ns / kMs && late_ns > kMost_ns;
        }
        return device_->write(now_ns, wrench);
    }
    void halt(int64_t now_ns) noexcept override {
        device_->halt(now_ns);
        halts_.fetch_add(1, std::memory_order_acq_rel);
    }
    static double at_s(int64_t now_ns, int64_t begin_ns) {
        return std::fmod(1e-9 * static_cast<double>(now_ns - begin_ns), kRound_s);
    }

 private:
    // 10 ms without samples (limits.too_late_ns) and two ticks; where the safety chain trips by
    // speed, as an encoder's jump may let it, its ramp of 20 ms. Missed is a force after this time
    // and in more ticks than fit into it: a tick that other programs held up is not the driver's.
    static constexpr int64_t kMost_ns = 12 * kMs + 20 * kMs;

    double at_s(int64_t now_ns) const { return at_s(now_ns, begin_ns_); }
    int64_t round_at(int64_t now_ns) const {
        return static_cast<int64_t>(1e-9 * static_cast<double>(now_ns - begin_ns_) / kRound_s);
    }
    void begin(int64_t now_ns) noexcept {
        faulty_ = true;
        fault_ns_ = now_ns;
        pushes_ = 0;
        ++seen_.faults;
        seen_.in_contact += is_pushing_;
        switch (static_cast<Trouble>(round_ % int64_t(Trouble::count))) {
            case Trouble::silent:
                model_.silent = true;
                break;
            case Trouble::failing_reads:
                transport_.set_fault([](Transfer& t, int64_t) {
                    if (t.is_in())
                        t.status = TransferStatus::failed;
                });
                break;
            case Trouble::garbage:
                transport_.set_fault([](Transfer& t, int64_t) {
                    for (size_t i = 2; t.is_in() && i < t.moved; ++i)
                        t.bytes[i] ^= std::byte{0x80};
                });
                break;
            case Trouble::encoder_jump:
                model_.encoder_shift = {3000, 0, 0};
                break;
            case Trouble::hang: {
                const uint64_t before = halts_.load(std::memory_order_acquire);
                constexpr int64_t kPatience_ns = 2'000 * kMs;
                while (halts_.load(std::memory_order_acquire) == before &&
                       monotonic_ns() < now_ns + kPatience_ns)
                    haptics::sleep_until(monotonic_ns() + kMs);
                const int64_t halted_ns = monotonic_ns() - now_ns;
                seen_.longest_halt_ns = std::max(seen_.longest_halt_ns.load(), halted_ns);
                seen_.missed += halted_ns >= kPatience_ns;
                fault_ns_ = 0; // this tick began before the hang, and the gate holds its force back
                break;
            }
            default:
                transport_.unplug();
        }
    }
    void end() noexcept {
        faulty_ = false;
        model_.silent = false;
        model_.encoder_shift = {};
        transport_.set_fault(nullptr);
        fault_ns_ = 0;
    }

    std::unique_ptr<FalconDevice> device_;
    FakeTransport& transport_;
    FakeFalcon& model_;
    const int64_t begin_ns_;
    Seen& seen_;
    int64_t round_, fault_ns_ = 0, pushes_ = 0; // ticks with force since the fault
    bool faulty_ = false, is_pushing_ = false;
    std::atomic<uint64_t> halts_{0};
};

class FalconSoak : public GpuTest {};

TEST_F(FalconSoak, DrillsBesidePicturesWithoutAMissedHaltAndWithFlatMemory) {
    const double seconds = given("PALPATE_SECONDS", 3);
    return_freed_memory(); // as the program
    const Place place = forehead();
    Scene scene;
    scene.size_px = {160, 120};
    scene.camera.target_mm = place.at_mm;
    scene.camera.eye_mm = place.at_mm + glm::dvec3(60, -180, 40);
    scene.camera.view_angle_deg = 30.0;
    scene.ray_cast.emplace();
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{kBone}};
    std::vector<std::byte> firmware(4999, std::byte{7});
    const int64_t begin_ns = monotonic_ns();
    FakeFalcon model({.firmware = firmware,
                      .is_loaded = false,
                      .is_homed = false,
                      .homing_packets = 30,
                      .path = drilling(seconds)});
    SinceBegin peer(model, begin_ns);
    Troubled::Seen seen;
    std::unique_ptr<Troubled> falcon; // outlives the session
    Session session(
        {.document = *make_document({{"head", VolumeKind::grey, place.volume}}),
         .grey = "head",
         .labels = "",
         .scene = scene,
         .parameters = {.iso = kBone, .tool_radius_mm = 1.95, .stiffness_n_per_m = 500.0}});
    // It takes away 0.05 mm more than it touches, so that a hand that moves on is held back.
    const Stroke mill = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 2})", ""),
                                     {.kind = OperationKind::cut, .to_value = -1000.0}, {{}});
    ASSERT_TRUE(session.use({mill.shape, mill.tool, mill.operation, "head", ""}));
    auto eye = session.add_eye();
    Renderer renderer(device());

    uint64_t ticks = 0, trips = 0, opened = 0;
    const auto count = [&] {
        if (session.servo()) {
            ticks += session.servo()->telemetry().ticks;
            trips += session.servo()->telemetry().trips;
        }
    };
    const auto open = [&] {
        auto transport = std::make_unique<FakeTransport>(peer, monotonic_clock());
        FakeTransport& cable = *transport;
        Result<std::unique_ptr<FalconDevice>> driver =
            FalconDevice::open(std::move(transport), firmware);
        ASSERT_TRUE(driver) << driver.error().message;
        ++opened;
        falcon = std::make_unique<Troubled>(std::move(*driver), cable, model, begin_ns, seen);
        const Result<void> started = session.start({*falcon,
                                                    *find_algorithm("swept-tool"),
                                                    Workspace(place.at_mm, 1.0),
                                                    {.remove_button = 0},
                                                    {},
                                                    {}});
        ASSERT_TRUE(started) << started.error().message;
    };
    ASSERT_NO_FATAL_FAILURE(open());

    std::vector<double> lowest_mib;
    uint64_t pictures = 0, undone = 0;
    bool is_fresh = true; // the round's strokes are not taken back yet
    const auto since_s = [&] { return 1e-9 * static_cast<double>(monotonic_ns() - begin_ns); };
    while (since_s() < seconds && !HasFailure()) {
        const int64_t drawn_ns = monotonic_ns();
        const Session::Eye::Sight sight = eye.look();
        ASSERT_TRUE(renderer.draw(sight.scene, sight.data));
        ++pictures;
        // A person, while the hand rests: plugs in again, allows force, takes strokes back.
        const DeviceReport report = session.device_report();
        const double at_s = Troubled::at_s(monotonic_ns(), begin_ns);
        if (report.status == DeviceStatus::gone && at_s > 16.5) {
            count();
            session.stop();
            falcon.reset();
            model.plugged();
            ASSERT_NO_FATAL_FAILURE(open());
        } else if (at_s > 16.5 && (report.faults & kFaultLatched)) {
            session.arm();
        }
        if (at_s > 17.0 && is_fresh) {
            is_fresh = false;
            for (size_t n = session.state().undo_steps; n > 0; --n)
                undone += session.undo();
        } else if (at_s < 10.0) {
            is_fresh = true;
        }
        const auto minute = static_cast<size_t>(since_s() / 60.0);
        lowest_mib.resize(std::max(lowest_mib.size(), minute + 1), resident_mib());
        lowest_mib[minute] = std::min(lowest_mib[minute], resident_mib());
        // Half of the time is left to others.
        haptics::sleep_until(2 * monotonic_ns() - drawn_ns);
    }
    count();
    session.stop();
    session.settle();
    std::printf(
        "    %.0f s: %zu ticks, %zu pictures, opened %zu times, %zu strokes taken back; %zu "
        "faults, %zu of them under force, %zu missed; force at most %.1f ms after one, a hang "
        "halted after %.1f ms at most, %zu trips\n",
        seconds, size_t(ticks), size_t(pictures), size_t(opened), size_t(undone),
        size_t(seen.faults), size_t(seen.in_contact), size_t(seen.missed),
        1e-6 * double(seen.longest_ns), 1e-6 * double(seen.longest_halt_ns), size_t(trips));
    EXPECT_EQ(seen.missed, 0u);
    EXPECT_GT(ticks, 100 * static_cast<uint64_t>(seconds));
    if (seconds > 2 * kRound_s) {
        EXPECT_GT(2 * seen.faults, static_cast<uint64_t>(seconds / kRound_s));
        EXPECT_GT(2 * seen.in_contact, seen.faults);
        EXPECT_GT(undone, 0u);
    }
    expect_flat_memory(std::move(lowest_mib));
}

} // namespace
} // namespace palpate
