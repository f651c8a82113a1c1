// Everything that lives while a volume is carved, at once, on one session: the servo's thread feels
// the newest snapshot by a real proxy and carves, the editor cuts and keeps a journal, one thread
// meshes what changed and one draws it, while tools, parameters and iso-values change, strokes are
// taken back and done again, volumes come and go, and devices are stopped and started; and the
// process is killed at any moment of it. PALPATE_SECONDS is how long the random work lasts at
// least, on PALPATE_SAMPLES^3 samples; it also lasts until every thread has met edits, however slow
// the machine. Variables of these names in the environment go before: for the thread sanitizer,
// under which edits are ten times as slow. The hand takes PALPATE_HAND_STEP seconds (0.1 unless
// given) from place to place; a slower one leaves the editor less to catch up with at the end.

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <random>
#include <thread>

#include "engine/base/profile.h"
#include "engine/edit/replay.h"
#include "engine/edit/stroke.h"
#include "engine/session/session.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "engine/volume/synthetic.h"
#include "haptics/device/recorded.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/given.h"
#include "tests/support/kill.h"

namespace palpate {
namespace {

using Reader = EditLag::Reader;

double seconds() {
    return given("PALPATE_SECONDS", 0.5);
}

constexpr double kIso = 250.0;
constexpr size_t kFewestFrames = 12;   // of each kind of drawing some, by random
constexpr size_t kFewestSnapshots = 3; // seen by the picture and by the mesh
constexpr double kLongest_s = 240.0;   // of the hand's path; the test is ended soon after
constexpr double kLife_s = 4.0;        // at most, of a process that is killed, once it works
const int kKills = std::max(2, int(seconds() / kLife_s));

class EditThreads : public GpuTest {
 protected:
    ~EditThreads() override { std::filesystem::remove(journal_); }

    static Volume ball() {
        const double samples = given("PALPATE_SAMPLES", 96);
        const Grid grid = make_grid(glm::uvec3(samples), glm::dvec3(40.0 / samples),
                                    glm::dvec3(-20.0 + 20.0 / samples));
        return synthetic::sample(synthetic::sphere({0, 0, 0}, 10.0, 0.5), grid, ScalarType::i16);
    }

    static Scene iso_scene() {
        Scene scene;
        scene.size_px = {48, 48};
        scene.camera.eye_mm = {60, 40, 30};
        scene.camera.view_angle_deg = 35.0;
        scene.ray_cast.emplace();
        scene.ray_cast->mode = RayMode::iso;
        scene.ray_cast->isos = {{kIso}};
        return scene;
    }

    // A hand that wanders in and about the ball and presses a button now and then.
    static std::unique_ptr<haptics::HapticDevice> wandering(uint64_t seed) {
        std::mt19937 random(static_cast<uint32_t>(seed));
        std::uniform_real_distribution<double> place(-13.0, 13.0);
        std::vector<haptics::HandPose> poses;
        const double step_s = given("PALPATE_HAND_STEP", 0.1);
        for (double t = 0; t <= seconds() + kLongest_s; t += step_s)
            poses.push_back({.time_s = t,
                             .tool = {.position_mm = {place(random), place(random), place(random)}},
                             .buttons = static_cast<uint32_t>(random() % 3 > 0)});
        return std::make_unique<haptics::RecordedDevice>(
            haptics::DeviceCapabilities{.workspace_m = glm::dvec3(0.05)},
            records_of_path(haptics::HandPath(std::move(poses)), haptics::Workspace({0, 0, 0}, 1),
                            1'000'000),
            profile::now_ns());
    }

    void start(Session& session, uint64_t seed) {
        stop(session);
        ++devices_;
        device_ = wandering(seed);
        const Result<void> started = session.start({*device_,
                                                    *haptics::find_algorithm("swept-point"),
                                                    haptics::Workspace({0, 0, 0}, 1),
                                                    {},
                                                    {},
                                                    {}});
        ASSERT_TRUE(started) << started.error().message;
        ticking_ = true;
    }

    void stop(Session& session) {
        session.stop();
        if (session.servo())
            ticks_ +=
                std::exchange(ticking_, false) ? session.servo()->telemetry().ticks.load() : 0;
    }

    static void use_some_tool(Session& session, std::mt19937& random) {
        static const char* const kShapes[] = {
            R"({"kind": "ball", "radius_mm": 2})",
            R"({"kind": "burr", "radius_mm": 3, "flutes": 6})",
            R"({"kind": "capsule", "radius_mm": 1, "length_mm": 4})"};
        Operation operation;
        operation.kind = random() % 2 ? OperationKind::cut : OperationKind::mill;
        operation.to_value = random() % 2 ? 0.0 : 500.0; // removes, or adds
        operation.rates = {{0.0, 20000.0}};
        const Stroke stroke = *make_stroke(*parse_json(kShapes[random() % 3], ""), operation, {{}});
        // Full: the next one then.
        (void)session.use({stroke.shape, stroke.tool, stroke.operation, "ball", ""});
    }

