// The editor's thread beside a servo that pushes poses and readers that take snapshots.
// PALPATE_SECONDS is how long the random work lasts at least.

#include "engine/edit/editor.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <csignal>

#include "engine/base/profile.h"
#include "engine/volume/content_hash.h"
#include "tests/support/given.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/edit/twin.h"
#include "tests/unit/edit/unreadable.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;
using JournalledEditor = TemporaryFolder;

struct Setup {
    Json shape;
    Operation operation;
};

Setup random_setup(Random& random) {
    const char* shapes[] = {R"({"kind": "ball", "radius_mm": 4})",
                            R"({"kind": "capsule", "radius_mm": 2, "length_mm": 5})",
                            R"({"kind": "point"})"};
    const OperationKind kinds[] = {OperationKind::draw, OperationKind::erase, OperationKind::erode,
                                   OperationKind::dilate, OperationKind::islands};
    Setup setup{*parse_json(shapes[pick(random, 0, 2)], ""),
                random_operation(random, kinds[pick(random, 0, 4)])};
    setup.operation.only_values.reset();
    return setup;
}

// Does what a hand does, waiting where the ring is full; tells what it did.
class Hand {
 public:
    Hand(Editor& editor, Volume volume, uint64_t seed)
        : editor_(editor), now_(std::move(volume)), random_(seed), reader_(editor.add_reader()) {}

    // One stroke, pushed as fast as the ring takes it; then perhaps an undo. What comes out is also
    // worked out here, without the editor's thread.
    void act() {
        stroke();
        wait_and_compare();
        if (pick(random_, 0, 3) == 0) {
            undo();
            wait_and_compare();
        }
    }

    // The same without waiting for anything.
    void act_on() {
        stroke();
        if (pick(random_, 0, 3) == 0)
            undo();
    }

    void wait_and_compare() {
        // The last input counts as done when its stroke has ended.
        while (reader_.pin()->inputs_done != number_ || reader_.pin()->strokes_done != depth_)
            std::this_thread::yield();
        const auto pin = reader_.pin();
        EXPECT_EQ(pin->refusal, "");
        EXPECT_EQ(pin->undo_steps, depth_);
        EXPECT_EQ(content_hash(pin->volume()), content_hash(now_)) << "after input " << number_;
    }

 private:
    void stroke() {
        const Setup setup = random_setup(random_);
        const Stroke stroke = *make_stroke(setup.shape, setup.operation,
                                           random_path(random_, now_.grid(), pick(random_, 2, 30)));
        while (!editor_.use(stroke.shape, stroke.tool, stroke.operation))
            std::this_thread::yield();
        for (size_t i = 0; i < stroke.poses.size(); ++i) {
            const auto kind = i == 0                         ? EditInput::Kind::down
                              : i + 1 == stroke.poses.size() ? EditInput::Kind::up
                                                             : EditInput::Kind::move;
            while (!editor_.push({kind, stroke.poses[i], ++number_, profile::now_ns()}))
                std::this_thread::yield();
        }
        past_.erase(past_.begin() + ptrdiff_t(depth_), past_.end());
        past_.push_back(now_);
        ++depth_;
        now_ = *apply_stroke(now_, stroke.tool, stroke.operation, stroke.poses);
    }

    void undo() {
        while (!editor_.undo())
            std::this_thread::yield();
        now_ = past_[--depth_];
    }

    Editor& editor_;
    Volume now_;
    Random random_;
    Mailbox<EditState>::Reader reader_;
    std::vector<Volume> past_;
    size_t depth_ = 0;
    uint64_t number_ = 0;
};

// Takes the newest snapshot again and again; what it sees never goes back and is never torn.
void read_until(const std::stop_token& stop, Mailbox<EditState>::Reader& reader,
                std::atomic<uint64_t>& seen) {
    uint64_t version = 0, inputs = 0;
    while (!stop.stop_requested()) {
        const auto pin = reader.pin();
        EXPECT_GE(pin->volume().version(), version);
        EXPECT_GE(pin->inputs_done, inputs);
        seen += pin->volume().version() > version;
        version = pin->volume().version();
        inputs = pin->inputs_done;
        float sum = 0;
        for_each_brick(pin->volume(), [&](glm::uvec3 at) {
            const Brick& brick = pin->volume().brick(at);
            for (uint32_t i = 0; i < kBrickSamples; i += 97)
                sum += brick.value(i);
        });
        EXPECT_GE(sum, 0.0f);
        std::this_thread::yield();
    }
}

