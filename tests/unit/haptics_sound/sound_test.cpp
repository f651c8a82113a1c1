#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "haptics/sound/milling_sound.h"
#include "haptics/sound/wav.h"
#include "tests/support/temporary_folder.h"

namespace palpate::haptics {
namespace {

double rms(std::span<const float> samples) {
    double sum = 0.0;
    for (const float sample : samples)
        sum += double(sample) * sample;
    return std::sqrt(sum / static_cast<double>(samples.size()));
}

std::vector<float> steady(const Milling& milling) {
    MillingSound sound;
    std::vector<float> samples(44100);
    sound.make(milling, samples);
    return samples;
}

TEST(MillingSound, LevelRisesWithRemovedVolume) {
    double last = 0.0;
    for (const double rate : {5.0, 20.0, 80.0, 320.0, 1280.0}) {
        const double level = rms(steady({.rate_mm3_per_s = rate, .hardness = 0.5}));
        EXPECT_GT(level, 1.1 * last) << rate;
        last = level;
    }
    EXPECT_GT(last, 0.1); // is heard
}

// Zero crossings a second: the tone keeps them low, and noise above raises them.
TEST(MillingSound, IsBrighterAtSpeedAndRougherInHardMaterial) {
    const auto crossings = [](const Milling& milling) {
        const std::vector<float> samples = steady(milling);
        int count = 0;
        for (size_t i = 1; i < samples.size(); ++i)
            count += (samples[i] < 0) != (samples[i - 1] < 0);
        return count;
    };
    const Milling slow{.rate_mm3_per_s = 100, .hardness = 0.3, .speed_mm_per_s = 1};
    Milling fast = slow, hard = slow;
    fast.speed_mm_per_s = 100;
    hard.hardness = 1.0;
    EXPECT_GT(crossings(fast), crossings(slow));
    EXPECT_GT(crossings(hard), crossings(slow));
}

TEST(MillingSound, SilentWithoutRemovalAndWithoutClicks) {
    for (const float sample : steady({.hardness = 1.0, .speed_mm_per_s = 50.0}))
        ASSERT_EQ(sample, 0.0f);
    // Begins and ends within kWhole_s, then exactly 0.
    const std::vector<MillingMoment> moments = {{0.1, {.rate_mm3_per_s = 500, .hardness = 1}},
                                                {0.3, {}}};
    const std::vector<float> samples = sound_of(moments, 0.5);
    ASSERT_EQ(samples.size(), 22050u);
    const auto at = [](double s) { return static_cast<size_t>(s * kSoundRate_hz); };
    for (size_t i = 0; i < samples.size(); ++i)
        if (i < at(0.1) || i > at(0.3 + MillingSound::kWhole_s) + 1) {
            ASSERT_EQ(samples[i], 0.0f) << i;
        }
    EXPECT_GT(rms(std::span(samples).subspan(at(0.15), at(0.1))), 0.05);
    EXPECT_LT(std::abs(samples[at(0.1) + 2]), 0.01f);
    EXPECT_LT(std::abs(samples[at(0.3 + MillingSound::kWhole_s) - 2]), 0.01f);
}

TEST(MillingSound, AnyStateGivesSamplesInRange) {
    for (const double rate : {0.0, 1e-9, 1e12, 1e300})
        for (const double hardness : {-1.0, 0.0, 2.0})
            for (const double speed : {-5.0, 0.0, 1e9})
                for (const float sample : steady({0.0, rate, hardness, speed}))
                    ASSERT_TRUE(sample >= -1.0f && sample <= 1.0f);
}

class Wav : public TemporaryFolder {};

TEST_F(Wav, IsTheSameBytesEachTime) {
    const std::vector<MillingMoment> moments = {{0.0, {.rate_mm3_per_s = 90, .hardness = 0.7}},
                                                {0.2, {.rate_mm3_per_s = 10, .hardness = 0.2}}};
    std::string bytes[2];
    for (int i = 0; i < 2; ++i) {
        const auto path = file(i ? "a.wav" : "b.wav");
        ASSERT_TRUE(save_wav(path, sound_of(moments, 0.4)));
        bytes[i] = bytes_of(i ? "a.wav" : "b.wav");
    }
    EXPECT_EQ(bytes[0], bytes[1]);
    // The header by the format's description.
    ASSERT_EQ(bytes[0].size(), 44 + 2 * 17640u);
    const auto number = [&](size_t at, size_t size) {
        uint32_t value = 0;
        std::memcpy(&value, bytes[0].data() + at, size);
        return value;
    };
    EXPECT_EQ(bytes[0].substr(0, 4), "RIFF");
    EXPECT_EQ(number(4, 4), bytes[0].size() - 8);
    EXPECT_EQ(bytes[0].substr(8, 8), "WAVEfmt ");
    EXPECT_EQ(number(20, 2), 1u);
    EXPECT_EQ(number(22, 2), 1u);
    EXPECT_EQ(number(24, 4), 44100u);
    EXPECT_EQ(number(34, 2), 16u);
    EXPECT_EQ(number(40, 4), 2 * 17640u);
}

} // namespace
} // namespace palpate::haptics
