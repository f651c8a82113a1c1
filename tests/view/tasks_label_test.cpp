// Tasks 32 to 45: labels are made, changed and read. The volume is Task::skull() of 41 samples of
// 2 mm, whose middle is sample 20.

#include "tests/view/task_session.h"

namespace palpate::view {
namespace {

constexpr uint32_t kSkullSide = 41;
constexpr double kSkullSpacing_mm = 2.0, kBrush_mm = 3.0; // of the brush, as it is at first

double radius_samples(glm::uvec3 at) {
    return glm::distance(glm::dvec3(at), glm::dvec3(20.0));
}

class LabelTask : public Task {
 protected:
    void begin_empty() { begin(scene_of_volume(skull(kSkullSide, kSkullSpacing_mm))); }
    template <class LabelAt>
    void begin_with(const LabelAt& label_at) {
        const Volume volume = skull(kSkullSide, kSkullSpacing_mm);
        const Volume map = label_map(volume, label_at);
        begin(scene_of_volume(volume, map));
    }
};

TEST_F(LabelTask, T32_OneLabelMoreHasANameAndAColour) {
    begin_with([](glm::uvec3 at) { return at.x < 4 ? 1 : at.x > 36 ? 2 : 0; });
    const LabelStyle generated = style_of(state().notes, 3);
    play("32_new_label");
    EXPECT_EQ(state().label, 3);
    EXPECT_EQ(dump()["label_names"]["3"], "tumour");
    EXPECT_TRUE(state().notes.label_styles.contains(3));
    EXPECT_NE(style_of(state().notes, 3).color, generated.color);
}

// Samples within 3 mm of one at 2 mm apart: i * i + j * j <= 2.25, that is 9 of the slice.
TEST_F(LabelTask, T33_ADiscIsPaintedInOneSlice) {
    begin_empty();
    play("33_paint");
    EXPECT_EQ(count(1), 9u);
    for_each_labelled(1, [](glm::uvec3 at) {
        EXPECT_EQ(at.z, 20u);
        EXPECT_LE(kSkullSpacing_mm * radius_samples(at), kBrush_mm);
    });
}

// The same in space: i * i + j * j + k * k <= 2.25, that is 1 + 6 + 12.
TEST_F(LabelTask, T34_ABallIsPaintedOverSeveralSlices) {
    begin_empty();
    play("34_paint_a_ball");
    EXPECT_EQ(count(1), 19u);
    std::set<uint32_t> slices;
    for_each_labelled(1, [&](glm::uvec3 at) { slices.insert(at.z); });
    EXPECT_EQ(slices, (std::set<uint32_t>{19, 20, 21}));
}

// The session drags from sample (12, 20, 20) to (20, 20, 20).
TEST_F(LabelTask, T35_APartOfALabelIsGone) {
    begin_with([](glm::uvec3) { return 1; });
    play("35_erase");
    const Volume map = labels();
    for (uint32_t z = 0; z < kSkullSide; ++z)
        for (uint32_t y = 0; y < kSkullSide; ++y)
            for (uint32_t x = 0; x < kSkullSide; ++x) {
                const glm::dvec3 at(x, y, z), on(std::clamp(double(x), 12.0, 20.0), 20.0, 20.0);
                const double away_mm = kSkullSpacing_mm * glm::distance(at, on);
                EXPECT_EQ(map.value({x, y, z}), away_mm <= kBrush_mm ? 0.0f : 1.0f);
            }
}

TEST_F(LabelTask, T36_BoneAloneIsUnderABroadStroke) {
    begin_empty();
    play("36_threshold_and_paint");
    ASSERT_GT(count(1), 10u);
    for_each_labelled(1, [&](glm::uvec3 at) { EXPECT_GE(value_at(at), 1190.0); });
    // The stroke goes by way of sample (36, 21, 20), bone, and (35, 12, 20), which lies outside.
    EXPECT_EQ(labels().value({36, 21, 20}), 1.0f);
    EXPECT_EQ(labels().value({35, 12, 20}), 0.0f);
}

// The session traces corners of which the least and the greatest lie 10 samples to each side along
// x, and 8 along y. Samples on the contour count, as Pick's theorem has them: at most a perimeter
// of them beside the area of the corners.
TEST_F(LabelTask, T37_WhatATracedContourEnclosesIsFilled) {
    begin_empty();
    play("37_fill_a_contour");
    constexpr double corners[][2] = {{1, 0},     {.9, .5},  {.6, .8},  {0, 1},
                                     {-.6, .8},  {-.9, .5}, {-1, 0},   {-.9, -.5},
                                     {-.6, -.8}, {0, -1},   {.6, -.8}, {.9, -.5}};
    double twice = 0.0, perimeter = 0.0;
    for (size_t i = 0; i < 12; ++i) {
        const auto &a = corners[i], &b = corners[(i + 1) % 12];
        twice += 80.0 * (a[0] * b[1] - b[0] * a[1]);
        perimeter += std::hypot(10.0 * (b[0] - a[0]), 8.0 * (b[1] - a[1]));
    }
    EXPECT_NEAR(static_cast<double>(count(1)), 0.5 * twice, perimeter);
    EXPECT_EQ(labels().value({20, 20, 20}), 1.0f);
    for_each_labelled(1, [](glm::uvec3 at) {
        EXPECT_EQ(at.z, 20u);
        EXPECT_LE(std::hypot((at.x - 20.0) / 10.0, (at.y - 20.0) / 8.0), 1.1);
    });
}

// Discs of 6, 8 and 6 samples in slices 10, 15 and 20.
TEST_F(LabelTask, T38_SlicesBetweenContoursAreFilled) {
    begin_with([](glm::uvec3 at) {
        const double r = std::hypot(at.x - 20.0, at.y - 20.0);
        return ((at.z == 10 || at.z == 20) && r <= 6.0) || (at.z == 15 && r <= 8.0) ? 1 : 0;
    });
    play("38_between_slices");
    std::map<uint32_t, size_t> slices;
    for_each_labelled(1, [&](glm::uvec3 at) { ++slices[at.z]; });
    ASSERT_EQ(slices.size(), 11u);
    EXPECT_EQ(slices.begin()->first, 10u);
    for (const auto& [z, samples] :
         slices) { // no less than the small discs, no more than the large
        EXPECT_GE(samples, slices[10]) << z;
        EXPECT_LE(samples, slices[15]) << z;
    }
}

// The organ is a ball of 100 HU in tissue of 0 HU, whose samples are known; the label's edge lies
// within a sample of its own.
TEST_F(LabelTask, T39_AnOrganGrowsFromSeedsInsideAndOutside) {
    const Grid its_grid = skull(kSkullSide, kSkullSpacing_mm).grid();
    begin(scene_of_volume(make_volume(its_grid, ScalarType::i16, [](glm::uvec3 at) {
        const double noise = (at.x * 7u + at.y * 13u + at.z * 29u) % 21u - 10.0;
        return noise + (kSkullSpacing_mm * radius_samples(at) <= kOrgan_mm ? 100.0 : 0.0);
    })));
    play("39_seeds_to_an_organ");
    const Volume map = labels();
    for (uint32_t z = 0; z < kSkullSide; ++z)
        for (uint32_t y = 0; y < kSkullSide; ++y)
            for (uint32_t x = 0; x < kSkullSide; ++x) {
                const double r_mm = kSkullSpacing_mm * radius_samples({x, y, z});
                const bool is_label = map.value({x, y, z}) == 1.0f;
                if (r_mm <= kOrgan_mm - kSkullSpacing_mm) {
                    EXPECT_TRUE(is_label) << x << " " << y << " " << z;
                } else if (r_mm >= kOrgan_mm + kSkullSpacing_mm) {
                    EXPECT_FALSE(is_label) << x << " " << y << " " << z;
                }
            }
}

TEST_F(LabelTask, T40_AllBoneIsOneLabel) {
    begin_empty();
    play("40_threshold_to_a_label");
    const Volume map = labels();
    for (uint32_t z = 0; z < kSkullSide; ++z)
        for (uint32_t y = 0; y < kSkullSide; ++y)
            for (uint32_t x = 0; x < kSkullSide; ++x)
                EXPECT_EQ(map.value({x, y, z}) == 1.0f, value_at({x, y, z}) >= 300.0);
}

// A ball of 8 samples and two crumbs that do not touch it.
TEST_F(LabelTask, T41_TheLargestPieceIsLeft) {
    const auto in_ball = [](glm::uvec3 at) { return radius_samples(at) <= 8.0; };
    begin_with([&](glm::uvec3 at) {
        return in_ball(at) || at == glm::uvec3(2, 2, 2) || (at.x > 35 && at.y > 35 && at.z == 30);
    });
    play("41_largest_piece");
    size_t in = 0;
    for_each_labelled(1, [&](glm::uvec3 at) {
        EXPECT_TRUE(in_ball(at));
        ++in;
    });
    EXPECT_EQ(in, 2109u); // lattice points within 8 of one
}

// Faces between the label and what is none of it: a ragged surface has more of them.
TEST_F(LabelTask, T42_ARaggedLabelIsSmooth) {
    const Volume volume = skull(kSkullSide, 1.0); // smoothed by 1 mm at first
    begin(scene_of_volume(volume, label_map(volume, [](glm::uvec3 at) {
                              const double r = radius_samples(at);
                              const bool odd = (at.x * 7u + at.y * 13u + at.z * 29u) % 3u == 0u;
                              return r <= 8.0 || (r <= 10.0 && odd) ? 1 : 0;
                          })));
    const auto faces = [&] {
        const Volume map = labels();
        size_t found = 0;
        for_each_labelled(1, [&](glm::uvec3 at) {
            for (int axis = 0; axis < 3; ++axis)
                for (const int by : {-1, 1}) {
                    glm::ivec3 beside(at);
                    beside[axis] += by;
                    found += map.value(glm::uvec3(beside)) != 1.0f;
                }
        });
        return found;
    };
    const size_t ragged = faces(), samples = count(1);
    play("42_smooth_a_label");
    EXPECT_LT(static_cast<double>(faces()), 0.8 * static_cast<double>(ragged));
    // Smoothing keeps the volume where nothing is thinner than its width; here single samples are.
    EXPECT_NEAR(static_cast<double>(count(1)), static_cast<double>(samples),
                0.1 * static_cast<double>(samples));
}

// The pointer is over label 2, and label 1 is drawn.
// An organ without bone before it: a body of 40 HU. Its colour is seen in the picture of 3D.
TEST_F(LabelTask, T43_TheSurfaceOfAnOrganIsSeenBesideTheSlices) {
    const Volume volume =
        make_volume(skull(kSkullSide, kSkullSpacing_mm).grid(), ScalarType::i16, [](glm::uvec3 at) {
            const double r = std::hypot(at.x - 20.0, at.y - 20.0);
            return r > 16.0  ? -1000.0
                   : r < 2.0 ? 1200.0 // the spine
                             : 40.0;
        });
    OpenedScene scene =
        scene_of_volume(volume, label_map(volume, [](glm::uvec3 at) {
                            return glm::distance(glm::dvec3(at), glm::dvec3(20, 10, 20)) <= 5.0;
                        }));
    scene.scene.labels->styles.resize(3);
    scene.scene.labels->styles[1].color = glm::dvec3(1.0, 0.0, 0.0);
    begin(std::move(scene));
    play("43_organ_in_3d");
    const Image shot = viewer().shot().value();
    const Box box = box_of(state(), Panel::volume).value();
    size_t red = 0;
    for (int y = 0; y < box.size_px.y; ++y)
        for (int x = 0; x < box.size_px.x; ++x) {
            const auto at = [&](uint32_t channel) {
                return shot.at(uint32_t(box.low_px.x + x), uint32_t(box.low_px.y + y), channel);
            };
            red += at(0) > 0.2f && at(1) < 0.3f * at(0) && at(2) < 0.3f * at(0);
        }
    // A ball of 10 mm radius in a view that shows 82 mm and more of it: over a hundredth of it.
    EXPECT_GT(red, size_t(box.size_px.x * box.size_px.y) / 100);
}

TEST_F(LabelTask, T44_StrokesOfOneLabelLeaveTheOtherAsItIs) {
    begin_with([](glm::uvec3 at) { return at.x >= 8 && at.x < 26 ? 2 : at.x < 4 ? 1 : 0; });
    const size_t of_2 = count(2), of_1 = count(1);
    play("44_lock_a_label");
    EXPECT_EQ(state().notes.locked_labels, std::vector<uint16_t>{2});
    play("34_paint_a_ball"); // into it
    EXPECT_EQ(count(2), of_2);
    EXPECT_EQ(count(1), of_1);
}

TEST_F(LabelTask, T45_TheVolumeOfALabelIsRead) {
    begin_with([](glm::uvec3 at) { return glm::all(glm::lessThan(at, glm::uvec3(10))) ? 1 : 0; });
    play("45_volume_in_ml");
    EXPECT_TRUE(has_widget("labels/row/1")); // with its volume
    EXPECT_EQ(dump()["label_counts"]["1"], 1000);
    EXPECT_EQ(viewer().work().label_sample_mm3(), 8.0);
}

} // namespace
} // namespace palpate::view
