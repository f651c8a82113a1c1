// Fewer rays while the hand moves, and full quality when it rests.

#include "engine/render/interactive.h"

#include <cmath>
#include <limits>

#include "engine/image/compare.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

// InteractiveTest takes over 5 s of a processor: pictures are refined step by step to the full one,
// all of them by a CPU driver.
class InteractiveTest : public GpuTest {
 protected:
    static const SceneData& phantom() {
        static const SceneData data = [] {
            const glm::uvec3 size(100, 100, 80);
            const glm::dvec3 spacing(2.0, 2.0, 2.4);
            const Grid grid = make_grid(size, spacing, -0.5 * (glm::dvec3(size) - 1.0) * spacing);
            return SceneData{synthetic::sample(synthetic::ct_phantom(), grid, ScalarType::i16),
                             std::nullopt};
        }();
        return data;
    }
    static Scene scene_of(RayMode mode) {
        Scene scene;
        scene.size_px = {407, 302}; // odd and even
        scene.camera = frame_volume(phantom().volume.grid(), {-0.45, -1.0, 0.4}, {0, 0, 1});
        scene.background = {0.1, 0.2, 0.3};
        RayCastLayer layer;
        layer.mode = mode;
        layer.transfer = window_function(-100, 1200, mode == RayMode::mip ? 1.0 : 0.1);
        layer.isos = {{300.0}};
        scene.ray_cast = layer;
        return scene;
    }
    // Every frame takes 10 ms, 8 of them for rays: no clock decides.
    static Interactive::Times ten_ms(const FrameStats&) { return {10.0, 8.0}; }
};

TEST_F(InteractiveTest, HoldsFortyDecibelsFromAFractionOfTheRays) {
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
        SCOPED_TRACE(static_cast<int>(mode));
        const Scene scene = scene_of(mode);
        Renderer renderer(device());
        const Result<Frame> full = renderer.render(scene, phantom());
        ASSERT_TRUE(full);
        const Result<FrameStats> coarse = renderer.draw(scene, phantom(), CoarseSettings{});
        ASSERT_TRUE(coarse);
        const double error = color_rmse(renderer.read_back()[0], full->eyes[0]);
        EXPECT_LT(error, 0.01); // 40 dB
        EXPECT_GT(error, 0.0);
        EXPECT_LT(coarse->coarse->traced_share, 0.8);
        EXPECT_GT(coarse->coarse->traced_share, 0.1);
    }
}

// With no contrast allowed every pixel of a tile that shows anything has a ray of its own.
TEST_F(InteractiveTest, WithoutContrastThePictureIsTheFullOne) {
    const Scene scene = scene_of(RayMode::alpha);
    Renderer renderer(device());
    const Result<Frame> full = renderer.render(scene, phantom());
    ASSERT_TRUE(full);
    const Result<FrameStats> coarse =
        renderer.draw(scene, phantom(), CoarseSettings{.step_factor = 1.0, .contrast = -1.0});
    ASSERT_TRUE(coarse);
    EXPECT_GT(coarse->coarse->traced_share, 0.3);
    EXPECT_LT(coarse->coarse->traced_share, 1.0) << "empty tiles need no rays";
    EXPECT_EQ(coarse->coarse->error_estimate, 0.0);
    EXPECT_EQ(renderer.read_back()[0].samples, full->eyes[0].samples);
}

// Listed rays of surfaces begin before the nearest of the hits about them. They are the full
// picture's to the bit, unless the full one meets something still nearer. How many are not.
size_t expect_missed_lie_in_front(Renderer& renderer, const Scene& scene, const SceneData& data) {
    const Result<Frame> full = renderer.render(scene, data);
    const Result<FrameStats> few = renderer.draw(scene, data, CoarseSettings{.contrast = -1.0});
    if (!full || !few) {
        ADD_FAILURE() << (full ? few.error().message : full.error().message);
        return 0;
    }
    const Image coarse = renderer.read_back()[0];
    const Image& picture = full->eyes[0];
    const size_t depth = picture.channels.size() - 1;
    EXPECT_EQ(picture.channels[depth], "depth");
    const auto step_mm = static_cast<float>(step_mm_of(*scene.ray_cast, data.volume.grid()));
    const auto is_same = [&](uint32_t x, uint32_t y) {
        for (size_t c = 0; c < 4; ++c)
            if (coarse.at(x, y, c) != picture.at(x, y, c))
                return false;
        return true;
    };
    size_t missed = 0;
    for (uint32_t y = 0; y < scene.size_px.y; ++y)
        for (uint32_t x = 0; x < scene.size_px.x; ++x) {
            if (is_same(x, y))
                continue;
            ++missed;
            EXPECT_FALSE(x % 2 == 0 && y % 2 == 0) << x << ' ' << y;
            float about = std::numeric_limits<float>::infinity();
            for (const uint32_t v : {y & ~1u, (y + 1) & ~1u})
                for (const uint32_t u : {x & ~1u, (x + 1) & ~1u}) {
                    const bool is_inside = u < scene.size_px.x && v < scene.size_px.y;
                    EXPECT_TRUE(is_inside) << "at the border rays begin where their tile does";
                    if (is_inside)
                        about = std::fmin(about, picture.at(u, v, depth));
                }
            // It begins at the lattice's last sample before two steps from there.
            EXPECT_LT(picture.at(x, y, depth), about - 2.0f * step_mm + 1e-3f) << x << ' ' << y;
        }
    return missed;
}

