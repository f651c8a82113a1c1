#include "engine/segment/expression.h"

#include <gmock/gmock.h>

#include <cmath>

#include "engine/segment/pointwise.h"
#include "engine/segment/threshold.h"
#include "engine/volume/builder.h"
#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

const std::vector<std::string> kNames{"a", "b", "mask_2"};

// The value of a text for a = -2, b = 3, mask_2 = 0.
float value_of(const char* text, std::array<float, 3> of = {-2, 3, 0}) {
    const Result<Expression> made = Expression::compile(text, kNames);
    if (!made) {
        ADD_FAILURE() << text << ": " << made.error().message;
        return 0;
    }
    std::vector<std::vector<float>> in;
    std::vector<const float*> from;
    for (const float v : of)
        in.emplace_back(1032, v); // two chunks and a rest
    for (const auto& v : in)
        from.push_back(v.data());
    std::vector<float> out(1032);
    made->evaluate(from, out.size(), out.data());
    for (const float v : out)
        EXPECT_TRUE(v == out[0] || (std::isnan(v) && std::isnan(out[0]))) << text;
    return out[0];
}

TEST(Expression, FollowsTheRulesOfArithmetic) {
    struct Case {
        const char* text;
        float value;
    };
    for (const Case& c : {Case{"1 + 2*3", 7},
                          {"(1+2)*3", 9},
                          {"2^3^2", 512},
                          {"-2^2", -4},
                          {"2^-1", 0.5},
                          {"10 - 4 - 3", 3},
                          {"12/3/2", 2},
                          {"a", -2},
                          {"a*b", -6},
                          {"-a", 2},
                          {"--a", -2},
                          {"a < b", 1},
                          {"a >= b", 0},
                          {"b > 3", 0},
                          {"b >= 3", 1},
                          {"a == -2", 1},
                          {"a != -2", 0},
                          {"!mask_2", 1},
                          {"!b", 0},
                          {"a < b && b < 4", 1},
                          {"0 || mask_2 > 1 || b == 3", 1},
                          {"min(a, b, -7)", -7},
                          {"max(a, b, -7)", 3},
                          {"abs(a)", 2},
                          {"sqrt(b*b + 16)", 5},
                          {"exp(0)", 1},
                          {"log(1)", 0},
                          {"pow(b, 2)", 9},
                          {"round(2.5)", 2},
                          {"clamp(a, -1, 1)", -1},
                          {"clamp(b, a, 1 + 1)", 2},
                          {"where(a < 0, b, 1/0)", 3},
                          {"where(mask_2, a, b + 1)", 4},
                          {"1.5e2", 150},
                          {".5", 0.5},
                          {"a*(b + (a - (b*(a + b))))", 4},
                          {"min(a*b, b*b, (a + b)*(a - b), a)", -6},
                          {"has(a) * 5 + has(b)", 6}}) {
        EXPECT_EQ(value_of(c.text), c.value) << c.text;
    }
}

TEST(Expression, NoDataStaysNoDataButWhereItIsNotRead) {
    const std::array<float, 3> of{NAN, 3, 0};
    for (const char* text :
         {"a", "a + b", "a < b", "!a", "a && mask_2", "b || a", "min(a, b)", "min(b, a)",
          "max(a, b)", "max(b, a)", "abs(a)", "pow(a, 0)", "pow(1, a)", "where(a, b, b)",
          "where(b, a, b)", "clamp(b, a, 5)", "sqrt(-1)", "log(-b)"})
        EXPECT_TRUE(std::isnan(value_of(text, of))) << text;
    EXPECT_EQ(value_of("where(mask_2, a, b)", of), 3.0f);
    EXPECT_EQ(value_of("where(has(a), a, -1)", of), -1.0f);
    EXPECT_EQ(value_of("has(a)", of), 0.0f);
}

