// Servo, editor, mesher, pictures and interface at once: a hand on a path that drills at random,
// and a person who clicks, types and drags at random. PALPATE_SECONDS is how long; the memory and
// the ticks are looked at meanwhile. And the same in a process that is killed, PALPATE_KILLS times.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <thread>

#include "engine/base/memory.h"
#include "engine/base/profile.h"
#include "engine/edit/replay.h"
#include "engine/session/project.h"
#include "engine/volume/content_hash.h"
#include "tests/support/flat_memory.h"
#include "tests/support/given.h"
#include "tests/support/kill.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPath_s = 20.0; // of one path; then the hand is started again
constexpr double kFile_s = 60.0; // then the file is opened anew, and the steps of undo go
const char* const kVolume = "synthetic:ball?size=64";

// To and fro about the ball's surface, with both buttons now and then.
haptics::HandPath drilling(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::vector<haptics::HandPose> poses;
    for (double t = 0; t <= kPath_s; t += 0.2) {
        const glm::dvec3 way = glm::normalize(glm::dvec3(normal(random), normal(random), 2.0));
        poses.push_back({.time_s = t,
                         .tool = {.position_mm = (34.0 + 3.0 * normal(random)) * way},
                         .buttons = t < 3.0 ? 0u : static_cast<uint32_t>(random() % 4)});
    }
    return haptics::HandPath(std::move(poses));
}

class Soak : public TemporaryFolder {
 protected:
    // With threads, as in a window; what is drawn goes to an image.
    std::unique_ptr<Viewer> open(GpuDevice& pictures, GpuDevice& interface,
                                 std::optional<Project::Opened> project, uint64_t seed) {
        ViewerOptions options{.threaded = true};
        options.hand = {"falcon", drilling(seed), "swept-tool"};
        options.open = [](const std::string& path, const std::string&, const std::stop_token&,
                          const std::function<void(double)>&) -> Result<Source> {
            return Source{open_synthetic(path)};
        };
        auto viewer = std::make_unique<Viewer>(pictures, interface, VK_FORMAT_R8G8B8A8_UNORM,
                                               Source{open_synthetic(kVolume), std::move(project)},
                                               glm::uvec2(640, 480), 1.0, std::move(options));
        return viewer;
    }

    // One thing that a person may do within `room`, which has no button that saves.
    Event random_event(std::mt19937_64& random, glm::ivec2 room) {
        const auto share = [&] { return static_cast<double>(random() % 10000) * 1e-4; };
        static const char* const keys[] = {"b", "e", "x",    "x",   "=",   "-",     "l",  "v",
                                           "j", "k", "home", "end", "tab", "space", "up", "s",
                                           "i", "n", "p",    "1",   "y",   "h",     "c",  "escape"};
        Event event{.modifiers = {.shift = random() % 8 == 0, .ctrl = random() % 8 == 0}};
        switch (random() % 8) {
            case 0:
                event.kind = Event::Kind::button;
                event.button = static_cast<Button>(random() % 3);
                event.down = down_ = !down_;
                break;
            case 1:
                event.kind = Event::Kind::wheel;
                event.wheel = {0.0, share() < 0.5 ? 1.0 : -1.0};
                break;
            case 2:
                event.kind = Event::Kind::key;
                event.key = keys[random() % std::size(keys)];
                event.down = true;
                event.modifiers.ctrl = random() % 6 == 0;
                if (event.modifiers.ctrl)
                    event.key = random() % 3 ? "z" : "y";
                break;
            default:
                event.at_px = glm::dvec2(share() * room.x, share() * room.y);
        }
        return event;
    }