TEST_F(InteractiveTest, RaysThatBeginLateMeetWhatLiesThere) {
    Scene scene = scene_of(RayMode::iso);
    scene.value_and_depth = true;
    Renderer renderer(device());
    for (const glm::uvec2 size_px : {glm::uvec2(407, 302), glm::uvec2(56, 44)}) {
        scene.size_px = size_px;
        EXPECT_EQ(expect_missed_lie_in_front(renderer, scene, phantom()), 0u)
            << "nothing in the phantom is so thin";
    }
}

// A fence of rods one sample thick before a wall, where a pixel is three: between two rays a rod
// may be passed over. At rest it is there.
TEST_F(InteractiveTest, RaysThatBeginLateMayPassOverWhatIsThinnerThanTwoPixels) {
    const SceneData data{
        make_volume(make_grid({64, 64, 64}, {1, 1, 1}, {-32, -32, -32}), ScalarType::i16,
                    [](glm::uvec3 i) {
                        const bool wall = i.y > 50;
                        const bool rod = i.y == 10 && i.x % 8 == 4;
                        return wall || rod ? 1000.0 : 0.0;
                    }),
        std::nullopt};
    Scene scene = scene_of(RayMode::iso);
    scene.size_px = {31, 24};
    scene.camera = frame_volume(data.volume.grid(), {0, -1, 0}, {0, 0, 1});
    scene.value_and_depth = true;
    Renderer renderer(device());
    EXPECT_GT(expect_missed_lie_in_front(renderer, scene, data), 0u);
    const Result<Frame> full = renderer.render(scene, data);
    ASSERT_TRUE(full) << full.error().message;
    ASSERT_TRUE(renderer.draw(scene, data, CoarseSettings{.contrast = -1.0}));
    ASSERT_TRUE(renderer.draw(scene, data, TileRows{0, Renderer::tile_rows(scene)}));
    const Image rested = renderer.read_back()[0];
    for (uint32_t y = 0; y < scene.size_px.y; ++y)
        for (uint32_t x = 0; x < scene.size_px.x; ++x)
            for (size_t c = 0; c < 4; ++c)
                ASSERT_EQ(rested.at(x, y, c), full->eyes[0].at(x, y, c)) << x << ' ' << y;
}

// Between rays 4, 8 and 16 pixels apart the picture is linear, and background where nothing is.
TEST_F(InteractiveTest, FewerRaysAreThoseOfThePictureAndLinearBetween) {
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso})
        for (const uint32_t apart : {4u, 8u, 16u}) {
            SCOPED_TRACE(testing::Message() << static_cast<int>(mode) << ", " << apart);
            const Scene scene = scene_of(mode);
            Renderer renderer(device());
            const Result<Frame> full = renderer.render(scene, phantom());
            ASSERT_TRUE(full);
            const Result<FrameStats> coarse =
                renderer.draw(scene, phantom(), CoarseSettings{.px_per_ray = apart});
            ASSERT_TRUE(coarse);
            EXPECT_LT(coarse->coarse->traced_share, 1.1 / (apart * apart));
            const Image picture = renderer.read_back()[0];
            const glm::uvec2 size = scene.size_px;
            const glm::uvec2 rays = (size + (apart - 1)) / apart;
            const glm::uvec2 first = (size - 1u - apart * (rays - 1u)) / 2u;
            size_t off = 0, seen = 0;
            for (uint32_t y = first.y; y < size.y; y += apart)
                for (uint32_t x = first.x; x < size.x; x += apart)
                    for (size_t c = 0; c < 4; ++c) {
                        off += picture.at(x, y, c) != full->eyes[0].at(x, y, c);
                        seen += picture.at(x, y, 3) > 0.0f;
                        // Half-way to the next ray right: the mean, where both tiles are marched.
                        if (x + apart >= size.x || picture.at(x, y, 3) == 0.0f ||
                            picture.at(x + apart, y, 3) == 0.0f)
                            continue;
                        const float mean =
                            0.5f * (picture.at(x, y, c) + picture.at(x + apart, y, c));
                        EXPECT_NEAR(picture.at(x + apart / 2, y, c), mean, 0x1p-22f);
                    }
            EXPECT_EQ(off, 0u);
            EXPECT_GT(seen, 100u / apart);
        }
}

