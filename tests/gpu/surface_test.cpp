// Meshes on the GPU against their twin in double, and what must not change a picture of them.
//
// Where GPU and twin may differ. Position: a corner moves by a few units in the last place of its
// camera coordinates, 2^-22 of 500 mm, a thousandth of a pixel of these pictures; so each pixel is
// that of the twin or that of the twin's rays within 1/256 pixel. Colour: the cosine keeps 16 bits,
// 2^-17, which light multiplies by diffuse + specular * shininess, below 2.8; colours of
// see-through triangles keep 16 bits as well, each layer adding 2^-17.

#include "tests/gpu/surface_scenes.h"

namespace palpate {
namespace {

using namespace testing_meshes;

// SurfaceTest takes over 5 s of a processor: a CPU driver draws each picture, and the twin draws it
// in double.
TEST_F(SurfaceTest, OpaqueMeshes) {
    Mesh rotated = box({-18, -10, -6}, {12, 9, 20}, 3);
    rotated.world_from_mesh = {{0.8, 0.6, 0, 0}, {-0.6, 0.8, 0, 0}, {0, 0, 1, 0}, {4, -3, 2, 1}};
    const SceneData data = data_with({torus_mesh({0, 0, 0}, 24, 9), rotated});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}), layer({0.3, 0.6, 0.9})});
    expect_like_twin(scene, data);
    scene.surfaces[0].smooth = false;
    scene.stereo = StereoSettings{{8.0, 160.0}, StereoLayout::separate};
    expect_like_twin(scene, data);
    scene.camera.projection = Projection::orthographic;
    scene.camera.view_height_mm = 80.0;
    expect_like_twin(scene, data);
}

TEST_F(SurfaceTest, SeeThroughMeshesAreBlendedInOrder) {
    const SceneData data = data_with({torus_mesh({0, 0, 0}, 22, 8), torus_mesh({6, 0, 4}, 20, 7)});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.4), layer({0.3, 0.6, 0.9}, 0.6)});
    expect_like_twin(scene, data);
    scene.surface_depth = 2;
    expect_like_twin(scene, data);
    add_slices(scene);
    scene.surface_depth = 8;
    expect_like_twin(scene, data, kBound + 1.0 / 4095.0);
}

TEST_F(SurfaceTest, RaysAreMarchedAmongMeshesAndSlices) {
    const SceneData data =
        data_with({torus_mesh({0, 0, 0}, 18, 7), box({-4, -35, -12}, {8, -6, 9})});
    for (const RayMode mode : {RayMode::alpha, RayMode::mip, RayMode::iso})
        for (const double opacity : {0.45, 1.0}) {
            Scene scene = scene_of({layer({0.9, 0.5, 0.3}, opacity), layer({0.3, 0.6, 0.9})});
            add_rays(scene, mode);
            expect_like_twin(scene, data, ray_bound(scene, data));
            add_slices(scene);
            scene.ray_cast->jitter_seed = 5;
            expect_like_twin(scene, data, ray_bound(scene, data));
        }
}

TEST_F(SurfaceTest, IntegratorExactAmongMeshes) {
    const SceneData data = data_with({torus_mesh({0, 0, 0}, 18, 7)});
    for (const RayMode mode : {RayMode::alpha, RayMode::iso}) {
        Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.45)});
        add_rays(scene, mode);
        scene.ray_cast->integrator = Integrator::exact;
        expect_like_twin(scene, data, ray_bound(scene, data));
    }
}

TEST_F(SurfaceTest, CapsCloseWhatClipPlanesCut) {
    Mesh mirrored = torus_mesh({0, 0, 0}, 20, 9);
    mirrored.world_from_mesh[0][0] = -1.0; // turns triangles inside out, and the mesh back
    for (auto& t : mirrored.triangles)
        std::swap(t.y, t.z);
    for (const double opacity : {1.0, 0.4})
        for (const bool turned : {false, true}) {
            const Mesh outer = turned ? mirrored : torus_mesh({0, 0, 0}, 20, 9);
            const SceneData data = data_with({outer, torus_mesh({0, 0, 0}, 20, 4)});
            Scene scene = scene_of({layer({0.9, 0.5, 0.3}, opacity), layer({0.3, 0.6, 0.9})});
            scene.clip_planes = {{{2, -3, 0}, {0.2, 1, 0}}, {{0, 0, 4}, {0, 0.1, -1}}};
            expect_like_twin(scene, data);
            add_rays(scene, RayMode::iso);
            expect_like_twin(scene, data, ray_bound(scene, data));
        }
}

