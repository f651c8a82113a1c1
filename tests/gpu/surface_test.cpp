// Meshes on the GPU against their twin in double, and what must not change a picture of them.
//
// Where GPU and twin may differ. Position: a corner moves by a few units in the last place of its
// camera coordinates, 2^-22 of 500 mm, a thousandth of a pixel of these pictures; so each pixel is
// that of the twin or that of the twin's rays within 1/256 pixel. Colour: the cosine keeps 16 bits,
// 2^-17, which light multiplies by diffuse + specular * shininess, below 2.8; colours of
// see-through triangles keep 16 bits as well, each layer adding 2^-17.

#include <algorithm>
#include <random>
#include <span>

#include "engine/reference/twin.h"
#include "engine/scene/presets.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/surface_meshes.h"

namespace palpate {
namespace {

using namespace testing_meshes;

constexpr double kBound = 2.8 * 0x1p-17 + 8 * 0x1p-17 + 0x1p-20;

// A ball of 20 mm in a box of 60 mm, on slices of uneven spacing.
Volume ball_volume() {
    const Grid grid = make_grid({61, 61, 21}, {1, 1, 3}, glm::dvec3(-30.0));
    return sample(synthetic::gaussian({}, 12.0), grid, ScalarType::f32);
}

SceneData data_with(std::vector<Mesh> meshes) {
    SceneData data{ball_volume(), std::nullopt, {}};
    for (Mesh& mesh : meshes)
        data.meshes.push_back(shared(std::move(mesh)));
    return data;
}

Scene scene_of(std::vector<SurfaceLayer> surfaces) {
    Scene scene;
    scene.size_px = {80, 72};
    scene.camera.eye_mm = {70.0, -150.0, 60.0};
    scene.background = {0.25, 0.125, 0.5};
    scene.value_and_depth = true;
    scene.surfaces = std::move(surfaces);
    return scene;
}

SurfaceLayer layer(glm::dvec3 color, double opacity = 1.0) {
    return {{color, opacity}, {}, {}, true};
}

void add_slices(Scene& scene) {
    scene.slice_transfer = window_function(0.0, 1000.0, 1.0);
    scene.slices = {SliceLayer{}, SliceLayer{{3.0, 0.0, 0.0}, {1.0, 0.3, 0.0}}};
}

void add_rays(Scene& scene, RayMode mode) {
    RayCastLayer rays;
    rays.mode = mode;
    rays.transfer = window_function(100.0, 1000.0, mode == RayMode::mip ? 1.0 : 0.05);
    rays.step_mm = 0.7;
    rays.min_transmittance = 0.0;
    rays.isos = {{400.0, {0.4, 0.9, 0.5}, 0.5}, {700.0}};
    scene.ray_cast = rays;
}

// Largest difference of samples that are neighbours along each axis.
glm::dvec3 steepest(const Volume& volume) {
    glm::dvec3 most(0.0);
    const glm::uvec3 size = volume.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                for (int a = 0; a < 3; ++a) {
                    glm::uvec3 next(x, y, z);
                    if (++next[a] < size[a])
                        most[a] = std::max<double>(
                            most[a], std::abs(volume.value(next) - volume.value({x, y, z})));
                }
    return most;
}

// How far a pixel with ray casting may be off: what its rays may be (twin_test.cpp, exact_test.cpp)
// of the ball of ball_volume(), what its meshes may be, and what the places where meshes part the
// rays are worth.
double ray_bound(const Scene& scene, const SceneData& data) {
    const RayCastLayer& rays = *scene.ray_cast;
    const Grid& grid = data.volume.grid();
    const glm::dvec3 size(grid.size), eye = index_point(grid, scene.camera.eye_mm);
    const bool exact = rays.integrator == Integrator::exact;
    // A place: origin, direction, distance and their sum are rounded in texture coordinates, all
    // below twice the eye's own; the exact integrator works in samples from the entry on. A value:
    // that times the steepest difference on each axis, and the roundings of interpolation.
    double value = 10.0 * 0x1p-24 * 1000.0;
    const glm::dvec3 steep = steepest(data.volume);
    for (int a = 0; a < 3; ++a)
        value += steep[a] * 0x1p-24 *
                 (exact ? 4.0 * (glm::length(eye) + glm::length(size)) + 10.0 * glm::length(size)
                        : 8.0 * size[a] * (1.0 + std::abs(eye[a]) / size[a]));
    // One entry further in the table, or with `exact` up to four and what the value is off.
    const TransferTable table = make_table(rays.transfer);
    double color = 0.0, tau = 0.0;
    for (size_t i = 1; i < table.entries.size(); ++i) {
        const glm::vec4 d = glm::abs(table.entries[i] - table.entries[i - 1]);
        color = std::max<double>(color, std::max({d.x, d.y, d.z}));
        tau = std::max<double>(tau, d.w);
    }
    const double entry = (table.high - table.low) / static_cast<double>(table.entries.size() - 1);
    const double entries =
        exact ? 4.0 + 2.0 * (value / entry + 1.0 / 256.0) : 1.0 + std::floor(value / entry);
    const double length_mm = glm::length(size * spacing_mm(grid));
    const double pieces = exact ? 3.0 * glm::length(size) : length_mm / rays.step_mm;
    const double slices = scene.slices.empty() ? 0.0 : 1.0 / 4095.0;
    const double meshes = kBound + slices;
    if (rays.mode == RayMode::mip)
        return meshes + 2.0 * entries * color; // of the colour, and of the opacity
    if (rays.mode == RayMode::alpha) {
        // A mesh's depth is good to 2^-20 of at most 200 mm, and as much again where it slants; up
        // to eight layers, one opaque mesh and two slices part a ray, at the densest tau a mm.
        const double parted = 11 * 2 * 200 * 0x1p-20 * table.entries.back().w;
        return meshes + entries * (color + tau * length_mm) + pieces * 0x1p-23 + parted;
    }
    // A normal: each of three differences of values over two spacings of at least 1 mm is off by
    // the value's error, over the gradient's length: v r / 12^2 where the Gaussian is v at r, of
    // which samples 3 mm apart leave nine tenths (3^2 / 12^2 = 1 / 16, times 1.5 at the most). The
    // place of a hit moves by value / slope, which turns the normal by that over the radius.
    double angle = 0.0;
    for (const IsoSurface& iso : rays.isos) {
        const double r = 12.0 * std::sqrt(2.0 * std::log(1000.0 / iso.value));
        const double slope = 0.9 * iso.value * r / 144.0;
        angle = std::max(angle, std::sqrt(3.0) * value / slope + value / slope / r);
    }
    const Shading shading;
    return meshes + (shading.diffuse + shading.specular * shading.shininess) * angle + 0x1p-20;
}

class SurfaceTest : public GpuTest {
 protected:
    // As a device that has no atomic operations on 64 bits.
    static GpuDevice& narrow_device() {
        static GpuDevice instance({.validation = true, .int64_atomics = false});
        return instance;
    }