class InteractiveEstimate : public InteractiveTest, public testing::WithParamInterface<uint32_t> {};
INSTANTIATE_TEST_SUITE_P(PixelsARay, InteractiveEstimate, testing::Values(2u, 4u, 8u, 16u));

// The estimate is a mean over sparse pixels: taken over many frames it is the error itself.
TEST_P(InteractiveEstimate, IsTheError) {
    const Scene scene = scene_of(RayMode::alpha);
    Renderer renderer(device());
    const Result<Frame> full = renderer.render(scene, phantom());
    ASSERT_TRUE(full);
    const CoarseSettings settings{.step_factor = 3.0, .contrast = 0.1, .px_per_ray = GetParam()};
    double squares = 0;
    constexpr int kFrames = kJudgedSpacing_px; // which look at other pixels each
    for (int i = 0; i < kFrames; ++i) {
        const Result<FrameStats> coarse = renderer.draw(scene, phantom(), settings);
        ASSERT_TRUE(coarse);
        squares += coarse->coarse->error_estimate * coarse->coarse->error_estimate / kFrames;
    }
    const Image hurried = renderer.read_back()[0];
    const double error = color_rmse(hurried, full->eyes[0]);
    EXPECT_GT(error, 1e-4);
    // The frames look at one pixel in kFrames. How far the mean of so many squared errors may be
    // from that of all is known from how these spread: four standard errors, as if drawn by chance.
    const double pixels = double(scene.size_px.x) * scene.size_px.y;
    double fourth_powers = 0;
    for (uint32_t y = 0; y < scene.size_px.y; ++y)
        for (uint32_t x = 0; x < scene.size_px.x; ++x) {
            double square = 0;
            for (size_t c = 0; c < 3; ++c) {
                const double off = double{hurried.at(x, y, c)} - double{full->eyes[0].at(x, y, c)};
                square += off * off / 3.0;
            }
            fourth_powers += square * square / pixels;
        }
    const double spread = std::sqrt(fourth_powers - error * error * error * error);
    EXPECT_NEAR(squares, error * error, 4.0 * spread / std::sqrt(pixels / kFrames));
}

TEST_F(InteractiveTest, ComesToRestAtFullQuality) {
    for (const bool stereo : {false, true}) {
        Scene scene = scene_of(RayMode::iso);
        if (stereo)
            scene.stereo = StereoSettings{};
        Renderer renderer(device());
        const Result<Frame> full = renderer.render(scene, phantom());
        ASSERT_TRUE(full);
        Interactive interactive(renderer, 1e-3); // a row of tiles a frame
        Result<InteractiveFrame> frame = interactive.draw(scene, phantom());
        ASSERT_TRUE(frame);
        EXPECT_FALSE(frame->complete);
        int frames = 0;
        while (!frame->complete && frames < 100) {
            frame = interactive.draw(scene, phantom());
            ASSERT_TRUE(frame);
            ++frames;
        }
        EXPECT_EQ(frames, static_cast<int>(Renderer::tile_rows(scene)));
        EXPECT_EQ(frame->error_estimate, 0.0);
        const std::vector<Image> rested = renderer.read_back();
        for (size_t eye = 0; eye < rested.size(); ++eye)
            EXPECT_EQ(rested[eye].samples, full->eyes[eye].samples);
    }
}

