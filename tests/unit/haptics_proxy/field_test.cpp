#include "haptics/field/field.h"

#include <gtest/gtest.h>

#include <algorithm>
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
#include "haptics/field/samples.h"

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
// 2^-24 of the largest value, for each of 7 + 7 + 7 taps and 64 coefficients, all weights below 1;
// and as much again for the spline's sums and weights, in floats, too.
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
        const double bound = 2.0 * 600.0 * 85.0 * 0x1p-24;
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
        // values below 40 in float, a sum of weights of 1.83, samples 0.5 mm apart; sums in float
        ASSERT_NEAR(s.value, cubic(p), 40.0 * 0x1p-20);
        ASSERT_LE(glm::distance(s.gradient, slope(p)), 40.0 * 0x1p-17);
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
        // Values below 600 in float: rounded when stored, and in each of 7 interpolations of three
        // roundings.
        ASSERT_NEAR(field->trilinear(mm), trilinear(volume, index), 600.0 * 22.0 * 0x1p-24);
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

// A new snapshot is seen, and the cache answers as a fresh one does: after edits of a few samples,
// after undo (bricks that were there before), after bricks that were made, freed and made again at
// the same address, and for another iso-value.
TEST(Field, CacheAnswersAsAFreshOneDoes) {
    Volume volume = noise_volume({70, 40, 40});
    const Volume first = volume;
    auto kept = std::make_unique<Field>();
    auto fresh = std::make_unique<Field>();
    Random random(6);
    for (int round = 0; round < 60; ++round) {
        const double iso = round % 7 == 6 ? 20.0 : 0.0;
        const double blur = round / 30 == 0 ? 1.0 : 0.0;
        kept->follow(volume, TouchSource::grey, iso, blur);
        *fresh = Field{};
        fresh->follow(volume, TouchSource::grey, iso, blur);
        std::vector<glm::vec3> offsets;
        std::vector<uint16_t> near(200), near_fresh(200);
        for (int i = 0; i < 200; ++i) {
            const dvec3 index = random.in(dvec3(0), dvec3(69, 39, 39));
            const dvec3 p = world_point(volume.grid(), index);
            // Stored less different iso-values: two roundings of values below 600.
            ASSERT_NEAR(kept->value(p), fresh->value(p), 600.0 * 85.0 * 0x1p-22);
            ASSERT_NEAR(kept->trilinear(p), fresh->trilinear(p), 600.0 * 22.0 * 0x1p-23);
            if (iso == 0.0) {
                ASSERT_EQ(kept->value(p), fresh->value(p));
                ASSERT_EQ(kept->smooth(p).gradient, fresh->smooth(p).gradient);
                ASSERT_EQ(kept->trilinear(p), fresh->trilinear(p));
            }
            offsets.push_back(glm::vec3(random.in(dvec3(-9), dvec3(9))));
        }
        const dvec3 at = world_point(volume.grid(), dvec3(35, 20, 20));
        const uint32_t count = kept->near_points(at, offsets, 9.0, near.data());
        ASSERT_EQ(count, fresh->near_points(at, offsets, 9.0, near_fresh.data()));
        ASSERT_TRUE(std::equal(near.begin(), near.begin() + count, near_fresh.begin()));
        if (round % 5 == 4)
            volume = first;
        for (int edits = 0; edits < 1 + round % 3; ++edits) {
            VolumeEdit edit(volume);
            for (int i = 0; i < 10; ++i)
                edit.set(glm::uvec3(random.in(dvec3(0), dvec3(70, 40, 40))), 500.0);
            volume = edit.commit();
        }
    }
}

