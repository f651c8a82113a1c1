// Random input to the window without a window: no crash, no hang, no message of validation, and a
// state in which everything is in its range.

#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <thread>

#include "apps/view/window/replay.h"
#include "haptics/device/hand_path.h"
#include "tests/support/given.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/random_hand.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

constexpr uint64_t kEventsASeed = 2500, kFramesAPicture = 150;
constexpr std::chrono::seconds kLongestFrame(120); // on a busy machine, with a picture

// Ends the program where a frame does not end, with the script that shows it.
class Watchdog {
 public:
    explicit Watchdog(std::string what) : what_(std::move(what)) {}
    void frame_begins() { begun_.store(clock::now().time_since_epoch().count()); }

 private:
    using clock = std::chrono::steady_clock;
    void watch(const std::stop_token& stop) {
        std::unique_lock lock(mutex_);
        while (!ended_.wait_for(lock, stop, std::chrono::seconds(1),
                                [&] { return stop.stop_requested(); })) {
            const clock::time_point begun{clock::duration(begun_.load())};
            if (clock::now() - begun < kLongestFrame)
                continue;
            std::fprintf(stderr, "a frame does not end; %s\n", what_.c_str());
            std::abort();
        }
    }
    std::string what_;
    std::atomic<clock::rep> begun_{clock::now().time_since_epoch().count()};
    std::mutex mutex_;
    std::condition_variable_any ended_;
    std::jthread thread_{[this](const std::stop_token& stop) { watch(stop); }}; // the last
};

bool is_finite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// The first thing of a state that is out of its range; empty where there is none.
std::string fault_of(const ViewState& state, const Grid& grid) {
    if (state.size_px.x < kSmallestWindow_px.x || state.size_px.y < kSmallestWindow_px.y)
        return "size";
    const glm::dvec3 at = index_point(grid, state.crosshair_mm);
    for (int axis = 0; axis < 3; ++axis) // the rounding of a point in the world and back
        if (!(at[axis] >= -1e-6 && at[axis] <= grid.size[axis] - 1.0 + 1e-6))
            return "crosshair";
    const Camera& camera = state.camera;
    if (!is_finite(camera.eye_mm) || !is_finite(camera.target_mm) || !is_finite(camera.up) ||
        !(glm::distance(camera.eye_mm, camera.target_mm) > 0.0) ||
        !(glm::length(glm::cross(camera.up, camera.target_mm - camera.eye_mm)) > 0.0))
        return "camera";
    for (const SliceView& slice : state.slices) {
        const double turn = glm::dot(glm::cross(slice.right, slice.up), slice.towards);
        if (!is_finite(slice.center_mm) || !(std::abs(turn - 1.0) < 1e-6))
            return "slice";
        if (!(slice.zoom >= 0.05 && slice.zoom <= 200.0))
            return "zoom";
    }
    const GreyWindow& window = state.window;
    if (!std::isfinite(window.low) || !std::isfinite(window.high) || !(window.low < window.high))
        return "window";
    if (!(state.radius_mm >= 0.1 && state.radius_mm <= 100.0))
        return "radius";
    if (!(state.label_opacity >= 0.0 && state.label_opacity <= 1.0))
        return "opacity";
    if (!is_finite(state.stylus.meant.position_mm))
        return "hand";
    for (const ClipPlane& plane : state.notes.clip_planes)
        if (!is_finite(plane.point_mm) || !(std::abs(glm::length(plane.normal) - 1.0) < 1e-6))
            return "clip plane";
    return "";
}

HandOptions random_device(RandomHand& random) {
    HandOptions hand;
    if (random.one_in(2))
        return hand;
    hand.device = random.one_in(2) ? kMouse : "falcon";
    if (hand.device == kMouse || random.one_in(2))
        return hand;
    std::vector<haptics::HandPose> poses(2 + random.below(40));
    const auto mm = [&] { return static_cast<double>(random.below(240)) - 120.0; };
    double time_s = 0.0;
    for (haptics::HandPose& pose : poses) {
        pose.time_s = time_s += 0.001 * static_cast<double>(1 + random.below(2000));
        pose.tool.position_mm = {mm(), mm(), mm()};
        pose.buttons = static_cast<uint32_t>(random.below(4));
    }
    hand.path = haptics::make_hand_path(std::move(poses)).value();
    return hand;
}

// The options of `palpate view` for a device; its path goes to a file.
std::string words_of(const HandOptions& hand, const std::filesystem::path& file) {
    if (hand.device.empty())
        return "";
    if (!hand.path)
        return " --hand " + hand.device;
    std::ofstream out(file);
    out << "time_s,x_mm,y_mm,z_mm,button\n";
    for (const haptics::HandPose& pose : hand.path->poses())
        out << fmt::format("{},{},{},{},{}\n", pose.time_s, pose.tool.position_mm.x,
                           pose.tool.position_mm.y, pose.tool.position_mm.z, pose.buttons);
    return fmt::format(" --hand {} --hand-path {}", hand.device, file.string());
}

