// A volume in a brick atlas looks as one in a single image does.

#include <cstring>
#include <limits>
#include <span>

#include "engine/scene/presets.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

using namespace synthetic;

constexpr Residency kDense = Residency::dense, kAtlas = Residency::atlas;
constexpr Sampling kByHand = Sampling::by_hand;

// AtlasTest takes over 5 s of a processor: each picture is drawn from an atlas and from one image,
// by two shaders that the CPU driver compiles.
class AtlasTest : public GpuTest {
 protected:
    // A head in 5 x 5 x 3 bricks, the last ones cut.
    static SceneData phantom() {
        const glm::uvec3 size(141, 160, 70);
        const glm::dvec3 spacing(1.4, 1.25, 2.8);
        const Grid grid = make_grid(size, spacing, -0.5 * (glm::dvec3(size) - 1.0) * spacing);
        return {sample(ct_phantom(), grid, ScalarType::i16), std::nullopt};
    }

    static Scene scene_of(const SceneData& data, RayMode mode, glm::dvec3 towards) {
        Scene scene;
        scene.size_px = size_or_half({75, 66}); // no multiple of a tile
        scene.camera = frame_volume(data.volume.grid(), towards, {0, 0, 1});
        scene.value_and_depth = true;
        RayCastLayer layer;
        layer.mode = mode;
        layer.transfer = window_function(150, 1200, 0.2);
        layer.isos = {{-300.0, {0.9, 0.6, 0.5}, 0.4}, {300.0}};
        scene.ray_cast = layer;
        return scene;
    }

    static Frame draw(const Scene& scene, const SceneData& data, RendererOptions options) {
        Renderer renderer = kept_renderer(options);
        Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        return frame ? std::move(*frame) : Frame{};
    }

    static size_t differing(const Frame& a, const Frame& b) {
        size_t count = 0;
        EXPECT_EQ(a.eyes.size(), b.eyes.size());
        for (size_t eye = 0; eye < std::min(a.eyes.size(), b.eyes.size()); ++eye) {
            const auto& x = a.eyes[eye].samples;
            const auto& y = b.eyes[eye].samples;
            EXPECT_EQ(x.size(), y.size());
            for (size_t i = 0; i < std::min(x.size(), y.size()); ++i)
                count += std::memcmp(&x[i], &y[i], sizeof x[i]) != 0;
        }
        return count;
    }

    // The largest difference of a channel; infinite where just one of two is a number.
    static double farthest(const Frame& a, const Frame& b, const std::string& channel) {
        double most = 0;
        for (size_t eye = 0; eye < a.eyes.size(); ++eye) {
            const Image& image = a.eyes[eye];
            size_t c = 0;
            while (image.channels[c] != channel)
                ++c;
            for (uint32_t y = 0; y < image.size_px.y; ++y)
                for (uint32_t x = 0; x < image.size_px.x; ++x) {
                    const double p = image.at(x, y, c), q = b.eyes[eye].at(x, y, c);
                    if (std::isnan(p) && std::isnan(q))
                        continue;
                    most = std::isnan(p) != std::isnan(q) ? std::numeric_limits<double>::infinity()
                                                          : std::max(most, std::abs(p - q));
                }
        }
        return most;
    }

    static size_t visible_pixels(const Frame& frame) {
        size_t count = 0;
        for (const Image& image : frame.eyes)
            for (uint32_t y = 0; y < image.size_px.y; ++y)
                for (uint32_t x = 0; x < image.size_px.x; ++x)
                    count += image.at(x, y, 3) > 0.0f;
        return count;
    }
};

const glm::dvec3 kViews[] = {{-0.45, -1.0, 0.4}, {1, 0, 0}, {0, -1, 0}, {0.02, 0.1, -1.0}};

// All of them, or on slow devices the first two.
std::span<const glm::dvec3> views() {
    return std::span(kViews).first(std::getenv("PALPATE_SMALL") ? 2 : std::size(kViews));
}

