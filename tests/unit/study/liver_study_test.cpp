#include "bench/study/liver_study.h"

#include <gmock/gmock.h>

namespace palpate::bench {
namespace {

const StudyOptions kSmall{
    .phantoms = 1, .outlined = 1, .users = 2, .seeds = 5, .curves = 1, .clicks = 2};

const Result<Json>& small_study() {
    static const Result<Json> study = liver_study(kSmall, {});
    return study;
}

double of(const Json& row, const char* group, const char* figure) {
    return row[group][figure].number;
}

// LiverStudy takes over 5 s of a processor: a small study of every method is made twice.
TEST(LiverStudy, TwoRunsGiveTheSameBytes) {
    const Result<Json>& first = small_study();
    const Result<Json> second = liver_study(kSmall, {});
    ASSERT_TRUE(first) << first.error().message;
    ASSERT_TRUE(second);
    EXPECT_EQ(json_text(*first), json_text(*second));
}

// Nothing has no sensitivity and no false sample; everything has all of both; a sample more or less
// lies between.
TEST(LiverStudy, ControlsScoreAsTheyMust) {
    const Result<Json>& study = small_study();
    ASSERT_TRUE(study) << study.error().message;
    const auto row = [&](std::string_view name) -> const Json& {
        for (const Json& one : (*study)["rows"])
            if (one["name"].string == name)
                return one;
        ADD_FAILURE() << name;
        return (*study)["rows"].items.front();
    };
    const Json& nothing = row("control: nothing");
    EXPECT_EQ(of(nothing, "dice", "worst"), 0.0);
    EXPECT_EQ(of(nothing, "sensitivity", "worst"), 0.0);
    EXPECT_EQ(of(nothing, "specificity", "worst"), 1.0);
    const Json& everything = row("control: everything");
    EXPECT_EQ(of(everything, "sensitivity", "worst"), 1.0);
    EXPECT_EQ(of(everything, "specificity", "worst"), 0.0);
    EXPECT_EQ(of(everything, "box_specificity", "worst"), 0.0);
    const Json& eroded = row("control: truth eroded by a sample");
    EXPECT_EQ(of(eroded, "specificity", "worst"), 1.0);
    EXPECT_GT(of(eroded, "dice", "worst"), 0.7);
    EXPECT_LT(of(eroded, "dice", "worst"), 1.0);
    const Json& dilated = row("control: truth dilated by a sample");
    EXPECT_EQ(of(dilated, "sensitivity", "worst"), 1.0);
    EXPECT_GT(of(dilated, "dice", "worst"), 0.7);
    EXPECT_EQ(row("fast marching")["results"].number, 2.0);
    EXPECT_EQ(row("fast marching")["precision"]["pairs"].number, 1.0);
    EXPECT_EQ(row("outlined by hand")["precision"]["pairs"].number, 1.0);
    EXPECT_EQ((*study)["curves"].items.size(), 4u);
    EXPECT_EQ((*study)["curves"].items.front()["dice"].items.size(), 2u);
}

TEST(LiverStudy, Stops) {
    std::stop_source source;
    source.request_stop();
    EXPECT_FALSE(liver_study(kSmall, {source.get_token(), {}}));
}

} // namespace
} // namespace palpate::bench
