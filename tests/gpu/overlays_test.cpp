// Tests of what lies over slices - another volume in colour, a second label map - and slabs, on the
// device against the twin in double; marks over eyes' pictures against their closed form.

#include <cmath>
#include <thread>

#include "engine/image/display_byte.h"
#include "engine/reference/twin.h"
#include "engine/render/display_pass.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

using namespace synthetic;

// Turned about the world's z axis, with a spacing of its own.
Grid turned_grid(glm::uvec3 size, glm::dvec3 spacing, double angle, glm::dvec3 middle) {
    Grid grid;
    grid.size = size;
    const glm::dmat3 turn(std::cos(angle), std::sin(angle), 0, -std::sin(angle), std::cos(angle), 0,
                          0, 0, 1);
    for (int axis = 0; axis < 3; ++axis)
        grid.world_from_index[axis] = glm::dvec4(turn[axis] * spacing[axis], 0.0);
    grid.world_from_index[3] =
        glm::dvec4(middle - turn * (0.5 * (glm::dvec3(size) - 1.0) * spacing), 1.0);
    return grid;
}

class OverlaysTest : public GpuTest {
 protected:
    OverlaysTest() {
        // It covers a part of the slices, and runs linearly: 25 a sample.
        const Grid grid = turned_grid({40, 36, 30}, {2.5, 2.5, 2.5}, -0.4, {10, -5, 0});
        data.fused = sample(ramp({10.0, 0, 0}, 500.0), grid, ScalarType::f32);
        data.overlay =
            sample(checkerboard(16.0, 4), turned_grid({50, 50, 40}, {2, 2, 2}, 0.1, {-8, 6, 0}),
                   ScalarType::u8);
        data.labels = sample(checkerboard(24.0, 3),
                             turned_grid({40, 40, 30}, {4, 4, 4}, 0.0, {0, 0, 0}), ScalarType::u8);
        scene.size_px = {96, 80};
        scene.camera = frame_volume(data.volume.grid(), {-0.3, -0.5, 1.0}, {0, 1, 0});
        scene.slices = {SliceLayer{{0, 0, 0}, {0, 0.1, 1}}};
        scene.slice_transfer = window_function(-1000, 1200, 1.0);
        scene.background = {0.25, 0.125, 0.5};
        scene.fusion = FusionLayer{
            {{{0.0, {0, 0, 1}}, {1000.0, {1, 1, 0}}}, {{200.0, 0.0}, {800.0, 0.9}}}, 0.8};
        scene.labels = LabelLayer{};
        scene.overlay = LabelLayer{{{}, {{1, 0, 0}, true}, {{0, 1, 0}, false}}, 0.7, 0.5, 1.5};
    }
    // Leaves a scene and its data without what it does not show.
    Image drawn(Scene of, SceneData with) {
        for (const auto& [shown, volume] : {std::pair(of.fusion.has_value(), &with.fused),
                                            {of.overlay.has_value(), &with.overlay},
                                            {of.labels.has_value(), &with.labels}})
            if (!shown)
                volume->reset();
        Renderer renderer(device());
        shown_ = with;
        return renderer.render(of, with).value().eyes.front();
    }
    // The share of a picture's pixels whose colour differs from the twin's by more than the bound.
    double share_beyond(const Scene& of, double bound) {
        const Image picture = drawn(of, data), twin = render_twin(of, *shown_);
        size_t beyond = 0;
        for (uint32_t y = 0; y < picture.size_px.y; ++y)
            for (uint32_t x = 0; x < picture.size_px.x; ++x) {
                double most = 0.0;
                for (size_t c = 0; c < 4; ++c)
                    most = std::max(most, std::abs(double{picture.at(x, y, c)} - twin.at(x, y, c)));
                beyond += most > bound;
            }
        return static_cast<double>(beyond) / (double{1} * picture.size_px.x * picture.size_px.y);
    }

    SceneData data{
        sample(ct_phantom(), turned_grid({64, 60, 40}, {2, 2, 3}, 0.2, {0, 0, 0}), ScalarType::i16),
        {},
        {}};
    std::optional<SceneData> shown_;
    Scene scene;
};

// Grey: an entry of the table, 1/4095, and the phantom's steepest step between samples (some 2000
// of a window of 2200) by the 1/256 of a sample that devices round positions to: 0.004. Fused: the
// same of a ramp of 25 a sample over colours that change by 1/1000 and weights by 0.8 * 0.9 / 600 a
// value (opacity is linear between its points): below 0.001. Labels fall on either side of their
// borders, and the fused volume ends at the borders of its box: few pixels.
constexpr double kBound = 0.005, kBorders = 0.02;