TEST_F(AtlasTest, InterpolatedByHandItIsTheSameToTheBit) {
    const SceneData data = phantom();
    for (const glm::dvec3 view : views())
        for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
            SCOPED_TRACE(testing::Message()
                         << "mode " << static_cast<int>(mode) << " view " << view.x);
            Scene scene = scene_of(data, mode, view);
            if (view.x > 0.5)
                scene.ray_cast->shading = Shading{};
            const Frame dense =
                draw(scene, data, {.residency = kDense, .sampling = Sampling::by_hand});
            const Frame atlas =
                draw(scene, data, {.residency = kAtlas, .sampling = Sampling::by_hand});
            EXPECT_FALSE(dense.stats.atlas);
            EXPECT_TRUE(atlas.stats.atlas);
            EXPECT_EQ(atlas.stats.parts, 1u);
            EXPECT_EQ(differing(dense, atlas), 0u);
            EXPECT_GT(visible_pixels(atlas), 100u); // the comparison means something
        }
}

TEST_F(AtlasTest, EveryIntegratorShadingAndStepIsTheSameToTheBit) {
    const SceneData data = phantom();
    for (const double step : {0.7, 9.0})
        for (const Integrator integrator :
             {Integrator::fast, Integrator::preintegrated, Integrator::exact})
            for (const bool shaded : {false, true}) {
                SCOPED_TRACE(testing::Message()
                             << "step " << step << " integrator " << static_cast<int>(integrator));
                Scene scene = scene_of(data, RayMode::alpha, kViews[0]);
                scene.ray_cast->integrator = integrator;
                scene.ray_cast->step_mm = step;
                if (shaded)
                    scene.ray_cast->shading = Shading{};
                EXPECT_EQ(differing(draw(scene, data, {.residency = kDense, .sampling = kByHand}),
                                    draw(scene, data, {.residency = kAtlas, .sampling = kByHand})),
                          0u);
            }
}

TEST_F(AtlasTest, ExactSurfacesAndMaximaAreTheSame) {
    const SceneData data = phantom();
    for (const RayMode mode : {RayMode::mip, RayMode::iso}) {
        Scene scene = scene_of(data, mode, kViews[0]);
        scene.ray_cast->integrator = Integrator::exact;
        scene.ray_cast->min_transmittance = 0.0;
        const Frame dense = draw(scene, data, {.residency = kDense, .sampling = kByHand});
        EXPECT_EQ(differing(dense, draw(scene, data, {.residency = kAtlas, .sampling = kByHand})),
                  0u);
        const Frame parts = draw(
            scene, data, {.residency = kAtlas, .most_resident_bricks = 45, .sampling = kByHand});
        EXPECT_GT(parts.stats.parts, 1u);
        // Rays are cut at the same faces, give or take 2 ulps of at most 1024 mm.
        EXPECT_LE(farthest(dense, parts, mode == RayMode::mip ? "value" : "depth"),
                  2.0 / 16384 * (mode == RayMode::mip ? 0.8 * 3 * 2100 : 1.0));
    }
}

TEST_F(AtlasTest, LabelsClipsSlicesAndStereoAreTheSameToTheBit) {
    SceneData data = phantom();
    data.labels = make_volume(data.volume.grid(), ScalarType::u8, [](glm::uvec3 i) {
        return static_cast<double>((i.x / 20 + i.y / 20 + i.z / 10) % 4);
    });
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso})
        for (const Interpolation slice : {Interpolation::linear, Interpolation::cubic}) {
            SCOPED_TRACE(static_cast<int>(mode));
            Scene scene = scene_of(data, mode, kViews[0]);
            scene.labels = LabelLayer{};
            scene.labels->styles = {{}, {{1, 0, 0}, true}, {{0, 1, 0}, false}};
            scene.clip_planes = {{{10, 0, 0}, {1, 0.3, 0}}};
            scene.slices = {{{0, 0, -20}, {0, 0.2, 1}, slice, 8.0}};
            scene.slice_transfer = window_function(-1000, 1000, 1.0);
            scene.stereo = StereoSettings{};
            EXPECT_EQ(differing(draw(scene, data, {.residency = kDense, .sampling = kByHand}),
                                draw(scene, data, {.residency = kAtlas, .sampling = kByHand})),
                      0u);
            scene.ray_cast.reset(); // slices alone
            EXPECT_EQ(differing(draw(scene, data, {.residency = kDense, .sampling = kByHand}),
                                draw(scene, data, {.residency = kAtlas, .sampling = kByHand})),
                      0u);
        }
}

