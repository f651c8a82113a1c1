#include "haptics/proxy/field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>

#include "bench/touch/scenes.h"
#include "engine/volume/bspline.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/sample.h"
#include "engine/volume/synthetic.h"
#include "haptics/proxy/samples.h"

namespace palpate::haptics {
namespace {

using glm::dvec3;

class Random {
 public:
    explicit Random(uint64_t seed) : engine_(seed) {}
    double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    dvec3 in(dvec3 low, dvec3 high) {
        const dvec3 u(unit(), unit(), unit());
        return low + u * (high - low);
    }

 private:
    std::mt19937_64 engine_;
};

Volume noise_volume(glm::uvec3 size, ScalarType type = ScalarType::f32,
                    dvec3 spacing = dvec3(0.5)) {
    return make_volume(make_grid(size, spacing, {-3, 2, 1}), type,
                       [](glm::uvec3 i) { return 100.0 * synthetic::noise(i, 7) + 10.0; });
}

TEST(ResidentSamples, EqualTheVolumesOwn) {
    Random random(1);
    for (const ScalarType type : {ScalarType::u8, ScalarType::i16, ScalarType::f32}) {
        const Volume volume = noise_volume({70, 41, 33}, type);
        for (int i = 0; i < 5000; ++i) {
            const dvec3 index = random.in(dvec3(-2), dvec3(72, 43, 35));
            const double expected = trilinear(volume, index);
            const double found = resident_trilinear(volume, index);
            ASSERT_EQ(std::memcmp(&expected, &found, sizeof found) == 0 ||
                          (std::isnan(expected) && std::isnan(found)),
                      true);
            const dvec3 inside = glm::clamp(index, dvec3(0), dvec3(69, 40, 32));
            ASSERT_EQ(central_gradient(volume, inside), resident_gradient(volume, inside));
        }
    }
}

TEST(ResidentSamples, CopyIsTheBoxWithWhatIsMissingFilled) {
    const Volume volume = noise_volume({40, 35, 70}, ScalarType::i16);
    Random random(2);
    for (int trial = 0; trial < 200; ++trial) {
        const glm::ivec3 start(random.in(dvec3(-8), dvec3(72)));
        const glm::ivec3 size(random.in(dvec3(1), dvec3(12)));
        std::vector<float> box(size_t(size.x) * size_t(size.y) * size_t(size.z));
        EXPECT_FALSE(copy_resident(volume, start, size, -7.0f, box.data()));
        size_t at = 0;
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x) {
                    const float s = resident_sample(volume, start + glm::ivec3(x, y, z));
                    ASSERT_EQ(box[at++], s == s ? s : -7.0f);
                }
    }
}

// The smooth view at a blur of 1 sample is the library's SmoothCursor, within float coefficients:
// 2^-24 of the largest value, for each of 7 + 7 + 7 taps and 64 coefficients, all weights below 1.
TEST(Field, SmoothEqualsTheSmoothCursor) {
    const Volume volume = noise_volume({70, 41, 37}, ScalarType::i16, {0.4, 0.4, 0.4});
    auto field = std::make_unique<Field>();
    field->follow(volume, TouchSource::grey, 0.0, 1.0);
    SmoothCursor cursor(volume);
    Random random(3);
    for (int i = 0; i < 3000; ++i) {
        const dvec3 index = random.in(dvec3(6), dvec3(63, 34, 30)); // the borders differ
        const SmoothSample expected = cursor.sample(index);
        const FieldSample found = field->smooth(world_point(volume.grid(), index));
        const double bound = 600.0 * 85.0 * 0x1p-24;
        ASSERT_NEAR(found.value, expected.value, bound);
        const dvec3 gradient = world_gradient(volume.grid(), expected.gradient);
        ASSERT_LE(glm::distance(found.gradient, gradient), 3.0 * bound / 0.4);
    }
}

// The sharp view holds cubic polynomials: its filter and spline are exact for them.
TEST(Field, SharpHoldsCubics) {
    const Grid grid = make_grid({40, 40, 40}, {0.5, 0.5, 0.5}, {-10, -10, -10});
    const auto cubic = [](dvec3 p) {
        return 0.01 * p.x * p.x * p.x - 0.02 * p.y * p.y * p.z + 0.1 * p.x * p.z + p.y;
    };
    const auto slope = [](dvec3 p) {
        return dvec3(0.03 * p.x * p.x + 0.1 * p.z, -0.04 * p.y * p.z + 1.0,
                     -0.02 * p.y * p.y + 0.1 * p.x);
    };
    const Volume volume = make_volume(
        grid, ScalarType::f32, [&](glm::uvec3 i) { return cubic(world_point(grid, dvec3(i))); });
    auto field = std::make_unique<Field>();
    field->follow(volume, TouchSource::grey, 0.0, 1.0);
    Random random(4);
    for (int i = 0; i < 2000; ++i) {
        const dvec3 p = random.in(dvec3(-7), dvec3(7));
        const FieldSample s = field->sharp(p);
        // values below 40 in float, a sum of weights of 1.83, samples 0.5 mm apart
        ASSERT_NEAR(s.value, cubic(p), 40.0 * 0x1p-21);
        ASSERT_LE(glm::distance(s.gradient, slope(p)), 40.0 * 0x1p-18);
        ASSERT_EQ(s.value, field->value(p));
    }
}

TEST(Field, TrilinearEqualsTheVolumes) {
    const Volume volume = noise_volume({70, 41, 37});
    auto field = std::make_unique<Field>();
    field->follow(volume, TouchSource::grey, 0.0, 1.0);
    Random random(5);
    for (int i = 0; i < 5000; ++i) {
        const dvec3 index = random.in(dvec3(0), dvec3(69, 40, 36));
        const dvec3 mm = world_point(volume.grid(), index);
        ASSERT_NEAR(field->trilinear(mm), trilinear(volume, index), 1e-9);
    }
}

TEST(Field, BeyondTheVolumeAndWithoutDataIsFree) {
    const Grid grid = make_grid({20, 20, 20}, dvec3(1.0));
    const Volume volume = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        return i.x > 12 && i.y > 12 ? std::numeric_limits<double>::quiet_NaN() : 1000.0;
    });
    auto field = std::make_unique<Field>();
    field->follow(volume, TouchSource::grey, 500.0, 1.0);
    EXPECT_GE(field->value({5, 5, 5}), 500.0);
    EXPECT_LT(field->value({17, 17, 10}), 500.0);
    for (const dvec3 far : {dvec3(-5, 5, 5), dvec3(1e9, 5, 5), dvec3(5, -1e300, 5)}) {
        EXPECT_LT(field->value(far), 500.0);
        EXPECT_LT(field->trilinear(far), 500.0);
        EXPECT_EQ(field->smooth(far).gradient, dvec3(0.0));
    }
}

