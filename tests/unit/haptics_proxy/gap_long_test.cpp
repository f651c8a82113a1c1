#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/unit/haptics_proxy/gap_grid.h"

namespace palpate::haptics {
namespace {

// A small tool catches on the steps of labels and slips, with a band or without: the same hand on
// the same labels without a band says by how much. Next to the band nothing is allowed for it.
bool is_as_gentle_as_without(GapCase c, const Crossed& with) {
    if (with.is_gentle(c.source) || c.source != TouchSource::labels)
        return with.is_gentle(c.source);
    c.width_mm = 0.0;
    return with.most_change_at_gap_n <= 0.02 && with.most_change_n <= cross(c).most_change_n;
}

// The whole grid of Gap.
TEST(GapGrid, ForceFadesInBandsAtEveryAngleAndRate) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    struct Felt {
        const char* algorithm;
        TouchSource source;
        double radius_mm;
    };
    constexpr Felt kFelt[] = {
        {"swept-point", TouchSource::grey, 0.0}, {"swept-point", TouchSource::labels, 0.0},
        {"swept-tool", TouchSource::grey, 0.5},  {"swept-tool", TouchSource::labels, 0.5},
        {"swept-tool", TouchSource::grey, 1.5},  {"swept-tool", TouchSource::labels, 1.5},
        {"swept-tool", TouchSource::grey, 4.0},  {"swept-tool", TouchSource::labels, 4.0},
        {"swept-local", TouchSource::grey, 0.0}, {"swept-local", TouchSource::labels, 0.0},
        {"swept-mesh", TouchSource::grey, 0.0}};
    for (const Felt& felt : kFelt) {
        Crossed worst;
        uint64_t runs = 0, wrong = 0, seed = 1000;
        const bool is_mesh = std::string_view(felt.algorithm) == "swept-mesh";
        for (const double tilt : {0.0, 10.0, 30.0, 45.0, 60.0, 80.0, 90.0})
            for (const double azimuth : {0.0, 35.0, 90.0, 145.0, 180.0})
                for (const double width_mm : {0.6, 2.0, 5.0})
                    for (const double hertz : {100.0, 1000.0, 10000.0}) {
                        ++seed;
                        if (is_mesh && seed % 5 != 0) // a mesh takes a second to make
                            continue;
                        const GapCase c{.algorithm = felt.algorithm,
                                        .source = felt.source,
                                        .value = seed % 3 == 0   ? kNaN
                                                 : seed % 3 == 1 ? kInfinity
                                                                 : -kInfinity,
                                        .tilt = tilt,
                                        .azimuth = azimuth,
                                        .width_mm = width_mm,
                                        .radius_mm = felt.radius_mm,
                                        .hertz = hertz,
                                        .yield_n = seed % 4 == 0 ? 0.8 : 0.0,
                                        .seed = seed};
                        const Crossed one = cross(c);
                        const bool is_right = one.is_finite && one.unknown > 0 &&
                                              is_as_gentle_as_without(c, one) &&
                                              one.most_left_n <= 0.02;
                        EXPECT_TRUE(is_right)
                            << name_of(c) << ": change " << one.most_change_n << " N, at the gap "
                            << one.most_change_at_gap_n << " N, left " << one.most_left_n << " N, "
                            << one.unknown << " ticks unknown";
                        ++runs;
                        wrong += !is_right;
                        worst.most_change_n = std::max(worst.most_change_n, one.most_change_n);
                        worst.most_left_n = std::max(worst.most_left_n, one.most_left_n);
                    }
        fmt::print(
            "{:12} {:6} radius {:.1f}: {} bands, {} wrong; change {:.4f} N beyond "
            "the rate, "
            "left {:.4f} N\n",
            felt.algorithm, felt.source == TouchSource::labels ? "labels" : "grey", felt.radius_mm,
            runs, wrong, worst.most_change_n, worst.most_left_n);
    }
}

} // namespace
} // namespace palpate::haptics
