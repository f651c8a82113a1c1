// Any label, 1 .. 65535, is drawn into any map: one of u8 becomes u16 as part of the step, and u8
// again when the step is undone. The expected samples are the twin's (twin.h), the expected type is
// kept by hand beside them.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "engine/edit/editor.h"
#include "engine/edit/replay.h"
#include "engine/volume/changes.h"
#include "tests/support/given.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

class LabelGrowth : public TemporaryFolder {};

struct State {
    ScalarType type;
    std::vector<double> values;
    friend bool operator==(const State&, const State&) = default;
};

State state_of(const Volume& volume) {
    return {volume.type(), FlatVolume(volume).values};
}

uint16_t random_label(Random& random) {
    switch (pick(random, 0, 4)) {
        case 0:
            return static_cast<uint16_t>(pick(random, 1, 3)); // one that is there
        case 1:
            return static_cast<uint16_t>(pick(random, 254, 257));
        case 2:
            return static_cast<uint16_t>(256 * pick(random, 1, 255) + pick(random, 0, 3));
        case 3:
            return 65535;
        default:
            return static_cast<uint16_t>(pick(random, 1, 65535));
    }
}

// Strokes, undo and redo through the editor with its journal, in an order drawn by chance.
class Work {
 public:
    Work(Random& random, const Volume& first, std::filesystem::path journal, EditorOptions options)
        : random_(random),
          journal_(std::move(journal)),
          began_with_(first),
          states_{state_of(first)},
          editor_(first, std::move(options)),
          reader_(editor_.add_reader()) {}

    void act() {
        const int what = pick(random_, 0, 9);
        if (what < 5)
            stroke();
        else if (what < 7 && depth_ > 0)
            step(true);
        else if (what < 9 && depth_ + 1 < states_.size())
            step(false);
        else
            change_journal();
    }

    // The journal in use, done again on what it began with, gives the present.
    void expect_replay() {
        const Result<Journal::Contents> kept = Journal::peek(journal_);
        ASSERT_TRUE(kept) << kept.error().message;
        Document document = began_with_;
        History history;
        for (const JournalEntry& entry : kept->entries) {
            const Result<Replayed> done = replay(document, history, entry, {});
            ASSERT_TRUE(done) << done.error().message;
        }
        EXPECT_EQ(state_of(document.first()), states_[depth_]);
    }

    size_t grown = 0; // strokes that made u16 of u8

 private:
    void stroke() {
        const OperationKind kinds[] = {OperationKind::draw,   OperationKind::draw,
                                       OperationKind::erase,  OperationKind::erode,
                                       OperationKind::dilate, OperationKind::smooth,
                                       OperationKind::fill,   OperationKind::islands};
        Operation op = random_operation(random_, kinds[pick(random_, 0, 7)]);
        op.only_values.reset();
        op.label = random_label(random_);
        const Volume before = reader_.pin()->volume();
        const Json ball{{"kind", "ball"}, {"radius_mm", uniform(random_, 2.0, 9.0)}};
        const Stroke stroke =
            *make_stroke(ball, op, random_path(random_, before.grid(), pick(random_, 2, 4)));
        const State was = states_[depth_];
        State next{was.type, brute_force(before, stroke.tool, op, stroke.poses, nullptr).values};
        const bool changes = next.values != was.values;
        if (changes && op.kind != OperationKind::erase && op.label > 255)
            next.type = ScalarType::u16;
        grown += next.type != was.type;
        ASSERT_TRUE(editor_.use(stroke.shape, stroke.tool, stroke.operation));
        for (size_t i = 0; i < stroke.poses.size(); ++i) {
            const auto kind = i == 0                         ? EditInput::Kind::down
                              : i + 1 == stroke.poses.size() ? EditInput::Kind::up
                                                             : EditInput::Kind::move;
            ASSERT_TRUE(editor_.push({kind, stroke.poses[i], ++number_, 0}));
        }
        states_.resize(++depth_);
        states_.push_back(std::move(next));
        expect_present(op.label, name_of(op.kind));
        if (changes) { // the list of changes is of values, whatever the types
            size_t bricks = 0;
            const Volume after = reader_.pin()->volume();
            for_each_brick(before, [&](glm::uvec3 at) {
                bool differs = false;
                for (uint32_t i = 0; i < kBrickSamples && !differs; ++i)
                    differs = before.brick(at).value(i) != after.brick(at).value(i);
                bricks += differs;
            });
            EXPECT_EQ(changed_bricks(before, after).size(), bricks);
        }
    }