// Points that are not near are not solid, wherever the whole goes within a sample; points that are
// solid are those of trilinear(), in their order.
TEST(Field, PointsThatAreNotNearStayFree) {
    touch::TouchCase body{.solid = touch::ball({1, 2, 3}, 3.0)};
    Random random(8);
    for (const touch::Form form : {touch::Form::grey_f32, touch::Form::labels}) {
        const touch::Scene scene = touch::make_scene(body, {.form = form});
        const bool labels = form == touch::Form::labels;
        auto field = std::make_unique<Field>();
        field->follow(labels ? *scene.touch.labels : *scene.touch.grey,
                      labels ? TouchSource::labels : TouchSource::grey, scene.iso, 0.0);
        for (const double reach : {6.0, 40.0}) { // 40 samples: more than the cache's table holds
            size_t spared = 0, solid = 0;
            for (int trial = 0; trial < 20; ++trial) {
                const dvec3 at = random.in(dvec3(-6), dvec3(8));
                std::vector<glm::vec3> offsets;
                std::vector<dvec3> mm;
                for (int i = 0; i < 400; ++i) {
                    mm.push_back(random.in(dvec3(-0.5 * reach), dvec3(0.5 * reach)));
                    offsets.push_back(field->offset_of(mm.back()));
                }
                std::vector<uint16_t> near(400);
                near.resize(field->near_points(at, offsets, reach, near.data()));
                spared += 400 - near.size();
                for (int moves = 0; moves < 8; ++moves) {
                    const dvec3 to = at + random.in(dvec3(-0.49), dvec3(0.49)); // 0.5 mm samples
                    std::vector<Field::Inside> found(400);
                    found.resize(field->solid_points(to, offsets, reach, near, 0.0f, found.data()));
                    std::vector<uint32_t> expected;
                    for (uint32_t i = 0; i < 400; ++i) {
                        const double value = field->trilinear(to + mm[i]) - field->iso();
                        // Places are floats: 2^-22 of 64 samples, in a field that rises by 570 in
                        // one.
                        if (std::abs(value) > (labels ? 1e-4 : 0.02) && value > 0.0)
                            expected.push_back(i);
                    }
                    solid += expected.size();
                    size_t next = 0;
                    for (const Field::Inside& inside : found)
                        if (next < expected.size() && inside.point == expected[next])
                            ++next;
                    ASSERT_EQ(next, expected.size()) << "solid, and not said so";
                    for (const Field::Inside& inside : found)
                        ASSERT_GT(field->trilinear(to + mm[inside.point]),
                                  field->iso() - (labels ? 1e-4 : 0.02));
                }
            }
            EXPECT_GT(spared, labels ? 500u : 4000u); // of labels, by whole blocks
            EXPECT_GT(solid, 50u);
        }
    }
}

// A spline of an edge, an erf of 0.7 samples, differs from the edge by what samples alias. In
// doubles, over 60000 planes and places: the spline sharpened by five taps meets 1/2 up to 0.01354
// samples off, the worst along an axis; normals of the one that is blurred by 0.36 - 0.49 samples^2
// err by up to 0.913 degrees, at a slant. tune() measures the edge within 1 % here, and an edge of
// 0.707 samples is blurred by 0.01 less: 0.01 / 0.82 of the error, which goes with the blur's
// exponent, is within a twentieth of it.
TEST(Field, PlanesAreWhereAnEdgeIsHalf) {
    Random random(9);
    for (int trial = 0; trial < 12; ++trial) {
        const dvec3 n = glm::normalize(random.in(dvec3(-1), dvec3(1)));
        touch::TouchCase body{.solid = touch::plane({0, 0, 0}, n)};
        const touch::Scene scene = touch::make_scene(body, {});
        auto field = std::make_unique<Field>();
        TouchParameters parameters{.iso = scene.iso};
        tune(parameters, *scene.touch.grey);
        ASSERT_EQ(parameters.normal_blur_samples, 0.0);
        ASSERT_NEAR(parameters.edge_samples, 0.7, 0.007);
        field->follow(*scene.touch.grey, parameters);
        for (int i = 0; i < 100; ++i) {
            dvec3 p = random.in(dvec3(-5), dvec3(5));
            p -= glm::dot(p, n) * n;
            const auto [sharp, smooth] = field->both(p);
            ASSERT_LE(std::abs(sharp.value - field->iso()) / glm::length(sharp.gradient),
                      0.0136 * field->voxel_mm());
            ASSERT_GE(glm::dot(-glm::normalize(smooth.gradient), n), std::cos(glm::radians(0.96)));
        }
    }
}

double moment(const Filter& filter, size_t axis, int power) {
    double sum = 0.0;
    for (int k = -filter.reach; k <= filter.reach; ++k)
        sum += filter.taps[axis][static_cast<size_t>(k + filter.reach)] * std::pow(k, power);
    return sum;
}

// Quadratics come back as they are: the spline's samples, 1/6, 2/3 and 1/6, add a third to the
// second moment, the taps take it. Without noise the fourth, a third of theirs, is taken, too.
TEST(FieldFilters, UndoTheSpline) {
    for (const dvec3 spacing : {dvec3(0.5), dvec3(0.4, 0.4, 1.2), dvec3(1.0, 0.3, 0.5)})
        for (const double blur : {0.0, 0.6}) {
            const Filter sharp =
                make_filters(make_grid({8, 8, 8}, spacing, {0, 0, 0}), blur, 0.7, false).sharp;
            for (size_t axis = 0; axis < 3; ++axis) {
                EXPECT_NEAR(moment(sharp, axis, 0), 1.0, 1e-6); // a few roundings of floats
                EXPECT_NEAR(moment(sharp, axis, 1), 0.0, 1e-6);
                EXPECT_NEAR(moment(sharp, axis, 2), -1.0 / 3.0, 2e-6);
                if (blur == 0.0) {
                    EXPECT_NEAR(
                        1.0 / 3.0 + 6.0 / 3.0 * moment(sharp, axis, 2) + moment(sharp, axis, 4),
                        0.0, 4e-6);
                }
            }
        }
}