TEST_F(AtlasTest, MissingDataIsTheSameToTheBit) {
    const Grid grid = make_grid({70, 64, 33}, {1, 1, 2}, {-35, -32, -33});
    const SceneData data{make_volume(grid, ScalarType::f32,
                                     [](glm::uvec3 i) {
                                         const bool gap = (i.x * 7 + i.y * 3 + i.z) % 97 == 0 ||
                                                          (i.x >= 32 && i.x < 64 && i.z < 32);
                                         return gap ? std::nan("") : 20.0 * i.y - 200.0;
                                     }),
                         std::nullopt};
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
        SCOPED_TRACE(static_cast<int>(mode));
        const Scene scene = scene_of(data, mode, kViews[0]);
        const Frame dense = draw(scene, data, {.residency = kDense, .sampling = kByHand});
        EXPECT_EQ(differing(dense, draw(scene, data, {.residency = kAtlas, .sampling = kByHand})),
                  0u);
        EXPECT_GT(visible_pixels(dense), 50u);
    }
}

// The device's sampler adds this: positions are rounded. Dense, a position p becomes a texture
// coordinate by one multiplication and one addition and texels by the device's multiplication: each
// rounds to 2^-24 of the volume's side N at most, so 4 N / 2^24 samples with the start's own
// rounding. In an atlas of side M the same holds for p in samples, and going to the slot adds the
// inset of 4 M / 2^24 and as much in rounding. A value moves by that share of the difference
// between neighbouring samples on each axis.
TEST_F(AtlasTest, InterpolatedByTheDeviceItIsTheSameWithinItsRounding) {
    const SceneData data = phantom();
    double slope = 0; // between neighbours, all axes together
    const glm::uvec3 size = data.volume.size();
    for (uint32_t z = 0; z + 1 < size.z; ++z)
        for (uint32_t y = 0; y + 1 < size.y; ++y)
            for (uint32_t x = 0; x + 1 < size.x; ++x) {
                const double here = data.volume.value({x, y, z});
                slope = std::max(slope, std::abs(data.volume.value({x + 1, y, z}) - here) +
                                            std::abs(data.volume.value({x, y + 1, z}) - here) +
                                            std::abs(data.volume.value({x, y, z + 1}) - here));
            }
    const double volume_side = 160, atlas_side = 33 * 5; // at most 5 slots a side hold 75 bricks
    const double moved = (8 * volume_side + 8 * atlas_side) / 16777216.0;
    // Graphics cards round weights to 8 bits, too, in either picture.
    const double weights = device().info().is_cpu() ? 0.0 : 2.0 / 256;
    const double bound = (moved + weights) * slope;
    for (const glm::dvec3 view : views()) {
        const Scene scene = scene_of(data, RayMode::mip, view);
        const Frame dense = draw(scene, data, {.residency = kDense});
        const Frame atlas = draw(scene, data, {.residency = kAtlas});
        EXPECT_LE(farthest(dense, atlas, "value"), bound) << "of " << slope;
        // tau of the window goes from 0 to its peak over 1050 HU; colour and opacity follow the
        // value at most that steeply, and the table has an entry for each 1050 / 4096 HU.
        EXPECT_LE(farthest(dense, atlas, "A"), (bound + 1050.0 / 2048) / 1050.0);
    }
}

