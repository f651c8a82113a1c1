#include <gtest/gtest.h>

#include <algorithm>

#include "engine/edit/stroke_run.h"
#include "tests/unit/haptics_servo/bench_loop.h"

// The way of an edit: pose, ring, editor, snapshot, mailbox, tick.
namespace palpate::haptics {
namespace {

// Looks up the sample nearest to the tool: what a tick sees of the snapshot, and nothing else.
struct Nothing {};
TickOutput probe_tick(Nothing&, const TickInput& input) noexcept {
    const Volume& volume = *input.scene->grey;
    const glm::dvec3 index = glm::round(index_point(volume.grid(), input.tool.position_mm));
    TickOutput out{.proxy = input.tool};
    if (glm::all(glm::greaterThanEqual(index, glm::dvec3(0))) &&
        glm::all(glm::lessThan(index, glm::dvec3(volume.size()))))
        out.depth_mm = volume.value(glm::uvec3(index));
    return out;
}

TEST(EditFelt, AStrokeIsPublishedWithinAMillisecondAndFeltInTheFirstTickAfter) {
    // A pose every other tick, of a ball of 2 mm through a block at 40 mm/s.
    const Grid grid = make_grid(glm::uvec3(128), glm::dvec3(0.5), glm::dvec3(-32));
    const Volume block =
        synthetic::sample(synthetic::ramp({0, 0, 0}, 1000.0), grid, ScalarType::i16);
    const HandPath path({{.time_s = 0, .tool = {.position_mm = {-20, 0.1, 0}}},
                         {.time_s = 1, .tool = {.position_mm = {20, 0.1, 0}}}});
    Loop loop{{.grey = block, .version = block.version()},
              {},
              std::make_unique<StatefulAlgorithm<Nothing, probe_tick>>(),
              std::make_unique<RecordedDevice>(
                  DeviceCapabilities{.workspace_m = glm::dvec3(0.05)},
                  records_of_path(path, Workspace({0, 0, 0}, 1.0), kTick_ns), kTick_ns)};
    const Tool burr{.shape = make_ball(2.0)};
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.to_value = 0.0;
    auto stroke = StrokeRun::start(block, burr, cut);
    ASSERT_TRUE(stroke) << stroke.error().message;

    std::vector<int64_t> cpu_ns;
    for (int i = 0; i < 500; ++i) { // two ticks each
        const ServoTick before = loop.tick();
        ToolStamp stamp;
        ASSERT_TRUE(loop.poses.pop(stamp));
        const int64_t began = thread_cpu_ns();
        const StrokePose pose{1e-9 * static_cast<double>(stamp.time_ns),
                              {stamp.tool.position_mm, stamp.tool.rotation}};
        (*stroke)->add(std::span(&pose, 1));
        (*stroke)->work();
        const Volume now = (*stroke)->publish();
        loop.scenes.publish(
            std::make_unique<const TouchScene>(TouchScene{.grey = now, .version = now.version()}));
        cpu_ns.push_back(thread_cpu_ns() - began);
        // At 40 mm/s the tool is 0.04 mm further on: still within what this pose has cut.
        const ServoTick after = loop.tick();
        ASSERT_TRUE(loop.poses.pop(stamp));
        ASSERT_EQ(after.scene_version, now.version()) << i;
        ASSERT_EQ(after.touched.depth_mm, 0.0) << i;
        if (i == 0) {
            ASSERT_EQ(before.touched.depth_mm, 1000.0);
        }
    }
    std::sort(cpu_ns.begin(), cpu_ns.end());
    std::printf("published after %.0f us of thread CPU (median), %.0f (p99), %.0f (most)\n",
                cpu_ns[250] / 1e3, cpu_ns[495] / 1e3, cpu_ns.back() / 1e3);
}

} // namespace
} // namespace palpate::haptics
