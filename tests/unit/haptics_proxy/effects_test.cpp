#include "haptics/proxy/effects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace palpate::touch {
namespace {

TEST(BandNoise, LiesBetween20And400Hz) {
    haptics::BandNoise noise;
    std::vector<double> x(8192);
    for (int i = 0; i < 1000; ++i)
        noise.next(1e-4);
    for (double& value : x) {
        value = noise.next(1e-4); // 10 kHz
        ASSERT_LE(std::abs(value), 1.0);
    }
    // Power by a plain Fourier sum, in bands of 40 Hz.
    const auto power = [&](double from, double to) {
        double sum = 0.0;
        int count = 0;
        for (double hertz = from; hertz < to; hertz += 10000.0 / 8192.0 * 3.0, ++count) {
            double re = 0.0, im = 0.0;
            for (size_t i = 0; i < x.size(); ++i) {
                const double window = 0.5 - 0.5 * std::cos(2.0 * M_PI * double(i) / 8192.0);
                re += window * x[i] * std::cos(2.0 * M_PI * hertz * 1e-4 * static_cast<double>(i));
                im += window * x[i] * std::sin(2.0 * M_PI * hertz * 1e-4 * static_cast<double>(i));
            }
            sum += re * re + im * im;
        }
        return sum / count;
    };
    // Butterworth of second order falls by 12 dB an octave: at 4 times the edge to 1/257, at a
    // fifth of the low edge to 1/626; a quarter of the mean is left to chance.
    const double band = power(60, 300);
    EXPECT_LE(power(1600, 1900), band / 60.0);
    EXPECT_LE(power(1, 5), band / 60.0);
}

} // namespace
} // namespace palpate::touch
