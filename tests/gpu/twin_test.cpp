// The GPU against its twin in double: same scene, same lattice.
//
// Where the two may differ, and by how much (derived, see bound_of()):
//   position  fp32 texture coordinates: a few units in the last place of the eye's own coordinate;
//   value     that, times the steepest difference of neighbouring samples;
//   entry     a value beside a boundary of the table may take the neighbouring entry: colours
//   change
//             by one entry's difference (weights add up to at most 1), optical depths by one
//             entry's difference at every sample.

#include <cmath>
#include <limits>

#include "engine/reference/twin.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/steepest.h"

namespace palpate {
namespace {

using namespace synthetic;

// A oblique_phantom on an oblique, uneven grid with one negative axis.
Grid oblique_grid(glm::uvec3 size) {
    const double angle = 0.3;
    Grid grid;
    grid.size = size;
    const glm::dvec3 spacing(1.6, 1.6, 3.2);
    glm::dmat3 turn(std::cos(angle), std::sin(angle), 0, -std::sin(angle), std::cos(angle), 0, 0, 0,
                    -1);
    for (int axis = 0; axis < 3; ++axis)
        grid.world_from_index[axis] = glm::dvec4(turn[axis] * spacing[axis], 0.0);
    const glm::dvec3 middle = turn * (0.5 * (glm::dvec3(size) - 1.0) * spacing);
    grid.world_from_index[3] = glm::dvec4(-middle, 1.0);
    return grid;
}

SceneData oblique_phantom() {
    const Grid grid = oblique_grid({120, 128, 60});
    return {sample(ct_phantom(), grid, ScalarType::i16), std::nullopt};
}

// A gentle transfer function, so that the bound of a whole ray stays tight.
Scene base_scene(const SceneData& data, RayMode mode) {
    Scene scene;
    scene.size_px = {72, 64};
    scene.camera = frame_volume(data.volume.grid(), {-0.45, -1.0, 0.4}, {0, 0, 1});
    scene.background = {0.25, 0.125, 0.5};
    scene.value_and_depth = true;
    RayCastLayer layer;
    layer.mode = mode;
    layer.transfer = window_function(-1000, 1200, mode == RayMode::mip ? 1.0 : 0.02);
    layer.step_mm = 1.0;
    layer.min_transmittance = 0.0;
    layer.isos = {{300.0}};
    scene.ray_cast = layer;
    return scene;
}

struct Errors {
    double value;    // of a sample, in the volume's units
    double color;    // one entry further: colour
    double tau_step; // one entry further: optical depth of a step
    double segments; // of a ray
};

Errors errors_of(const Scene& scene, const SceneData& data, const TransferFunction& transfer) {
    const Grid& grid = data.volume.grid();
    const glm::dvec3 eye = index_point(grid, scene.camera.eye_mm);
    const glm::dvec3 size(grid.size);
    double farthest = 1.0; // in texture coordinates
    for (int axis = 0; axis < 3; ++axis)
        farthest = std::max(farthest, 1.0 + std::abs(eye[axis] / size[axis]));
    // Origin, direction, distance and their sum are rounded once each, all below 2 * farthest.
    const double voxels = std::max({size.x, size.y, size.z}) * farthest * 8.0 * 0x1p-24;
    const TransferTable table = make_table(transfer);
    Errors errors{3.0 * voxels * steepest(data.volume), 0.0, 0.0, 0.0};
    const double h = step_mm_of(*scene.ray_cast, grid);
    for (size_t i = 1; i < table.entries.size(); ++i) {
        const glm::vec4 d = glm::abs(table.entries[i] - table.entries[i - 1]);
        errors.color = std::max<double>(errors.color, std::max({d.x, d.y, d.z}));
        errors.tau_step = std::max(errors.tau_step, d.w * h);
    }
    const double entry = (table.high - table.low) / static_cast<double>(table.entries.size() - 1);
    const double entries = 1.0 + std::floor(errors.value / entry);
    errors.color *= entries;
    errors.tau_step *= entries;
    errors.segments = glm::length(size * spacing_mm(grid)) / h;
    return errors;
}

// Bound of a pixel's colour where it is composed of many samples. Sums carry their rounding; what
// is left is one unit in the last place of the transmittance a sample.
double bound_of(const Scene& scene, const SceneData& data) {
    const Errors e = errors_of(scene, data, scene.ray_cast->transfer);
    return e.color + e.segments * (e.tau_step + 0x1p-23);
}

struct Difference {
    double worst = 0.0;
    double share_beyond = 0.0; // of pixels, beyond the bound given
};

class TwinTest : public GpuTest {
 protected:
    static Difference compare(const Scene& scene, const SceneData& data, double bound,
                              TexelFormat format = TexelFormat::automatic) {
        Renderer renderer = kept_renderer({.volume_format = format});
        const Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        Difference found;
        size_t beyond = 0, pixels = 0;
        for (size_t eye = 0; eye < frame->eyes.size(); ++eye) {
            const Image& gpu = frame->eyes[eye];
            const Image twin = render_twin(scene, data, static_cast<int>(eye));
            EXPECT_EQ(gpu.channels, twin.channels);
            for (uint32_t y = 0; y < gpu.size_px.y; ++y)
                for (uint32_t x = 0; x < gpu.size_px.x; ++x) {
                    double largest = 0.0;
                    for (size_t c = 0; c < 4; ++c)
                        largest =
                            std::max<double>(largest, std::abs(gpu.at(x, y, c) - twin.at(x, y, c)));
                    beyond += !(largest <= bound);
                    found.worst = std::max(found.worst, largest);
                    ++pixels;
                }
        }
        found.share_beyond = static_cast<double>(beyond) / static_cast<double>(pixels);
        std::printf("    bound %.1e, worst %.1e, beyond %zu of %zu\n", bound, found.worst, beyond,
                    pixels);
        return found;
    }
};

TEST_F(TwinTest, Alpha) {
    const SceneData data = oblique_phantom();
    const Scene scene = base_scene(data, RayMode::alpha);
    EXPECT_EQ(compare(scene, data, bound_of(scene, data)).share_beyond, 0.0);
    EXPECT_EQ(compare(scene, data, bound_of(scene, data), TexelFormat::unorm16).share_beyond, 0.0);
}

TEST_F(TwinTest, AlphaPreintegrated) {
    const SceneData data = oblique_phantom();
    Scene scene = base_scene(data, RayMode::alpha);
    scene.ray_cast->integrator = Integrator::preintegrated;
    EXPECT_EQ(compare(scene, data, bound_of(scene, data)).share_beyond, 0.0);
}

// A Gaussian shown between 200 and 800 of its 1000: its gradient there is at least
// 200 / 15 * sqrt(2 ln 5) = 24 per mm, so that a difference of two values errs by a known angle.
TEST_F(TwinTest, AlphaShaded) {
    const Grid grid = make_grid({64, 64, 40}, {1.5, 1.5, 2.4}, {-47.25, -47.25, -46.8});
    const SceneData data{sample(gaussian({}, 15.0), grid, ScalarType::f32), std::nullopt};
    for (const Integrator integrator : {Integrator::fast, Integrator::preintegrated}) {
        Scene scene = base_scene(data, RayMode::alpha);
        scene.ray_cast->integrator = integrator;
        scene.ray_cast->transfer = {{{0.0, {0.9, 0.7, 0.5}}},
                                    {{200.0, 0.0}, {250.0, 0.02}, {750.0, 0.02}, {800.0, 0.0}}};
        const Shading shading;
        scene.ray_cast->shading = shading;
        const Errors e = errors_of(scene, data, scene.ray_cast->transfer);
        const double angle = std::sqrt(3.0) * e.value / 1.5 / 24.0;
        const double lit = (shading.diffuse + shading.specular * shading.shininess) * angle;
        EXPECT_EQ(compare(scene, data, bound_of(scene, data) + lit).share_beyond, 0.0);
    }
}

// The maximum errs by a value's error: its colour and its opacity, one entry each.
TEST_F(TwinTest, Mip) {
    const SceneData data = oblique_phantom();
    const Scene scene = base_scene(data, RayMode::mip);
    const Errors e = errors_of(scene, data, scene.ray_cast->transfer);
    const double bound = e.color + e.color + 0x1p-20; // opacity is the grey value itself
    EXPECT_EQ(compare(scene, data, bound).share_beyond, 0.0);
    EXPECT_EQ(compare(scene, data, bound, TexelFormat::unorm16).share_beyond, 0.0);
}

// Surfaces differ where one of the two misses a grazing ray: on silhouettes alone, whose pixels are
// few; elsewhere the normal errs as above. The shell's edge rises 500 HU a voxel; false position
// leaves a hit the same for both.
TEST_F(TwinTest, Iso) {
    const SceneData data = oblique_phantom();
    Scene scene = base_scene(data, RayMode::iso);
    const Errors e = errors_of(scene, data, scene.ray_cast->transfer);
    const Shading shading;
    const double bound =
        (shading.diffuse + shading.specular * shading.shininess) * e.value / 100.0 + 0x1p-20;
    EXPECT_LE(compare(scene, data, bound).share_beyond, 0.01);
    scene.ray_cast->isos = {{-300.0, {0.9, 0.6, 0.5}, 0.35}, {200.0, {1, 0, 0}, 0.5}, {700.0}};
    EXPECT_LE(compare(scene, data, 3.0 * bound).share_beyond, 0.01);
}

// Gaps in the data: a hundred samples are missing, on the surface too. Colours stay the twin's but
// for rays that graze a cell with a missing corner.
TEST_F(TwinTest, MissingData) {
    const Grid grid = make_grid({64, 64, 40}, {1.5, 1.5, 2.4}, {-47.25, -47.25, -46.8});
    Volume volume = sample(gaussian({}, 15.0), grid, ScalarType::f32);
    VolumeEdit edit(volume);
    for (uint32_t i = 0; i < 100; ++i)
        edit.set({20 + i * 7 % 23, 20 + i * 11 % 25, 10 + i * 5 % 19},
                 std::numeric_limits<double>::quiet_NaN());
    const SceneData data{edit.commit(), std::nullopt};
    ASSERT_GT(data.volume.no_data_count(), 50u);
    for (const RayMode mode : {RayMode::alpha, RayMode::mip, RayMode::iso}) {
        Scene scene = base_scene(data, mode);
        scene.ray_cast->transfer = window_function(0, 1000, mode == RayMode::mip ? 1.0 : 0.02);
        const Difference found = compare(scene, data, 0.02);
        EXPECT_LE(found.share_beyond, 0.01);
        EXPECT_TRUE(std::isfinite(found.worst));
    }
}

// A slice pixel errs by one entry's colour; a border between labels may fall on the other side.
TEST_F(TwinTest, SlicesLabelsStereoClipOrthographic) {
    SceneData data = oblique_phantom();
    Scene scene = base_scene(data, RayMode::alpha);
    scene.slices = {SliceLayer{}, SliceLayer{{0, 0, 0}, {0, 1, 0.2}, Interpolation::cubic}};
    scene.slice_transfer = window_function(-160, 240, 1.0);
    const auto bound = [&] {
        return bound_of(scene, data) + errors_of(scene, data, scene.slice_transfer).color;
    };
    EXPECT_EQ(compare(scene, data, bound()).share_beyond, 0.0);
    scene.slices[0].slab_mm = 12.0;
    scene.slices[1].slab_mm = 9.0;
    scene.slices[1].slab_mode = SlabMode::maximum;
    scene.stereo = StereoSettings{};
    scene.clip_planes = {{{10, 0, 0}, {1, 0.1, 0}}, {{0, 0, 30}, {0, 0, -1}}};
    EXPECT_EQ(compare(scene, data, bound()).share_beyond, 0.0);
    data.labels = sample(checkerboard(20.0, 5), make_grid({60, 50, 40}, {3, 3, 4}, {-90, -75, -80}),
                         ScalarType::u8);
    scene.labels = LabelLayer{};
    scene.labels->styles = {{}, {{1, 0, 0}, true}, {{0, 1, 0}, false}};
    EXPECT_LE(compare(scene, data, bound()).share_beyond, 0.002);
    scene.camera.projection = Projection::orthographic;
    scene.ray_cast->mode = RayMode::iso;
    EXPECT_LE(compare(scene, data, bound()).share_beyond, 0.01);
    scene.ray_cast->mode = RayMode::mip;
    EXPECT_LE(compare(scene, data, 2.0 * bound()).share_beyond, 0.002);
    scene.ray_cast.reset();
    scene.ray_cast = RayCastLayer{};
    scene.ray_cast->transfer = window_function(-1000, 1200, 0.02);
    EXPECT_LE(compare(scene, data, bound(), TexelFormat::unorm16).share_beyond, 0.002);
}

} // namespace
} // namespace palpate
