#include "engine/measure/measure_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

using ::testing::HasSubstr;

MeasureReport example() {
    MeasureReport report;
    Measured length;
    length.length_mm = 5.0;
    report.measures.push_back({{MeasureKind::ruler, {{0, 0, 0}, {3, 4, 0}}, "a, \"b\""}, length});
    Measured empty;
    empty.radius_mm = 1.0;
    empty.volume_mm3 = 4.0;
    empty.values = statistics_of({});
    empty.note = "no sample lies inside";
    report.measures.push_back({{MeasureKind::sphere, {{0, 0, 0}, {1, 0, 0}}}, empty});
    LabelStatistics label;
    label.label = 7;
    label.count = 3;
    label.volume_mm3 = 1500.0;
    label.values = statistics_of({1.0f, 2.0f, 6.0f});
    label.covariance_mm2 = glm::dmat3(1.0);
    label.covariance_mm2[1][1] = 20.0;
    label.histogram = {1, 2};
    report.histogram_range = {1.0f, 6.0f};
    report.labels.push_back({label, {600.0, 1490.0, 0.9}, "kidney"});
    return report;
}

TEST(MeasureReport, ATableHasAnEmptyFieldForWhatIsNotDefined) {
    const std::string csv = report_csv(example());
    std::vector<std::string> lines;
    for (size_t at = 0, end; (end = csv.find("\r\n", at)) != csv.npos; at = end + 2)
        lines.push_back(csv.substr(at, end - at));
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_THAT(lines[0], HasSubstr("kind,name,label,length_mm,radius_mm,area_mm2"));
    EXPECT_THAT(lines[1], HasSubstr("ruler,\"a, \"\"b\"\"\",,5,,"));
    EXPECT_THAT(lines[2], HasSubstr("sphere,sphere 2,,,1,,4,0.004,0,,,,,,,,,,"));
    EXPECT_THAT(lines[2], HasSubstr("no sample lies inside"));
    EXPECT_THAT(lines[3], HasSubstr("label,kidney,7,,,600,1500,1.5,3,3,"));
    const auto fields = [](const std::string& line) {
        size_t count = 1;
        bool in_quotes = false;
        for (const char c : line) {
            in_quotes ^= c == '"';
            count += c == ',' && !in_quotes;
        }
        return count;
    };
    EXPECT_THAT(lines[3], HasSubstr(",0.9,10,")); // a second moment of 20: an axis of sqrt(5 x 20)
    EXPECT_THAT(lines[3], HasSubstr("0 1 0"));
    EXPECT_THAT(lines[3], HasSubstr(",1 2,"));
    for (const std::string& line : lines)
        EXPECT_EQ(fields(line), fields(lines[0])) << line;
}

// A ruler and a ball fill no column of labels, and no angle.
TEST(MeasureReport, ATableHasColumnsThatAreFilledAndTheirUnits) {
    MeasureReport report;
    Measured length, ball;
    length.length_mm = 5.0;
    report.measures.push_back({{MeasureKind::ruler, {{0, 0, 0}, {3, 4, 0}}}, length});
    ball.radius_mm = 1.0;
    ball.volume_mm3 = 4.0;
    ball.values = statistics_of({40.0f, 50.0f});
    report.measures.push_back({{MeasureKind::sphere, {{0, 0, 0}, {1, 0, 0}}}, ball});
    report.unit = "HU";
    const std::string csv = report_csv(report);
    EXPECT_EQ(csv.substr(0, csv.find("\r\n")),
              "kind,name,length_mm,radius_mm,volume_mm3,volume_ml,count,mean_HU,sd_HU,min_HU,p5_HU,"
              "p25_HU,median_HU,p75_HU,p95_HU,max_HU,points_mm");
    ball.values = statistics_of({40.0f, NAN});
    report.measures.push_back({{MeasureKind::sphere, {{0, 0, 0}, {1, 0, 0}}}, ball});
    report.unit.clear();
    EXPECT_THAT(report_csv(report), HasSubstr(",count,no_data,mean,sd,"));
}

TEST(MeasureReport, JsonLeavesOutWhatIsNotDefined) {
    const Json json = report_json(example());
    const Json& sphere = json["measures"].items[1];
    EXPECT_EQ(sphere["values"]["count"].number, 0.0);
    EXPECT_FALSE(sphere["values"].contains("mean"));
    EXPECT_EQ(sphere["note"].string, "no sample lies inside");
    EXPECT_EQ(json["labels"].items[0]["values"]["median"].number, 2.0);
    EXPECT_EQ(json["labels"].items[0]["volume_ml"].number, 1.5);
    EXPECT_EQ(json["labels"].items[0]["area_mm2"].number, 600.0);
    EXPECT_EQ(json["labels"].items[0]["semi_axes_mm"].items[0].number, 10.0);
    EXPECT_EQ(json["labels"].items[0]["axes"].items[0].items[1].number, 1.0);
    EXPECT_EQ(json["labels"].items[0]["histogram"]["counts"].items[1].number, 2.0);
}

TEST(MeasureReport, HeadlinesCarryTheirUnit) {
    const auto text = [](auto member, double value) {
        Measured measured;
        measured.*member = value;
        return headline(measured);
    };
    EXPECT_EQ(text(&Measured::length_mm, 12.345), "12.3 mm");
    EXPECT_EQ(text(&Measured::angle_deg, 41.25), "41.2\u00b0");
    EXPECT_EQ(text(&Measured::area_mm2, 152.0), "152.0 mm\u00b2");
    EXPECT_EQ(text(&Measured::area_mm2, 15200.0), "152.0 cm\u00b2");
    EXPECT_EQ(text(&Measured::volume_mm3, 14137.2), "14.1 ml");
}

// The percentile p of 1 .. 100 is the number p.
TEST(Statistics, PercentilesAreNearestRanks) {
    std::vector<float> values;
    for (int i = 100; i >= 1; --i)
        values.push_back(static_cast<float>(i));
    values.push_back(NAN);
    const ValueStatistics s = statistics_of(values);
    EXPECT_EQ(s.count, 100u);
    EXPECT_EQ(s.no_data, 1u);
    EXPECT_EQ(s.p5, 5.0);
    EXPECT_EQ(s.p25, 25.0);
    EXPECT_EQ(s.median, 50.0);
    EXPECT_EQ(s.p75, 75.0);
    EXPECT_EQ(s.p95, 95.0);
    EXPECT_DOUBLE_EQ(s.mean, 50.5);
    EXPECT_NEAR(s.sd, std::sqrt(100.0 * 101.0 / 12.0), 1e-12); // n (n + 1) / 12 with n - 1
}

} // namespace
} // namespace palpate
