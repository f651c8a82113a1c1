// The memory that docs/reference/segment.md states of every method.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

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
        if (!method.takes_curves) // memory of a surface between curves is of their box
            all.push_back({method.name, &method, tables::values_of(method)});
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

class MethodMemory : public testing::TestWithParam<MethodUse> {};

// A ball with a soft edge and noise, on whole bricks. Beside the volume and what it returns, a
// method has at most three volumes of floats; and buffers of a thread (some 15 boxes of a brick
// with samples around, 0.2 MB each) and the coarsest grids of a flow (1.2 MB), which are whole
// bricks. A fourth volume would be 8 MiB.
TEST_P(MethodMemory, IsAtMostThreeVolumesOfFloats) {
    const MethodUse& use = GetParam();
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    const Grid grid = make_grid({128, 128, 128}, {1, 1, 1.5});
    const Volume volume = make_volume(grid, ScalarType::i16, [](glm::uvec3 i) {
        const double r = glm::length(glm::dvec3(i) - 63.5);
        return std::round(200 / (1 + std::exp((r - 38) / 2))) +
               double((i.x * 7 + i.y * 13 + i.z * 29) % 11);
    });
    const SegmentInput input = tables::input_of(*use.method, volume);
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

INSTANTIATE_TEST_SUITE_P(Table, MethodMemory, testing::ValuesIn(uses()),
                         [](const auto& row) { return tables::test_name(row.param.name); });

} // namespace
} // namespace palpate
