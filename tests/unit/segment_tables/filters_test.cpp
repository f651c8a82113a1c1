#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <set>

#include "engine/io/brick_file.h"
#include "engine/io/brick_file_layout.h"
#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/segment_tables/volumes.h"

namespace palpate {
namespace {

const std::set<std::string_view> kOtherGrids{"crop",     "pad",      "flip",
                                             "reorient", "resample", "resample-like"};
// They take a place, which may have no answer, and are of a part of the volume.
const std::set<std::string_view> kOfPlaces{"piece", "local-threshold", "level-trace"};

// EveryFilter takes over 5 s of a processor: each filter meets each type, grid, shape and content.
class EveryFilter : public TemporaryFolder, public testing::WithParamInterface<size_t> {
 protected:
    const Filter& filter() const { return filters()[GetParam()]; }

    // Calls check(use, case, result) for each use of the filter on each volume.
    template <class Check>
    void for_each_use(const Check& check) const {
        for (const tables::VolumeCase& one : tables::volumes(filter().takes_labels)) {
            const auto others = tables::others_of(one.volume);
            for (const tables::FilterUse& use : tables::uses_of(filter(), others)) {
                SCOPED_TRACE(use.name + " on " + one.name);
                check(use, one, run_filter(filter(), one.volume, use.values, {}));
            }
        }
    }
};

// On every type, grid, shape and content, or with a sentence that a sheared grid is refused; no
// data stays where it is; a volume of one value has a result of one value.
TEST_P(EveryFilter, TakesEveryVolume) {
    const bool keeps_grid = !kOtherGrids.contains(filter().name);
    for_each_use([&](const tables::FilterUse& use, const tables::VolumeCase& one,
                     const Result<Volume>& made) {
        if (!made) {
            EXPECT_TRUE((one.sheared && tables::says_sheared(made.error().message)) ||
                        kOfPlaces.contains(filter().name))
                << made.error().message;
            return;
        }
        if (!keeps_grid)
            return;
        EXPECT_EQ(made->grid(), one.volume.grid());
        if (one.name == "constant" || one.name == "0") {
            const bool is_mask = std::string_view(filter().name) == "mask" ||
                                 std::string_view(filter().name) == "expression";
            const bool is_of_part =
                kOfPlaces.contains(filter().name) || std::string_view(filter().name) == "scissors";
            EXPECT_TRUE(is_mask || is_of_part || made->range().empty() ||
                        made->range().min == made->range().max);
        }
        if (filter().takes_labels) {
            if (made->no_data_count() > 0) { // distances where all is of one kind
                EXPECT_EQ(made->no_data_count(), sample_count(made->grid()));
            }
            return;
        }
        if (made->type() != ScalarType::f32)
            return;
        const bool is_mask = std::string_view(filter().name) == "mask";
        const Volume& kept = use.values.others->at("b");
        const glm::uvec3 size = made->size();
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    ASSERT_EQ(std::isnan(made->value({x, y, z})),
                              std::isnan(one.volume.value({x, y, z})) &&
                                  (!is_mask || kept.value({x, y, z}) != 0.0f))
                        << x << ", " << y << ", " << z;
    });
}

// A locked label keeps its samples and gets no other, or the sentence says that a label is needed.
TEST_P(EveryFilter, LeavesLockedLabels) {
    if (!filter().changes_map)
        return;
    for_each_use([&](const tables::FilterUse& use, const tables::VolumeCase& one,
                     const Result<Volume>& made) {
        FilterValues values = use.values;
        values.locked = {2};
        const Result<Volume> kept = run_filter(filter(), one.volume, values, {});
        if (!kept || !made)
            return;
        const glm::uvec3 size = kept->size();
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    ASSERT_EQ(kept->value({x, y, z}) == 2.0f, one.volume.value({x, y, z}) == 2.0f)
                        << x << ", " << y << ", " << z;
    });
}

TEST_P(EveryFilter, GivesTheSameBitsOnAnyNumberOfThreads) {
    for_each_use([&](const tables::FilterUse& use, const tables::VolumeCase& one,
                     const Result<Volume>& made) {
        for (const size_t threads : {1, 2, 4}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            EXPECT_TRUE(tables::same(made, run_filter(filter(), one.volume, use.values, {})))
                << threads << " threads";
        }
    });
}

TEST_P(EveryFilter, GivesTheSameBitsOfABrickFile) {
    std::map<std::string, Volume> opened;
    for_each_use([&](const tables::FilterUse& use, const tables::VolumeCase& one,
                     const Result<Volume>& made) {
        if (!opened.contains(one.name)) {
            ASSERT_TRUE(save_brick_file(file(one.name), stream_of(one.volume)));
            Result<BrickFile> read = open_brick_file(file(one.name), 1);
            ASSERT_TRUE(read) << read.error().message;
            opened.emplace(one.name, std::move(read->volume));
        }
        EXPECT_TRUE(tables::same(made, run_filter(filter(), opened.at(one.name), use.values, {})));
    });
}

// A brick that cannot be read is an error of the reader, not a wrong result.
TEST_P(EveryFilter, PassesOnThatABrickCannotBeRead) {
    const Volume good =
        tables::sampled(make_grid({70, 40, 34}, {1, 1, 2}), ScalarType::i16, filter().takes_labels);
    ASSERT_TRUE(save_brick_file(file("good.pbv"), stream_of(good)));
    std::string bytes = bytes_of("good.pbv");
    bytes[sizeof(io::BrickFileHeader) + 20] ^= 1; // of the first brick
    write("bad.pbv", bytes);
    const Result<BrickFile> read = open_brick_file(file("bad.pbv"), 1);
    ASSERT_TRUE(read) << read.error().message;
    const auto others = tables::others_of(good);
    for (const tables::FilterUse& use : tables::uses_of(filter(), others))
        EXPECT_THROW((void)run_filter(filter(), read->volume, use.values, {}), SourceError)
            << use.name;
}

INSTANTIATE_TEST_SUITE_P(Table, EveryFilter, testing::Range(size_t{0}, filters().size()),
                         [](const auto& row) {
                             return tables::test_name(filters()[row.param].name);
                         });

} // namespace
} // namespace palpate