// Random expressions against the same in double, built beside each other.
TEST(Expression, RandomOnesEqualTheirTwins) {
    std::mt19937 random(5);
    std::function<std::pair<std::string, double>(int)> make = [&](int depth) {
        const std::array<double, 3> of{-2, 3, 0};
        if (depth == 0 || random() % 5 == 0) {
            const size_t i = random() % 6;
            if (i < 3)
                return std::pair(kNames[i], of[i]);
            const double v = double(random() % 64) / 8.0;
            return std::pair(fmt::format("{:g}", v), v);
        }
        const auto [s, x] = make(depth - 1);
        const auto [t, y] = make(depth - 1);
        switch (random() % 8) {
            case 0:
                return std::pair("(" + s + "+" + t + ")", x + y);
            case 1:
                return std::pair("(" + s + " - " + t + ")", x - y);
            case 2:
                return std::pair("min(" + s + "," + t + ")", std::min(x, y));
            case 3:
                return std::pair("max(" + s + ", " + t + ")", std::max(x, y));
            case 4:
                return std::pair("(" + s + "<" + t + ")", double(x < y));
            case 5:
                return std::pair("where(" + s + "," + t + ",1)", x != 0 ? y : 1.0);
            case 6:
                return std::pair("-" + s, -x);
            default:
                return std::pair("(" + s + "*0.5 + " + t + "/2)", 0.5 * x + y / 2);
        }
    };
    for (int i = 0; i < 400; ++i) {
        const auto [text, value] = make(6);
        // Multiples of 2^-9 below 2^10: exact in float.
        ASSERT_EQ(value_of(text.c_str()), float(value)) << text;
    }
}

TEST(Expression, ErrorsNameTheColumn) {
    const auto message = [](std::string text) {
        const Result<Expression> made = Expression::compile(text, kNames);
        return made ? std::string("compiled") : made.error().message;
    };
    EXPECT_EQ(message(""), "column 1: expected a number, a name or '(', found the end");
    EXPECT_EQ(message("a +"), "column 4: expected a number, a name or '(', found the end");
    EXPECT_EQ(message("a + c"), "column 5: expected a volume (a, b, mask_2), found 'c'");
    EXPECT_EQ(message("a b"), "column 3: expected an operator or the end, found 'b'");
    EXPECT_EQ(message("(a"), "column 3: expected ')', found the end");
    EXPECT_EQ(message("a = b"), "column 3: expected an operator or the end, found '= b'");
    EXPECT_EQ(message("1 < 2 < 3"), "column 7: expected an operator or the end, found '< 3'");
    EXPECT_EQ(message("sin(a)"),
              "column 1: expected a function (min, max, abs, sqrt, exp, log, pow, round, clamp, "
              "where, has), found 'sin(a)'");
    EXPECT_EQ(message("min(a)"), "column 4: expected 2 or more arguments of min(), found 1");
    EXPECT_EQ(message("abs(a, b)"), "column 4: expected 1 argument of abs(), found 2");
    EXPECT_EQ(message("min(a b)"), "column 7: expected ',' or ')', found 'b)'");
    EXPECT_EQ(message("1e99"), "column 1: expected a number that is finite in float, found '1e99'");
    EXPECT_EQ(message(std::string(5000, '(') + "a"),
              "column 202: expected at most 200 nested parts");
    EXPECT_EQ(message(std::string(5000, '-') + "a"),
              "column 202: expected at most 200 nested parts");
    std::string sum = "a";
    for (int i = 0; i < 5000; ++i)
        sum += "+a";
    EXPECT_THAT(message(sum), ::testing::HasSubstr("expected at most 4096 operations"));
    for (int c = 0; c < 256; ++c) // any byte anywhere is an error or a meaning, and no crash
        message(std::string("a+") + char(c) + "b");
}

