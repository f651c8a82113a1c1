// Changes that must not change a bit of a picture of meshes, and what drawing them holds.

#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/gpu/surface_scenes.h"

namespace palpate {
namespace {

using namespace testing_meshes;

TEST_F(SurfaceTest, OrderOfTrianglesAndTwoRunsChangeNoBit) {
    Mesh mesh = torus_mesh({0, 0, 0}, 22, 8, 200, 100);
    SceneData data = data_with({mesh});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.4)});
    scene.value_and_depth = false;
    scene.clip_planes = {{{0, -4, 0}, {0, 1, 0.2}}};
    const std::vector<Image> first = drawn(scene, data);
    EXPECT_EQ(drawn(scene, data)[0].samples, first[0].samples);
    std::mt19937 random(7);
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
    data.meshes = {shared(mesh)};
    EXPECT_EQ(drawn(scene, data)[0].samples, first[0].samples);
}

// Only rows of pixels in which a mesh can be seen are looked at. A vertex that no triangle has lies
// behind the eye: then all rows are, and the picture is the same.
TEST_F(SurfaceTest, RowsThatNoMeshReachesChangeNoBit) {
    Mesh small = torus_mesh({4, 0, 11}, 6, 3);
    small.world_from_mesh = {{0.8, 0.6, 0, 0}, {-0.6, 0.8, 0, 0}, {0, 0, 1, 0}, {4, -3, 2, 1}};
    const auto wide = [](Mesh mesh) {
        mesh.positions.push_back({70.0f, -400.0f, 60.0f});
        if (!mesh.normals.empty())
            mesh.normals.push_back({1.0f, 0.0f, 0.0f});
        return mesh;
    };
    Mesh away = small; // out of the picture
    away.world_from_mesh[3] = {0.0, 0.0, 300.0, 1.0};
    Mesh cut = small; // by the picture's edge
    cut.world_from_mesh[3].z += 36.0;
    const auto expect_same = [&](const Scene& scene, const Mesh& mesh) {
        const std::vector<Image> found = drawn(scene, data_with({mesh}));
        const std::vector<Image> expected = drawn(scene, data_with({wide(mesh)}));
        ASSERT_EQ(found.size(), expected.size());
        for (size_t eye = 0; eye < found.size(); ++eye)
            for (size_t i = 0; i < found[eye].samples.size(); ++i)
                ASSERT_EQ(std::bit_cast<uint32_t>(found[eye].samples[i]),
                          std::bit_cast<uint32_t>(expected[eye].samples[i]))
                    << eye << ", sample " << i;
    };
    for (const Mesh& mesh : {small, away, cut}) {
        Scene scene = scene_of({layer({0.9, 0.5, 0.3})});
        expect_same(scene, mesh);
        scene.clip_planes = {{{4, -3, 13}, {0.2, 1, 0}}};
        expect_same(scene, mesh);
        scene.stereo = StereoSettings{{8.0, 160.0}, StereoLayout::separate};
        add_slices(scene);
        expect_same(scene, mesh);
        add_rays(scene, RayMode::alpha);
        expect_same(scene, mesh);
        scene.camera.projection = Projection::orthographic;
        scene.camera.view_height_mm = 80.0;
        expect_same(scene, mesh);
        scene.surfaces = {layer({0.9, 0.5, 0.3}, 0.4)};
        expect_same(scene, mesh);
    }
}

// As of a tool among rays: it takes a part of what a mesh all over the picture does. Less than a
// half: it has a tenth of the rows, and drawing its triangles takes the same time. On a graphics
// card either takes what beginning a pass does.
TEST_F(SurfaceTest, ASmallMeshTakesLittleTime) {
    if (!device().info().is_cpu())
        GTEST_SKIP() << "a device on which pixels take no time";
    const Mesh small = torus_mesh({0, 0, 0}, 3, 1);
    Mesh wide = small;
    wide.positions.push_back({70.0f, -400.0f, 60.0f});
    if (!wide.normals.empty())
        wide.normals.push_back({1.0f, 0.0f, 0.0f});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3})});
    add_rays(scene, RayMode::alpha);
    scene.value_and_depth = false;
    scene.size_px = {400, 400};
    const auto least_ms = [&](const Mesh& mesh) {
        const SceneData data = data_with({mesh});
        Renderer renderer(device());
        double least = INFINITY;
        for (int i = 0; i < 7; ++i) {
            const FrameStats frame = renderer.draw(scene, data).value();
            for (const PassTime& pass : frame.passes)
                if (pass.name == std::string_view("surfaces"))
                    least = std::min(least, pass.gpu_ms);
        }
        return least;
    };
    const double small_ms = least_ms(small), wide_ms = least_ms(wide);
    EXPECT_LT(small_ms, 0.5 * wide_ms) << wide_ms;
}