TEST_F(OverlaysTest, FusionAndTwoLabelMapsAreThoseOfTheTwin) {
    for (const bool fusion : {false, true})
        for (const bool overlay : {false, true})
            for (const bool labels : {false, true}) {
                Scene some = scene;
                if (!fusion)
                    some.fusion.reset();
                if (!overlay)
                    some.overlay.reset();
                if (!labels)
                    some.labels.reset();
                EXPECT_LE(share_beyond(some, kBound), kBorders) << fusion << overlay << labels;
            }
    Scene voxels = scene;
    voxels.labels->edges = voxels.overlay->edges = LabelEdges::voxels;
    EXPECT_LE(share_beyond(voxels, kBound), kBorders);
    scene.stereo = StereoSettings{};
    scene.ray_cast = RayCastLayer{}; // slices among rays
    scene.ray_cast->transfer = window_function(300, 1200, 0.02);
    scene.ray_cast->step_mm = 1.0;
    EXPECT_LE(share_beyond(scene, 0.02), kBorders);
}

// Label maps that become u16 with a label above 255, grow on, and become u8 again by an undo: what
// one renderer makes of them in turn is what a new one makes of each, to the bit.
TEST_F(OverlaysTest, LabelsThatGrowAreDrawnAsByANewRenderer) {
    const auto drawn_into = [](const Volume& labels, double label, ScalarType type) {
        return make_volume(labels.grid(), type, [&](glm::uvec3 i) {
            const bool inside = i.x >= 12 && i.x < 26 && i.y >= 10 && i.y < 22;
            return inside && label > 0.0 ? label : double{labels.value(i)};
        });
    };
    scene.ray_cast = RayCastLayer{};
    scene.ray_cast->transfer = window_function(300, 1200, 0.02);
    scene.ray_cast->step_mm = 1.0;
    const Volume labels = *data.labels, overlay = *data.overlay;
    Renderer renderer(device());
    std::vector<std::vector<float>> pictures;
    for (const auto& [label, type] : {std::pair(0.0, ScalarType::u8),
                                      {255.0, ScalarType::u8},
                                      {300.0, ScalarType::u16},
                                      {65535.0, ScalarType::u16},
                                      {0.0, ScalarType::u8},
                                      {4097.0, ScalarType::u16}}) {
        data.labels = drawn_into(labels, label, type);
        data.overlay = drawn_into(overlay, label, type);
        const Result<Frame> frame = renderer.render(scene, data);
        ASSERT_TRUE(frame) << frame.error().message;
        pictures.push_back(frame->eyes.front().samples);
        EXPECT_EQ(pictures.back(), drawn(scene, data).samples) << label;
    }
    EXPECT_NE(pictures[0], pictures[2]);
    EXPECT_EQ(pictures[0], pictures[4]);
}

TEST_F(OverlaysTest, FusionFollowsItsOpacityAndLeavesTheRestAlone) {
    const Image with = drawn(scene, data);
    scene.fusion->opacity = 0.0;
    const Image clear = drawn(scene, data);
    scene.fusion.reset();
    const Image without = drawn(scene, data);
    EXPECT_EQ(clear.samples, without.samples);
    size_t same = 0, different = 0;
    for (size_t i = 0; i < with.samples.size(); i += 4)
        ++(std::equal(&with.samples[i], &with.samples[i] + 4, &without.samples[i]) ? same
                                                                                   : different);
    EXPECT_GT(same, 1000u);     // beyond its box, and where it is transparent
    EXPECT_GT(different, 400u); // within
}

