// The memory that docs/reference/segment.md states of every method.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "engine/volume/builder.h"
#include "tests/unit/segment_tables/process_memory.h"
#include "tests/unit/segment_tables/volumes.h"

namespace palpate {
namespace {

struct MethodUse {
    std::string name;
    const SegmentMethod* method;
    ParameterValues values;
};

std::vector<MethodUse> uses() {
    std::vector<MethodUse> all;
    for (const SegmentMethod& method : segment_methods())
        all.push_back({method.name, &method,
                       method.takes_curves ? ParameterValues() : tables::values_of(method)});
    MethodUse flow = *std::ranges::find(all, "level-set-edges", &MethodUse::name);
    flow.name += "-flow";
    flow.values["flow"] = 1.0;
    all.push_back(std::move(flow));
    for (MethodUse& use : all) // what a surface needs on its way, it needs at its start
        if (use.method->has_distance)
            use.values["iterations"] = 5;
        else if (use.name == "random-walker")
            use.values["tolerance"] = 0.05;
    return all;
}

// Three circles of samples about the middle of a grid, each across the others.
std::vector<WireCurve> circles(const Grid& grid, double radius) {
    std::vector<WireCurve> curves(3);
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i <= 8; ++i) {
            const double turn = 2.0 * std::numbers::pi * (i % 8) / 8;
            glm::dvec3 at = 0.5 * glm::dvec3(grid.size - 1u);
            at[(axis + 1) % 3] += radius * std::cos(turn);
            at[(axis + 2) % 3] += radius * std::sin(turn);
            curves[size_t(axis)].points_mm.push_back(world_point(grid, at));
        }
    return curves;
}

class MethodMemory : public testing::TestWithParam<MethodUse> {};

// A ball with a soft edge and noise, on whole bricks. Beside the volume and what it returns, a
// method has at most three volumes of floats; and buffers of a thread (some 15 boxes of a brick
// with samples around, 0.2 MB each) and the coarsest grids of a flow (1.2 MB), which are whole
// bricks. A fourth volume would be 8 MiB.
TEST_P(MethodMemory, IsAtMostThreeVolumesOfFloats) {
    const MethodUse& use = GetParam();
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    const Grid grid = make_grid({128, 128, 128}, {1, 1, 1.5});
    // Memory of a surface through curves is of its box.
    const double radius = use.method->takes_curves ? 60 : 38;
    const Volume volume = make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
        const double r = glm::length(glm::dvec3(i) - 63.5);
        return std::round(200 / (1 + std::exp((r - radius) / 2))) +
               double((i.x * 7 + i.y * 13 + i.z * 29) % 11);
    });
    SegmentInput input = tables::input_of(*use.method, volume);
    if (use.method->takes_curves)
        input.curves = circles(grid, radius);
    const uint64_t samples = 128 * 128 * 128;
    const ProcessMemory memory;
    const Result<Segmented> made = segment(*use.method, input, use.values, {});
    const uint64_t peak = memory.peak_more();
    ASSERT_TRUE(made) << made.error().message;
    uint64_t results = made->labels.type() == ScalarType::u8 ? samples : 2 * samples;
    for (const std::optional<Volume>* made_too : {&made->cost, &made->strength, &made->distance})
        results += *made_too ? 4 * samples : 0;
    std::printf("%s: %.1f bytes a sample, of which %.1f are results\n", use.name.c_str(),
                double(peak) / double(samples), double(results) / double(samples));
    EXPECT_LE(peak, results + 12 * samples + 6 * kMiB);
}

// The filter that holds most. A sample takes 2 bytes of the length so far and, on each grid, 4 of
// the flow, 4 of its right side and 2 of a packed weight; the flow becomes the result. The coarse
// grids have 2/7 of the samples, as the axis of 1.5 mm is left out of the first halving (1/4, then
// 1/8 of it, ..). Bricks of 128 KiB take a page more here, as blocks of their own: 1/32.
TEST(FilterMemory, TheLengthOfAFlowHoldsWhatItsGridsNeed) {
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    const Volume edges =
        make_volume(make_grid({128, 128, 128}, {1, 1, 1.5}), ScalarType::f32, [](glm::uvec3 i) {
            const double r = glm::length(glm::dvec3(i) - 63.5);
            return std::exp(-std::abs(r - 38) / 2) + double((i.x * 7 + i.y * 13) % 11) / 100;
        });
    const uint64_t samples = 128 * 128 * 128;
    const auto filter = std::ranges::find_if(
        filters(), [](const Filter& one) { return std::string_view(one.name) == "gvf"; });
    const ProcessMemory memory;
    const Result<Volume> made = run_filter(*filter, edges, {{3.0, 0.2, 1e-2}, "", nullptr}, {});
    const uint64_t peak = memory.peak_more();
    ASSERT_TRUE(made) << made.error().message;
    std::printf("gvf length: %.1f bytes a sample, of which 4 are the result\n",
                double(peak) / double(samples));
    EXPECT_LE(peak, (2 * samples + 10 * samples / 7 * 9) / 32 * 33 + 6 * kMiB);
}

INSTANTIATE_TEST_SUITE_P(Table, MethodMemory, testing::ValuesIn(uses()),
                         [](const auto& row) { return tables::test_name(row.param.name); });

} // namespace
} // namespace palpate
