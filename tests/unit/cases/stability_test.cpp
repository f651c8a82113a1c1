// The report of a hard case: its worst figure, its failures, its JSON.

#include "bench/cases/stability.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <limits>
#include <stdexcept>

namespace palpate::cases {
namespace {

using ::testing::HasSubstr;

TEST(Findings, KeepTheErrorThatUsesTheLargestShareOfItsBound) {
    Findings findings;
    findings.part("mm");
    findings.in("first");
    findings.within(5.0, 100.0);
    findings.in("second");
    findings.at(3, 4);
    findings.within(-0.2, 1.0);
    findings.in("third");
    findings.near(1.0, 1.0, 0.0); // met exactly
    ASSERT_EQ(findings.lines().size(), 1u);
    const Line& line = findings.lines()[0];
    EXPECT_TRUE(line.pass());
    EXPECT_EQ(line.figure, 0.2);
    EXPECT_EQ(line.bound, 1.0);
    EXPECT_EQ(line.checks, 3u);
    EXPECT_EQ(line.worst, "second, pixel 3 4");
}

TEST(Findings, FailBeyondABoundOnNanAndWithoutAnyCheck) {
    Findings findings;
    findings.part("too far");
    findings.in("here");
    findings.within(2.0, 1.0);
    findings.within(0.5, 1.0);
    findings.part("not a number");
    findings.within(std::numeric_limits<double>::quiet_NaN(), 1e9);
    findings.part("inexact");
    findings.within(1e-300, 0.0);
    findings.part("untrue");
    findings.expect(false, "the truth");
    findings.part("unchecked");
    ASSERT_EQ(findings.lines().size(), 5u);
    for (const Line& line : findings.lines())
        EXPECT_FALSE(line.pass()) << line.part;
    EXPECT_EQ(findings.lines()[0].failed, 1u);
    EXPECT_EQ(findings.lines()[0].sentence, "here, pixel 0 0: expected at most 1, found 2");
    EXPECT_THAT(findings.lines()[3].sentence, HasSubstr("expected the truth"));
}

TEST(HardCases, AreR1ToR23InOrder) {
    int number = 0;
    for (const HardCase& hard_case : hard_cases()) {
        EXPECT_EQ(hard_case.name, fmt::format("R{}", ++number));
        EXPECT_STRNE(hard_case.title, "");
        EXPECT_STRNE(hard_case.why, "");
    }
    EXPECT_EQ(number, 23);
}

class BrokenPainter : public Painter {
 public:
    Image draw(const Scene&, const SceneData&, const Choices&) override {
        throw std::runtime_error("the device is lost");
    }
    double weight_rounding() const override { return 0.0; }
};

TEST(HardCases, ThatCannotBeDrawnFailAndSayWhy) {
    BrokenPainter painter;
    size_t told = 0;
    const auto results = run_hard_cases(painter, [&](const CaseResult&) { ++told; });
    EXPECT_EQ(told, hard_cases().size());
    for (const CaseResult& result : results) {
        EXPECT_FALSE(result.pass()) << result.hard_case->name;
        EXPECT_THAT(describe(result), HasSubstr("the device is lost"));
        EXPECT_THAT(describe(result), HasSubstr("FAIL"));
    }
    const auto json = to_json(results);
    EXPECT_EQ(json["passed"], 0);
    EXPECT_EQ(json["count"], hard_cases().size());
    EXPECT_EQ(json["cases"].items[0]["name"], "R1");
}

TEST(HardCases, FiguresThatAreNoNumbersAreNullInJson) {
    const HardCase& any = hard_cases()[0];
    Findings findings;
    findings.part("value");
    findings.within(std::numeric_limits<double>::quiet_NaN(), 1.0);
    const auto json = to_json({{&any, findings.lines(), 1.5}});
    EXPECT_THAT(json_line(json), HasSubstr("\"figure\": null"));
    EXPECT_EQ(json["cases"].items[0]["lines"].items[0]["bound"], 1.0);
    EXPECT_EQ(json["cases"].items[0]["pass"], false);
    EXPECT_EQ(json["cases"].items[0]["ms"], 1.5);
}

TEST(HardCases, StopWhenAsked) {
    BrokenPainter painter;
    std::stop_source stop;
    const auto results = run_hard_cases(
        painter, [&](const CaseResult&) { stop.request_stop(); }, stop.get_token());
    EXPECT_EQ(results.size(), 1u);
}

} // namespace
} // namespace palpate::cases
