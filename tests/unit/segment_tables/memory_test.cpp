// Filters that docs/reference/filters.md marks so take volumes larger than memory.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "engine/io/brick_file.h"
#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/segment_tables/process_memory.h"
#include "tests/unit/segment_tables/volumes.h"

namespace palpate {
namespace {

class BrickFilter : public TemporaryFolder, public testing::WithParamInterface<size_t> {};

std::vector<size_t> by_bricks() {
    std::vector<size_t> all;
    for (size_t i = 0; i < filters().size(); ++i)
        if (filters()[i].bricks)
            all.push_back(i);
    return all;
}

// 48 MiB of samples, a cache of 1 MiB: from file to file in at most half of the volume, of which a
// thread's buffers of the writer are 10 MiB (brick_file.h), and those of the filter a brick with
// its halo in some copies.
TEST_P(BrickFilter, NeedsLessMemoryThanTheVolume) {
    const Filter& filter = filters()[GetParam()];
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    const Grid grid = make_grid({256, 256, 192}, {1, 1, 1});
    const auto value = [](glm::uvec3 i) { return double((i.x * 7 + i.y * i.z / 8) % 64 / 16); };
    ASSERT_TRUE(
        save_brick_file(file("v.pbv"), {grid, ScalarType::f32, false, {}, [&](glm::uvec3 p) {
                                            return make_brick(grid, ScalarType::f32, value, p);
                                        }}));
    const Result<BrickFile> read = open_brick_file(file("v.pbv"), kMiB);
    ASSERT_TRUE(read) << read.error().message;
    std::map<std::string, Volume> others;
    const std::string name = filter.name;
    if (name == "expression" || name == "mask")
        others.emplace("b", read->volume);
    if (name == "resample-like")
        others.emplace("other", read->coarser.front());
    const tables::FilterUse use = tables::uses_of(filter, others).front();
    const ProcessMemory memory;
    const Result<BrickMaker> maker = filter.bricks(read->volume, use.values, {});
    ASSERT_TRUE(maker) << maker.error().message;
    const Result<void> saved =
        save_brick_file(file("out.pbv"), {maker->grid, maker->type, false, {}, maker->brick});
    ASSERT_TRUE(saved) << saved.error().message;
    const uint64_t more = memory.peak_more();
    std::printf("%s: %.1f MiB more\n", filter.name, double(more) / double(kMiB));
    EXPECT_LE(more, 36 * kMiB);
}

INSTANTIATE_TEST_SUITE_P(Table, BrickFilter, testing::ValuesIn(by_bricks()), [](const auto& row) {
    return tables::test_name(filters()[row.param].name);
});

} // namespace
} // namespace palpate
