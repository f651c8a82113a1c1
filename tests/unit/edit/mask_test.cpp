// Masks: strokes and whole maps change what a mask leaves open, and no other sample.

#include "engine/edit/edit_mask.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "engine/edit/editor.h"
#include "engine/edit/spared.h"
#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

using Kind = EditArea::Kind;

EditMask random_mask(Random& random) {
    EditMask mask;
    if (pick(random, 0, 3))
        mask.area = random_area(random);
    if (pick(random, 0, 1))
        mask.values = {uniform(random, -800, 0), uniform(random, 0, 900)};
    if (pick(random, 0, 1)) {
        mask.over.emplace();
        for (uint16_t label = 0; label < 4; ++label)
            if (pick(random, 0, 1))
                mask.over->push_back(label);
    }
    return mask;
}

// By hand: whether a sample of the label `had` and a grey value may get the label `gets`.
bool is_open(const EditMask& mask, double had, double gets, double grey) {
    bool named = false;
    for (const uint16_t label : mask.area.labels)
        named = named || had == label;
    if (mask.area.labels.empty())
        named = had != 0;
    if (mask.area.kind == Kind::inside && !named)
        return false;
    if (mask.area.kind == Kind::outside && named)
        return false;
    if (mask.values && (grey < mask.values->first || grey > mask.values->second))
        return false;
    if (!mask.over || gets == 0)
        return true;
    return std::find(mask.over->begin(), mask.over->end(), had) != mask.over->end();
}

struct Given {
    Volume labels, greys;
};
Given random_given(Random& random, uint64_t seed) { // two spacings, two types, by turns
    const Grid grid = make_grid({pick(random, 33, 45), pick(random, 20, 40), pick(random, 5, 36)},
                                seed & 1 ? glm::dvec3(0.7, 0.7, 2.5) : glm::dvec3(1.0));
    return {random_labels(random, grid, seed & 2 ? ScalarType::u8 : ScalarType::u16),
            random_greys(random, grid, ScalarType::i16)};
}

TEST(EditMask, AnAreaIsInsideOrOutsideOfLabels) {
    const EditArea everywhere, inside{Kind::inside, {2, 5}}, outside{Kind::outside, {2, 5}},
        all{Kind::inside, {}}, none{Kind::outside, {}};
    for (const uint16_t label : {0, 1, 2, 5, 65535}) {
        const bool named = label == 2 || label == 5;
        EXPECT_TRUE(everywhere.has(label));
        EXPECT_EQ(inside.has(label), named);
        EXPECT_EQ(outside.has(label), !named);
        EXPECT_EQ(all.has(label), label != 0);
        EXPECT_EQ(none.has(label), label == 0);
    }
}

// Drawing and erasing change each sample for itself: within a mask they do what they do without it
// where it is open, whatever the number of threads.
TEST(EditMask, StrokesChangeWhatItLeavesOpen) {
    size_t changed = 0, kept = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        Random random(700 + seed);
        const auto [labels, greys] = random_given(random, seed);
        Operation open;
        open.kind = seed % 3 ? OperationKind::draw : OperationKind::erase;
        open.label = 3;
        const double becomes = seed % 3 ? 3.0 : 0.0;
        const EditMask mask = random_mask(random);
        const Operation masked = *within_mask(open, mask);
        const Tool tool = random_tool(random);
        const std::vector<StrokePose> poses = random_path(random, labels.grid(), 5);
        const Volume all = *apply_stroke(labels, tool, open, poses);
        for (const size_t threads : {1u, 2u, 4u}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            const Volume found = *apply_stroke(labels, tool, masked, poses, greys);
            FlatVolume(labels).for_each([&](glm::ivec3 i) {
                const glm::uvec3 at(i);
                const double had = labels.value(at);
                const bool touched = all.value(at) != had;
                const bool opens = is_open(mask, had, becomes, greys.value(at));
                ASSERT_EQ(found.value(at), touched && opens ? becomes : had)
                    << "seed " << seed << ", " << threads << " threads";
                changed += touched && opens;
                kept += touched && !opens;
            });
            if (HasFatalFailure())
                return;
        }
    }
    EXPECT_GT(changed, 1000u);
    EXPECT_GT(kept, 1000u);
}