// A mesh that has moved, as a tool in the hand does, under the same scene.
TEST_F(InteractiveTest, OfAMeshThatHasMovedThePictureIsTheNewOne) {
    Scene scene = scene_of(RayMode::iso);
    scene.surfaces = {SurfaceLayer{}};
    SceneData data = phantom();
    const auto at = [](double x_mm) {
        const float x = static_cast<float>(x_mm);
        Mesh mesh{.positions = {{x, -150, -40}, {x + 60, -150, -40}, {x, -150, 40}},
                  .triangles = {{0, 1, 2}, {0, 2, 1}}};
        return std::make_shared<const Mesh>(std::move(mesh));
    };
    Renderer renderer(device());
    Interactive interactive(renderer, 1e6);
    for (const double x_mm : {-60.0, 10.0}) {
        data.meshes = {at(x_mm)};
        Result<InteractiveFrame> frame = interactive.draw(scene, data);
        ASSERT_TRUE(frame);
        EXPECT_FALSE(frame->complete) << "another picture than before";
        for (uint32_t row = 0; row < Renderer::tile_rows(scene) && !frame->complete; ++row) {
            frame = interactive.draw(scene, data);
            ASSERT_TRUE(frame);
        }
        EXPECT_TRUE(frame->complete);
        const Image seen = renderer.read_back()[0];
        Renderer fresh(device());
        EXPECT_EQ(seen.samples, fresh.render(scene, data).value().eyes[0].samples);
    }
}

// A part slower than the budget is drawn anew where a picture from fewer rays takes as long.
TEST_F(InteractiveTest, APartIsDrawnAnewRatherThanAllFromFewerRays) {
    Scene scene = scene_of(RayMode::iso);
    scene.surfaces = {SurfaceLayer{}};
    SceneData data = phantom();
    const auto same_mesh = [] {
        return std::make_shared<const Mesh>(
            Mesh{.positions = {{0, -150, -40}, {60, -150, -40}, {0, -150, 40}},
                 .triangles = {{0, 1, 2}, {0, 2, 1}}});
    };
    Renderer renderer(device());
    Interactive interactive(renderer, 1e9);
    interactive.set_times(ten_ms);
    data.meshes = {same_mesh()};
    EXPECT_GE(interactive.draw(scene, data).value().px_per_ray, 2u);
    for (int i = 0; i < 4; ++i) { // the first waits for its pipeline, the second tells its time
        if (i == 2)
            interactive.set_budget_ms(1.0);
        data.meshes = {same_mesh()};
        EXPECT_EQ(interactive.draw(scene, data, PixelBox{{8, 8}, {16, 16}}).value().px_per_ray, 1u);
    }
}

TEST_F(InteractiveTest, TakesFewerRaysUnderPressureAndMoreAgain) {
    Scene scene = scene_of(RayMode::alpha);
    Renderer renderer(device());
    Interactive interactive(renderer, 1.0);
    interactive.set_times(ten_ms);
    uint32_t px_per_ray = 0;
    bool coarsest = false;
    for (int i = 0; i < 9; ++i) {
        scene.camera = orbit(scene.camera, 5.0);
        const Result<InteractiveFrame> frame = interactive.draw(scene, phantom());
        ASSERT_TRUE(frame);
        EXPECT_GE(frame->px_per_ray, px_per_ray);
        px_per_ray = frame->px_per_ray;
        coarsest = frame->coarsest;
    }
    EXPECT_EQ(px_per_ray, 16u);
    EXPECT_TRUE(coarsest) << "and says so";
    interactive.set_budget_ms(1e9);
    double factor = 0;
    for (int i = 0; i < 9; ++i) {
        scene.camera = orbit(scene.camera, 5.0);
        const Result<InteractiveFrame> frame = interactive.draw(scene, phantom());
        ASSERT_TRUE(frame);
        EXPECT_LE(frame->px_per_ray, px_per_ray);
        px_per_ray = frame->px_per_ray;
        factor = frame->step_factor;
    }
    EXPECT_EQ(factor, 1.0);
    EXPECT_EQ(px_per_ray, 2u);
}