    static std::vector<Image> drawn_on(GpuDevice& which, const Scene& scene, const SceneData& data,
                                       RendererOptions options) {
        Renderer renderer(which, std::move(options));
        Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        return frame ? std::move(frame->eyes) : std::vector<Image>{};
    }

    // Without 64 bits at a time not a bit of the picture is another.
    static std::vector<Image> drawn(const Scene& scene, const SceneData& data,
                                    const RendererOptions& options = {}) {
        std::vector<Image> eyes = drawn_on(device(), scene, data, options);
        if (!device().has_int64_atomics())
            return eyes; // they are drawn so already
        EXPECT_FALSE(narrow_device().has_int64_atomics());
        const std::vector<Image> narrow = drawn_on(narrow_device(), scene, data, options);
        EXPECT_EQ(narrow.size(), eyes.size());
        for (size_t i = 0; i < std::min(eyes.size(), narrow.size()); ++i)
            EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(eyes[i].samples)),
                                           std::as_bytes(std::span(narrow[i].samples))));
        EXPECT_TRUE(narrow_device().validation_messages().empty());
        return eyes;
    }

    static double difference(const Image& image, uint32_t x, uint32_t y, const PixelSample& twin) {
        double largest = 0.0;
        for (int c = 0; c < 4; ++c)
            largest = std::max(largest, std::abs(image.at(x, y, c) - twin.rgba[c]));
        const double depth = image.at(x, y, 5);
        if (std::isnan(depth) != std::isnan(twin.depth))
            return 1.0;
        // 2^-20 of the distance, and as much again across a slanted triangle.
        return std::isnan(depth) || std::abs(depth - twin.depth) <= 1e-4 * (1.0 + depth) ? largest
                                                                                         : 1.0;
    }

    // How many pixels are neither the twin's nor those of its rays close by.
    static void expect_like_twin(const Scene& scene, const SceneData& data, double bound = kBound) {
        const std::vector<Image> eyes = drawn(scene, data);
        size_t wrong = 0, doubtful = 0;
        double worst = 0.0;
        for (size_t eye = 0; eye < eyes.size(); ++eye) {
            const auto number = static_cast<int>(eye);
            const Image twin = render_twin(scene, data, number);
            for (uint32_t y = 0; y < scene.size_px.y; ++y)
                for (uint32_t x = 0; x < scene.size_px.x; ++x) {
                    PixelSample same;
                    for (int c = 0; c < 4; ++c)
                        same.rgba[c] = twin.at(x, y, c);
                    same.depth = twin.at(x, y, 5);
                    double least = difference(eyes[eye], x, y, same);
                    if (least > bound) {
                        ++doubtful;
                        for (int side = 0; side < 9 && least > bound; ++side) {
                            const glm::dvec2 beside(side % 3 - 1, side / 3 - 1);
                            const glm::dvec2 at = glm::dvec2(x, y) + beside / 256.0;
                            least = std::min(
                                least,
                                difference(eyes[eye], x, y, twin_pixel(scene, data, at, number)));
                        }
                    }
                    wrong += least > bound;
                    if (least <= bound)
                        worst = std::max(worst, least);
                }
        }
        std::printf("    bound %.1e, worst %.1e, %zu on edges, %zu wrong\n", bound, worst, doubtful,
                    wrong);
        EXPECT_EQ(wrong, 0u);
    }
};

