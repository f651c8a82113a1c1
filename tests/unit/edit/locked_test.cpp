// Locked labels: no edit changes their samples or the grey values under them, or adds to them, and
// all other samples change as they do without the lock.

#include <gmock/gmock.h>

#include "engine/edit/editor.h"
#include "engine/edit/spared.h"
#include "engine/edit/stroke_run.h"
#include "tests/support/given.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

bool same(double a, double b) {
    return a == b || (std::isnan(a) && std::isnan(b));
}

bool is_in(const std::vector<uint16_t>& labels, double value) {
    return std::find(labels.begin(), labels.end(), value) != labels.end();
}

std::vector<uint16_t> random_locks(Random& random) { // of the labels 1 .. 3
    std::vector<uint16_t> locks;
    for (uint16_t label = 1; label < 4; ++label)
        if (pick(random, 0, 1))
            locks.push_back(label);
    return locks;
}

glm::uvec3 random_size(Random& random) {
    return {pick(random, 20, 45), pick(random, 20, 45), pick(random, 5, 40)};
}

// A sample of the edit's result and of the one without locks, both beside the sample before.
struct Looked {
    bool was_spared = false; // it would have changed otherwise
    bool is_right = false;
};
Looked look(double before, double unlocked, double found, double label_before, bool on_labels,
            const std::vector<uint16_t>& locks) {
    const bool stays = is_in(locks, label_before) || (on_labels && is_in(locks, unlocked));
    return {stays && !same(before, unlocked), same(found, stays ? before : unlocked)};
}

// LockedStroke takes over 5 s of a processor: its twin looks at every sample of the volume.
class LockedStroke : public testing::TestWithParam<OperationKind> {};

TEST_P(LockedStroke, ChangesTheOtherSamplesAlone) {
    const auto strokes = uint64_t(given("PALPATE_STROKES", 15));
    uint64_t refused = 0, spared = 0;
    for (uint64_t seed = 0; seed < strokes; ++seed) {
        Random random(seed * 100 + uint64_t(GetParam()));
        Operation op = random_operation(random, GetParam());
        op.rates.front().per_s += 1000.0; // else a mill may change nothing
        const Grid grid = random_grid(random, random_size(random));
        const Volume labels =
            random_labels(random, grid, pick(random, 0, 1) ? ScalarType::u8 : ScalarType::u16);
        const Volume greys = random_greys(random, grid, ScalarType::i16);
        const bool on_labels = op.on_labels();
        const Volume& before = on_labels ? labels : greys;
        const Volume& guide = on_labels ? greys : labels;
        Tool tool = random_tool(random);
        if (op.by_region() && pick(random, 0, 3)) // components are closed in large tools only
            tool.shape = make_ball(uniform(random, 5.0, 20.0));
        const std::vector<StrokePose> poses = random_path(random, grid, pick(random, 2, 6));
        const FlatVolume unlocked = brute_force(before, tool, op, poses, &guide);

        op.spared = random_locks(random);
        if (pick(random, 0, 3)) // else it is refused too often
            std::erase(op.spared, op.label);
        if (op.names_label() && is_in(op.spared, op.label)) {
            const auto run = StrokeRun::start(before, tool, op, guide);
            ASSERT_FALSE(run);
            EXPECT_THAT(run.error().message, testing::HasSubstr("is locked"));
            ++refused;
            continue;
        }
        const auto run = StrokeRun::start(before, tool, op, guide);
        ASSERT_TRUE(run) << run.error().message;
        (*run)->add(poses);
        (*run)->lift();
        (*run)->work();
        const Volume found = (*run)->publish();
        uint16_t met = 0; // the lowest label of which a sample was spared
        unlocked.for_each([&](glm::ivec3 i) {
            const glm::uvec3 at(i);
            const double label = labels.value(at);
            const Looked seen =
                look(before.value(at), unlocked[i], found.value(at), label, on_labels, op.spared);
            ASSERT_TRUE(seen.is_right) << "seed " << seed << " at " << i.x << " " << i.y << " "
                                       << i.z << ": found " << found.value(at);
            if (seen.was_spared && (met == 0 || label < met))
                met = uint16_t(label);
        });
        if (HasFatalFailure())
            return;
        spared += met != 0;
        if (on_labels) {
            EXPECT_EQ((*run)->met_spared(), met) << "seed " << seed;
        } else if (met != 0) { // a value that is there already does not change, and is met
            EXPECT_THAT((*run)->met_spared(), testing::AllOf(testing::Ge(1), testing::Le(met)));
        }
    }
    std::printf("    %zu strokes, %zu refused, %zu spared samples\n", size_t(strokes),
                size_t(refused), size_t(spared));
    EXPECT_LT(refused, strokes);
    const bool takes_own_label_alone =
        GetParam() == OperationKind::erode || GetParam() == OperationKind::islands;
    EXPECT_EQ(spared > 0, !takes_own_label_alone);
}

INSTANTIATE_TEST_SUITE_P(Operations, LockedStroke,
                         testing::Values(OperationKind::draw, OperationKind::erase,
                                         OperationKind::erode, OperationKind::dilate,
                                         OperationKind::smooth, OperationKind::fill,
                                         OperationKind::islands, OperationKind::cut,
                                         OperationKind::mill),
                         operation_name);

