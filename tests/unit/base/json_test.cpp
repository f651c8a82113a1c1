#include "engine/base/json_value.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

using ::testing::HasSubstr;

// The value as another implementation reads it.
nlohmann::json peer(const Json& value) {
    const nlohmann::json line = nlohmann::json::parse(json_line(value));
    EXPECT_EQ(nlohmann::json::parse(json_text(value)), line);
    return line;
}

TEST(Json, LiteralsAreWhatAnotherReaderReads) {
    const std::vector<std::string> warnings{"one", "two"};
    Json report{{"size", {64, 64, 40}},
                {"modality", "CT"},
                {"place", glm::dvec3(1.5, -2.0, 0.1)},
                {"is_whole", true},
                {"nothing", nullptr},
                {"warnings", warnings},
                {"pairs", Json::array({{1.0, 2.0}, {3.0, 4.0}})},
                {"nested", {{"bytes", uint64_t{1} << 52}, {"none", Json::array()}}},
                {"empty", Json::object()}};
    report["added"]["deep"] = -3;
    report["list"].push_back("a \"quoted\" line\n");
    EXPECT_EQ(peer(report), nlohmann::json::parse(R"({
        "size": [64, 64, 40], "modality": "CT", "place": [1.5, -2.0, 0.1], "is_whole": true,
        "nothing": null, "warnings": ["one", "two"], "pairs": [[1, 2], [3, 4]],
        "nested": {"bytes": 4503599627370496, "none": []}, "empty": {},
        "added": {"deep": -3}, "list": ["a \"quoted\" line\n"]})"));
}

TEST(Json, NumbersComeBackToTheBitAndWhatIsNoneIsNull) {
    for (const double value : {0.1, -1e-300, 1e300, 123456789012345.0, 1.0 / 3.0, -0.0})
        EXPECT_EQ(peer(Json(value)).get<double>(), value);
    for (const double value : {double(NAN), double(INFINITY), -double(INFINITY)})
        EXPECT_TRUE(peer(Json(value)).is_null());
}

TEST(Json, KeepsTheOrderOfItsMembersAndReplacesThemInPlace) {
    Json json{{"b", 1}, {"a", 2}};
    json.update({{"a", 3}, {"c", 4}});
    EXPECT_EQ(json_line(json), R"({"b": 1, "a": 3, "c": 4})");
    EXPECT_EQ(json_text(json), "{\n  \"b\": 1,\n  \"a\": 3,\n  \"c\": 4\n}\n");
}

TEST(Json, IsEqualByValueWhateverTheLine) {
    const Result<Json> read = parse_json("\n\n{\"a\": [1, \"x\", null]}", "f");
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, (Json{{"a", {1, "x", nullptr}}}));
    EXPECT_NE(*read, (Json{{"a", {1, "x"}}}));
    EXPECT_TRUE(read->contains("a"));
    EXPECT_FALSE((*read)["a"].contains("b"));
    EXPECT_TRUE(std::as_const(*read)["b"].is_null());
    EXPECT_EQ((Json{1, 2.5, -3}).numbers(), (std::vector<double>{1, 2.5, -3}));
}

TEST(JsonValue, TakesWhatIsThereAndNamesWhatIsWrong) {
    const auto why = [](const char* text) {
        const Result<Json> json = parse_json(text, "f");
        JsonErrors errors{"f", {}};
        const JsonValue in(*json, "", errors);
        double size = 7.0;
        uint32_t count = 3;
        bool on = false;
        std::string name = "none";
        in.take("size", size, 0.0, 10.0);
        in.take("count", count, 0, 9);
        in.take("on", on);
        in.take("name", name);
        return errors.first ? errors.first->message
                            : fmt::format("{} {} {} {}", size, count, on, name);
    };
    EXPECT_EQ(why("{}"), "7 3 false none");
    EXPECT_EQ(why(R"({"size": 0.5, "count": 9, "on": true, "name": "x"})"), "0.5 9 true x");
    EXPECT_EQ(why("{\n\"size\": 11}"), "f:2: size: expected a number from 0 to 10, found 11");
    EXPECT_EQ(why(R"({"count": 1.5})"),
              "f:1: count: expected a whole number from 0 to 9, found 1.5");
    EXPECT_THAT(why(R"({"on": 1})"), HasSubstr("on: expected true or false"));
    EXPECT_THAT(why(R"({"name": []})"), HasSubstr("name: expected a text"));
}

TEST(JsonValue, AMemberThatMustBeThereIsMissed) {
    const Json json{{"a", {{"b", 1}}}};
    JsonErrors errors{"f", {}};
    const JsonValue in(json, "", errors);
    EXPECT_EQ(in.at("a").at("b").number(0, 2), 1.0);
    EXPECT_FALSE(errors.first);
    EXPECT_TRUE(in.at("a").at("c").is(Json::Kind::null));
    ASSERT_TRUE(errors.first);
    EXPECT_EQ(errors.first->message, "f:0: a: expected the key \"c\", found none");
}

} // namespace
} // namespace palpate