    // A person does these things beside touching.
    void do_something(Session& session, std::mt19937& random) {
        if (random() % 3 == 0)
            use_some_tool(session, random);
        switch (random() % 40) {
            case 0:
            case 1:
            case 2:
                (void)session.undo();
                break;
            case 10:
            case 11:
                (void)session.redo();
                break;
            case 3:
                (void)session.put(
                    {"mask", VolumeKind::labels,
                     make_volume(make_grid(glm::uvec3(40), glm::dvec3(1)), ScalarType::u8,
                                 [n = random() % 7](glm::uvec3 i) {
                                     return double((i.x + i.y) % (2 + n));
                                 })},
                    "threshold");
                break;
            case 4:
                start(session, random());
                break;
            case 5: {
                haptics::TouchParameters parameters = session.parameters();
                parameters.stiffness_n_per_m = 200.0 + 100.0 * double(random() % 4);
                session.feel(parameters);
                break;
            }
            case 6:
                session.set_iso(kIso + 20.0 * double(random() % 3));
                break;
            default:
                break;
        }
    }

    // On the ball, seen, felt and meshed, with a tool and a hand.
    std::unique_ptr<Session> begin(const Document& first, std::mt19937& random) {
        std::filesystem::remove(journal_);
        auto session = std::make_unique<Session>(
            SessionSetup{.document = first,
                         .grey = "ball",
                         .labels = "",
                         .scene = iso_scene(),
                         .parameters = {.iso = kIso},
                         .mesh_iso = static_cast<float>(kIso),
                         .edit = {.slice_ms = 1.0,
                                  .journal = *Journal::create(journal_, Journal::base_of(first))}});
        use_some_tool(*session, random);
        start(*session, random());
        return session;
    }

    static void draw_somehow(Renderer& renderer, const Session::Eye::Sight& sight,
                             std::mt19937& random) {
        switch (random() % 4) {
            case 0: {
                const uint32_t rows = Renderer::tile_rows(sight.scene);
                ASSERT_TRUE(renderer.draw(sight.scene, sight.data,
                                          TileRows{static_cast<uint32_t>(random() % rows), 1}));
                break;
            }
            case 1:
                ASSERT_TRUE(renderer.draw(sight.scene, sight.data, CoarseSettings{}));
                break;
            default:
                ASSERT_TRUE(renderer.draw(sight.scene, sight.data));
        }
    }

