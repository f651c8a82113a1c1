#include "haptics/device/hand_path.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::haptics {
namespace {

TEST(HandPath, IsStraightBetweenItsPosesAndRestsBeyondThem) {
    const HandPath path({{.time_s = 1, .tool = {.position_mm = {0, 0, 0}}, .buttons = 1},
                         {.time_s = 3, .tool = {.position_mm = {10, 0, -4}}, .buttons = 2}});
    EXPECT_EQ(path.at(0).tool.position_mm, glm::dvec3(0, 0, 0));
    EXPECT_EQ(path.at(1.5).tool.position_mm, glm::dvec3(2.5, 0, -1));
    EXPECT_EQ(path.at(2).buttons, 1u);
    EXPECT_EQ(path.at(3).buttons, 2u);
    EXPECT_EQ(path.at(9).tool.position_mm, glm::dvec3(10, 0, -4));
    EXPECT_EQ(path.velocity_mm_per_s(0.5), glm::dvec3(0));
    EXPECT_EQ(path.velocity_mm_per_s(1.0), glm::dvec3(5, 0, -2));
    EXPECT_EQ(path.velocity_mm_per_s(3.0), glm::dvec3(0));
}

TEST(HandPath, TurnsTheShortWay) {
    const glm::dquat quarter = glm::normalize(glm::dquat(1, 0, 0, 1));
    const HandPath path({{.time_s = 0}, {.time_s = 1, .tool = {.rotation = -quarter}}});
    const glm::dquat half = path.at(0.5).tool.rotation;
    // Halfway of a quarter turn is an eighth, on both of a rotation's quaternions.
    const glm::dquat eighth(std::cos(M_PI / 8), 0, 0, std::sin(M_PI / 8));
    EXPECT_NEAR(std::abs(glm::dot(half, eighth)), 1.0, 1e-15);
}

TEST(HandPath, ReadsColumnsInAnyOrderAndPassesOthersOver) {
    const Result<HandPath> path = parse_hand_path(
        "# recorded by hand\nz_mm, time_s, x_mm, y_mm, note, "
        "button\r\n3,0,1,2,7,1\n\n6,0.5,4,5,7,0",
        "p.csv");
    ASSERT_TRUE(path) << path.error().message;
    ASSERT_EQ(path->poses().size(), 2u);
    EXPECT_EQ(path->poses()[0].tool.position_mm, glm::dvec3(1, 2, 3));
    EXPECT_EQ(path->poses()[0].buttons, 1u);
    EXPECT_EQ(path->poses()[1].time_s, 0.5);
    EXPECT_EQ(path->poses()[1].tool.position_mm, glm::dvec3(4, 5, 6));
}

TEST(HandPath, PassesOverAByteOrderMark) {
    const Result<HandPath> path =
        parse_hand_path("\xEF\xBB\xBFtime_s,x_mm,y_mm,z_mm\r\n0,1,2,3\r\n", "p.csv");
    ASSERT_TRUE(path) << path.error().message;
    EXPECT_EQ(path->poses().front().tool.position_mm, glm::dvec3(1, 2, 3));
}

TEST(HandPath, SaysWhereATextIsWrong) {
    const auto why = [](const char* text) {
        const Result<HandPath> path = parse_hand_path(text, "p.csv");
        return path ? std::string("nothing") : path.error().message;
    };
    const std::string head = "time_s,x_mm,y_mm,z_mm\n";
    EXPECT_EQ(why(""), "p.csv: expected a line of column names, found none");
    EXPECT_EQ(why("time_s,x_mm,y_mm\n"), "p.csv:1: expected a column z_mm, found none");
    EXPECT_EQ(why("time_s,x_mm,y_mm,z_mm,x_mm\n"),
              "p.csv:1: expected the column x_mm once, found it twice");
    EXPECT_EQ(why(head.c_str()), "p.csv: expected at least one pose, found none");
    EXPECT_EQ(why((head + "0,1,2\n").c_str()), "p.csv:2: expected 4 values, found 3");
    EXPECT_EQ(why((head + "0,1,2,3mm\n").c_str()), "p.csv:2: z_mm: expected a number, found '3mm'");
    EXPECT_EQ(why((head + "0,1,2,nan\n").c_str()), "p.csv:2: z_mm: expected a number, found 'nan'");
    EXPECT_EQ(why((head + "0,1,2,1e999\n").c_str()),
              "p.csv:2: z_mm: expected a number, found '1e999'");
    EXPECT_EQ(why((head + "1,1,2,3\n1,1,2,3\n").c_str()),
              "p.csv:3: time_s: expected more than 1, found 1");
    EXPECT_EQ(why("time_s,x_mm,y_mm,z_mm,qw\n0,0,0,0,0\n"),
              "p.csv:2: qw, qx, qy, qz: expected a rotation, found length 0");
    EXPECT_EQ(why("time_s,x_mm,y_mm,z_mm,button\n0,0,0,0,1.5\n"),
              "p.csv:2: button: expected a whole number from 0 to 4294967295, found 1.5");
}

TEST(HandPath, EveryTruncationOfATextIsAPathOrASentence) {
    const std::string text =
        "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n1,4,5,6,0,1,0,0\n";
    for (size_t size = 0; size < text.size(); ++size) {
        const Result<HandPath> path = parse_hand_path(text.substr(0, size), "p");
        EXPECT_TRUE(path ? path->poses().size() <= 2 : !path.error().message.empty());
    }
}

TEST(Trajectories, PressGoesInHoldsAndComesOutAtItsSpeed) {
    const TrajectoryShape shape{.at_mm = {1, 2, 3},
                                .direction = {0, 0, -2},
                                .depth_mm = 5,
                                .distance_mm = 20,
                                .speed_mm_per_s = 50,
                                .duration_s = 1};
    const HandPath path = find_trajectory("press")->make(shape);
    EXPECT_NEAR(path.end_s(), 2.0, 2e-4); // 25 mm at 50 mm/s, twice, and a second; steps of 0.1 ms
    EXPECT_LE(glm::length(path.at(0).tool.position_mm - glm::dvec3(1, 2, 23)), 1e-12);
    EXPECT_LE(glm::length(path.at(1).tool.position_mm - glm::dvec3(1, 2, -2)), 1e-12);
    EXPECT_LE(glm::length(path.at(2).tool.position_mm - glm::dvec3(1, 2, 23)), 0.01);
    EXPECT_NEAR(glm::length(path.velocity_mm_per_s(0.25)), 50.0, 1e-6);
}

TEST(Trajectories, EachIsFiniteRepeatsItselfAndStaysNear) {
    const TrajectoryShape shape{.at_mm = {100, -50, 20}, .direction = {1, 2, 3}};
    for (const TrajectoryEntry& entry : trajectories()) {
        const HandPath a = entry.make(shape), b = entry.make(shape);
        ASSERT_EQ(a.poses().size(), b.poses().size());
        for (size_t i = 0; i < a.poses().size(); ++i) {
            const glm::dvec3 p = a.poses()[i].tool.position_mm;
            ASSERT_EQ(p, b.poses()[i].tool.position_mm) << entry.name;
            // Nothing leaves a box of distance + depth, by a diagonal at most.
            ASSERT_LE(glm::length(p - shape.at_mm), 25.0 * 1.7321) << entry.name << ' ' << i;
        }
    }
    EXPECT_EQ(find_trajectory("hop"), nullptr);
}

TEST(Trajectories, OnlyTheBrokenSensorJumps) {
    const TrajectoryShape shape;
    for (const TrajectoryEntry& entry : trajectories()) {
        double fastest = 0;
        const HandPath path = entry.make(shape);
        for (size_t i = 1; i < path.poses().size(); ++i)
            fastest = std::max(fastest, glm::length(path.poses()[i].tool.position_mm -
                                                    path.poses()[i - 1].tool.position_mm));
        // Slide is the fastest of the others: 2 pi x 20 mm/s across and 1.5 times that up, and the
        // way in, below 0.03 mm a 0.1 ms.
        EXPECT_EQ(fastest > 0.03, std::string(entry.name) == "walk") << entry.name << fastest;
    }
}

TEST(HandPath, OfPosesThatAreNoPathIsRefused) {
    const auto why = [](std::vector<HandPose> poses) {
        const Result<HandPath> made = make_hand_path(std::move(poses));
        return made ? "" : made.error().message;
    };
    EXPECT_EQ(why({{.time_s = 1.0}, {.time_s = 2.0}}), "");
    EXPECT_EQ(why({}), "a path: expected at least one pose, found none");
    EXPECT_EQ(why({{.time_s = 1.0}, {.time_s = 1.0}}),
              "a path: expected times that rise, found 1 s at pose 1");
    EXPECT_EQ(why({{.time_s = NAN}}), "a path: expected times that rise, found nan s at pose 0");
    EXPECT_EQ(why({{.tool = {.position_mm = {0, 2e8, 0}}}}),
              "a path: expected places within 1e+08 mm, found 0, 200000000, 0 at pose 0");
    EXPECT_EQ(why({{.tool = {.rotation = {2, 0, 0, 0}}}}),
              "a path: expected rotations of unit length, found 2 at pose 0");
}

} // namespace
} // namespace palpate::haptics