// Normals are blurred as much in mm on every axis: the edge, the taps and the spline's third of a
// sample make 0.36 + 1/3 of the coarsest spacing's square, or of noise's blur. The widest
// here has 1.75 samples on the fine axes and is cut off at 5.5, z = 3.13 deviations: it lacks
// 2 z phi(z), 1.9 %.
TEST(FieldFilters, BlurAnEdgeToOneWidth) {
    const dvec3 spacing(0.5, 0.5, 0.8);
    const Grid grid = make_grid({8, 8, 8}, spacing, {0, 0, 0});
    for (const double edge : {0.0, 0.3, 0.5, 0.7})
        for (const double blur : {0.0, 1.0}) {
            const FieldFilters made = make_filters(grid, blur, edge, false);
            const double all = blur > 0.0 ? 1.0 : 0.36 - edge * edge;
            for (size_t axis = 0; axis < 3; ++axis) {
                const double share = spacing[static_cast<int>(axis)] / 0.8;
                const double variance = (moment(made.smooth, axis, 2) + 1.0 / 3.0) * share * share;
                EXPECT_NEAR(moment(made.smooth, axis, 0), 1.0, 1e-6);
                EXPECT_NEAR(variance, all + 1.0 / 3.0, 0.019 * (all + 1.0 / 3.0))
                    << edge << ", blur " << blur << ", axis " << axis;
            }
        }
}

// How deep, as a share of the coarsest spacing, the surface lies at most below that of a ball whose
// radius is 0.83 of that spacing, wherever samples lie in it: the kink in its middle is near. No
// more is asked than of all bodies, a tenth.
TEST(Field, SmallBallsKeepTheirSize) {
    const touch::Storage storage{.spacing_mm = touch::kUneven_mm, .form = touch::Form::grey_i16};
    Random random(4);
    double most_mm = 0.0;
    auto field = std::make_unique<Field>();
    for (int trial = 0; trial < 100; ++trial) {
        const dvec3 middle = random.in(dvec3(-0.6), dvec3(0.6));
        touch::TouchCase body{.solid = touch::ball(middle, 1.0)};
        const touch::Scene scene = touch::make_scene(body, storage);
        TouchParameters parameters{.iso = scene.iso};
        tune(parameters, *scene.touch.grey);
        field->follow(*scene.touch.grey, parameters);
        for (int i = 0; i < 200; ++i) {
            const dvec3 way = glm::normalize(random.in(dvec3(-1), dvec3(1)));
            double in = 0.5, out = 1.5;
            while (out - in > 1e-4) {
                const double half = 0.5 * (in + out);
                (field->value(middle + half * way) >= field->iso() ? in : out) = half;
            }
            most_mm = std::max(most_mm, 1.0 - in);
        }
    }
    EXPECT_LT(most_mm / touch::kUneven_mm.z, 0.1);
    RecordProperty("deepest", std::to_string(most_mm / touch::kUneven_mm.z));
}

// An iso-value amid noise has no surface but that of grains: a run of equally likely sides is at
// most three long 7 times in 8, and of the 32 crossings of a line of 64 the first ends none. Of the
// lines through a ball of ten samples 2 % leave it within three.
TEST(Field, TellsGrainsFromBodies) {
    for (const double noise : {0.0, 0.1}) {
        const touch::Storage storage{.noise = noise};
        const touch::TouchCase body{.solid = touch::ball({1, 2, 3}, 5.0)};
        const touch::Scene scene = touch::make_scene(body, storage);
        // Noise has not so many of them that anybody were warned.
        EXPECT_LE(tuning_for(*scene.touch.grey, scene.iso).grains, noise == 0.0 ? 0.02 : 0.5);
    }
    EXPECT_NEAR(tuning_for(noise_volume({64, 64, 64}), 10.0).grains, 7.0 / 8 * 31 / 32, 0.02);
}

// A segment that is called clear is clear: nothing near it is solid.
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
        return tuning_for(*scene.touch.grey, scene.iso).normal_blur_samples;
    };
    EXPECT_EQ(blur(0.0), 0.0);
    EXPECT_EQ(blur(0.02), 0.6);
    EXPECT_EQ(blur(0.05), 1.0);
    EXPECT_EQ(blur(0.1), 1.0);
}

} // namespace
} // namespace palpate::haptics