class RandomInput : public ViewerTest, public ::testing::WithParamInterface<uint64_t> {
 protected:
    RandomInput() // fields that are typed name files: of this folder
        : folder_(std::filesystem::temp_directory_path() /
                  fmt::format("palpate.RandomInput.{}.{}", ::getpid(), GetParam())) {
        std::filesystem::create_directories(folder_);
        before_ = std::filesystem::current_path();
        std::filesystem::current_path(folder_);
    }
    ~RandomInput() override {
        std::filesystem::current_path(before_);
        if (!HasFailure())
            std::filesystem::remove_all(folder_);
    }

    void meet(uint64_t seed, uint64_t events, bool with_device = true) {
        RandomHand hand(seed);
        constexpr const char* volumes[] = {"synthetic:phantom?size=24", "synthetic:ball?size=9",
                                           "synthetic:gyroid?size=17,3,40&spacing=1,4,0.5",
                                           "synthetic:checkerboard?size=16",
                                           "synthetic:ramp?size=1"};
        volume_ = volumes[hand.below(std::size(volumes))];
        const glm::uvec2 size(480 + hand.below(300), 320 + hand.below(200));
        HandOptions device_of_hand = with_device ? random_device(hand) : HandOptions();
        Recorder script(script_, with_bars(size), 1.0); // as open() makes the window
        const std::string what =
            fmt::format("seed {}: palpate view '{}' --headless --state - --replay {}{}", seed,
                        volume_, script_.string(), words_of(device_of_hand, folder_ / "hand.csv"));
        Watchdog watchdog(what);
        std::puts(what.c_str()); // so that it is known after a crash
        std::fflush(stdout);
        open(volume_, size, std::move(device_of_hand));
        uint64_t done = 0;
        for (uint64_t frame = 1; done < events && !HasFailure(); ++frame) {
            std::vector<Event> input = hand.next(viewer());
            done += input.size();
            script.add(frame, input, viewer());
            watchdog.frame_begins();
            viewer().frame(std::move(input), hand.time_s());
            if (frame % kFramesAPicture == 0)
                draw();
            const std::string fault = fault_of(state(), grid());
            ASSERT_EQ(fault, "") << what;
            ASSERT_FALSE(viewer().failure()) << *viewer().failure() << "; " << what;
            ASSERT_EQ(device().validation_messages().size(), 0u)
                << device().validation_messages().front() << "; " << what;
        }
        for (int i = 1; i <= 2; ++i) // as replay() ends, in which a hand goes on
            viewer().frame({}, hand.time_s() + i * kFrame_s);
        state_json_ = json_line(viewer().dump());
        done_ += done;
    }

    // Draws all that is shown, at full quality.
    void draw() {
        const Result<void> drawn = viewer().draw_pictures();
        ASSERT_TRUE(drawn) << drawn.error().message;
        Commands commands(device());
        UiTarget target{GpuImage(device(), "frame",
                                 {.format = VK_FORMAT_R8G8B8A8_UNORM,
                                  .size = glm::uvec3(state().size_px, 1),
                                  .attachment = true})};
        viewer().record(commands, target);
        commands.submit();
        commands.ticket().wait();
    }

    uint64_t done_ = 0;
    std::string volume_, state_json_; // of the last seed

 private:
    std::filesystem::path folder_, before_;

 protected:
    const std::filesystem::path script_ = folder_ / "script.jsonl";
};

// RandomInput takes over 5 s of a processor: thousands of events have a frame each, and pictures
// are drawn between them.
TEST_P(RandomInput, EndsWithEverythingInItsRange) {
    const auto events = uint64_t(given("PALPATE_EVENTS", 5000));
    for (uint64_t seed = 1000 * GetParam(); done_ < events && !HasFailure(); ++seed)
        meet(seed, std::min(kEventsASeed, events - done_));
    EXPECT_GE(done_, events);
}

// A recording gives the same document, views and panels again.
using RandomRecording = RandomInput;
TEST_P(RandomRecording, EndsTheSameWhenItIsReplayed) {
    meet(GetParam(), 600, false);
    const Script script = load_script(script_).value();
    open_window(Source{open_synthetic(volume_)}, script.size_px);
    const Result<void> done = replay(viewer(), script);
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_EQ(json_line(viewer().dump()), state_json_);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomRecording, ::testing::Range<uint64_t>(100, 104));
INSTANTIATE_TEST_SUITE_P(Shares, RandomInput,
                         ::testing::Range<uint64_t>(0, uint64_t(given("PALPATE_SHARES", 4))));

} // namespace
} // namespace palpate::view