TEST(EditMask, MapsChangeWhatItLeavesOpen) {
    size_t changed = 0, kept = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        Random random(800 + seed);
        const auto [before, greys] = random_given(random, seed);
        const Volume after = random_labels(random, before.grid(), ScalarType::u16);
        const EditMask mask = random_mask(random);
        const Spared found = sparing(before, after, {{}, mask, greys});
        bool met = false;
        FlatVolume(before).for_each([&](glm::ivec3 i) {
            const glm::uvec3 at(i);
            const double had = before.value(at), gets = after.value(at);
            const bool opens = is_open(mask, had, gets, greys.value(at));
            ASSERT_EQ(found.labels.value(at), opens ? gets : had) << "seed " << seed;
            met = met || (!opens && gets != had);
            changed += opens && gets != had;
        });
        if (HasFatalFailure())
            return;
        EXPECT_EQ(found.met_mask, met);
        kept += met;
    }
    EXPECT_GT(changed, 1000u);
    EXPECT_GT(kept, 10u);
}

TEST(EditMask, OfGreyValuesReadsItsAreaFromTheGuide) {
    for (uint64_t seed = 0; seed < 4; ++seed) {
        Random random(900 + seed);
        const auto [labels, greys] = random_given(random, seed);
        Operation cut;
        cut.kind = OperationKind::cut;
        cut.to_value = -2000;
        const Tool tool{make_ball(12.0)};
        const std::vector<StrokePose> poses = random_path(random, labels.grid(), 3);
        const Volume all = *apply_stroke(greys, tool, cut, poses);
        cut.area = {Kind::inside, {2}};
        const Result<Volume> alone = apply_stroke(greys, tool, cut, poses);
        ASSERT_FALSE(alone);
        EXPECT_EQ(alone.error().message, "cut: its area needs a guide, a volume of labels");
        const Volume found = *apply_stroke(greys, tool, cut, poses, labels);
        EXPECT_FALSE(changed_bricks(greys, found).empty());
        FlatVolume(greys).for_each([&](glm::ivec3 i) {
            const glm::uvec3 at(i);
            ASSERT_EQ(found.value(at), labels.value(at) == 2 ? all.value(at) : greys.value(at));
        });
    }
}

TEST(EditMask, AndAStrokesOwnLimitsHoldBoth) {
    Operation op;
    op.only_values = {0, 100};
    op.over = {0, 1, 2};
    const Operation both = *within_mask(op, {{Kind::inside, {1}}, {{50, 200}}, {{1, 2, 3}}});
    EXPECT_EQ(both.only_values, std::pair(50.0, 100.0));
    EXPECT_EQ(both.over, (std::vector<uint16_t>{1, 2}));
    EXPECT_EQ(both.area, (EditArea{Kind::inside, {1}}));
    const auto why = [&](const EditMask& mask) {
        const Result<Operation> made = within_mask(both, mask);
        return made ? "" : made.error().message;
    };
    EXPECT_EQ(why({{Kind::outside, {}}, {}, {}}),
              "draw: the stroke has an area of its own, and the mask has another");
    EXPECT_EQ(why({{}, {{101, 102}}, {}}),
              "draw: the stroke is of values 50 to 100, the mask of 101 to 102");
    EXPECT_EQ(why({{}, {}, {{0}}}),
              "draw: the stroke may overwrite no label that the mask leaves open");
    Operation erase;
    erase.kind = OperationKind::erase;
    EXPECT_EQ(within_mask(erase, {{}, {}, {{0}}})->over, std::nullopt);
}

TEST(EditMask, OfAPutIsOneStepOrARefusal) {
    const Grid grid = make_grid({40, 8, 8}, glm::dvec3(1.0));
    const auto row = [&](double left, double right) {
        return make_volume(grid, ScalarType::u8,
                           [=](glm::uvec3 i) { return i.x < 20 ? left : right; });
    };
    Editor editor(*make_document({{"labels", VolumeKind::labels, row(1, 0)}}), {.threaded = false});
    auto reader = editor.add_reader();
    const EditLimits unlabelled{{}, {{}, {}, {{0}}}, {}};
    editor.put({"labels", VolumeKind::labels, row(2, 0)}, "method", {}, {}, unlabelled);
    editor.settle();
    EXPECT_EQ(reader.pin()->undo_steps, 0u);
    EXPECT_EQ(editor.take_refusal(), "method: the mask leaves nothing of it to change");
    editor.put({"labels", VolumeKind::labels, row(2, 2)}, "method", {}, {}, unlabelled);
    editor.settle();
    EXPECT_EQ(reader.pin()->undo_steps, 1u);
    EXPECT_EQ(reader.pin()->volume().value({19, 0, 0}), 1.0f);
    EXPECT_EQ(reader.pin()->volume().value({20, 0, 0}), 2.0f);
    editor.undo();
    editor.settle();
    EXPECT_EQ(reader.pin()->volume().value({20, 0, 0}), 0.0f);
}

} // namespace
} // namespace palpate