// More triangles at one depth than a pixel keeps: those with the smallest numbers stay.
TEST_F(SurfaceTest, OfTrianglesThatCoincideTheFirstAreKept) {
    const Mesh mesh = torus_mesh({0, 0, 0}, 22, 8);
    Mesh thrice = mesh;
    for (int copy = 1; copy < 3; ++copy)
        thrice.triangles.insert(thrice.triangles.end(), mesh.triangles.begin(),
                                mesh.triangles.end());
    const SceneData data = data_with({mesh, thrice, mesh});
    Scene scene = scene_of(
        {layer({0.9, 0.5, 0.3}, 0.4), layer({0.3, 0.6, 0.9}, 0.6), layer({0.1, 0.9, 0.2}, 0.5)});
    scene.value_and_depth = false;
    for (const uint32_t depth : {2u, 4u, 8u}) {
        scene.surface_depth = depth;
        const std::vector<Image> all = drawn(scene, data);
        if (depth > 2)
            continue;
        // Two of five: the first mesh's, and the first of the second's.
        Scene two = scene;
        two.surfaces.pop_back();
        EXPECT_EQ(drawn(two, data_with({mesh, mesh}))[0].samples, all[0].samples);
    }
}

// A ray through a common edge or corner of triangles meets exactly one of them: on a grid whose
// lines and points the rays of all pixels hit exactly, every pixel has one layer.
TEST_F(SurfaceTest, RaysThroughEdgesAndCornersMeetOneTriangle) {
    Mesh mesh;
    for (uint32_t j = 0; j <= 64; ++j)
        for (uint32_t i = 0; i <= 64; ++i)
            mesh.positions.push_back({0.5f * i, 0.5f * j, 0.0f});
    for (uint32_t j = 0; j < 64; ++j)
        for (uint32_t i = 0; i < 64; ++i) {
            const uint32_t a = j * 65 + i, b = a + 1, c = a + 65, d = c + 1;
            if ((i + j) % 2 == 0) {
                mesh.triangles.push_back({a, b, d});
                mesh.triangles.push_back({a, d, c});
            } else {
                mesh.triangles.push_back({a, b, c});
                mesh.triangles.push_back({b, d, c});
            }
        }
    const SceneData data = data_with({mesh});
    Scene scene = scene_of({{{{1, 1, 1}, 0.5}, {}, {1.0, 0.0, 0.0, 1.0}, true}});
    scene.background = glm::dvec3(0.0);
    scene.size_px = {62, 62};
    scene.camera.projection = Projection::orthographic;
    scene.camera.target_mm = {16.0, 16.0, 0.0};
    scene.camera.eye_mm = {16.0, 16.0, 64.0};
    scene.camera.up = {0, 1, 0};
    scene.camera.view_height_mm = 31.0;      // half a millimetre a pixel
    for (const double shift : {0.0, 0.25}) { // centres of pixels on corners, or on diagonals
        scene.camera.target_mm.x = scene.camera.eye_mm.x = 16.25 + shift;
        scene.camera.target_mm.y = scene.camera.eye_mm.y = 16.25 + shift;
        const Image image = drawn(scene, data)[0];
        for (uint32_t y = 0; y < 62; ++y)
            for (uint32_t x = 0; x < 62; ++x)
                ASSERT_NEAR(image.at(x, y, 3), 0.5, 1e-4) << x << ", " << y;
    }
}

TEST_F(SurfaceTest, FarFromTheWorldsOriginThePictureIsTheSame) {
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.4)});
    scene.clip_planes = {{{0, -4, 0}, {0, 1, 0}}};
    SceneData data = data_with({torus_mesh({0, 0, 0}, 22, 8)});
    const Image near = drawn(scene, data)[0];
    const glm::dvec3 away(1e7, -3e6, 2e6);
    Mesh mesh = torus_mesh({0, 0, 0}, 22, 8);
    mesh.world_from_mesh[3] = glm::dvec4(away, 1.0);
    data.meshes = {shared(mesh)};
    scene.camera.eye_mm += away;
    scene.camera.target_mm += away;
    scene.clip_planes[0].point_mm += away;
    scene.value_and_depth = true;
    EXPECT_EQ(drawn(scene, data)[0].samples.size(), near.samples.size());
    const Image far = drawn(scene, data)[0];
    for (size_t i = 0; i < near.samples.size(); ++i)
        ASSERT_TRUE(far.samples[i] == near.samples[i] || std::isnan(near.samples[i]));
}

