#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>

#include "engine/io/brick_file.h"
#include "engine/io/brick_file_layout.h"
#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/segment_tables/volumes.h"

namespace palpate {
namespace {

// EveryMethod takes over 5 s of a processor: each method meets each type, grid, shape and content.
class EveryMethod : public TemporaryFolder, public testing::WithParamInterface<size_t> {
 protected:
    const SegmentMethod& method() const { return segment_methods()[GetParam()]; }

    Result<Segmented> run(const Volume& volume) const {
        const auto input = tables::input_of(method(), volume);
        return segment(method(), input, tables::values_of(method()), {});
    }
    static Result<Volume> labels_of(const Result<Segmented>& made) {
        return made ? Result<Volume>(made->labels) : tl::unexpected(made.error());
    }
    static testing::AssertionResult same(const Result<Segmented>& a, const Result<Segmented>& b) {
        testing::AssertionResult labels = tables::same(labels_of(a), labels_of(b));
        if (!labels || !a || !a->strength)
            return labels;
        return tables::same(*a->strength, *b->strength);
    }
};

// On every type, grid, shape and content, or with a sentence that a sheared grid is refused, that
// no seed has data, or that a single sample has no room for an object beside others. Labels are 0
// and 1; a sample without data has none, and a seed of the object has 1, but for level sets.
TEST_P(EveryMethod, TakesEveryVolume) {
    for (const tables::VolumeCase& one : tables::volumes(false)) {
        SCOPED_TRACE(one.name);
        const Result<Segmented> made = run(one.volume);
        if (!made) {
            const std::string& why = made.error().message;
            const bool no_data = one.name == "without data" && why.find("no data") < why.size();
            bool no_room = false;
            for (const char* words : {"two labels", "some samples, and not all", "seeds outside"})
                no_room |= one.name == "a sample" && why.find(words) < why.size();
            EXPECT_TRUE((one.sheared && tables::says_sheared(why)) || no_data || no_room) << why;
            continue;
        }
        const Volume& labels = made->labels;
        EXPECT_EQ(labels.grid(), one.volume.grid());
        EXPECT_TRUE(labels.type() == ScalarType::u8 || labels.type() == ScalarType::u16);
        EXPECT_EQ(made->strength.has_value(), method().strength.has_value());
        const glm::uvec3 size = labels.size();
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x) {
                    const float label = labels.value({x, y, z});
                    ASSERT_TRUE(label == 0.0f || label == 1.0f);
                    if (std::isnan(one.volume.value({x, y, z}))) {
                        ASSERT_EQ(label, 0.0f) << x << ", " << y << ", " << z;
                    }
                }
        // The surface of a level set starts at the seeds, and curvature takes small ones away.
        const bool keeps_seeds = !std::string_view(method().name).starts_with("level-set");
        if (method().takes_seeds && keeps_seeds && !std::isnan(one.volume.value(size / 2u))) {
            EXPECT_EQ(labels.value(size / 2u), 1.0f);
        }
    }
}

TEST_P(EveryMethod, GivesTheSameBitsOnAnyNumberOfThreads) {
    for (const tables::VolumeCase& one : tables::volumes(false)) {
        SCOPED_TRACE(one.name);
        const Result<Segmented> made = run(one.volume);
        for (const size_t threads : {1, 2, 4}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            EXPECT_TRUE(same(made, run(one.volume))) << threads << " threads";
        }
    }
}

TEST_P(EveryMethod, GivesTheSameBitsOfABrickFile) {
    for (const tables::VolumeCase& one : tables::volumes(false)) {
        SCOPED_TRACE(one.name);
        ASSERT_TRUE(save_brick_file(file(one.name), stream_of(one.volume)));
        const Result<BrickFile> read = open_brick_file(file(one.name), 1);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_TRUE(same(run(one.volume), run(read->volume)));
    }
}

TEST_P(EveryMethod, PassesOnThatABrickCannotBeRead) {
    const Volume good = tables::sampled(make_grid({70, 40, 34}, {1, 1, 2}), ScalarType::i16, false);
    ASSERT_TRUE(save_brick_file(file("good.pbv"), stream_of(good)));
    std::string bytes = bytes_of("good.pbv");
    io::BrickFileHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    for (size_t i = sizeof header; i < header.index_offset; i += 16)
        bytes[i] ^= 1; // of all bricks
    write("bad.pbv", bytes);
    const Result<BrickFile> read = open_brick_file(file("bad.pbv"), 1);
    ASSERT_TRUE(read) << read.error().message;
    ParameterValues values = tables::values_of(method());
    if (values.contains("edges"))
        values["edges"] = 3.0; // at 0 a mesh reads no values
    EXPECT_THROW((void)segment(method(), tables::input_of(method(), read->volume), values, {}),
                 SourceError);
}

// Seeds that are a map of zeros, or of another grid.
TEST_P(EveryMethod, RefusesSeedsThatAreNone) {
    const Volume volume =
        tables::sampled(make_grid({40, 21, 10}, {1, 1, 2}), ScalarType::i16, false);
    const auto why = [&](const Grid& grid) {
        const Volume seeds = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
        const Result<Segmented> made =
            segment(method(), {volume, seeds, {}, 0}, tables::values_of(method()), {});
        return made ? std::string("made") : made.error().message;
    };
    if (!method().takes_seeds) {
        EXPECT_EQ(why(volume.grid()), "made");
        return;
    }
    EXPECT_EQ(why(volume.grid()), "seeds: expected seeds, found a label map of zeros");
    EXPECT_NE(why(make_grid({40, 21, 11}, {1, 1, 2})).find("on the grid of the volume"),
              std::string::npos);
}

// A method that takes curves needs closed ones that cross each other, which its own test draws.
std::vector<size_t> without_curves() {
    std::vector<size_t> rows;
    for (size_t i = 0; i < segment_methods().size(); ++i)
        if (!segment_methods()[i].takes_curves)
            rows.push_back(i);
    return rows;
}

INSTANTIATE_TEST_SUITE_P(Table, EveryMethod, testing::ValuesIn(without_curves()),
                         [](const auto& row) {
                             return tables::test_name(segment_methods()[row.param].name);
                         });

} // namespace
} // namespace palpate
