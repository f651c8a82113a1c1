// Every operation equals its brute-force twin, on strokes, tools, spacings, directions and label
// sets drawn by chance. PALPATE_STROKES is how many strokes of each operation: few in `quick`.

#include <gtest/gtest.h>

#include "engine/edit/stroke_run.h"
#include "tests/support/given.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

// EditTwin takes over 5 s of a processor: the twin looks at every sample of the volume for every
// stroke.
class EditTwin : public testing::TestWithParam<OperationKind> {};

TEST_P(EditTwin, EqualsTheDefinition) {
    const auto strokes = uint64_t(given("PALPATE_STROKES", 25));
    uint64_t changed_strokes = 0;
    for (uint64_t seed = 0; seed < strokes; ++seed) {
        Random random(seed * 100 + uint64_t(GetParam()));
        Operation op = random_operation(random, GetParam());
        // Two bricks on an axis, sometimes three; edges that end within a brick.
        const glm::uvec3 size(pick(random, 20, 45), pick(random, 20, 45), pick(random, 5, 40));
        const Grid grid = random_grid(random, size);
        const ScalarType types[] = {ScalarType::u8, ScalarType::u16, ScalarType::i16,
                                    ScalarType::f32, ScalarType::i8};
        const Volume before = op.on_labels()
                                  ? random_labels(random, grid, types[pick(random, 0, 1)])
                                  : random_greys(random, grid, types[pick(random, 0, 4)]);
        const Volume guide = random_greys(random, grid, ScalarType::i16);
        Tool tool = random_tool(random);
        if (op.by_region() && pick(random, 0, 3)) // components are closed in large tools only
            tool.shape = make_ball(uniform(random, 5.0, 20.0));
        const std::vector<StrokePose> poses = random_path(random, grid, pick(random, 1, 6));
        const FlatVolume expected = brute_force(before, tool, op, poses, &guide);

        const Result<Volume> found = apply_stroke(before, tool, op, poses, guide);
        ASSERT_TRUE(found) << found.error().message;
        size_t changed = 0;
        expected.for_each([&](glm::ivec3 i) {
            const double e = expected[i], f = found->value(glm::uvec3(i));
            changed += !(e == before.value(glm::uvec3(i)));
            ASSERT_TRUE(e == f || (std::isnan(e) && std::isnan(f)))
                << "seed " << seed << " at " << i.x << " " << i.y << " " << i.z << ": expected "
                << e << ", found " << f << ", was " << before.value(glm::uvec3(i));
        });
        if (HasFatalFailure())
            return;
        changed_strokes += changed > 0;
    }
    EXPECT_GT(changed_strokes, strokes / 10);
}

INSTANTIATE_TEST_SUITE_P(Operations, EditTwin,
                         testing::Values(OperationKind::draw, OperationKind::erase,
                                         OperationKind::erode, OperationKind::dilate,
                                         OperationKind::smooth, OperationKind::fill,
                                         OperationKind::islands, OperationKind::cut,
                                         OperationKind::mill),
                         operation_name);

} // namespace
} // namespace palpate