// In parts, a ray takes the same samples, and its sum is rounded anew: two segments a part are
// taken as cut ones (exp() of a product instead of the table's own entry, a few units in the last
// place of at most 1), and one sum is composed of another. A ray stops by what it met in a part, so
// later than in one go at most: both are within min_transmittance of the end.
TEST_F(AtlasTest, InPartsItIsTheSameWithinItsRoundingOfSums) {
    const SceneData data = phantom();
    for (const glm::dvec3 view : views())
        for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso})
            for (const bool stereo : {false, true}) {
                SCOPED_TRACE(testing::Message() << "mode " << static_cast<int>(mode) << " view "
                                                << view.x << " stereo " << stereo);
                Scene scene = scene_of(data, mode, view);
                if (stereo)
                    scene.stereo = StereoSettings{};
                else
                    scene.ray_cast->min_transmittance = 0.0;
                const Frame whole = draw(scene, data, {.residency = kDense, .sampling = kByHand});
                const Frame parts = draw(scene, data,
                                         {.residency = kAtlas,
                                          .most_resident_bricks = mode == RayMode::mip ? 45u : 34u,
                                          .sampling = kByHand});
                EXPECT_GT(parts.stats.parts, stereo ? 3u : 1u);
                EXPECT_LE(parts.stats.room_for_bricks, 48u);
                // A cut segment's middle is rounded twice: 2 ulps (2^-14 mm) of at most 1024 mm,
                // 0.8 samples a mm; neighbours differ by 2100 HU on each of three axes at most.
                if (mode == RayMode::mip) {
                    EXPECT_LE(farthest(whole, parts, "value"), 2.0 / 16384 * 0.8 * 3 * 2100);
                }
                const double color = static_cast<double>(parts.stats.parts) * 16 / (1 << 24) +
                                     scene.ray_cast->min_transmittance;
                for (const char* channel : {"R", "G", "B", "A"})
                    EXPECT_LE(farthest(whole, parts, channel), color) << channel;
            }
}

TEST_F(AtlasTest, AnEditUploadsTheBricksItChangedAndThoseBelow) {
    const SceneData data = phantom();
    const Scene scene = scene_of(data, RayMode::iso, kViews[0]);
    Renderer renderer(device(), {.residency = kAtlas, .sampling = kByHand});
    const Result<Frame> first = renderer.render(scene, data);
    ASSERT_TRUE(first) << first.error().message;
    EXPECT_GT(first->stats.uploaded_bricks, 10u);
    EXPECT_EQ(renderer.render(scene, data)->stats.uploaded_bricks, 0u);
    VolumeEdit edit(data.volume);
    for (uint32_t i = 0; i < 20; ++i)
        for (uint32_t j = 0; j < 20; ++j)
            edit.set({60 + i, 5 + j, 32}, 2000.0); // the first layer of its bricks
    const SceneData after{edit.commit(), std::nullopt};
    const Result<Frame> next = renderer.render(scene, after);
    ASSERT_TRUE(next) << next.error().message;
    EXPECT_GT(next->stats.uploaded_bricks, 0u);
    EXPECT_LE(next->stats.uploaded_bricks, 12u); // 2 x 1 bricks change; with those below 3 x 1 x 2
    EXPECT_EQ(differing(*next, draw(scene, after, {.residency = kDense, .sampling = kByHand})), 0u);
    EXPECT_GT(differing(*next, *first), 0u);
}