TEST(Pointwise, ExpressionsOfSeveralVolumesHaveTypes) {
    const Grid grid = make_grid({40, 6, 5}, {1, 1, 2});
    const Volume a = twin::noise(grid, ScalarType::i16), b = twin::noise(grid, ScalarType::f32, 4);
    const std::map<std::string, Volume> others{{"b", b}};
    const auto make = [&](const char* text) {
        return make_bricks(expression_bricks(a, text, others).value(), {}).value();
    };
    const Volume sum = make("a - 2*b"), more = make("a > b"), own = make("a + 0.5");
    EXPECT_EQ(sum.type(), ScalarType::f32);
    EXPECT_EQ(more.type(), ScalarType::u8);
    for (const glm::ivec3 i : twin::indices({40, 6, 5})) {
        const glm::uvec3 at(i);
        const float expected = a.value(at) - 2 * b.value(at);
        EXPECT_TRUE(sum.value(at) == expected ||
                    (std::isnan(expected) && std::isnan(sum.value(at))));
        EXPECT_EQ(more.value(at), a.value(at) > b.value(at) ? 1.0f : 0.0f);
        EXPECT_EQ(own.value(at), a.value(at) + 0.5f);
    }
    // A volume that is not read need not fit; one that is read must.
    const std::map<std::string, Volume> far{
        {"b", twin::noise(make_grid({40, 6, 5}, {1, 1, 2}, {0, 0, 1}), ScalarType::u8)},
        {"c", twin::noise(make_grid({40, 6, 4}, {1, 1, 2}), ScalarType::u8)}};
    EXPECT_TRUE(expression_bricks(a, "a", far));
    EXPECT_EQ(expression_bricks(a, "a+b", far).error().message,
              "b: expected the positions of V's samples, found some 1 mm away; resample it first "
              "(--resample-like)");
    EXPECT_EQ(expression_bricks(a, "a+c", far).error().message,
              "c: expected 40 x 6 x 5 samples as in V, found 40 x 6 x 4");
}

TEST(Pointwise, RowsOfTheTable) {
    const std::vector<float> samples{-5, 0, 2.5f, 7, 10, NAN, 3, 4};
    const Volume v = make_volume(make_grid({8, 1, 1}, {1, 1, 1}), std::span<const float>(samples));
    const auto values = [](const Result<BrickMaker>& maker) {
        const Volume made = make_bricks(maker.value(), {}).value();
        std::vector<float> all;
        for (uint32_t i = 0; i < 8; ++i)
            all.push_back(made.value({i, 0, 0}));
        return all;
    };
    using ::testing::ElementsAre;
    using ::testing::IsNan;
    EXPECT_THAT(values(threshold_bricks(v, 0, 4)), ElementsAre(0, 1, 1, 0, 0, 0, 1, 1));
    EXPECT_THAT(values(clamp_bricks(v, 0, 4)), ElementsAre(0, 0, 2.5, 4, 4, IsNan(), 3, 4));
    EXPECT_THAT(values(rescale_bricks(v, 0, 10, 0, 1)),
                ElementsAre(-0.5, 0, 0.25, 0.7f, 1, IsNan(), 0.3f, 0.4f));
    EXPECT_THAT(values(invert_bricks(v)), ElementsAre(10, 5, 2.5, -2, -5, IsNan(), 2, 1));
    EXPECT_THAT(values(mask_bricks(v, v, -9)), ElementsAre(-5, -9, 2.5, 7, 10, -9, 3, 4));
    EXPECT_EQ(threshold_bricks(v, 4, 0).error().message, "expected low <= high, found 4 and 0");
    EXPECT_EQ(rescale_bricks(v, 4, 4, 0, 1).error().message,
              "expected two values that differ, found 4 twice");
    const Volume u8 = twin::noise(v.grid(), ScalarType::u8);
    EXPECT_EQ(mask_bricks(u8, v, -9).error().message,
              "outside: expected a value of the type u8, found -9");
}

TEST(Threshold, BothEndsOfTheIntervalBelongToIt) {
    const Volume volume = make_volume(make_grid({5, 1, 1}, glm::dvec3(1.0)), ScalarType::f32,
                                      [](glm::uvec3 i) { return 0.5 * i.x; });
    const Result<Volume> labels = threshold_labels(volume, {0.5, 1.5}, {});
    ASSERT_TRUE(labels);
    for (uint32_t x = 0; x < 5; ++x)
        EXPECT_EQ(labels->value({x, 0, 0}), x >= 1 && x <= 3 ? 1.0f : 0.0f) << x;
}

} // namespace
} // namespace palpate