// A pixel's colour in closed form: a uniform volume, and another over it.
TEST_F(OverlaysTest, FusionMixesByOpacityTimesTheTransferFunctions) {
    data.volume = sample(ramp({0, 0, 0}, 100.0), turned_grid({8, 8, 8}, {4, 4, 4}, 0, {0, 0, 0}),
                         ScalarType::i16);
    data.fused = sample(ramp({0, 0, 0}, 500.0), turned_grid({8, 8, 8}, {4, 4, 4}, 0, {0, 0, 0}),
                        ScalarType::f32);
    scene.labels.reset();
    scene.overlay.reset();
    scene.camera = frame_volume(data.volume.grid(), {0, 0, 1}, {0, 1, 0}, 0.4);
    scene.slices = {SliceLayer{}};
    scene.slice_transfer = window_function(0, 200, 1.0); // 0.5
    const Image picture = drawn(scene, data);
    const double weight = 0.8 * 0.45; // half-way from 200 to 800
    const glm::dvec3 expected = glm::mix(glm::dvec3(0.5), glm::dvec3(0.5, 0.5, 0.5), weight);
    scene.fusion->transfer.colors = {{0.0, {1.0, 0.25, 0.0}}};
    const Image red = drawn(scene, data);
    const glm::dvec3 expected_red = glm::mix(glm::dvec3(0.5), glm::dvec3(1.0, 0.25, 0.0), weight);
    for (int c = 0; c < 3; ++c) { // two entries of tables
        EXPECT_NEAR(picture.at(48, 40, static_cast<size_t>(c)), expected[c], 1e-3);
        EXPECT_NEAR(red.at(48, 40, static_cast<size_t>(c)), expected_red[c], 1e-3);
    }
}

TEST_F(OverlaysTest, SlabsTakeMaximumMeanOrMinimum) {
    scene.fusion.reset();
    scene.labels.reset();
    scene.overlay.reset();
    scene.value_and_depth = true;
    scene.slices[0].slab_mm = 12.0;
    std::vector<Image> pictures;
    for (const SlabMode mode : {SlabMode::minimum, SlabMode::mean, SlabMode::maximum}) {
        scene.slices[0].slab_mode = mode;
        EXPECT_LE(share_beyond(scene, kBound), kBorders);
        pictures.push_back(drawn(scene, data));
    }
    size_t apart = 0;
    for (uint32_t y = 0; y < scene.size_px.y; ++y)
        for (uint32_t x = 0; x < scene.size_px.x; ++x) {
            const float low = pictures[0].at(x, y, 4), mean = pictures[1].at(x, y, 4),
                        high = pictures[2].at(x, y, 4);
            if (std::isnan(low))
                continue;
            EXPECT_LE(low, mean + 1e-2f);
            EXPECT_LE(mean, high + 1e-2f);
            apart += high > low + 100.0f;
        }
    EXPECT_GT(apart, 40u);
}

// Marks: eyes' pictures of one colour, a mark each, in every layout.
constexpr StereoLayout kLayouts[] = {StereoLayout::side_by_side,       StereoLayout::top_bottom,
                                     StereoLayout::row_interleaved,    StereoLayout::left,
                                     StereoLayout::column_interleaved, StereoLayout::right,
                                     StereoLayout::checkerboard,       StereoLayout::anaglyph};

class MarksTest : public GpuTest {
 protected:
    static constexpr glm::uvec2 kEye_px{61, 47};
    static DisplayLayout layout_of(StereoLayout layout, bool mirror) {
        DisplayLayout display{.layout = layout,
                              .swap_eyes = mirror,
                              .mirror = mirror,
                              .origin_px = {mirror ? 1 : 0, 0}};
        display.marks = {{0, {20.37f, 18.81f}, {5.0f, 5.0f}, {1.0f, 0.9f, 0.3f}, 1.0f},
                         {1, {31.62f, 18.81f}, {4.0f, 6.0f}, {0.4f, 0.8f, 1.0f}, 0.75f}};
        return display;
    }
    static std::vector<Image> eyes_of(float value) {
        std::vector<Image> eyes(2, make_image(kEye_px, {"R", "G", "B", "A"}));
        for (Image& eye : eyes)
            std::fill(eye.samples.begin(), eye.samples.end(), value);
        return eyes;
    }
};