TEST_F(AtlasTest, HoldsWhatCanBeSeenAndKeepsToItsBudget) {
    const SceneData data = phantom();
    Scene scene = scene_of(data, RayMode::iso, kViews[0]);
    scene.ray_cast->isos = {{1000.0}}; // inner skull
    const uint64_t before = device().resource_bytes();
    for (const uint64_t budget : {uint64_t{64} << 20, uint64_t{16} << 20, uint64_t{9} << 20}) {
        Renderer renderer(device(), {.memory_limit_bytes = before + budget});
        const Result<Frame> frame = renderer.render(scene, data);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_LE(device().resource_bytes() - before, budget);
        EXPECT_LT(frame->stats.needed_bricks, 75u);
        EXPECT_FALSE(frame->stats.residency_reason.empty());
    }
    Renderer renderer(device(), {.memory_limit_bytes = before + (uint64_t{3} << 20)});
    const Result<Frame> none = renderer.render(scene, data);
    ASSERT_FALSE(none);
    EXPECT_NE(none.error().message.find("limit"), std::string::npos) << none.error().message;
}

// Rays carry more from part to part than the volume holds here, and only an atlas needs that.
TEST_F(AtlasTest, LargePicturesOnSmallDevicesAreDrawnOrRefused) {
    const SceneData data = phantom();
    Scene scene = scene_of(data, RayMode::iso, kViews[0]);
    scene.size_px = {1100, 900};
    scene.value_and_depth = false;
    const uint64_t before = device().resource_bytes();
    bool fitted = false;
    for (uint64_t budget = uint64_t{18} << 20; budget <= uint64_t{60} << 20;
         budget += uint64_t{7} << 20) {
        Renderer renderer(device(), {.memory_limit_bytes = before + budget});
        const Result<FrameStats> drawn = renderer.draw(scene, data);
        EXPECT_TRUE(drawn || !fitted) << budget; // more room never hurts
        if (!drawn)
            EXPECT_NE(drawn.error().message.find("limit"), std::string::npos);
        else
            EXPECT_LE(device().resource_bytes() - before, budget);
        fitted = fitted || drawn;
    }
    EXPECT_TRUE(fitted);
}

TEST_F(AtlasTest, AStoppedFrameLeavesNothingBehind) {
    const SceneData data = phantom();
    const Scene scene = scene_of(data, RayMode::alpha, kViews[0]);
    RendererOptions options{.residency = Residency::atlas, .most_resident_bricks = 48};
    const Frame whole = draw(scene, data, options);
    ASSERT_GT(whole.stats.parts, 1u);
    int calls = 0, stop_at = 1;
    options.progress = [&](double) { return ++calls != stop_at; };
    Renderer renderer(device(), options);
    for (stop_at = 1; stop_at <= static_cast<int>(whole.stats.parts); ++stop_at) {
        calls = 0;
        const Result<Frame> stopped = renderer.render(scene, data);
        ASSERT_FALSE(stopped);
        EXPECT_NE(stopped.error().message.find("stopped after"), std::string::npos);
    }
    stop_at = 0;
    const Result<Frame> again = renderer.render(scene, data);
    ASSERT_TRUE(again);
    EXPECT_EQ(differing(whole, *again), 0u);
}

TEST_F(AtlasTest, LongerThanTheDevicesImagesItIsDrawnNonetheless) {
    const uint32_t length = device().limits().maxImageDimension3D + 40;
    const Grid grid = make_grid({length, 6, 6}, {0.1, 40, 40});
    const SceneData data{make_volume(grid, ScalarType::u8,
                                     [&](glm::uvec3 i) { return i.x + 40 >= length ? 200.0 : 7; }),
                         std::nullopt};
    Scene scene = scene_of(data, RayMode::mip, {-1, 0, 0}); // along the volume
    const Frame frame = draw(scene, data, {});
    EXPECT_TRUE(frame.stats.atlas);
    EXPECT_NE(frame.stats.residency_reason.find("on an axis"), std::string::npos);
    ASSERT_EQ(frame.eyes.size(), 1u);
    // The brightest lies beyond the longest image. 16-bit texels round to 193 / 65535.
    EXPECT_NEAR(frame.eyes[0].at(scene.size_px.x / 2, scene.size_px.y / 2, 4), 200.0, 0.003);
}

} // namespace
} // namespace palpate
