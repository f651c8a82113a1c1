#include <gmock/gmock.h>

#include "engine/edit/stroke.h"
#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

using testing::HasSubstr;

const std::string kHeader =
    R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 3}, )"
    R"("operation": {"kind": "erode", "label": 2, "neighbours": 26}})"
    "\n";
const std::string kPose = R"({"t_s": 0.5, "p_mm": [1, 2.5, -3]})"
                          "\n";

std::string why(const std::string& text) {
    const Result<std::vector<Stroke>> strokes = parse_strokes(text, "f");
    return strokes ? "fine" : strokes.error().message;
}

std::string header(const std::string& shape, const std::string& operation) {
    return R"({"stroke": 1, "units": "mm", "shape": )" + shape + R"(, "operation": )" + operation +
           "}\n" + kPose;
}

TEST(StrokeFile, ReadsHeadersAndPoses) {
    const Result<std::vector<Stroke>> strokes = parse_strokes(
        kHeader + kPose + "\n" + R"({"t_s": 0.75, "p_mm": [0, 0, 0], "q": [0, 0, 0, 1]})" + "\n" +
            header(R"({"kind": "point"})", R"({"kind": "draw"})"),
        "f");
    ASSERT_TRUE(strokes) << strokes.error().message;
    ASSERT_EQ(strokes->size(), 2u);
    const Stroke& first = strokes->front();
    EXPECT_EQ(first.operation.kind, OperationKind::erode);
    EXPECT_EQ(first.operation.label, 2);
    EXPECT_EQ(first.operation.neighbours, 26);
    EXPECT_EQ(first.tool.shape->ball_radius_mm(), 3.0);
    ASSERT_EQ(first.poses.size(), 2u);
    EXPECT_EQ(first.poses[0].tool.position_mm, glm::dvec3(1, 2.5, -3));
    EXPECT_EQ(first.poses[0].time_s, 0.5);
    EXPECT_EQ(first.poses[1].tool.rotation, glm::dquat(0, 0, 0, 1));
    EXPECT_TRUE(strokes->back().tool.marks_origin);
    EXPECT_FALSE(strokes->back().tool.shape);
}

TEST(StrokeFile, WritesWhatItReadsToTheBit) {
    const char* shapes[] = {
        R"({"kind": "burr", "radius_mm": 2.1, "flutes": 5, "flute_radius_mm": 0.3})",
        R"({"kind": "union", "of": [{"kind": "point"}, {"kind": "capsule", "radius_mm": 1, "length_mm": 2, "at_mm": [0.1, 0, 0], "turn": [1, 2, 3, 4]}]})",
        R"({"kind": "difference", "of": [{"kind": "box", "size_mm": [1, 2, 3]}, {"kind": "ellipsoid", "radii_mm": [0.3, 0.4, 0.5]}], "scale": 1.7})",
        R"({"kind": "mesh", "cell_mm": 0.5, "positions_mm": [[0,0,0],[4,0,0],[0,4,0],[0,0,4]], "triangles": [[0,2,1],[0,1,3],[0,3,2],[1,2,3]]})"};
    Random random(1);
    for (int i = 0; i < 60; ++i) {
        const auto kind = static_cast<OperationKind>(i % 9);
        const Grid grid = random_grid(random, {40, 30, 20});
        JsonErrors errors{"f", {}};
        Operation operation = random_operation(random, kind);
        if (i % 3 == 0)
            operation.spared = {uint16_t(operation.label + 1), 65535};
        const Stroke stroke =
            *make_stroke(*parse_json(shapes[i % 4], "f"), operation, random_path(random, grid, 4));
        const std::string text = stroke_text(stroke);
        const Result<std::vector<Stroke>> read = parse_strokes(text, "f");
        ASSERT_TRUE(read) << read.error().message << "\n" << text;
        ASSERT_EQ(read->size(), 1u);
        EXPECT_EQ(stroke_text(read->front()), text);
        EXPECT_TRUE(read->front().poses == stroke.poses);
        EXPECT_EQ(read->front().operation.spared, operation.spared);
        EXPECT_EQ(read->front().operation.area, operation.area);
        const bool labels = stroke.operation.on_labels();
        const Volume before = labels ? random_labels(random, grid, ScalarType::u8)
                                     : random_greys(random, grid, ScalarType::i16);
        const Volume guide = labels ? random_greys(random, grid, ScalarType::i16)
                                    : random_labels(random, grid, ScalarType::u8);
        const auto apply = [&](const Stroke& s) {
            return *apply_stroke(before, s.tool, s.operation, s.poses, guide);
        };
        EXPECT_TRUE(changed_bricks(apply(stroke), apply(read->front())).empty());
    }
}