TEST_F(MarksTest, BytesOnTheDeviceAreThoseOfTheCpu) {
    DisplayPass pass(device());
    const std::vector<Image> eyes = eyes_of(0.2f);
    for (const StereoLayout layout : kLayouts)
        for (const bool mirror : {false, true}) {
            const DisplayLayout display = layout_of(layout, mirror);
            const Image joint = display_image(eyes, display);
            Commands commands(device());
            GpuImage picture(device(), "eyes",
                             {.format = VK_FORMAT_R32G32B32A32_SFLOAT,
                              .size = {kEye_px, 1},
                              .layers = 2,
                              .storage = true});
            commands.clear(picture, glm::vec4(0.2f));
            GpuImage target = DisplayPass::make_target(device(), "shown", joint.size_px);
            pass.record(commands, picture, display, {.image = target});
            const Commands::Region all{0, glm::uvec3(0), target.shape().size};
            const BufferSlice bytes = commands.read_back(
                target, std::span(&all, 1), uint64_t{4} * joint.size_px.x * joint.size_px.y);
            commands.submit();
            commands.finish();
            size_t wrong = 0;
            for (uint32_t y = 0; y < joint.size_px.y; ++y)
                for (uint32_t x = 0; x < joint.size_px.x; ++x)
                    for (size_t c = 0; c < 3; ++c)
                        wrong += std::to_integer<uint8_t>(
                                     bytes.mapped()[4 * (y * joint.size_px.x + x) + c]) !=
                                 display_byte(joint.at(x, y, c));
            EXPECT_EQ(wrong, 0u) << int(layout) << ", mirror " << mirror;
        }
}

// Its centroid over the pixels that show its eye.
TEST_F(MarksTest, LieWhereTheyAreInEveryLayout) {
    const std::vector<Image> eyes = eyes_of(0.0f);
    for (const StereoLayout layout : kLayouts)
        for (const bool mirror : {false, true})
            for (uint32_t eye = 0; eye < 2; ++eye) {
                DisplayLayout display = layout_of(layout, mirror);
                const EyeMark mark = display.marks[eye];
                display.marks = {mark};
                const Image joint = display_image(eyes, display);
                double weight = 0.0;
                glm::dvec2 sum(0.0);
                for (uint32_t y = 0; y < joint.size_px.y; ++y)
                    for (uint32_t x = 0; x < joint.size_px.x; ++x) {
                        // An anaglyph shows an eye in red or in green.
                        const double w = layout == StereoLayout::anaglyph
                                             ? joint.at(x, y, (eye ^ (mirror ? 1u : 0u)))
                                             : joint.at(x, y, 0);
                        const glm::dvec2 at(x % kEye_px.x, y % kEye_px.y);
                        sum += w * at;
                        weight += w;
                    }
                const bool hidden = (layout == StereoLayout::left && (eye == 1) != mirror) ||
                                    (layout == StereoLayout::right && (eye == 0) != mirror);
                if (hidden) {
                    EXPECT_EQ(weight, 0.0) << int(layout);
                    continue;
                }
                glm::dvec2 at = sum / weight;
                if (mirror)
                    at.y = kEye_px.y - 1.0 - at.y;
                EXPECT_NEAR(at.x, mark.at_px.x, 0.03) << int(layout) << ", eye " << eye;
                EXPECT_NEAR(at.y, mark.at_px.y, 0.03) << int(layout) << ", eye " << eye;
            }
}

// A retired object may hold the last reference to a resource, which is retired in its turn.
TEST_F(MarksTest, WhatIsRetiredMayHoldResources) {
    const size_t before = device().resources().size();
    for (int i = 0; i < 4; ++i) {
        auto image = std::make_shared<GpuImage>(
            device(), "held", ImageShape{.format = VK_FORMAT_R8G8B8A8_UNORM, .size = {8, 8, 1}});
        device().retire([held = std::move(image)] {});
        Commands commands(device());
        commands.submit();
        device().wait(device().last_submitted());
    }
    device().wait(device().last_submitted());
    EXPECT_EQ(device().resources().size(), before);
    EXPECT_EQ(device().retired_bytes(), 0u);
}

// Two queues of one device, or one in turns.
TEST_F(MarksTest, ASecondThreadUsesTheSameDevice) {
    GpuDevice second(device());
    EXPECT_EQ(second.handle(), device().handle());
    Buffer here(device(), "here", 4096, Memory::device);
    std::jthread other([&] {
        Buffer there(second, "there", 4096, Memory::device);
        for (int i = 0; i < 200; ++i) {
            Commands commands(second);
            commands.zero(there);
            commands.submit();
        }
        second.wait(second.last_submitted());
    });
    for (int i = 0; i < 200; ++i) {
        Commands commands(device());
        commands.zero(here);
        commands.submit();
    }
    device().wait(device().last_submitted());
    other.join();
    Commands after(device());
    after.wait_for(second.done_by(second.last_submitted()));
    after.zero(here);
    after.submit();
    device().wait(device().last_submitted());
    EXPECT_EQ(second.passed(), 200u);
}

} // namespace
} // namespace palpate