    // Frames for so long; `each` is called after each one.
    template <class Each>
    void work(Viewer& viewer, GpuDevice& interface, double seconds, uint64_t seed, bool files,
              const Each& each) {
        std::mt19937_64 random(seed);
        UiTarget target{GpuImage(interface, "window",
                                 {.format = VK_FORMAT_R8G8B8A8_UNORM,
                                  .size = glm::uvec3(viewer.state().size_px, 1),
                                  .attachment = true})};
        const auto begin = Clock::now();
        const auto since = [&] {
            return std::chrono::duration<double>(Clock::now() - begin).count();
        };
        double restarted_s = 0.0, opened_s = 0.0;
        for (double now_s = 0.0; now_s < seconds && !HasFailure(); now_s = since()) {
            std::vector<Event> events{random_event(
                random, {places_of(viewer.state()).tools.low_px.x, viewer.state().size_px.y})};
            if (files && now_s - opened_s > kFile_s) {
                count_ticks(viewer);
                const Event drop{.kind = Event::Kind::drop, .paths = {kVolume}};
                viewer.frame({drop}, now_s);
                viewer.frame({}, now_s);
                const auto& widgets = viewer.interface().widgets();
                if (const auto asks = widgets.find("leave/discard"); asks != widgets.end()) {
                    const glm::dvec2 at(asks->second.low_px + asks->second.size_px / 2);
                    for (const Event& event : {Event{.kind = Event::Kind::move, .at_px = at},
                                               Event{.kind = Event::Kind::button, .down = true},
                                               Event{.kind = Event::Kind::button}})
                        viewer.frame({event}, now_s);
                }
                opened_s = now_s;
            }
            events.front().time_s = now_s;
            viewer.frame(std::move(events), now_s);
            ASSERT_FALSE(viewer.failure()) << *viewer.failure();
            Touch& touch = viewer.work().hand().touch();
            if (!touch.running() || now_s - restarted_s > kPath_s) {
                count_ticks(viewer);
                HandOptions options = touch.options();
                options.device = random() % 2 ? "falcon" : "exact";
                options.path = drilling(random());
                touch.set_up(options);
                ASSERT_TRUE(touch.start(viewer.state().stylus));
                touch.arm();
                restarted_s = now_s;
            }
            Commands commands(interface);
            viewer.record(commands, target);
            commands.submit();
            commands.ticket().wait();
            each(now_s);
            std::this_thread::sleep_until(begin + std::chrono::duration<double>(now_s + kFrame_s));
        }
        count_ticks(viewer);
    }

    void count_ticks(Viewer& viewer) {
        if (const haptics::Telemetry* telemetry = viewer.work().hand().touch().telemetry();
            telemetry) {
            ticks_ += telemetry->ticks;
            skipped_ += telemetry->skipped;
            refused_ += telemetry->poses_refused;
            worst_us_ = std::max(worst_us_, double(telemetry->cpu_ns.percentile(0.999)) * 1e-3);
        }
    }

    uint64_t ticks_ = 0, skipped_ = 0, refused_ = 0;
    double worst_us_ = 0.0; // p99.9 of a tick's processor time
    bool down_ = false;
};

// Soak takes over 5 s of a processor: memory that grows is seen in time alone, and a process is
// started for each kill.
TEST_F(Soak, MemoryIsFlatAndNoTickIsMissedByOurDoing) {
    const double seconds = given("PALPATE_SECONDS", 2);
    return_freed_memory(); // as the program
    GpuDevice pictures(headless_device("", false)), interface(headless_device("", false));
    std::unique_ptr<Viewer> viewer = open(pictures, interface, std::nullopt, 1);
    viewer->work().hand().touch().arm();
    // The lowest in each minute: what is seen, as rays or as a surface or as both, and how many
    // steps can be undone, changes within it by 30 MiB, and each file passes through the least.
    std::vector<double> lowest_mib;
    work(*viewer, interface, seconds, 2, true, [&](double now_s) {
        const auto minute = static_cast<size_t>(now_s / kFile_s);
        lowest_mib.resize(std::max(lowest_mib.size(), minute + 1), resident_mib());
        lowest_mib[minute] = std::min(lowest_mib[minute], resident_mib());
    });
    viewer->work().hand().touch().stop();
    viewer->work().session().settle();
    const EditState state = viewer->work().edited();
    // A tick that the machine gives no processor is not of our doing; one that computes for longer
    // than a period is, and so are a full ring and a page that a tick waits for.
    EXPECT_LT(worst_us_, 1000.0);
    EXPECT_EQ(refused_, 0u);
    EXPECT_GT(ticks_, 100 * static_cast<uint64_t>(seconds));
    std::printf("    %.0f s: %zu ticks, %zu not in time, p99.9 %.0f us; %zu strokes; %.1f MiB\n",
                seconds, size_t(ticks_), size_t(skipped_), worst_us_, state.strokes_done,
                resident_mib());
    expect_flat_memory(std::move(lowest_mib));
}

// How many steps can be taken back and done again: what a process saw, and what its project leads
// through.
struct Steps {
    uint64_t undo = 0, redo = 0;
    friend bool operator==(const Steps&, const Steps&) = default;
};