// Strokes on both volumes, maps that are put in the place of the labels, undo and redo, in a row.
TEST(LockedLabels, StayThroughAnySteps) {
    const auto runs = uint64_t(given("PALPATE_STROKES", 15)) / 5;
    size_t refused = 0, spared = 0, changed = 0;
    for (uint64_t seed = 0; seed < runs; ++seed) {
        Random random(9000 + seed);
        const Grid grid = random_grid(random, random_size(random));
        const Volume first_greys = random_greys(random, grid, ScalarType::i16),
                     first_labels = random_labels(random, grid, ScalarType::u8);
        std::vector<uint16_t> locks = random_locks(random);
        if (locks.empty())
            locks = {2};
        Editor editor(*make_document({{"grey", VolumeKind::grey, first_greys},
                                      {"labels", VolumeKind::labels, first_labels}}),
                      {.threaded = false});
        auto reader = editor.add_reader();
        uint64_t number = 0;
        for (int step = 0; step < 12; ++step) {
            const EditState was = *reader.pin();
            const Volume labels = *was.document.find("labels"), greys = *was.document.find("grey");
            const int what = pick(random, 0, 9);
            std::optional<FlatVolume> unlocked_labels, unlocked_greys;
            if (what == 0) {
                editor.undo();
            } else if (what == 1) {
                editor.redo();
            } else if (what == 2) {
                const Volume put = random_labels(random, grid, ScalarType::u16);
                unlocked_labels.emplace(put);
                editor.put({"labels", VolumeKind::labels, put}, "a map", Json::object(), {},
                           {locks});
            } else {
                Operation op = random_operation(random, OperationKind(pick(random, 0, 8)));
                const Tool tool = random_tool(random);
                const std::vector<StrokePose> poses = random_path(random, grid, pick(random, 2, 6));
                auto& unlocked = op.on_labels() ? unlocked_labels : unlocked_greys;
                unlocked = op.on_labels() ? brute_force(labels, tool, op, poses, &greys)
                                          : brute_force(greys, tool, op, poses, &labels);
                op.spared = locks;
                const bool is_refused = op.names_label() && is_in(locks, op.label);
                if (is_refused)
                    unlocked.emplace(labels);
                editor.use({{},
                            tool,
                            op,
                            op.on_labels() ? "labels" : "grey",
                            op.on_labels() ? "grey" : "labels"});
                for (size_t i = 0; i < poses.size(); ++i)
                    editor.push({i == 0                 ? EditInput::Kind::down
                                 : i + 1 < poses.size() ? EditInput::Kind::move
                                                        : EditInput::Kind::up,
                                 poses[i], ++number});
            }
            editor.settle();
            const EditState is = *reader.pin();
            refused += is.refusals > was.refusals;
            bool any_spared = false;
            FlatVolume(first_labels).for_each([&](glm::ivec3 i) {
                const glm::uvec3 at(i);
                const double first = first_labels.value(at),
                             label = is.document.find("labels")->value(at),
                             grey = is.document.find("grey")->value(at);
                ASSERT_EQ(is_in(locks, first), is_in(locks, label)) << "seed " << seed;
                if (is_in(locks, first)) {
                    ASSERT_EQ(label, first) << "seed " << seed << " step " << step;
                    ASSERT_TRUE(same(grey, first_greys.value(at))) << "seed " << seed;
                }
                if (unlocked_labels) {
                    const Looked seen = look(labels.value(at), (*unlocked_labels)[i], label,
                                             labels.value(at), true, locks);
                    ASSERT_TRUE(seen.is_right) << "seed " << seed << " step " << step;
                    any_spared = any_spared || seen.was_spared;
                }
                if (unlocked_greys) {
                    const Looked seen = look(greys.value(at), (*unlocked_greys)[i], grey,
                                             labels.value(at), false, locks);
                    ASSERT_TRUE(seen.is_right) << "seed " << seed << " step " << step;
                    any_spared = any_spared || seen.was_spared;
                }
            });
            if (HasFatalFailure())
                return;
            spared += any_spared;
            changed += is.undo_steps != was.undo_steps;
            if (any_spared) {
                EXPECT_EQ(is.met_spared, was.met_spared + 1) << "seed " << seed << " step " << step;
                EXPECT_TRUE(is_in(locks, is.spared_label));
            }
        }
    }
    std::printf("    %zu runs: %zu steps refused, %zu with spared samples\n", size_t(runs), refused,
                spared);
    EXPECT_GT(refused, 0u);
    EXPECT_GT(spared, 0u);
    EXPECT_GT(changed, 0u);
}

TEST(LockedLabels, RefuseAMapThatChangesThemAlone) {
    const Grid grid = make_grid({40, 8, 8}, glm::dvec3(1.0));
    const auto row = [&](double left, double right) {
        return make_volume(grid, ScalarType::u16,
                           [=](glm::uvec3 i) { return i.x < 20 ? left : right; });
    };
    Editor editor(*make_document({{"labels", VolumeKind::labels, row(300, 0)}}),
                  {.threaded = false});
    auto reader = editor.add_reader();
    editor.put({"labels", VolumeKind::labels, row(0, 0)}, "largest piece", {}, {}, {{300}});
    editor.settle();
    EXPECT_EQ(reader.pin()->undo_steps, 0u);
    EXPECT_THAT(editor.take_refusal(), testing::HasSubstr("label 300, which is locked"));
    // A map of u8 does not hold the locked label: what comes out does.
    const Volume other = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 5.0; });
    editor.put({"labels", VolumeKind::labels, other}, "other", {}, {}, {{300}});
    editor.settle();
    EXPECT_EQ(reader.pin()->undo_steps, 1u);
    EXPECT_EQ(reader.pin()->volume().value({19, 0, 0}), 300.0f);
    EXPECT_EQ(reader.pin()->volume().value({20, 0, 0}), 5.0f);
}

} // namespace
} // namespace palpate
