#include "haptics/proxy/groove.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace palpate {
namespace {

using glm::dvec3;
using haptics::agree;
using haptics::Groove;
using haptics::groove_of;
using haptics::Hold;

constexpr double kReach_mm = 0.1, kError_mm = 0.03;

const dvec3 kAlong = glm::normalize(dvec3(0.3, -0.8, 0.5));
const dvec3 kOut = glm::normalize(glm::cross(kAlong, dvec3(1.0, 0.0, 0.0)));
const dvec3 kAcross = glm::cross(kAlong, kOut);

dvec3 normal_at(double degrees) {
    const double angle = glm::radians(degrees);
    return std::cos(angle) * kOut + std::sin(angle) * kAcross;
}

// The holds of a ball that has moved by `place_mm` in a groove which it fits, from -widest to
// widest, with clearances that err by up to error_mm and normals that lean by lean_rad, in turns.
std::vector<Hold> across_groove(double widest_deg, dvec3 place_mm, double error_mm = 0.0,
                                double lean_rad = 0.0) {
    std::vector<Hold> holds;
    for (int i = 0; i <= 8; ++i) {
        const dvec3 n = normal_at((i / 4.0 - 1.0) * widest_deg);
        const double sign = i % 3 - 1.0;
        holds.push_back({.normal = glm::normalize(n + sign * lean_rad * kAlong),
                         .clearance_mm = glm::dot(n, place_mm) + sign * error_mm});
    }
    return holds;
}

double left_of(const std::vector<Hold>& holds, dvec3 place_mm) {
    double sum = 0.0;
    for (const Hold& hold : holds)
        sum += std::pow(hold.clearance_mm - glm::dot(hold.normal, place_mm), 2.0);
    return std::sqrt(sum / static_cast<double>(holds.size()));
}

} // namespace

TEST(Groove, IsFoundWhereNormalsLieAcrossIt) {
    for (const double widest : {20.0, 45.0, 85.0}) {
        const Groove groove = groove_of(across_groove(widest, {}, 0.0, 0.01), kReach_mm);
        EXPECT_GT(groove.certainty, 0.8) << widest;
        EXPECT_GT(std::abs(glm::dot(groove.along, kAlong)), std::cos(glm::radians(0.7))) << widest;
        EXPECT_NEAR(groove.high_rad - groove.low_rad, glm::radians(2.0 * widest), 1e-3);
        EXPECT_NEAR(glm::dot(groove.out, kOut), 1.0, 1e-3);
        EXPECT_NEAR(glm::determinant(glm::dmat3(groove.along, groove.out, groove.across)), 1.0,
                    1e-9);
        EXPECT_NEAR(groove.angle_rad_of(groove.normal_at(0.3)), 0.3, 1e-12);
    }
}

TEST(Groove, IsNoneWhereOneFaceHolds) {
    EXPECT_EQ(groove_of({}, kReach_mm).certainty, 0.0);
    const std::vector<Hold> one{{.normal = kOut}};
    EXPECT_EQ(groove_of(one, kReach_mm).certainty, 0.0);
    EXPECT_EQ(groove_of(across_groove(3.0, {}), kReach_mm).certainty, 0.0);
    // What is far from the surface does not count.
    std::vector<Hold> far = across_groove(60.0, {});
    for (size_t i = 1; i < far.size(); ++i)
        far[i].clearance_mm = kReach_mm;
    EXPECT_EQ(groove_of(far, kReach_mm).certainty, 0.0);
}

// A ball on a body that bulges has contacts whose normals lie across a groove, too, and faces the
// surface in none but one of them.
TEST(Groove, IsNoneOnWhatBendsAwayFromTheBall) {
    std::vector<Hold> holds = across_groove(45.0, {});
    for (size_t i = 0; i < holds.size(); ++i)
        holds[i].faces = i == 4 ? 1.0 : 0.0;
    EXPECT_EQ(groove_of(holds, kReach_mm).certainty, 0.0);
}

TEST(Groove, IsNotBelievedWhereThreeFacesHold) {
    const std::vector<Hold> corner{
        {.normal = {1, 0, 0}}, {.normal = {0, 1, 0}}, {.normal = {0, 0, 1}}};
    EXPECT_LT(groove_of(corner, kReach_mm).certainty, 0.01);
    std::vector<Hold> holds = corner;
    holds[0].clearance_mm = 0.02;
    agree(groove_of(holds, kReach_mm), holds, kReach_mm, kError_mm);
    EXPECT_NEAR(holds[0].clearance_mm, 0.02, 1e-4);
    EXPECT_GT(glm::dot(holds[0].normal, corner[0].normal), std::cos(glm::radians(0.2)));
}