TEST_F(SurfaceTest, OpaqueMeshes) {
    Mesh rotated = box({-18, -10, -6}, {12, 9, 20}, 3);
    rotated.world_from_mesh = {{0.8, 0.6, 0, 0}, {-0.6, 0.8, 0, 0}, {0, 0, 1, 0}, {4, -3, 2, 1}};
    const SceneData data = data_with({torus({0, 0, 0}, 24, 9), rotated});
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
    const SceneData data = data_with({torus({0, 0, 0}, 22, 8), torus({6, 0, 4}, 20, 7)});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.4), layer({0.3, 0.6, 0.9}, 0.6)});
    expect_like_twin(scene, data);
    scene.surface_depth = 2;
    expect_like_twin(scene, data);
    add_slices(scene);
    scene.surface_depth = 8;
    expect_like_twin(scene, data, kBound + 1.0 / 4095.0);
}

TEST_F(SurfaceTest, RaysAreMarchedAmongMeshesAndSlices) {
    const SceneData data = data_with({torus({0, 0, 0}, 18, 7), box({-4, -35, -12}, {8, -6, 9})});
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
    const SceneData data = data_with({torus({0, 0, 0}, 18, 7)});
    for (const RayMode mode : {RayMode::alpha, RayMode::iso}) {
        Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.45)});
        add_rays(scene, mode);
        scene.ray_cast->integrator = Integrator::exact;
        expect_like_twin(scene, data, ray_bound(scene, data));
    }
}