TEST(Editor, GivesWhatStrokesGiveWhileOthersRead) {
    Random random(1);
    const Volume first =
        random_labels(random, make_grid({64, 60, 50}, {0.7, 0.7, 1.4}), ScalarType::u8);
    Editor editor(first, {.ring_inputs = 8, .slice_ms = 0.05});
    std::atomic<uint64_t> seen_by_servo = 0, seen_by_frame = 0;
    auto servo_reader = editor.add_reader(), frame_reader = editor.add_reader();
    std::jthread servo(
        [&](const std::stop_token& stop) { read_until(stop, servo_reader, seen_by_servo); });
    std::jthread frame(
        [&](const std::stop_token& stop) { read_until(stop, frame_reader, seen_by_frame); });
    Hand hand(editor, first, 2);
    const auto end = Clock::now() + std::chrono::duration<double>(given("PALPATE_SECONDS", 0.5));
    int strokes = 0;
    while ((Clock::now() < end || strokes < 4 || seen_by_servo == 0 || seen_by_frame == 0) &&
           !testing::Test::HasFailure()) {
        hand.act();
        ++strokes;
    }
    servo.request_stop();
    frame.request_stop();
    servo.join();
    frame.join();
    std::printf("    %d strokes; the readers met %zu and %zu snapshots\n", strokes,
                size_t(seen_by_servo), size_t(seen_by_frame));
}

// Strokes, tools and undos pushed far ahead of the editor happen in the order in which they came.
TEST(Editor, CommandsTakeTheirTurn) {
    Random random(5);
    const Volume first =
        random_labels(random, make_grid({64, 60, 50}, {0.7, 0.7, 1.4}), ScalarType::u8);
    for (uint64_t seed = 0; seed < 4; ++seed) {
        Editor editor(first, {.ring_inputs = 1024});
        Hand hand(editor, first, seed);
        for (int i = 0; i < 12; ++i)
            hand.act_on();
        hand.wait_and_compare();
    }
}

