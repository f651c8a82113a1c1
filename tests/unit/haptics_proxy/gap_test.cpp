#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/unit/haptics_proxy/gap_grid.h"

namespace palpate::haptics {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool is_repaired(std::string_view name) {
    return !find_algorithm(name)->as_printed;
}

void expect_faded(const GapCase& c) {
    SCOPED_TRACE(name_of(c));
    const Crossed crossed = cross(c);
    EXPECT_TRUE(crossed.is_finite);
    EXPECT_GT(crossed.unknown, 0);
    if (is_sound_at_ends(c)) {
        EXPECT_LT(crossed.unknown, crossed.ticks);
    }
    EXPECT_LE(crossed.most_left_n, 0.02);
    // Printed algorithms jump elsewhere, too.
    EXPECT_LE(crossed.most_change_at_gap_n, 0.02);
    EXPECT_TRUE(!is_repaired(c.algorithm) || crossed.is_gentle(c.source))
        << crossed.most_change_n << " N";
    if (!is_repaired(c.algorithm) || !is_sound_at_ends(c) || c.yield_n > 0.0)
        return;
    // The surface of labels lies within half a sample.
    EXPECT_NEAR(crossed.pressed_n, 1.0, c.source == TouchSource::labels ? 0.4 : 0.03);
    EXPECT_NEAR(crossed.again_n, 1.0, c.source == TouchSource::labels ? 0.3 : 0.03);
}

TEST(Gap, ForceFadesInBandsWithoutDataAndComesAgainByTheRateOfEdits) {
    constexpr double kTilts[] = {90.0, 45.0, 70.0, 15.0, 0.0},
                     kAzimuths[] = {0.0, 60.0, 180.0, 25.0}, kWidths[] = {2.0, 0.6, 5.0},
                     kRates[] = {1000.0, 100.0, 4000.0}, kValues[] = {kNaN, kInfinity, -kInfinity};
    uint64_t seed = 0;
    for (const char* algorithm : {"swept-point", "swept-tool", "swept-local"})
        for (const TouchSource source : {TouchSource::grey, TouchSource::labels})
            for (int turn = 0; turn < 3; ++turn, ++seed) {
                GapCase c{.algorithm = algorithm,
                          .source = source,
                          .value = kValues[seed % 3],
                          .tilt = kTilts[seed % 5],
                          .azimuth = kAzimuths[seed % 4],
                          .width_mm = kWidths[(seed / 2) % 3],
                          .hertz = kRates[turn],
                          .yield_n = seed % 4 == 3 ? 0.8 : 0.0,
                          .seed = seed};
                if (std::string_view(algorithm) == "swept-tool")
                    c.radius_mm = turn == 0 ? 2.5 : 1.0;
                expect_faded(c);
            }
    expect_faded({.algorithm = "swept-mesh", .tilt = 60.0, .azimuth = 30.0, .seed = 30});
    expect_faded({.tilt = 80.0, .azimuth = 10.0, .hertz = 10000.0, .seed = 31});
}

// A ball that is wider than the band begins anew in material, and contacts beside the band may hold
// it on its way out: single ticks of a force that is not there.
TEST(Gap, AWideBallFeelsNothingUntilItIsKnownWhereItRests) {
    GapCase c{.algorithm = "swept-tool",
              .tilt = 30.0,
              .azimuth = 180.0,
              .width_mm = 5.0,
              .radius_mm = 4.0,
              .seed = 1134};
    expect_faded(c);
    c = {.algorithm = "swept-tool",
         .value = -kInfinity,
         .azimuth = 90.0,
         .radius_mm = 4.0,
         .hertz = 100.0,
         .yield_n = 0.8,
         .seed = 1292};
    expect_faded(c);
    c = {.algorithm = "swept-tool",
         .source = TouchSource::labels,
         .azimuth = 180.0,
         .radius_mm = 4.0,
         .seed = 1311};
    expect_faded(c);
    // Away from the band it is felt as ever, before and after.
    c = {.algorithm = "swept-tool", .radius_mm = 4.0, .seed = 90};
    ASSERT_TRUE(is_sound_at_ends(c));
    expect_faded(c);
}

// The hand goes in so fast that the ball is left behind, and its spring is long when the samples
// that it is over have no data: no force comes then.
TEST(Gap, ForceThatFadedBehindTheHandStaysAway) {
    expect_faded({.algorithm = "swept-tool",
                  .source = TouchSource::labels,
                  .value = kInfinity,
                  .tilt = 30.0,
                  .azimuth = 180.0,
                  .width_mm = 0.6,
                  .radius_mm = 4.0,
                  .hertz = 100.0,
                  .seed = 3127});
}

TEST(Gap, PrintedAlgorithmsFadeToo) {
    uint64_t seed = 50;
    for (const AlgorithmEntry& entry : algorithms())
        if (entry.as_printed) {
            GapCase c{.algorithm = entry.name, .tilt = 80.0, .width_mm = 3.0, .seed = ++seed};
            if (std::string_view(entry.name) == "vidholm-2004")
                c.radius_mm = 1.0;
            expect_faded(c);
        }
}

} // namespace
} // namespace palpate::haptics