    std::filesystem::path journal_ =
        std::filesystem::path(testing::TempDir()) / fmt::format("threads.{}.journal", ::getpid());
    std::unique_ptr<haptics::HapticDevice> device_; // outlives the session
    size_t devices_ = 0;
    uint64_t ticks_ = 0; // of all devices
    bool ticking_ = false;
};

std::string all_of(const Document& document) {
    std::string text;
    for (const NamedVolume& v : document.volumes)
        text += fmt::format("{} {:016x}\n", v.name, content_hash(v.volume));
    return text;
}

// EditThreads takes over 5 s of a processor: it lasts until each of its threads has met edits, and
// kills a process several times.
TEST_F(EditThreads, HandEyeAndMeshFollowTheEditorForARandomWhile) {
    const Document first = *make_document({{"ball", VolumeKind::grey, ball()}});
    std::mt19937 random(3);
    const std::unique_ptr<Session> session = begin(first, random);
    auto eye = session->add_eye();

    Renderer renderer(device());
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::duration<double>(seconds());
    size_t frames = 0;
    bool edited = false; // a picture has shown another volume than the first
    const auto has_met = [&](Reader reader) {
        return session->lag().latency_ms(reader).count >= kFewestSnapshots;
    };
    while ((Clock::now() < end || frames < kFewestFrames || !edited || devices_ < 2 ||
            !has_met(Reader::picture) || !has_met(Reader::mesh)) &&
           !HasFailure()) {
        const Session::Eye::Sight sight = eye.look();
        draw_somehow(renderer, sight, random);
        eye.reached(Reader::picture, sight, profile::now_ns());
        ++frames;
        edited = edited || (sight.state.strokes_done > 0 &&
                            content_hash(sight.data.volume) != content_hash(first.first()));
        if (devices_ < 2 && frames >= kFewestFrames)
            start(*session, 2);
        do_something(*session, random);
    }
    stop(*session);
    session->settle();

    // Each of them holds at the end what one who begins now would hold.
    const Session::Eye::Sight last = eye.look();
    const auto iso = static_cast<float>(session->parameters().iso);
    const Mesh mesh = session->mesh(), fresh_mesh = marching_cubes(last.data.volume, iso);
    EXPECT_FALSE(mesh.positions.empty());
    EXPECT_EQ(mesh.positions, fresh_mesh.positions);
    EXPECT_EQ(mesh.triangles, fresh_mesh.triangles);
    const haptics::TouchScene felt = session->felt();
    ASSERT_TRUE(felt.grey);
    EXPECT_TRUE(felt.grey->is_same_as(last.data.volume));
    Renderer fresh(device());
    const Result<Frame> picture = renderer.render(last.scene, last.data);
    const Result<Frame> expected = fresh.render(last.scene, last.data);
    ASSERT_TRUE(picture && expected);
    EXPECT_EQ(picture->eyes[0].samples, expected->eyes[0].samples);
    const std::string lag = json_line(session->lag().json());

    // And the journal, done again, gives the same.
    const Journal::Contents kept = *Journal::peek(journal_);
    EXPECT_FALSE(kept.cut || kept.damage);
    Document again = first;
    History history;
    for (const JournalEntry& entry : kept.entries) {
        const auto done = replay(again, history, entry, {});
        ASSERT_TRUE(done) << done.error().message;
    }
    EXPECT_EQ(all_of(again), all_of(last.state.document));
    EXPECT_EQ(history.stats().undo_steps, last.state.undo_steps);
    std::printf("    %zu ticks, %zu frames, %zu devices, %zu entries, %zu steps standing; %s\n",
                size_t(ticks_), frames, devices_, kept.entries.size(), last.state.strokes_done,
                lag.c_str());
}

// How many steps can be taken back and done again: of the state that a process saw last, and of
// each that its journal leads through. Equal ones may follow one another unseen; what was told is a
// part of what the journal leads through, in its order.
struct Steps {
    uint32_t undo = 0, redo = 0;
    friend bool operator==(const Steps&, const Steps&) = default;
};

// The same work, in a process that is killed: a child has the threads it makes, so it is this
// program again. It tells each change of its steps that it has seen done.
TEST_F(EditThreads, DISABLED_WorksUntilItIsKilled) {
    const char *journal = std::getenv("PALPATE_JOURNAL"), *told = std::getenv("PALPATE_TOLD");
    ASSERT_TRUE(journal && told);
    journal_ = journal;
    std::mt19937 random(static_cast<uint32_t>(::getpid()));
    const std::unique_ptr<Session> session =
        begin(*make_document({{"ball", VolumeKind::grey, ball()}}), random);
    auto eye = session->add_eye();
    Renderer renderer(device());
    Steps last;
    do {
        const Session::Eye::Sight sight = eye.look();
        const Steps now{static_cast<uint32_t>(sight.state.undo_steps),
                        static_cast<uint32_t>(sight.state.redo_steps)};
        if (now != std::exchange(last, now)) {
            ASSERT_EQ(::write(std::atoi(told), &now, sizeof now), ssize_t{sizeof now});
        }
        draw_somehow(renderer, sight, random);
        do_something(*session, random);
    } while (!HasFailure());
}

TEST_F(EditThreads, NoStepIsLostWheneverTheProcessIsKilled) {
    const Document first = *make_document({{"ball", VolumeKind::grey, ball()}});
    int told[2];
    ASSERT_EQ(::pipe2(told, O_NONBLOCK), 0);
    std::mt19937 random(5);
    size_t steps = 0, entries = 0, kills_at_work = 0;
    for (int n = 0; kills_at_work < size_t(kKills); ++n) {
        ASSERT_LT(n, 40 * kKills) << "it is killed before it has begun";
        std::filesystem::remove(journal_);
        // Longer from time to time, for a machine on which it begins slowly.
        const std::chrono::duration<double, std::milli> life(
            1e3 * kLife_s * (1 + n / (2 * kKills)) * (0.25 + 0.75 * (random() % 1000) / 1000.0));
        const End end =
            run_and_kill(std::chrono::duration_cast<std::chrono::microseconds>(life), [&] {
                ::setenv("PALPATE_JOURNAL", journal_.c_str(), 1);
                ::setenv("PALPATE_TOLD", std::to_string(told[1]).c_str(), 1);
                ::dup2(::open("/dev/null", O_RDWR), STDOUT_FILENO);
                return ::execl("/proc/self/exe", "test", "--gtest_also_run_disabled_tests",
                               "--gtest_filter=*.DISABLED_WorksUntilItIsKilled",
                               static_cast<char*>(nullptr));
            });
        ASSERT_EQ(end, End::killed);
        std::vector<Steps> seen;
        for (Steps one; ::read(told[0], &one, sizeof one) == ssize_t{sizeof one};)
            seen.push_back(one);
        if (seen.empty())
            continue;
        ++kills_at_work;
        const auto kept = Journal::open(journal_, Journal::base_of(first)); // cuts what is torn
        ASSERT_TRUE(kept) << kept.error().message;
        EXPECT_FALSE(kept->damage);
        Document now = first;
        History history;
        size_t met = 0; // of `seen`
        for (const JournalEntry& entry : kept->entries) {
            const auto done = replay(now, history, entry, {});
            ASSERT_TRUE(done) << done.error().message;
            const History::Stats stats = history.stats();
            const Steps here{static_cast<uint32_t>(stats.undo_steps),
                             static_cast<uint32_t>(stats.redo_steps)};
            met += met < seen.size() && seen[met] == here;
        }
        EXPECT_EQ(met, seen.size()) << kept->entries.size() << " entries";
        steps += seen.size();
        entries += kept->entries.size();
    }
    ::close(told[0]);
    ::close(told[1]);
    std::printf("    %zu kills; %zu steps were seen done, %zu were kept\n", kills_at_work, steps,
                entries);
}

} // namespace
} // namespace palpate