// A new snapshot is seen, and the cache answers as a fresh one does.
TEST(Field, CacheForgetsWhatAnEditChanged) {
    Volume volume = noise_volume({40, 40, 40});
    auto kept = std::make_unique<Field>();
    auto fresh = std::make_unique<Field>();
    Random random(6);
    for (int round = 0; round < 20; ++round) {
        kept->follow(volume, TouchSource::grey, 0.0, 1.0);
        *fresh = Field{};
        fresh->follow(volume, TouchSource::grey, 0.0, 1.0);
        for (int i = 0; i < 100; ++i) {
            const dvec3 p = world_point(volume.grid(), random.in(dvec3(0), dvec3(39)));
            ASSERT_EQ(kept->value(p), fresh->value(p));
            ASSERT_EQ(kept->smooth(p).gradient, fresh->smooth(p).gradient);
            ASSERT_EQ(kept->trilinear(p), fresh->trilinear(p));
        }
        VolumeEdit edit(volume);
        for (int i = 0; i < 50; ++i)
            edit.set(glm::uvec3(random.in(dvec3(0), dvec3(40))), 500.0);
        volume = edit.commit();
    }
}

// What is called clear is clear: nothing near the segment is solid.
TEST(Field, ClearSegmentsMeetNothing) {
    touch::TouchCase body{.solid = touch::ball({1, 2, 3}, 3.0)};
    const touch::Scene scene = touch::make_scene(body, {});
    auto field = std::make_unique<Field>();
    field->follow(*scene.touch.grey, TouchSource::grey, scene.iso, 1.0);
    Random random(7);
    int clear = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const dvec3 a = random.in(dvec3(-14), dvec3(14)), b = a + random.in(dvec3(-4), dvec3(4));
        if (!field->is_clear(a, b, 0.0))
            continue;
        ++clear;
        for (int i = 0; i <= 40; ++i)
            ASSERT_LT(field->value(glm::mix(a, b, i / 40.0)), scene.iso);
    }
    EXPECT_GT(clear, 500);
}

TEST(Field, BlurFollowsTheNoise) {
    touch::TouchCase body{.solid = touch::plane({0, 0, 0}, {0.3, 0.4, 0.8})};
    const auto blur = [&](double noise) {
        const touch::Scene scene = touch::make_scene(body, {.noise = noise});
        return normal_blur_for(*scene.touch.grey, scene.iso);
    };
    EXPECT_EQ(blur(0.0), 0.0);
    EXPECT_EQ(blur(0.02), 0.6);
    EXPECT_EQ(blur(0.05), 1.0);
    EXPECT_EQ(blur(0.1), 1.0);
}

} // namespace
} // namespace palpate::haptics