TEST(StrokeFile, SaysWhatIsWrongAndWhere) {
    EXPECT_EQ(why(kHeader + kPose), "fine");
    EXPECT_EQ(why(""), "f: expected a stroke, found none");
    EXPECT_EQ(why(kPose), "f:1: expected a header with \"stroke\": 1 before the first pose");
    EXPECT_EQ(why("\n" + kHeader + "\n" + kHeader + kPose),
              "f:2: expected at least one pose after the header, found none");
    EXPECT_THAT(why(kHeader + kPose + "{\"p_mm\": [1, 2}"), HasSubstr("f:3: not readable as JSON"));
    EXPECT_EQ(why(kHeader + "[1]\n"), "f:2: expected a header or a pose, found a list");
    EXPECT_EQ(why(kHeader + kPose + R"({"t_s": 0.25, "p_mm": [0, 0, 0]})"),
              "f:3: expected a time of at least 0.5 s, that of the pose before, found 0.25 s");
    EXPECT_THAT(why(kHeader + R"({"t_s": 1, "p": [0, 0, 0]})"), HasSubstr("f:2"));
    EXPECT_THAT(why(kHeader + R"({"p_mm": [0, 0, 0], "q": [1, 1, 0, 0]})"),
                HasSubstr("f:2: q: expected a unit quaternion [w, x, y, z], found length 1.41421"));
    EXPECT_THAT(why(kHeader + R"({"p_mm": [0, 0, 1e300]})"), HasSubstr("f:2: p_mm[2]"));
    const std::string ball = R"({"kind": "ball", "radius_mm": 3})", draw = R"({"kind": "draw"})";
    EXPECT_EQ(why(header(ball, draw)), "fine");
    EXPECT_THAT(why(header(R"({"kind": "bal", "radius_mm": 3})", draw)),
                HasSubstr("f:1: shape.kind"));
    EXPECT_THAT(why(header(R"({"kind": "ball"})", draw)), HasSubstr("expected \"radius_mm\""));
    EXPECT_THAT(why(header(R"({"kind": "ball", "radius_mm": 0})", draw)), HasSubstr("radius_mm"));
    EXPECT_THAT(why(header(R"({"kind": "ball", "radius_mm": 3, "colour": 1})", draw)),
                HasSubstr("colour"));
    EXPECT_THAT(why(header(R"({"kind": "intersection", "of": [{"kind": "point"}]})", draw)),
                HasSubstr("expected a point by itself"));
    EXPECT_THAT(why(header(R"({"kind": "mesh", "triangles": [[0,1,2],[0,2,3],[0,3,1],[1,3,3]], )"
                           R"("positions_mm": [[0,0,0],[4,0,0],[0,4,0],[0,0,4]]})",
                           draw)),
                HasSubstr("expected a closed mesh"));
    EXPECT_THAT(why(header(ball, R"({"kind": "erode", "neighbours": 8})")),
                HasSubstr("expected 6, 18 or 26"));
    EXPECT_THAT(why(header(ball, R"({"kind": "draw", "label": 0})")), HasSubstr("operation.label"));
    EXPECT_THAT(why(header(ball, R"({"kind": "draw", "rate_per_s": 1})")), HasSubstr("rate_per_s"));
    EXPECT_THAT(why(header(ball, R"({"kind": "mill"})")), HasSubstr("expected \"rate_per_s\""));
    EXPECT_THAT(why(header(ball, R"({"kind": "mill", "rate_per_s": [[1, 2], [1, 3]]})")),
                HasSubstr("values that rise"));
    EXPECT_THAT(why(header(ball, R"({"kind": "draw", "only_values": [3, 2]})")),
                HasSubstr("low <= high"));
    EXPECT_EQ(why(header(ball, R"({"kind": "draw", "inside": "any"})")), "fine");
    EXPECT_THAT(why(header(ball, R"({"kind": "draw", "inside": "all"})")),
                HasSubstr("operation.inside: expected \"any\" or a list of labels, found \"all\""));
    EXPECT_THAT(why(header(ball, R"({"kind": "draw", "outside": [2, 1]})")),
                HasSubstr("expected labels that rise"));
    EXPECT_THAT(why(header(ball, R"({"kind": "erase", "inside": [1], "outside": [2]})")),
                HasSubstr("expected \"inside\" or \"outside\", found both"));
    std::string other = kHeader;
    other.replace(other.find("mm"), 2, "in");
    EXPECT_THAT(why(other + kPose), HasSubstr(":1: units: expected \"mm\", found \"in\""));
    other = kHeader;
    other.replace(other.find("\"units\": \"mm\", "), 15, "");
    EXPECT_THAT(why(other + kPose), HasSubstr("expected \"units\": \"mm\", found none"));
}

// Any piece of a good file is read or refused, and never anything else.
TEST(StrokeFile, EveryTruncationIsReadOrRefused) {
    const std::string text = kHeader + kPose + kPose;
    size_t fine = 0;
    for (size_t i = 0; i <= text.size(); ++i)
        fine += why(text.substr(0, i)) == "fine";
    EXPECT_EQ(fine, 4u); // after each pose, with and without its line break
}

TEST(Stroke, OfPartsThatAreNoneIsRefused) {
    const auto why = [](const char* shape, std::vector<StrokePose> poses) {
        const Result<Stroke> made = make_stroke(*parse_json(shape, "f"), {}, std::move(poses));
        return made ? "" : made.error().message;
    };
    const char* ball = R"({"kind": "ball", "radius_mm": 2})";
    EXPECT_EQ(why(ball, {{0.0}, {0.0}, {1.5}}), "");
    EXPECT_EQ(why(ball, {}), "a stroke: expected at least one pose, found none");
    EXPECT_EQ(why(ball, {{1.0}, {0.5}}),
              "a stroke: expected times that do not fall, found 0.5 s after 1 s");
    EXPECT_THAT(why(R"({"kind": "ball", "radius_mm": 0})", {{}}), HasSubstr("radius_mm"));
}

} // namespace
} // namespace palpate