TEST_F(SurfaceTest, LabelsHaveStylesAndCaps) {
    Mesh mesh;
    append(mesh, box({-20, -15, -10}, {0, 15, 10}, 4), 1);
    append(mesh, box({0, -15, -10}, {20, 15, 10}, 4), 7); // a wall of both at x = 0
    append(mesh, box({-8, -20, 12}, {8, 20, 18}, 2), 3);
    const SceneData data = data_with({mesh});
    Scene scene = scene_of({{{}, {{}, {{0.8, 0.2, 0.2}, 0.5}, {}, {{1, 1, 0}, 0.0}}, {}, true}});
    expect_like_twin(scene, data);
    scene.clip_planes = {{{0, -4, 0}, {0, 1, 0.2}}};
    expect_like_twin(scene, data);
    for (const Image& image : drawn(scene, data)) {
        bool seven = false, three = false;
        for (uint32_t y = 0; y < image.size_px.y; ++y)
            for (uint32_t x = 0; x < image.size_px.x; ++x) {
                seven = seven || image.at(x, y, 4) == 7.0f;
                three = three || image.at(x, y, 4) == 3.0f;
            }
        EXPECT_TRUE(seven);
        EXPECT_FALSE(three) << "a label that is not shown";
    }
}

// The same two labels with one wall between them: seen from either side, cut, and with one of them
// out of sight.
TEST_F(SurfaceTest, SharedWallsShowTheLabelBehindThem) {
    Mesh mesh;
    append(mesh, box({-20, -15, -10}, {0, 15, 10}, 4), 1);
    append(mesh, box({0, -15, -10}, {20, 15, 10}, 4), 7);
    Mesh walls{.positions = mesh.positions};
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
        const glm::uvec3 t = mesh.triangles[i];
        const bool wall =
            mesh.positions[t.x].x == 0 && mesh.positions[t.y].x == 0 && mesh.positions[t.z].x == 0;
        if (wall && mesh.labels[i] == 7)
            continue;
        walls.triangles.push_back(t);
        walls.labels.push_back(mesh.labels[i]);
        walls.outer_labels.push_back(wall ? 7 : 0);
    }
    const SceneData data = data_with({walls});
    const SurfaceStyle red{{0.8, 0.2, 0.2}, 1.0}, hidden{{1, 1, 0}, 0.0}, glass{{0, 1, 0}, 0.4};
    for (const SurfaceStyle& one : {red, hidden, glass}) {
        Scene scene = scene_of({{{{}, 0.5}, {{}, one}, {}, true}});
        scene.camera.eye_mm.x = -90;
        expect_like_twin(scene, data);
        scene.clip_planes = {{{0, -4, 0}, {0.3, 1, 0.2}}};
        expect_like_twin(scene, data);
        scene.camera.eye_mm.x = 90;
        expect_like_twin(scene, data);
    }
}

// Large triangles run through the plane of the eye, and small ones behind it.
TEST_F(SurfaceTest, EyeWithinAMesh) {
    const SceneData data = data_with({box({-60, -60, -60}, {60, 60, 60}), torus_mesh({}, 24, 9)});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}), layer({0.3, 0.6, 0.9}, 0.5)});
    scene.camera.view_angle_deg = 95.0;
    for (const glm::dvec3 eye : {glm::dvec3(25, 1, 2), glm::dvec3(-40, 30, 20)}) {
        scene.camera.eye_mm = eye;
        scene.camera.target_mm = {-3, -20, 5};
        expect_like_twin(scene, data);
    }
}

} // namespace
} // namespace palpate
