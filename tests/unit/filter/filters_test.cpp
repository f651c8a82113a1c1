#include "engine/segment/filters.h"

#include <gmock/gmock.h>

#include <set>

#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

const Filter& filter_named(std::string_view name) {
    for (const Filter& filter : filters())
        if (filter.name == name)
            return filter;
    throw std::runtime_error("no such filter");
}

TEST(Filters, TheTableIsWhole) {
    std::set<std::string> names;
    for (const Filter& filter : filters()) {
        EXPECT_TRUE(names.insert(filter.name).second) << filter.name;
        EXPECT_NE((filter.bricks != nullptr), (filter.whole != nullptr)) << filter.name;
        EXPECT_GT(std::string(filter.purpose).size(), 8u) << filter.name;
        EXPECT_GT(std::string(filter.memory).size(), 1u) << filter.name;
        EXPECT_GT(std::string(filter.type).size(), 1u) << filter.name;
        bool optional = false; // parameters with a preset come last
        for (const FilterParameter& p : filter.parameters) {
            EXPECT_LE(optional, p.preset.has_value()) << filter.name;
            optional |= p.preset.has_value();
            EXPECT_LT(p.least, p.most) << filter.name;
        }
    }
}

TEST(Filters, ValuesInOrderOrByName) {
    const Filter& derivative = filter_named("derivative");
    EXPECT_EQ(filter_arguments(derivative), "AXIS,SIGMA[,SECOND]");
    EXPECT_EQ(filter_ranges(derivative),
              "axis: left/posterior/superior; sigma: 0 .. 1000 mm; second: "
              "none/left/posterior/superior (default: none)");
    EXPECT_EQ(read_filter_values(derivative, "posterior,1.5")->numbers,
              (std::vector<double>{1, 1.5, 0}));
    EXPECT_EQ(read_filter_values(derivative, "sigma=2,second=left,axis=left")->numbers,
              (std::vector<double>{0, 2, 1}));
    const auto message = [&](const char* text) {
        const auto read = read_filter_values(derivative, text);
        return read ? std::string("read") : read.error().message;
    };
    EXPECT_EQ(message("x,1"), "axis: expected left/posterior/superior, found 'x'");
    EXPECT_EQ(message("left,one"), "sigma: expected a number 0 .. 1000 mm, found 'one'");
    EXPECT_EQ(message("left,nan"), "sigma: expected a number 0 .. 1000 mm, found 'nan'");
    EXPECT_EQ(message("left,"), "sigma: expected a number 0 .. 1000 mm, found ''");
    EXPECT_EQ(message("left"), "expected AXIS,SIGMA[,SECOND], found 'left'");
    EXPECT_EQ(message("left,1,none,4"), "expected AXIS,SIGMA[,SECOND], found 'left,1,none,4'");
    EXPECT_EQ(message("left,1,axis=left"), "axis: expected one value, found 'left,1,axis=left'");
    EXPECT_EQ(message("left,1,width=3"), "expected AXIS,SIGMA[,SECOND], found 'left,1,width=3'");
}

// Every filter that works by bricks gives the same bricks one by one as all at once, and changes
// nothing of the grid.
TEST(Filters, RunOnEveryShapeOfVolume) {
    for (const Filter& filter : filters()) {
        if (filter.text[0] != '\0')
            continue;
        FilterValues values;
        for (const FilterParameter& p : filter.parameters) {
            values.numbers.push_back(p.preset.value_or(p.words[0] != '\0'                   ? 0.0
                                                       : std::string_view(p.name) == "high" ? 2.0
                                                                                            : 1.0));
        }
        for (const glm::uvec3 size : {glm::uvec3(1), {35, 6, 1}, {3, 1, 34}})
            for (const ScalarType type : {ScalarType::u8, ScalarType::i16, ScalarType::f32})
                for (const bool oblique : {false, true}) {
                    const glm::dvec3 spacing(0.7, 0.9, 2.0);
                    const Volume volume = twin::noise(
                        oblique ? twin::turned(size, spacing, true) : make_grid(size, spacing),
                        type, type == ScalarType::f32 ? 3 : 0);
                    if (std::string_view(filter.name) == "gvf" && oblique)
                        continue; // sheared: refused
                    if (std::string_view(filter.name) == "crop")
                        values.numbers.assign(6, 0.0);
                    const Result<Volume> made = run_filter(filter, volume, values, {});
                    ASSERT_TRUE(made) << filter.name << ": " << made.error().message;
                    if (!filter.bricks)
                        continue;
                    const BrickMaker maker = filter.bricks(volume, values, {}).value();
                    EXPECT_EQ(maker.grid, made->grid());
                    EXPECT_EQ(maker.type, made->type());
                    for_each_brick(*made, [&](glm::uvec3 at) {
                        const BrickPtr brick = maker.brick(at);
                        EXPECT_EQ(brick->type(), maker.type) << filter.name;
                        EXPECT_EQ(differing_blocks(*brick, made->brick(at)), 0u) << filter.name;
                    });
                }
    }
}

} // namespace
} // namespace palpate