TEST_F(SurfaceTest, CapsCloseWhatClipPlanesCut) {
    Mesh mirrored = torus({0, 0, 0}, 20, 9);
    mirrored.world_from_mesh[0][0] = -1.0; // turns triangles inside out, and the mesh back
    for (auto& t : mirrored.triangles)
        std::swap(t.y, t.z);
    for (const double opacity : {1.0, 0.4})
        for (const bool turned : {false, true}) {
            const Mesh outer = turned ? mirrored : torus({0, 0, 0}, 20, 9);
            const SceneData data = data_with({outer, torus({0, 0, 0}, 20, 4)});
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
    const SceneData data = data_with({box({-60, -60, -60}, {60, 60, 60}), torus({}, 24, 9)});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}), layer({0.3, 0.6, 0.9}, 0.5)});
    scene.camera.view_angle_deg = 95.0;
    for (const glm::dvec3 eye : {glm::dvec3(25, 1, 2), glm::dvec3(-40, 30, 20)}) {
        scene.camera.eye_mm = eye;
        scene.camera.target_mm = {-3, -20, 5};
        expect_like_twin(scene, data);
    }
}

TEST_F(SurfaceTest, OrderOfTrianglesAndTwoRunsChangeNoBit) {
    Mesh mesh = torus({0, 0, 0}, 22, 8, 200, 100);
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

// More triangles at one depth than a pixel keeps: those with the smallest numbers stay.
TEST_F(SurfaceTest, OfTrianglesThatCoincideTheFirstAreKept) {
    const Mesh mesh = torus({0, 0, 0}, 22, 8);
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

// Of triangles with a common edge or corner exactly one is met by a ray that runs through it: on a
// grid whose lines and points the rays of all pixels hit exactly, every pixel has one layer.
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
    SceneData data = data_with({torus({0, 0, 0}, 22, 8)});
    const Image near = drawn(scene, data)[0];
    const glm::dvec3 away(1e7, -3e6, 2e6);
    Mesh mesh = torus({0, 0, 0}, 22, 8);
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
    data.meshes = {shared(torus({0, 0, 0}, 18, 7)), shared(box({-4, -35, -12}, {8, -6, 9}))};
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

// What a scene does not use is not there.
TEST_F(SurfaceTest, ASceneHoldsWhatItShowsAndNothingElse) {
    const auto has = [](std::string_view part) {
        const auto& all = device().resources();
        return std::any_of(all.begin(), all.end(), [&](const ResourceInfo& r) {
            return r.kind != "pipeline" && r.name.find(part) != std::string::npos;
        });
    };
    const SceneData data = data_with({torus({0, 0, 0}, 22, 8)});
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
    const SceneData data = data_with({torus({0, 0, 0}, 18, 7), box({-4, -35, -12}, {8, -6, 9})});
    Scene scene = scene_of({layer({0.9, 0.5, 0.3}, 0.45), layer({0.3, 0.6, 0.9})});
    scene.value_and_depth = false;
    add_rays(scene, RayMode::alpha);
    const Image full = drawn(scene, data)[0];
    Renderer renderer(device());
    const Result<CoarseStats> coarse = renderer.draw_coarse(scene, data, {});
    ASSERT_TRUE(coarse) << coarse.error().message;
    // The rays it is held against, kJudgedSpacing_px apart both ways, are those of the full
    // picture, bit by bit, among meshes too. So the estimate is the error of these pixels but for
    // floats: a difference, three squares, two sums and a division round by 2^-24 each, of the
    // square at most seven of them, of its root half of that.
    const Image hurried = renderer.read_back()[0];
    double squares = 0.0;
    int rays = 0;
    for (uint32_t y = coarse->first_judged.y; y < scene.size_px.y; y += kJudgedSpacing_px)
        for (uint32_t x = coarse->first_judged.x; x < scene.size_px.x;
             x += kJudgedSpacing_px, ++rays)
            for (size_t c = 0; c < 3; ++c) {
                const double off = double{hurried.at(x, y, c)} - double{full.at(x, y, c)};
                squares += off * off / 3.0;
            }
    const double error = std::sqrt(squares / rays);
    EXPECT_GT(error, 0.0);
    EXPECT_NEAR(coarse->error_estimate, error, 4.0 * 0x1p-24 * error);
    ASSERT_TRUE(renderer.refine(scene, data, 0, Renderer::tile_rows(scene)));
    EXPECT_EQ(renderer.read_back()[0].samples, full.samples);
}

} // namespace
} // namespace palpate
