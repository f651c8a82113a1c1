#include "engine/segment/filters.h"

#include <gmock/gmock.h>

#include <set>

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
    const Filter& erode = filter_named("erode");
    EXPECT_EQ(filter_arguments(erode), "ELEMENT[,BY[,LABEL[,OVER]]]");
    EXPECT_EQ(read_filter_values(erode, "ball,2.5,label=3")->numbers,
              (std::vector<double>{3, 2.5, 3, 0}));
    EXPECT_EQ(read_filter_values(erode, "6,label=1.5").error().message,
              "label: expected a whole number 0 .. 65535 (0: all), found '1.5'");
}

} // namespace
} // namespace palpate
