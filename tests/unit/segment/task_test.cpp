#include "engine/segment/task.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <vector>

#include "engine/volume/brick.h"
#include "engine/volume/grid.h"

namespace palpate {
namespace {

BrickPtr brick_of(float value) {
    return Brick::make(std::span<const float>(&value, 1));
}

TEST(Task, MakesEveryBrickAndTellsHowFarItIs) {
    std::vector<double> shares;
    const Task task{{}, [&](double share) { shares.push_back(share); }};
    const Grid grid = make_grid({100, 40, 33}, {1, 1, 3});
    const Result<Volume> made =
        make_bricks(grid, ScalarType::f32, task.part(0.5, 1.0),
                    [](glm::uvec3 at) { return brick_of(float(at.x + 10 * at.y + 100 * at.z)); });
    ASSERT_TRUE(made);
    for_each_brick(*made, [&](glm::uvec3 at) {
        EXPECT_EQ(made->brick(at).value(0), float(at.x + 10 * at.y + 100 * at.z));
    });
    ASSERT_FALSE(shares.empty());
    EXPECT_GT(shares.front(), 0.5);
    EXPECT_EQ(shares.back(), 1.0);
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
}

TEST(Task, StoppedWorkIsAnError) {
    std::stop_source source;
    const Task task{source.get_token(), {}};
    std::atomic<int> run{0};
    const Result<Volume> made =
        make_bricks(make_grid({256, 256, 256}, {1, 1, 1}), ScalarType::f32, task, [&](glm::uvec3) {
            source.request_stop();
            ++run;
            return brick_of(1.0f);
        });
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().message, "stopped before it was done");
    EXPECT_LT(run, 512);
}

} // namespace
} // namespace palpate