    void step(bool back) {
        ASSERT_TRUE(back ? editor_.undo() : editor_.redo());
        depth_ += back ? -1 : 1;
        expect_present(0, back ? "undo" : "redo");
    }

    // As a save does: later steps are kept in a new journal, which knows no step before it.
    void change_journal() {
        expect_replay();
        journal_ += "+";
        const Document now = reader_.pin()->document;
        Result<Journal> fresh = Journal::create(journal_, Journal::base_of(now));
        ASSERT_TRUE(fresh) << fresh.error().message;
        std::optional<JournalChange> asked = editor_.change_journal(std::move(*fresh));
        ASSERT_TRUE(asked);
        editor_.settle();
        ASSERT_TRUE(asked->wait(std::chrono::seconds(1)));
        began_with_ = now;
    }

    void expect_present(int label, const char* what) {
        editor_.settle();
        const auto pin = reader_.pin();
        ASSERT_EQ(pin->refusal, "");
        ASSERT_EQ(name_of(pin->volume().type()), name_of(states_[depth_].type))
            << what << " " << label;
        ASSERT_EQ(state_of(pin->volume()), states_[depth_]) << what << " " << label;
    }

    Random& random_;
    std::filesystem::path journal_;
    Document began_with_;
    std::vector<State> states_; // by depth
    size_t depth_ = 0;
    uint64_t number_ = 0;
    Editor editor_;
    Mailbox<EditState>::Reader reader_;
};

TEST_F(LabelGrowth, AnyLabelGoesIntoAnyMapAndUndoTakesItBack) {
    const auto strokes = uint64_t(given("PALPATE_STROKES", 25));
    size_t grown = 0;
    for (uint64_t seed = 0; seed < strokes / 3 && !HasFatalFailure(); ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const glm::uvec3 size(pick(random, 20, 40), pick(random, 12, 20), pick(random, 8, 14));
        const ScalarType type = pick(random, 0, 3) ? ScalarType::u8 : ScalarType::u16;
        const Volume first = random_labels(random, random_grid(random, size), type);
        const std::filesystem::path path = file(fmt::format("journal-{}", seed));
        EditorOptions options{.threaded = false};
        options.journal = *Journal::create(path, Journal::base_of(first));
        if (pick(random, 0, 1)) // steps are packed and spilled as soon as they are recorded
            options.history = {.memory_bytes = 1, .spill_folder = file(""), .notice = {}};
        Work work(random, first, path, std::move(options));
        for (int i = 0; i < 14 && !HasFatalFailure(); ++i)
            work.act();
        work.expect_replay();
        grown += work.grown;
    }
    EXPECT_GT(grown, strokes / 10);
}

// A disk that is full takes the stroke back: the map is u8 again.
TEST_F(LabelGrowth, AStrokeThatCannotBeKeptLeavesTheType) {
    Random random(7);
    const Volume first =
        random_labels(random, make_grid({40, 20, 20}, glm::dvec3(1)), ScalarType::u8);
    EditorOptions options{.threaded = false};
    options.journal = *Journal::create(file("full"), Journal::base_of(first));
    Editor editor(first, std::move(options));
    auto reader = editor.add_reader();
    const Json ball{{"kind", "ball"}, {"radius_mm", 5}};
    const Stroke stroke =
        *make_stroke(ball, {.label = 300}, {{0, {glm::dvec3(15, 10, 10), kUpright}}});
    ASSERT_TRUE(editor.use(stroke.shape, stroke.tool, stroke.operation));
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    const rlimit little{bytes_of("full").size() + 5, old.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &little);
    ASSERT_TRUE(editor.push({EditInput::Kind::down, stroke.poses[0], 1, 0}));
    editor.settle();
    EXPECT_EQ(reader.pin()->volume().type(), ScalarType::u16); // seen while it is drawn
    ASSERT_TRUE(editor.push({EditInput::Kind::up, stroke.poses[0], 2, 0}));
    editor.settle();
    ::setrlimit(RLIMIT_FSIZE, &old);
    const auto pin = reader.pin();
    EXPECT_TRUE(pin->refusal.ends_with("the stroke is taken back")) << pin->refusal;
    EXPECT_EQ(state_of(pin->volume()), state_of(first));
    EXPECT_GT(pin->volume().version(), first.version()); // later than the pieces that were seen
}

} // namespace
} // namespace palpate