// A volume in an atlas is marched in parts; meshes are met in the part where they lie.
TEST_F(SurfaceTest, PartsOfAVolumeChangeNoBit) {
    const Grid grid = make_grid({150, 120, 130}, {0.5, 0.5, 0.5}, {-37.0, -30.0, -32.0});
    SceneData data{sample(synthetic::gaussian({}, 14.0), grid, ScalarType::f32), std::nullopt, {}};
    data.meshes = {shared(torus_mesh({0, 0, 0}, 18, 7)), shared(box({-4, -35, -12}, {8, -6, 9}))};
    for (const RayMode mode : {RayMode::alpha, RayMode::iso}) {
        Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.45), layer({0.3, 0.6, 0.9}, 0.7)});
        add_rays(scene, mode);
        scene.ray_cast->isos[0].value = 120.0; // seen in more bricks than there is room for
        const Image dense = drawn(scene, data, {.sampling = Sampling::by_hand})[0];
        Renderer renderer(device(), {.residency = Residency::atlas,
                                     .most_resident_bricks = 45u,
                                     .sampling = Sampling::by_hand});
        const Result<Frame> frame = renderer.render(scene, data);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_GT(frame->stats.parts, 1u);
        double worst = 0.0;
        for (uint32_t y = 0; y < dense.size_px.y; ++y)
            for (uint32_t x = 0; x < dense.size_px.x; ++x)
                for (size_t c = 0; c < 4; ++c)
                    worst = std::max<double>(
                        worst, std::abs(dense.at(x, y, c) - frame->eyes[0].at(x, y, c)));
        // As in atlas_test.cpp: two segments a part are cut, and each part's sum is rounded.
        EXPECT_LE(worst, static_cast<double>(frame->stats.parts) * 16 / (1 << 24) + 1e-6);
    }
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.45), layer({0.3, 0.6, 0.9}, 0.7)});
    add_rays(scene, RayMode::mip);
    Renderer renderer(device(), {.residency = Residency::atlas, .most_resident_bricks = 45});
    const Result<Frame> refused = renderer.render(scene, data);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("MIP"), std::string::npos);
}

// Resources that a scene does not use are not there.
TEST_F(SurfaceTest, ASceneHoldsWhatItShowsAndNothingElse) {
    drop_kept_renderers();
    const auto has = [](std::string_view part) {
        const auto& all = device().resources();
        return std::any_of(all.begin(), all.end(), [&](const ResourceInfo& r) {
            return r.kind != "pipeline" && r.name.find(part) != std::string::npos;
        });
    };
    const SceneData data = data_with({torus_mesh({0, 0, 0}, 22, 8)});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3})});
    Renderer renderer(device());
    ASSERT_TRUE(renderer.draw(scene, data));
    EXPECT_TRUE(has("surface 1 triangles"));
    EXPECT_FALSE(has("volume")) << "nothing shows voxels";
    EXPECT_FALSE(has("see-through") || has("clip planes") || has("labels"));
    scene.surfaces[0].style.opacity = 0.5;
    ASSERT_TRUE(renderer.draw(scene, data));
    EXPECT_TRUE(has("see-through triangles"));
    EXPECT_FALSE(has("see-through layers")) << "no rays to stand in the way of";
    const GpuDevice::Traffic before = device().traffic();
    scene.surfaces.clear();
    add_rays(scene, RayMode::iso);
    SceneData voxels = data;
    voxels.meshes.clear();
    ASSERT_TRUE(renderer.draw(scene, voxels));
    EXPECT_FALSE(has("surface") || has("triangles") || has("behind"));
    EXPECT_GT(device().traffic().uploads, before.uploads);
}

TEST_F(SurfaceTest, InteractiveFramesSettleOnTheFullPicture) {
    const SceneData data =
        data_with({torus_mesh({0, 0, 0}, 18, 7), box({-4, -35, -12}, {8, -6, 9})});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.45), layer({0.3, 0.6, 0.9})});
    scene.value_and_depth = false;
    add_rays(scene, RayMode::alpha);
    const Image full = drawn(scene, data)[0];
    Renderer renderer(device());
    const Result<FrameStats> coarse = renderer.draw(scene, data, CoarseSettings{});
    ASSERT_TRUE(coarse) << coarse.error().message;
    // The rays it is held against, kJudgedSpacing_px apart both ways, are those of the full
    // picture, bit by bit, among meshes too. So the estimate is the error of these pixels but for
    // floats: a difference, three squares, two sums and a division round by 2^-24 each, of the
    // square at most seven of them, of its root half of that.
    const Image hurried = renderer.read_back()[0];
    double squares = 0.0;
    int rays = 0;
    for (uint32_t y = coarse->coarse->first_judged.y; y < scene.size_px.y; y += kJudgedSpacing_px)
        for (uint32_t x = coarse->coarse->first_judged.x; x < scene.size_px.x;
             x += kJudgedSpacing_px, ++rays)
            for (size_t c = 0; c < 3; ++c) {
                const double off = double{hurried.at(x, y, c)} - double{full.at(x, y, c)};
                squares += off * off / 3.0;
            }
    const double error = std::sqrt(squares / rays);
    EXPECT_GT(error, 0.0);
    EXPECT_NEAR(coarse->coarse->error_estimate, error, 4.0 * 0x1p-24 * error);
    ASSERT_TRUE(renderer.draw(scene, data, TileRows{0, Renderer::tile_rows(scene)}));
    EXPECT_EQ(renderer.read_back()[0].samples, full.samples);
}

} // namespace
} // namespace palpate