TEST(Editor, ALongStrokeAppearsPieceByPieceAndTheRingStaysEmpty) {
    const Volume first = make_volume(make_grid(glm::uvec3(160), glm::dvec3(1)), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    Editor editor(first, {.ring_inputs = 64, .slice_ms = 0.01});
    auto reader = editor.add_reader();
    const Json ball = *parse_json(R"({"kind": "ball", "radius_mm": 60})", "");
    const Stroke stroke = *make_stroke(ball, {}, {{0, {glm::dvec3(80), kUpright}}});
    ASSERT_TRUE(editor.use(stroke.shape, stroke.tool, stroke.operation));
    constexpr uint64_t kInputs = 2000; // many more than the ring has room for
    while (reader.pin()->commands_done < 1)
        std::this_thread::yield();
    const uint64_t before = reader.pin()->snapshot;
    // The first dab is all the work: a snapshot after each slice of it, whoever looks meanwhile.
    // The last of them has the input whole.
    ASSERT_TRUE(editor.push({EditInput::Kind::down, stroke.poses[0], 1, 0}));
    while (reader.pin()->inputs_done < 1)
        std::this_thread::yield();
    EXPECT_GT(reader.pin()->snapshot - before, 4u);
    for (uint64_t number = 1; number < kInputs;) {
        const auto kind = number + 1 == kInputs ? EditInput::Kind::up : EditInput::Kind::move;
        if (editor.push({kind, stroke.poses[0], number + 1, 0}))
            ++number;
    }
    while (reader.pin()->inputs_done < kInputs)
        std::this_thread::yield();
    EXPECT_EQ(content_hash(reader.pin()->volume()),
              content_hash(*apply_stroke(first, stroke.tool, {}, stroke.poses)));
}

TEST_F(JournalledEditor, SaysTheValueThatAToolWithoutOneLeaves) {
    const Volume first = make_volume(make_grid(glm::uvec3(16), glm::dvec3(1)), ScalarType::u8,
                                     [](glm::uvec3 i) { return 5.0 + i.x; });
    const Journal::Base base = Journal::base_of(first);
    {
        Editor editor(first, {.journal = *Journal::create(file("j"), base)});
        auto reader = editor.add_reader();
        const Json shape = *parse_json(R"({"kind": "ball", "radius_mm": 3})", "");
        Operation cut;
        cut.kind = OperationKind::cut;
        JsonErrors errors{"", {}};
        ASSERT_TRUE(editor.use(shape, read_tool(JsonValue(shape, "", errors)), cut));
        const StrokePose pose{0, {glm::dvec3(8), kUpright}};
        ASSERT_TRUE(editor.push({EditInput::Kind::down, pose, 1}));
        ASSERT_TRUE(editor.push({EditInput::Kind::up, pose, 2}));
        while (reader.pin()->inputs_done < 2)
            std::this_thread::yield();
        EXPECT_EQ(reader.pin()->volume().value({8, 8, 8}), 5.0f);
    }
    const Result<Journal::Found> found = Journal::open(file("j"), base);
    ASSERT_TRUE(found) << found.error().message;
    ASSERT_EQ(found->entries.size(), 1u);
    EXPECT_EQ(found->entries[0].stroke.operation.to_value, 5.0);
}

// The journal holds what is seen, while the disk is full (the limit on the size of files stands for
// it) and after.
TEST_F(JournalledEditor, WhatCannotBeKeptIsTakenBack) {
    const Volume first = make_volume(make_grid(glm::uvec3(40), glm::dvec3(1)), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    const Journal::Base base = Journal::base_of(first);
    Editor editor(first, {.journal = *Journal::create(file("j"), base)});
    auto reader = editor.add_reader();
    const Json ball = *parse_json(R"({"kind": "ball", "radius_mm": 6})", "");
    std::vector<Stroke> strokes;
    for (int i = 0; i < 3; ++i)
        strokes.push_back(*make_stroke(ball, {}, {{0, {glm::dvec3(10 + 10 * i), kUpright}}}));
    ASSERT_TRUE(editor.use(ball, strokes[0].tool, {}));
    uint64_t number = 0;
    const auto dab = [&](const Stroke& stroke) {
        for (const auto kind : {EditInput::Kind::down, EditInput::Kind::up})
            ASSERT_TRUE(editor.push({kind, stroke.poses[0], ++number, 0}));
        while (reader.pin()->inputs_done != number)
            std::this_thread::yield();
    };
    const auto expect = [&](std::vector<Stroke> all, const char* refusal) {
        Volume expected = first;
        for (const Stroke& stroke : all)
            expected = *apply_stroke(expected, stroke.tool, stroke.operation, stroke.poses);
        const auto pin = reader.pin();
        EXPECT_THAT(pin->refusal, testing::HasSubstr(refusal));
        EXPECT_EQ(content_hash(pin->volume()), content_hash(expected));
        EXPECT_EQ(pin->strokes_done, all.size());
        EXPECT_EQ(pin->undo_steps, all.size());
    };
    dab(strokes[0]);
    expect({strokes[0]}, "");
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    const rlimit little{bytes_of("j").size() + 5, old.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &little);
    dab(strokes[1]);
    expect({strokes[0]}, "the stroke is taken back");
    const uint64_t before = reader.pin()->snapshot;
    ASSERT_TRUE(editor.undo());
    while (reader.pin()->snapshot == before)
        std::this_thread::yield();
    expect({strokes[0]}, "nothing is undone");
    ::setrlimit(RLIMIT_FSIZE, &old);
    dab(strokes[2]);
    expect({strokes[0], strokes[2]}, "");
    const auto kept = Journal::peek(file("j"));
    ASSERT_TRUE(kept);
    ASSERT_EQ(kept->entries.size(), 2u);
    for (const int i : {0, 1}) // an input is a pose each: down and up
        EXPECT_EQ(kept->entries[size_t(i)].stroke.poses,
                  std::vector<StrokePose>(2, strokes[size_t(2 * i)].poses[0]));
}

// A journal that is a help and no promise: steps stay where the disk is full, which is said once,
// and the journal ends with the step before.
TEST_F(JournalledEditor, StepsOutliveAJournalThatMayEnd) {
    const Volume first = make_volume(make_grid(glm::uvec3(40), glm::dvec3(1)), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    Editor editor(first, {.journal = *Journal::create(file("j"), Journal::base_of(first)),
                          .journal_may_end = true,
                          .threaded = false});
    auto reader = editor.add_reader();
    const Json ball = *parse_json(R"({"kind": "ball", "radius_mm": 6})", "");
    const Stroke stroke = *make_stroke(ball, {}, {{0, {glm::dvec3(20), kUpright}}});
    ASSERT_TRUE(editor.use(ball, stroke.tool, {}));
    uint64_t number = 0;
    const auto dab = [&](double x) {
        const StrokePose pose{0, {{x, 20, 20}, kUpright}};
        for (const auto kind : {EditInput::Kind::down, EditInput::Kind::up})
            ASSERT_TRUE(editor.push({kind, pose, ++number, 0}));
        editor.settle();
    };
    dab(10);
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    const rlimit little{bytes_of("j").size() + 5, old.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &little);
    dab(20);
    ::setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_THAT(editor.take_refusal(), testing::HasSubstr("steps are not kept on disk any more"));
    EXPECT_EQ(reader.pin()->undo_steps, 2u);
    dab(30);
    ASSERT_TRUE(editor.undo());
    editor.settle();
    EXPECT_EQ(editor.take_refusal(), "");
    EXPECT_EQ(reader.pin()->undo_steps, 2u);
    const auto kept = Journal::peek(file("j"));
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->entries.size(), 1u);
    EXPECT_TRUE(Journal::expect_ended(file("j"))) << "it is closed";
}

// The second brick is in no file any more: strokes that meet it are refused, others are done.
TEST(Editor, OutlivesSamplesThatCannotBeRead) {
    const Volume first = unreadable_volume();
    Editor editor(first, {.slice_ms = 0.01});
    auto reader = editor.add_reader();
    const Tool ball{make_ball(5.0)};
    Operation draw;
    draw.label = 9;
    ASSERT_TRUE(editor.use(Json{}, ball, draw));
    uint64_t number = 0;
    const auto dab = [&](double x) {
        for (const auto kind : {EditInput::Kind::down, EditInput::Kind::up})
            ASSERT_TRUE(editor.push({kind, {0, {{x, 16, 16}, kUpright}}, ++number, 0}));
        while (reader.pin()->inputs_done != number)
            std::this_thread::yield();
    };
    for (const double x : {50.0, 31.0}) { // all of it there; half of it
        dab(x);
        EXPECT_EQ(reader.pin()->refusal, "draw: the file was cut; the stroke is taken back");
        EXPECT_EQ(reader.pin()->volume().value({30, 16, 16}), 0.0f);
        EXPECT_EQ(reader.pin()->strokes_done, 0u);
    }
    dab(16);
    EXPECT_EQ(reader.pin()->refusal, "");
    EXPECT_EQ(reader.pin()->volume().value({16, 16, 16}), 9.0f);
    EXPECT_EQ(reader.pin()->undo_steps, 1u);
}

TEST(Editor, SaysWhyItDidNothing) {
    const Volume greys = make_volume(make_grid(glm::uvec3(8), glm::dvec3(1)), ScalarType::i16,
                                     [](glm::uvec3) { return 5.0; });
    Editor editor(greys);
    auto reader = editor.add_reader();
    const auto refusal = [&](const char* part) {
        for (;;) {
            const auto pin = reader.pin();
            if (pin->refusal.find(part) != std::string::npos)
                return pin->volume().version() == greys.version();
            std::this_thread::yield();
        }
    };
    ASSERT_TRUE(editor.push({EditInput::Kind::down, {}, 1, 0}));
    EXPECT_TRUE(refusal("before there was a tool"));
    ASSERT_TRUE(editor.use(Json{}, {make_ball(1.0)}, {}));
    ASSERT_TRUE(editor.undo());
    EXPECT_TRUE(refusal("nothing is left to undo"));
    ASSERT_TRUE(editor.push({EditInput::Kind::down, {}, 2, 0}));
    EXPECT_TRUE(refusal("expected labels stored as u8 or u16, found i16"));
    ASSERT_TRUE(editor.push({EditInput::Kind::down, {0, {{}, {0, 0, 0, 0}}}, 3, 0}));
    EXPECT_TRUE(refusal("expected a unit quaternion [w, x, y, z], found length 0"));
}

// As a servo pushes them: moves wake nobody, also where the stroke is refused and fills the ring,
// and none is left when the servo has ended.
TEST(Editor, PolledInputsAreAllTaken) {
    const Volume greys = make_volume(make_grid(glm::uvec3(8), glm::dvec3(1)), ScalarType::i16,
                                     [](glm::uvec3) { return 5.0; });
    for (const bool is_refused : {false, true}) {
        Editor editor(greys, {.ring_inputs = 8});
        auto reader = editor.add_reader();
        if (!is_refused) {
            ASSERT_TRUE(
                editor.use(Json{}, {make_ball(1.0)}, {.kind = OperationKind::cut, .to_value = 0}));
        }
        editor.poll_inputs(true);
        uint64_t number = 0;
        const auto push = [&](EditInput::Kind kind) {
            while (!editor.push({kind, {1e-3 * static_cast<double>(number), {}}, number + 1, 0}))
                std::this_thread::yield();
            ++number;
        };
        const auto until_done = [&] {
            while (reader.pin()->inputs_done != number)
                std::this_thread::yield();
        };
        for (int stroke = 0; stroke < 20; ++stroke) {
            push(EditInput::Kind::down);
            for (int i = 0; i < 40; ++i)
                push(EditInput::Kind::move);
            until_done(); // nothing follows: the editor has looked by itself
            push(EditInput::Kind::move);
            push(EditInput::Kind::up);
            if (stroke % 2)
                until_done();
        }
        editor.poll_inputs(false);
        until_done();
        EXPECT_EQ(reader.pin()->refusals, is_refused ? 20u : 0u);
    }
}

// However fast they come: the oldest in their order, and the number of those beyond.
TEST(Editor, NoRefusalIsLost) {
    const Volume greys = make_volume(make_grid(glm::uvec3(8), glm::dvec3(1)), ScalarType::i16,
                                     [](glm::uvec3) { return 5.0; });
    Editor editor(greys);
    auto reader = editor.add_reader();
    constexpr size_t kAll = Editor::kMostRefusals + 36;
    for (size_t i = 0; i < kAll;)
        i += i % 2 ? editor.redo() : editor.undo();
    while (reader.pin()->commands_done < kAll)
        std::this_thread::yield();
    EXPECT_EQ(reader.pin()->refusals, kAll);
    for (size_t i = 0; i < Editor::kMostRefusals; ++i)
        ASSERT_EQ(editor.take_refusal(),
                  i % 2 ? "nothing is left to redo" : "nothing is left to undo");
    EXPECT_EQ(editor.take_refusal(), "36 more steps had no effect");
    EXPECT_EQ(editor.take_refusal(), "");
    ASSERT_TRUE(editor.undo());
    while (reader.pin()->commands_done < kAll + 1)
        std::this_thread::yield();
    EXPECT_EQ(editor.take_refusal(), "nothing is left to undo");
}

// A journal that waits for the end of a stroke is given up after the limit, and the editor goes on
// with the one that it has.
TEST_F(JournalledEditor, AChangeOfJournalWaitsNoLongerThanItsLimit) {
    const Volume first = make_volume(make_grid(glm::uvec3(16), glm::dvec3(1)), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    Editor editor(first, {.journal = *Journal::create(file("old"), Journal::base_of(first))});
    auto reader = editor.add_reader();
    const Stroke ball =
        *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 3})", ""), {}, {{}});
    ASSERT_TRUE(editor.use(ball.shape, ball.tool, ball.operation));
    ASSERT_TRUE(editor.push({EditInput::Kind::down, {0, {{8, 8, 8}, kUpright}}, 1, 0}));
    while (reader.pin()->inputs_done < 1)
        std::this_thread::yield();
    auto change = editor.change_journal(*Journal::create(file("new"), {.save = 1}));
    ASSERT_TRUE(change);
    const Result<Document> reached = change->wait(std::chrono::milliseconds(20));
    ASSERT_FALSE(reached);
    EXPECT_THAT(reached.error().message, testing::HasSubstr("lift the tool"));
    ASSERT_TRUE(editor.push({EditInput::Kind::up, {1, {{9, 8, 8}, kUpright}}, 2, 0}));
    while (reader.pin()->strokes_done < 1 || reader.pin()->commands_done < 2)
        std::this_thread::yield();
    EXPECT_EQ(Journal::peek(file("old"))->entries.size(), 1u);
    EXPECT_EQ(Journal::peek(file("new"))->entries.size(), 0u);
    // It has let go of the other one, and another is taken.
    EXPECT_TRUE(Journal::expect_ended(file("new")));
    change = editor.change_journal(*Journal::create(file("newer"), {.save = 1}));
    EXPECT_TRUE(change->wait(std::chrono::hours(1)));
    ASSERT_TRUE(editor.undo());
    while (reader.pin()->commands_done < 4)
        std::this_thread::yield();
    EXPECT_EQ(Journal::peek(file("old"))->entries.size(), 1u);
    EXPECT_EQ(Journal::peek(file("newer"))->entries.size(), 1u);
}

// Numbers that are no pose change nothing of a stroke, and those that are almost one are what a
// file would hold.
TEST(Editor, PassesOverWhatIsNoPose) {
    const Volume first = make_volume(make_grid(glm::uvec3(40), glm::dvec3(1)), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    const Json capsule = *parse_json(R"({"kind": "capsule", "radius_mm": 3, "length_mm": 9})", "");
    const glm::dquat lying(std::sqrt(0.5), std::sqrt(0.5), 0, 0), nearly = 1.0004 * lying;
    const double nan = std::numeric_limits<double>::quiet_NaN(), far = 1e300;
    const std::vector<StrokePose> pushed{
        {0, {{8, 20, 20}, kUpright}},    {1, {{20, 20, 20}, {0, 0, 0, 0}}},
        {2, {{nan, 20, 20}, kUpright}},  {3, {{far, 20, 20}, kUpright}},
        {nan, {{20, 20, 20}, kUpright}}, {5, {{20, 20, 20}, {1, nan, 0, 0}}},
        {6, {{30, 20, 20}, nearly}},     {7, {{9, 9, 9}, {0, 0, 0, 0}}}};
    Editor editor(first);
    auto reader = editor.add_reader();
    const Stroke stroke = *make_stroke(capsule, {}, {pushed[0], {6, {{30, 20, 20}, lying}}});
    ASSERT_TRUE(editor.use(stroke.shape, stroke.tool, stroke.operation));
    for (size_t i = 0; i < pushed.size(); ++i) {
        const auto kind = i == 0                   ? EditInput::Kind::down
                          : i + 1 == pushed.size() ? EditInput::Kind::up
                                                   : EditInput::Kind::move;
        ASSERT_TRUE(editor.push({kind, pushed[i], i + 1, 0}));
    }
    while (reader.pin()->strokes_done == 0)
        std::this_thread::yield();
    const auto pin = reader.pin();
    EXPECT_EQ(pin->inputs_done, pushed.size());
    EXPECT_EQ(pin->refusal,
              "input 8 is passed over: expected a unit quaternion [w, x, y, z], "
              "found length 0");
    const glm::dquat unit = checked_pose(pushed[6])->tool.rotation;
    EXPECT_LT(glm::length(unit - lying), 1e-15);
    std::vector<StrokePose> poses = stroke.poses;
    poses[1].tool.rotation = unit;
    EXPECT_EQ(content_hash(pin->volume()),
              content_hash(*apply_stroke(first, stroke.tool, {}, poses)));
    EXPECT_NE(content_hash(pin->volume()), content_hash(first));
}

} // namespace
} // namespace palpate
