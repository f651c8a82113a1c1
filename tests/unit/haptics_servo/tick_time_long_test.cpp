#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>
#include <thread>

#include "engine/edit/stroke_run.h"
#include "haptics/servo/servo_thread.h"
#include "tests/unit/haptics_servo/bench_loop.h"

extern char** environ;

// What a tick takes of its thread's processor time in a 512^3 volume, while an editor cuts at full
// speed and the program draws. PALPATE_TICKS (10^6) sets how many ticks, PALPATE_ALGORITHM
// (swept-tool) which algorithms, separated by commas. Bounds are those of this kind of machine.
namespace palpate::haptics {
namespace {

// The program, drawing without end on the software driver; ended with this.
class Drawing {
 public:
    Drawing() {
        const char* arguments[] = {
            PALPATE_PROGRAM, "--quiet", "render",   "synthetic:phantom?size=128",
            "--mode",        "alpha",   "--frames", "100000",
            "--orbit-deg",   "1",       "-o",       "/dev/null/none.png",
            nullptr};
        if (posix_spawn(&child_, PALPATE_PROGRAM, nullptr, nullptr, const_cast<char**>(arguments),
                        environ) != 0)
            child_ = -1;
    }
    ~Drawing() {
        if (child_ > 0) {
            kill(child_, SIGKILL);
            waitpid(child_, nullptr, 0);
        }
    }
    bool is_alive() const { return child_ > 0 && waitpid(child_, nullptr, WNOHANG) == 0; }

 private:
    pid_t child_ = -1;
};

// Plays records again and again.
class Again final : public Device {
 public:
    explicit Again(std::vector<DeviceRecord> records) : records_(std::move(records)) {}
    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override {
        sample = records_[next_++ % records_.size()].sample;
        sample.time_ns = now_ns;
        return DeviceStatus::ok;
    }
    DeviceStatus write(int64_t, const Wrench&) noexcept override { return DeviceStatus::ok; }
    void halt(int64_t) noexcept override {}

 private:
    DeviceCapabilities capabilities_{.workspace_m = glm::dvec3(0.2), .max_force_n = 8};
    std::vector<DeviceRecord> records_;
    size_t next_ = 0;
};

std::string setting(const char* name, const char* otherwise) {
    const char* value = std::getenv(name);
    return value ? value : otherwise;
}

void measure(const AlgorithmEntry& entry, const Volume& phantom, const TouchParameters& parameters,
             uint64_t ticks) {
    // The hand slides over the scalp at the forehead, and in and out of it.
    const TrajectoryShape shape{.at_mm = {0, -92, 0},
                                .direction = {0, 1, 0},
                                .depth_mm = 1.5,
                                .distance_mm = 15,
                                .duration_s = 10};
    const HandPath path = find_trajectory("slide")->make(shape);
    const std::vector<DeviceRecord> records =
        records_of_path(path, Workspace({0, 0, 0}, 1.0), kTick_ns);
    Servo::Options options;
    options.limits.ramp_s = 0.1;
    Loop loop{{.grey = phantom, .version = phantom.version()},
              parameters,
              entry.make(),
              std::make_unique<Again>(records)};

    std::atomic<bool> done = false;
    uint64_t published = 0;
    std::thread editor([&] { // one stroke after the other, on the far side of the hand's surface
        const Tool burr{.shape = make_ball(3.0)};
        Operation cut;
        cut.kind = OperationKind::cut;
        cut.to_value = -1000.0;
        uint64_t step = 0;
        while (!done) {
            auto stroke = StrokeRun::start(phantom, burr, cut);
            for (int i = 0; i < 200 && !done; ++i, ++step) {
                const HandPose pose = path.at(static_cast<double>(step % 10'000) * 1e-3);
                const palpate::ToolPose at{
                    1e-3 * i, pose.tool.position_mm + glm::dvec3(8, 0, 0), {1, 0, 0, 0}};
                (*stroke)->add(std::span(&at, 1));
                (*stroke)->work();
                const Volume now = (*stroke)->publish();
                loop.scenes.publish(std::make_unique<const TouchScene>(
                    TouchScene{.grey = now, .version = now.version()}));
                ++published;
            }
        }
    });
    const Drawing drawing;
    const int64_t steal = steal_ns();
    uint64_t contacts = 0;
    // Without sleeping in between: the processor's time is what is measured.
    for (uint64_t i = 0; i < ticks; ++i) {
        const int64_t due_ns = loop.now_ns += kTick_ns;
        contacts += loop.servo.tick(due_ns, due_ns).touched.contact != Contact::free;
        ToolStamp stamp;
        loop.poses.pop(stamp);
    }
    const bool drew = drawing.is_alive();
    done = true;
    editor.join();
    const Histogram& cpu = loop.servo.telemetry().cpu_ns;
    std::printf(
        "%s: %llu ticks, %.0f %% in contact, %llu edits beside them, drawing: %s; CPU of a "
        "tick in us: p50 %.1f, p99 %.1f, p99.9 %.1f, p99.99 %.1f, most %.1f; steal %.2f s\n",
        entry.name, static_cast<unsigned long long>(ticks),
        100.0 * static_cast<double>(contacts) / static_cast<double>(ticks),
        static_cast<unsigned long long>(published), drew ? "yes" : "no", cpu.percentile(0.5) / 1e3,
        cpu.percentile(0.99) / 1e3, cpu.percentile(0.999) / 1e3, cpu.percentile(0.9999) / 1e3,
        cpu.max() / 1e3, 1e-9 * static_cast<double>(steal_ns() - steal));
    EXPECT_TRUE(drew);
    EXPECT_GT(published, ticks / 1000);
    EXPECT_LE(cpu.percentile(0.5), 25'000u);
    EXPECT_LE(cpu.percentile(0.99), 60'000u);
    EXPECT_LE(cpu.percentile(0.999), 120'000u);
}

TEST(TickTime, Of340SamplesIn512CubedWhileAnEditorCutsAndTheProgramDraws) {
    const auto ticks = std::stoull(setting("PALPATE_TICKS", "1000000"));
    const std::string names = setting("PALPATE_ALGORITHM", "swept-tool") + ",";
    const Volume phantom = synthetic::sample_ct_phantom(
        make_grid(glm::uvec3(512), glm::dvec3(0.4), glm::dvec3(-102.2)));
    TouchParameters parameters;
    parameters.iso = -300.0;
    parameters.tool_radius_mm = 2.0;
    parameters.tool_samples = 340;
    for (size_t begin = 0, end; (end = names.find(',', begin)) != std::string::npos;
         begin = end + 1) {
        const AlgorithmEntry* entry = find_algorithm(names.substr(begin, end - begin));
        ASSERT_NE(entry, nullptr) << names;
        measure(*entry, phantom, parameters, ticks);
    }
}

} // namespace
} // namespace palpate::haptics