// Time beyond the budget is taken for a picture that errs by more than the aim, and for none else.
TEST_F(InteractiveTest, TakesTheTimeThatItsAimNeeds) {
    Scene scene = scene_of(RayMode::alpha);
    Renderer renderer(device());
    for (const double aim : {1e-9, 0.01, 1.0}) {
        SCOPED_TRACE(aim);
        Interactive interactive(renderer, 1.0);
        interactive.set_times(ten_ms);
        interactive.set_aim(aim, 1e9);
        for (int i = 0; i < 12; ++i) {
            scene.camera = orbit(scene.camera, 5.0);
            const Result<InteractiveFrame> frame = interactive.draw(scene, phantom());
            ASSERT_TRUE(frame);
            if (aim == 1e-9) {
                EXPECT_EQ(frame->px_per_ray, 2u);
                EXPECT_EQ(frame->step_factor, 1.0);
            } else if (aim == 0.01 && i > 8) { // or about to be: a level is tried before it is left
                EXPECT_TRUE(frame->error_estimate < 3.0 * aim) << frame->error_estimate;
            } else if (aim == 1.0 && i > 8) {
                EXPECT_TRUE(frame->coarsest);
            }
        }
    }
}

// Every second pixel, the listed ones, the sparse ones and those of the picture at rest.
TEST_F(InteractiveTest, OfABrickAtlasItIsTheSameToTheBit) {
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso})
        for (const bool slices : {false, true}) {
            if (slices && mode != RayMode::alpha)
                continue;
            SCOPED_TRACE(testing::Message() << static_cast<int>(mode) << " slices " << slices);
            Scene scene = scene_of(mode);
            scene.size_px = size_or_half({71, 58});
            scene.ray_cast->integrator = Integrator::preintegrated;
            if (slices) {
                scene.slices = {{{0, 0, -20}, {0, 0.2, 1}, Interpolation::linear, 8.0}};
                scene.slice_transfer = window_function(-1000, 1000, 1.0);
            }
            Renderer dense(device(),
                           {.residency = Residency::dense, .sampling = Sampling::by_hand});
            Renderer atlas(device(),
                           {.residency = Residency::atlas, .sampling = Sampling::by_hand});
            const CoarseSettings settings{.step_factor = 3.0};
            for (int frame = 0; frame < 2; ++frame) {
                const Result<FrameStats> a = dense.draw(scene, phantom(), settings);
                const Result<FrameStats> b = atlas.draw(scene, phantom(), settings);
                ASSERT_TRUE(a && b) << (a ? b.error().message : a.error().message);
                EXPECT_FALSE(a->atlas);
                EXPECT_TRUE(b->atlas);
                EXPECT_EQ(a->coarse->error_estimate, b->coarse->error_estimate);
                EXPECT_EQ(a->coarse->traced_share, b->coarse->traced_share);
                EXPECT_EQ(dense.read_back()[0].samples, atlas.read_back()[0].samples);
                if (!slices) {
                    EXPECT_EQ(b->uploaded_bricks > 0, frame == 0);
                }
            }
            const uint32_t rows = Renderer::tile_rows(scene);
            ASSERT_TRUE(atlas.draw(scene, phantom(), TileRows{0, rows / 2}));
            ASSERT_TRUE(atlas.draw(scene, phantom(), TileRows{rows / 2, rows - rows / 2}));
            const Result<Frame> full = dense.render(scene, phantom());
            ASSERT_TRUE(full) << full.error().message;
            EXPECT_EQ(atlas.read_back()[0].samples, full->eyes[0].samples);
        }
}

TEST_F(InteractiveTest, IsRefusedWhereTheVolumeIsMarchedInParts) {
    // 5 x 2 x 2 bricks, none of them constant; one and its neighbours are 12 at most.
    const Grid grid = make_grid({160, 64, 64}, {1, 1, 1}, {-80, -32, -32});
    const SceneData data{
        make_volume(grid, ScalarType::i16, [](glm::uvec3 i) { return 5.0 * (i.x + i.y + i.z); }),
        std::nullopt};
    const Scene scene = scene_of(RayMode::mip);
    Renderer renderer(device(), {.residency = Residency::atlas, .most_resident_bricks = 12});
    const Result<Frame> full = renderer.render(scene, data);
    ASSERT_TRUE(full) << full.error().message;
    EXPECT_GT(full->stats.parts, 1u);
    const Result<FrameStats> coarse = renderer.draw(scene, data, CoarseSettings{});
    ASSERT_FALSE(coarse);
    EXPECT_EQ(coarse.error().message,
              "an interactive frame: expected room on the device for the 20 bricks that can be "
              "seen, found room for 12");
    EXPECT_FALSE(renderer.draw(scene, data, TileRows{0, 1}));
    EXPECT_EQ(renderer.read_back()[0].samples, full->eyes[0].samples); // nothing was drawn
}

} // namespace
} // namespace palpate
