#include "engine/edit/history.h"

#include <gmock/gmock.h>

#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "engine/volume/content_hash.h"
#include "tests/support/given.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/edit/twin.h"
#include "tests/unit/edit/unreadable.h"

namespace palpate {
namespace {

Volume random_edit(Random& random, const Volume& volume) {
    VolumeEdit edit(volume);
    const int writes = pick(random, 1, 40);
    const glm::uvec3 near(pick(random, 0, int(volume.size().x) - 9),
                          pick(random, 0, int(volume.size().y) - 9),
                          pick(random, 0, int(volume.size().z) - 9));
    for (int i = 0; i < writes; ++i)
        edit.set(near + glm::uvec3(pick(random, 0, 8), pick(random, 0, 8), pick(random, 0, 8)),
                 pick(random, 0, 3));
    return edit.commit();
}

class HistoryTest : public TemporaryFolder {
 protected:
    // PALPATE_EDITS edits with undo and redo at random; then back to the start and forth again.
    static void expect_every_depth(HistoryOptions options, ScalarType type) {
        Random random(uint64_t(type) + 1);
        const Grid grid = make_grid({70, 50, 40}, glm::dvec3(1));
        Volume now = type == ScalarType::f32 ? random_greys(random, grid, type)
                                             : random_labels(random, grid, type);
        History history(options);
        std::vector<uint64_t> hashes{content_hash(now)}; // of every depth
        size_t depth = 0;
        const int edits = int(given("PALPATE_EDITS", 400));
        for (int i = 0; i < edits; ++i) {
            const int what = pick(random, 0, 9);
            if (what < 6) {
                const Volume next = random_edit(random, now);
                history.record(now, next);
                hashes.resize(++depth);
                hashes.push_back(content_hash(next));
                now = next;
            } else {
                const bool back = what < 8;
                const Result<std::optional<Document>> taken =
                    back ? history.undo(now) : history.redo(now);
                ASSERT_TRUE(taken) << taken.error().message;
                if (!*taken) {
                    ASSERT_EQ(depth, back ? 0 : hashes.size() - 1);
                    continue;
                }
                depth += back ? -1 : 1;
                // The snapshot of a step that changed nothing stays.
                EXPECT_TRUE((*taken)->first().version() > now.version() ||
                            hashes[depth] == hashes[depth + (back ? 1 : -1)]);
                now = (*taken)->first();
                ASSERT_EQ(content_hash(now), hashes[depth]);
            }
        }
        history.settle(); // all steps packed
        for (const bool back : {true, false})
            for (;;) {
                const Result<std::optional<Document>> taken =
                    back ? history.undo(now) : history.redo(now);
                ASSERT_TRUE(taken) << taken.error().message;
                if (!*taken)
                    break;
                now = (*taken)->first();
                depth += back ? -1 : 1;
                ASSERT_EQ(content_hash(now), hashes[depth]);
            }
        EXPECT_EQ(depth, hashes.size() - 1);
    }
};

TEST_F(HistoryTest, HashesMatchAtEveryDepth) {
    expect_every_depth({}, ScalarType::u8);
}

TEST_F(HistoryTest, HashesMatchWhereStepsLieOnDisk) {
    expect_every_depth({.memory_bytes = 40000, .spill_folder = file("")}, ScalarType::u16);
}

TEST_F(HistoryTest, HashesMatchWithNoData) {
    expect_every_depth({}, ScalarType::f32);
}

// Done-when of the issue: one dab of 5 mm on labels of 512^3 samples of 0.5 mm.
TEST_F(HistoryTest, AStepCostsWhatItChanged) {
    const Grid grid = make_grid(glm::uvec3(512), glm::dvec3(0.5));
    const Volume before = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
        return i.x < 128 ? 1.0 + i.z % 3 : 0.0; // some bricks hold more than one value
    });
    Operation draw;
    draw.label = 7;
    const StrokePose pose{0, {glm::dvec3(64), kUpright}};
    const Volume after = *apply_stroke(before, {make_ball(5.0)}, draw, {&pose, 1});
    ASSERT_EQ(changed_bricks(before, after).size(), 8u);
    uint64_t touched = 0;
    for (const ChangedBrick& brick : changed_bricks(before, after))
        touched += before.brick(brick.position).bytes();
    History history;
    history.record(before, after);
    const uint64_t at_first = history.stats().newest_bytes;
    // Beside the bricks: 40 bytes a brick of its place, 128 of the step, 256 of the volume it is
    // of.
    EXPECT_LE(at_first, std::max<uint64_t>(touched + 8 * 64 + 128 + 256, 8192));
    EXPECT_LE(touched, 8u * (kBrickSamples + sizeof(Brick) + sizeof(BlockRanges)));
    history.settle();
    EXPECT_LE(history.stats().newest_bytes, 8192u);
    EXPECT_EQ(content_hash((*history.undo(after))->first()), content_hash(before));
    std::printf("    one dab: %zu bytes, then %zu\n", size_t(at_first),
                size_t(history.stats().memory_bytes));
}