// In a process of its own, until it is killed: tells each change of its steps that it has seen
// done.
TEST_F(Soak, DISABLED_WorksUntilItIsKilled) {
    const char *folder = std::getenv("PALPATE_PROJECT"), *told = std::getenv("PALPATE_TOLD");
    ASSERT_TRUE(folder && told);
    GpuDevice pictures(headless_device("", false)), interface(headless_device("", false));
    std::optional<Project::Opened> project = Project::open(folder).value();
    const auto seed = static_cast<uint64_t>(::getpid());
    std::unique_ptr<Viewer> viewer = open(pictures, interface, std::move(project), seed);
    viewer->work().hand().touch().arm();
    Steps last;
    work(*viewer, interface, 3600.0, seed, false, [&](double) {
        const EditState state = viewer->work().edited();
        const Steps now{state.undo_steps, state.redo_steps};
        if (now != std::exchange(last, now)) {
            ASSERT_EQ(::write(std::atoi(told), &now, sizeof now), ssize_t{sizeof now});
        }
    });
}

TEST_F(Soak, AProjectOpensWithEveryFinishedStrokeWheneverItIsKilled) {
    const auto kills = static_cast<size_t>(given("PALPATE_KILLS", 1));
    const std::string folder = file("work.palpate").string();
    const OpenedScene scene = open_synthetic(kVolume);
    const Document first =
        *make_document({{Work::kGrey, VolumeKind::grey, scene.loaded.data.volume}});
    int told[2];
    ASSERT_EQ(::pipe2(told, O_NONBLOCK), 0);
    std::mt19937 random(7);
    size_t at_work = 0, steps_seen = 0, entries_before = 0;
    constexpr size_t kMostEntries = 300; // of a project, that are done again after each kill
    for (size_t n = 0; at_work < kills; ++n) {
        ASSERT_LT(n, 20 * kills) << "it is killed before it has begun";
        if (n == 0 || entries_before > kMostEntries) {
            std::filesystem::remove_all(folder);
            Session session({.document = first,
                             .grey = Work::kGrey,
                             .labels = Work::kLabels,
                             .scene = scene.scene});
            const Result<Project> made = Project::create_from(folder, session, scene.file);
            ASSERT_TRUE(made) << made.error().message;
            entries_before = 0;
        }
        // Longer from time to time, for a machine on which it begins slowly.
        const std::chrono::duration<double, std::milli> life(
            (1500.0 + static_cast<double>(random() % 3000)) *
            static_cast<double>(1 + n / (2 * kills)));
        const End end =
            run_and_kill(std::chrono::duration_cast<std::chrono::microseconds>(life), [&] {
                ::setenv("PALPATE_PROJECT", folder.c_str(), 1);
                ::setenv("PALPATE_TOLD", std::to_string(told[1]).c_str(), 1);
                ::dup2(::open(file("child.txt").c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600),
                       STDOUT_FILENO);
                return ::execl("/proc/self/exe", "test", "--gtest_also_run_disabled_tests",
                               "--gtest_filter=*.DISABLED_WorksUntilItIsKilled",
                               static_cast<char*>(nullptr));
            });
        ASSERT_EQ(end, End::killed) << bytes_of("child.txt");
        std::vector<Steps> seen;
        for (Steps one; ::read(told[0], &one, sizeof one) == ssize_t{sizeof one};)
            seen.push_back(one);
        // The states seen are a part of those that the project leads through, in its order. Nothing
        // is saved meanwhile: one journal has all of it.
        const auto kept = Journal::peek(std::filesystem::path(folder) / "journal-1");
        ASSERT_TRUE(kept) << kept.error().message;
        EXPECT_FALSE(kept->damage);
        Document now = first;
        History history;
        size_t met = 0, entries = 0;
        const auto meet = [&] {
            const History::Stats stats = history.stats();
            if (entries >= entries_before && met < seen.size() &&
                seen[met] == Steps{stats.undo_steps, stats.redo_steps})
                ++met;
        };
        meet();
        for (const JournalEntry& entry : kept->entries) {
            const auto done = replay(now, history, entry, {});
            ASSERT_TRUE(done) << done.error().message;
            ++entries;
            meet();
        }
        EXPECT_EQ(met, seen.size()) << entries << " entries";
        const Result<Project::Opened> opened = Project::open(folder);
        ASSERT_TRUE(opened) << opened.error().message;
        for (const NamedVolume& volume : now.volumes) {
            const Volume* is = opened->setup.document.find(volume.name);
            ASSERT_NE(is, nullptr) << volume.name;
            EXPECT_EQ(content_hash(*is), content_hash(volume.volume)) << volume.name;
        }
        at_work += seen.size() > 1;
        steps_seen += seen.size();
        entries_before = entries;
    }
    ::close(told[0]);
    ::close(told[1]);
    std::printf("    %zu kills; %zu changes were seen done\n", at_work, steps_seen);
}

} // namespace
} // namespace palpate::view