TEST(Groove, LeavesAsItIsWhatAgrees) {
    const dvec3 place = 0.01 * kOut - 0.004 * kAcross;
    std::vector<Hold> holds = across_groove(50.0, place);
    const std::vector<Hold> before = holds;
    EXPECT_GT(agree(groove_of(holds, kReach_mm), holds, kReach_mm, kError_mm), 0.99);
    for (size_t i = 0; i < holds.size(); ++i) {
        EXPECT_NEAR(holds[i].clearance_mm, before[i].clearance_mm, 1e-5);
        EXPECT_NEAR(glm::distance(holds[i].normal, before[i].normal), 0.0, 1e-6);
    }
}

TEST(Groove, TakesMostOfWhatErrs) {
    const dvec3 place = 0.01 * kOut - 0.004 * kAcross;
    std::vector<Hold> holds = across_groove(80.0, place, 0.01, 0.01);
    const double before = left_of(holds, place);
    const double share = agree(groove_of(holds, kReach_mm), holds, kReach_mm, kError_mm);
    EXPECT_GT(share, 0.8);
    EXPECT_LT(left_of(holds, place), 0.5 * before);
    for (const Hold& hold : holds)
        EXPECT_LT(std::abs(glm::dot(hold.normal, kAlong)), 0.006) << "of 0.01";
}

// A face at the groove's end is as far from the surface as holds may be that take part: it says
// little of the groove, and the groove little of it.
TEST(Groove, TurnsAFaceThatComesNearByLittle) {
    for (const double lean_deg : {10.0, 30.0})
        for (const double share : {0.9, 0.97, 0.999}) {
            std::vector<Hold> holds = across_groove(75.0, {});
            const double lean = glm::radians(lean_deg);
            const dvec3 normal = std::cos(lean) * kOut + std::sin(lean) * kAlong;
            holds.push_back({.normal = normal, .clearance_mm = share * kReach_mm});
            agree(groove_of(holds, kReach_mm), holds, kReach_mm, kError_mm);
            // By no more than its weight, 1 - share^2, of how it leans.
            const double most_rad = 1.1 * (1.0 - share * share) * lean;
            EXPECT_GT(glm::dot(holds.back().normal, normal), std::cos(most_rad))
                << lean_deg << " " << share;
        }
}

// Clearances that err by 0.09 in turns are believed by error^2 / (error^2 + left), where `left` is
// the mean square of what the best place leaves, each weighing 1 - (clearance / reach)^2; and are
// drawn to that place by as much times their weight. The best place is looked for on a grid here.
TEST(Groove, BelievesLittleOfWhatDisagreesMore) {
    std::vector<Hold> holds = across_groove(80.0, {}, 0.09);
    const std::vector<Hold> before = holds;
    const auto weight = [](const Hold& hold) {
        return 1.0 - std::pow(hold.clearance_mm / kReach_mm, 2.0);
    };
    const auto apart = [](const Hold& hold, dvec3 place) {
        return hold.clearance_mm - glm::dot(hold.normal, place);
    };
    dvec3 best(0.0);
    double left = 1.0;
    for (int i = -100; i <= 100; ++i)
        for (int j = -100; j <= 100; ++j) {
            const dvec3 place = 1e-3 * (double(i) * kOut + double(j) * kAcross);
            double squares = 0.0, total = 0.0;
            for (const Hold& hold : before) {
                squares += weight(hold) * std::pow(apart(hold, place), 2.0);
                total += weight(hold);
            }
            if (squares / total < left) {
                left = squares / total;
                best = place;
            }
        }
    const Groove groove = groove_of(holds, kReach_mm);
    const double share = agree(groove, holds, kReach_mm, kError_mm);
    const double expected =
        groove.certainty * kError_mm * kError_mm / (kError_mm * kError_mm + left);
    // The grid's place is within 0.0005 of the best in each direction, which changes `left` by less
    // than its square and what is left of each by as much itself.
    EXPECT_NEAR(share, expected, 1e-3);
    for (size_t i = 0; i < holds.size(); ++i)
        EXPECT_NEAR(holds[i].clearance_mm,
                    before[i].clearance_mm - expected * weight(before[i]) * apart(before[i], best),
                    1e-3);
    // And what is out of reach is not changed at all.
    std::vector<Hold> far = across_groove(80.0, {});
    far[4].clearance_mm = 2.0 * kReach_mm;
    agree(groove_of(far, kReach_mm), far, kReach_mm, kError_mm);
    EXPECT_EQ(far[4].clearance_mm, 2.0 * kReach_mm);
}

} // namespace palpate