TEST_F(HistoryTest, AThousandDabsTakeLessThan16MB) {
    Random random(3);
    const Grid grid = make_grid(glm::uvec3(512), glm::dvec3(0.5));
    Volume now = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    History history;
    for (int i = 0; i < 1000; ++i) {
        Operation draw;
        draw.label = uint16_t(1 + i % 9);
        const StrokePose pose{0,
                              {glm::dvec3(uniform(random, 20, 230), uniform(random, 20, 230),
                                          uniform(random, 20, 230)),
                               {}}};
        const Volume next = *apply_stroke(now, {make_ball(5.0)}, draw, {&pose, 1});
        history.record(now, next);
        now = next;
    }
    history.settle();
    const History::Stats stats = history.stats();
    EXPECT_EQ(stats.undo_steps, 1000u);
    EXPECT_LT(stats.memory_bytes, 16000000u);
    std::printf("    1000 dabs: %zu bytes\n", size_t(stats.memory_bytes));
}

TEST_F(HistoryTest, HoldsItsCapAndSaysThatStepsAreGone) {
    Random random(4);
    Volume now = random_greys(random, make_grid({96, 96, 64}, glm::dvec3(1)), ScalarType::i16);
    std::vector<std::string> notices;
    History history({.memory_bytes = 100000,
                     .notice = [&](const std::string& notice) { notices.push_back(notice); }});
    for (int i = 0; i < 60; ++i) {
        const Volume next = make_volume(now.grid(), ScalarType::i16, [&](glm::uvec3 at) {
            return now.value(at) + (at.x % 7 == uint32_t(i) % 7);
        });
        history.record(now, next);
        now = next;
    }
    history.settle();
    EXPECT_LE(history.stats().memory_bytes, 100000u);
    EXPECT_GT(history.stats().dropped_steps, 0u);
    EXPECT_EQ(history.stats().dropped_steps + history.stats().undo_steps, 60u);
    ASSERT_EQ(notices.size(), 1u); // not one for every step
    EXPECT_THAT(notices[0], testing::HasSubstr("cannot be undone"));
    size_t undone = 0;
    for (;; ++undone) {
        const Result<std::optional<Document>> before = history.undo(now);
        ASSERT_TRUE(before);
        if (!*before)
            break;
        now = (*before)->first();
    }
    EXPECT_EQ(undone, 60 - history.stats().dropped_steps);
}

TEST_F(HistoryTest, AFolderThatTakesNothingCostsOldStepsAndASentence) {
    Random random(5);
    Volume now = random_greys(random, make_grid({64, 64, 64}, glm::dvec3(1)), ScalarType::u8);
    std::vector<std::string> notices;
    History history({.memory_bytes = 20000,
                     .spill_folder = file("no such folder"),
                     .notice = [&](const std::string& notice) { notices.push_back(notice); }});
    for (int i = 0; i < 30; ++i) {
        const Volume next = random_greys(random, now.grid(), ScalarType::u8);
        history.record(now, next);
        now = next;
    }
    history.settle();
    EXPECT_GT(history.stats().dropped_steps, 0u);
    ASSERT_FALSE(notices.empty());
    EXPECT_THAT(notices[0], testing::HasSubstr("no such folder"));
}

TEST_F(HistoryTest, NothingChangedIsAStepToo) {
    Random random(6);
    const Volume v =
        random_labels(random, make_grid(glm::uvec3(20), glm::dvec3(1)), ScalarType::u8);
    const Volume w = random_edit(random, v);
    History history;
    EXPECT_FALSE(*history.undo(v));
    EXPECT_FALSE(*history.redo(v));
    history.record(v, w);
    history.record(w, w);
    history.settle();
    EXPECT_EQ(history.stats().undo_steps, 2u);
    const Volume first = (*history.undo(w))->first();
    EXPECT_EQ(content_hash(first), content_hash(w));
    const Volume second = (*history.undo(first))->first();
    EXPECT_EQ(content_hash(second), content_hash(v));
    EXPECT_FALSE(*history.undo(second));
    const Volume again = (*history.redo(**history.redo(second)))->first();
    EXPECT_EQ(content_hash(again), content_hash(w));
    EXPECT_FALSE(*history.redo(again));
}

// A step from samples that can no longer be read leads back all the same.
TEST_F(HistoryTest, SamplesThatCannotBeReadCostASentence) {
    const Volume before = unreadable_volume();
    const std::vector<uint8_t> sevens(kBrickSamples, 7);
    const PlacedBrick placed[] = {{{1, 0, 0}, Brick::make(std::span<const uint8_t>(sevens))}};
    const Volume after = with_bricks(before, placed);
    std::vector<std::string> notices;
    History history({.notice = [&](const std::string& notice) { notices.push_back(notice); }});
    history.record(before, after);
    history.settle();
    EXPECT_THAT(notices,
                testing::ElementsAre("history: a step stays unpacked in memory: the file was cut"));
    const Volume back = (*history.undo(after))->first();
    for (const uint32_t x : {0u, 1u})
        EXPECT_EQ(back.brick_ptr({x, 0, 0}), before.brick_ptr({x, 0, 0}));
}

} // namespace
} // namespace palpate
