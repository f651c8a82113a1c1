// The exact integrator on the GPU: against its twin in double, and against grid truth.
//
// How far fp32 may be off (see place_error()): a ray's line by the rounding of eye and direction, a
// point on it by that of its distance; a value by that times the steepest difference of neighbours.

#include <cmath>
#include <cstdio>
#include <limits>

#include "engine/image/compare.h"
#include "engine/reference/truth.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/steepest.h"
#include "tests/support/hard_cases.h"

namespace palpate {
namespace {

using namespace synthetic;

// In voxels. Eye and direction are rounded once each and the place of entry is their product and
// sum, all as far out as the eye; from there on distances and places are below twice the volume's
// size, and are a quotient, a product, two sums and the place's own cell.
double place_error(const Scene& scene, const SceneData& data) {
    const Grid& grid = data.volume.grid();
    const double eye = glm::length(index_point(grid, scene.camera.eye_mm));
    const double size = glm::length(glm::dvec3(grid.size));
    return 0x1p-24 * (4.0 * (eye + size) + 10.0 * size);
}

// The error of a value inside a cell: its place on three axes, and ten roundings of the cubic.
double value_error(const Scene& scene, const SceneData& data) {
    const ValueRange range = data.volume.range();
    const double largest = std::max(std::abs(range.min), std::abs(range.max));
    return 3.0 * place_error(scene, data) * steepest(data.volume) + 10.0 * 0x1p-24 * largest;
}

// The bound for a pixel of alpha. A place in the table is off by the value's error and by its
// rounding to 1/256 of an entry; where that makes a span narrow or not, or takes a sub-step more,
// the mean of tau moves by at most two entries' difference each (detail_of_one_entry() sees to
// that). Colours move likewise.
double alpha_bound(const Scene& scene, const SceneData& data) {
    const TransferTable table = make_table(scene.ray_cast->transfer);
    double color = 0.0, tau = 0.0;
    for (size_t i = 1; i < table.entries.size(); ++i) {
        const glm::vec4 d = glm::abs(table.entries[i] - table.entries[i - 1]);
        color = std::max<double>(color, std::max({d.x, d.y, d.z}));
        if (table.entries[i].w < 1.0f) // the step that no value reaches
            tau = std::max<double>(tau, d.w);
    }
    const double entry = (table.high - table.low) / static_cast<double>(table.entries.size() - 1);
    const double entries = 4.0 + 2.0 * (value_error(scene, data) / entry + 1.0 / 256.0);
    const double length_mm =
        glm::length(glm::dvec3(data.volume.size()) * spacing_mm(data.volume.grid()));
    const double pieces = 3.0 * glm::length(glm::dvec3(data.volume.size()));
    return entries * (color + tau * length_mm) + pieces * 0x1p-23;
}

// A gentle ramp, with a step far above all values, for which sub-steps come within an entry.
TransferFunction detail_of_one_entry(double low, double high, double opacity) {
    return {{{low, {0.1, 0.2, 0.3}}, {high, {1.0, 0.9, 0.5}}},
            {{low, 0.0}, {high, opacity}, {high, 0.9999}},
            1.0};
}

SceneData phantom() {
    const double angle = 0.3;
    Grid grid;
    grid.size = {60, 64, 30};
    const glm::dvec3 spacing(3.2, 3.2, 6.4);
    const glm::dmat3 turn(std::cos(angle), std::sin(angle), 0, -std::sin(angle), std::cos(angle), 0,
                          0, 0, -1);
    for (int axis = 0; axis < 3; ++axis)
        grid.world_from_index[axis] = glm::dvec4(turn[axis] * spacing[axis], 0.0);
    const glm::dvec3 middle = turn * (0.5 * (glm::dvec3(grid.size) - 1.0) * spacing);
    grid.world_from_index[3] = glm::dvec4(-middle, 1.0);
    return {sample(ct_phantom(), grid, ScalarType::i16), std::nullopt};
}

Scene scene_of(const SceneData& data, RayMode mode) {
    Scene scene;
    scene.size_px = {64, 56};
    scene.camera = frame_volume(data.volume.grid(), {-0.45, -1.0, 0.4}, {0, 0, 1});
    scene.background = {0.25, 0.125, 0.5};
    scene.value_and_depth = true;
    RayCastLayer layer;
    layer.mode = mode;
    layer.integrator = Integrator::exact;
    layer.transfer = mode == RayMode::mip ? window_function(-1000, 1200, 1.0)
                                          : detail_of_one_entry(-1000, 1200, 0.02);
    layer.min_transmittance = 0.0;
    layer.isos = {{300.0}};
    scene.ray_cast = layer;
    return scene;
}

// ExactTest takes over 5 s of a processor: a CPU driver draws each picture, and the twin draws it
// in double.
class ExactTest : public GpuTest {
 protected:
    static Image picture(const Scene& scene, const SceneData& data,
                         TexelFormat format = TexelFormat::automatic) {
        Renderer renderer = kept_renderer({.volume_format = format});
        Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        return frame->eyes.back();
    }
    // Share of pixels in which some channel of colour differs by more than the bound.
    static double share_beyond(const Image& a, const Image& b, double bound) {
        EXPECT_EQ(a.channels, b.channels);
        size_t beyond = 0;
        double worst = 0.0;
        for (uint32_t y = 0; y < a.size_px.y; ++y)
            for (uint32_t x = 0; x < a.size_px.x; ++x) {
                double largest = 0.0;
                for (size_t c = 0; c < 4; ++c)
                    largest = std::max<double>(largest, std::abs(a.at(x, y, c) - b.at(x, y, c)));
                beyond += !(largest <= bound);
                worst = std::max(worst, largest);
            }
        std::printf("    bound %.1e, worst %.1e, beyond %zu\n", bound, worst, beyond);
        return static_cast<double>(beyond) / (a.size_px.x * a.size_px.y);
    }
};

TEST_F(ExactTest, AlphaIsItsTwin) {
    const SceneData data = phantom();
    Scene scene = scene_of(data, RayMode::alpha);
    for (const uint32_t sub_steps : {1u, 8u}) {
        scene.ray_cast->sub_steps = sub_steps;
        const Image twin = render_twin(scene, data);
        const double bound = alpha_bound(scene, data);
        EXPECT_EQ(share_beyond(picture(scene, data), twin, bound), 0.0);
        EXPECT_EQ(share_beyond(picture(scene, data, TexelFormat::unorm16), twin, bound), 0.0);
    }
}

// As in TwinTest.AlphaShaded: the Gaussian's gradient is at least 24 per mm where it is shown.
TEST_F(ExactTest, ShadedAlphaIsItsTwin) {
    const Grid grid = make_grid({64, 64, 40}, {1.5, 1.5, 2.4}, {-47.25, -47.25, -46.8});
    const SceneData data{sample(gaussian({}, 15.0), grid, ScalarType::f32), std::nullopt};
    Scene scene = scene_of(data, RayMode::alpha);
    scene.ray_cast->transfer = {
        {{0.0, {0.9, 0.7, 0.5}}},
        {{200.0, 0.0}, {250.0, 0.02}, {750.0, 0.02}, {800.0, 0.0}, {2000, 0.0}, {2000, 0.9999}}};
    const Shading shading;
    scene.ray_cast->shading = shading;
    // The place at which a cell is shaded moves with what is seen of it, by at most as much as
    // places do relative to a cell: a thousandth; the normal turns by a radian in 15 mm, ten cells.
    const double angle = std::sqrt(3.0) * value_error(scene, data) / 1.5 / 24.0 + 1e-4;
    const double lit = (shading.diffuse + shading.specular * shading.shininess) * angle;
    EXPECT_EQ(share_beyond(picture(scene, data), render_twin(scene, data),
                           alpha_bound(scene, data) + lit),
              0.0);
}

// Neighbours of 0 and 1000 in samples of 1 to 10 mm, as opaque as can be, red to green: what lies
// in front of a cell hides what lies behind in it.
TEST_F(ExactTest, DenseMatterMixesItsColours) {
    for (const double spacing_mm : {1.0, 3.0, 10.0}) {
        const Grid grid = make_grid({9, 10, 11}, glm::dvec3(spacing_mm), glm::dvec3(0.0));
        const SceneData data{
            make_volume(grid, ScalarType::i16,
                        [](glm::uvec3 i) { return (i.x + i.y + i.z) % 2 ? 1000.0 : 0.0; }),
            std::nullopt};
        Scene scene = scene_of(data, RayMode::alpha);
        scene.size_px = {32, 28};
        scene.value_and_depth = false;
        for (const double low : {0.0, 0.99}) {
            scene.ray_cast->transfer = {
                {{0, {1, 0, 0}}, {1000, {0, 1, 0}}}, {{0, low}, {1000, 0.99}}, 1.0};
            const Image truth = render_truth(scene, data);
            for (const uint32_t sub_steps : {8u, 64u}) {
                scene.ray_cast->sub_steps = sub_steps;
                // Colour changes by all of itself over `detail`, of which the curve of a sub-step
                // may leave its chord by 1 / sub_steps^2; all of the error in each of 20 sub-steps;
                // an entry of the table.
                const double curve = 1.0 / (1.0 * sub_steps * sub_steps);
                const double bound = curve + 20.0 * span_tolerance(sub_steps) + 1.0 / 4095.0;
                const Image drawn = picture(scene, data);
                EXPECT_EQ(share_beyond(drawn, truth, bound), 0.0);
                EXPECT_EQ(share_beyond(drawn, render_twin(scene, data), bound), 0.0);
                const double rmse = color_rmse(drawn, truth);
                EXPECT_LE(rmse, bound); // 0.018 at 3 mm where spans were not cut
                std::printf("    %g mm, opacities %g .. 0.99, %u sub-steps: RMSE of colour %.1e\n",
                            spacing_mm, low, sub_steps, rmse);
            }
        }
    }
}

TEST_F(ExactTest, MaximumIsThatOfTheField) {
    // Peaks between samples, at all places within a cell.
    const Grid grid = make_grid({40, 40, 40}, {1.0, 1.0, 1.0}, glm::dvec3(-19.5));
    const SceneData data{make_volume(grid, ScalarType::f32,
                                     [&](glm::uvec3 i) {
                                         const glm::dvec3 p = world_point(grid, glm::dvec3(i));
                                         return 500.0 * (2.0 + std::sin(0.9 * p.x + 0.3 * p.z) +
                                                         std::cos(0.7 * p.y - 0.5 * p.x));
                                     }),
                         std::nullopt};
    Scene scene = scene_of(data, RayMode::mip);
    const Image exact = picture(scene, data), truth = render_truth(scene, data);
    scene.ray_cast->integrator = Integrator::fast;
    const Image fast = picture(scene, data);
    double worst = 0.0, worst_fast = 0.0;
    for (uint32_t y = 0; y < exact.size_px.y; ++y)
        for (uint32_t x = 0; x < exact.size_px.x; ++x) {
            const double value = truth.at(x, y, 4);
            if (std::isnan(value) || std::isnan(exact.at(x, y, 4))) {
                EXPECT_EQ(std::isnan(value), std::isnan(exact.at(x, y, 4)));
                continue;
            }
            worst = std::max(worst, std::abs(exact.at(x, y, 4) - value));
            worst_fast = std::max(worst_fast, value - fast.at(x, y, 4));
        }
    EXPECT_LE(worst, value_error(scene, data));
    EXPECT_GT(worst_fast, 10.0) << "samples a step apart miss the peaks";
}

// Shells d apart: (r - R)^2 falls to (d / 2)^2 and rises again, often within one cell. The first
// hit lies between those of iso-values a value's error higher and lower.
TEST_F(ExactTest, ShellsOfAnyThicknessAreMet) {
    const double spacing = 1.0, radius = 12.3;
    const Grid grid = make_grid({33, 33, 33}, glm::dvec3(spacing), glm::dvec3(-16.0));
    const SceneData data{make_volume(grid, ScalarType::f32,
                                     [&](glm::uvec3 i) {
                                         const double r =
                                             glm::length(world_point(grid, glm::dvec3(i)));
                                         return (r - radius) * (r - radius);
                                     }),
                         std::nullopt};
    Scene scene = scene_of(data, RayMode::iso);
    const double error = value_error(scene, data);
    const double place_mm = place_error(scene, data) * spacing;
    for (const double apart : {0.1, 0.2, 0.5, 1.0, 1.5, 2.0}) {
        // Grid truth lies above (r - R)^2 by up to h^2 / 4 between samples, hence the 0.3.
        const double iso = 0.25 * apart * apart + 0.3;
        const auto truth_at = [&](double value) {
            scene.ray_cast->isos = {{value}};
            return render_truth(scene, data);
        };
        const Image before = truth_at(iso + error), after = truth_at(iso - error);
        scene.ray_cast->isos = {{iso}};
        const Image seen = picture(scene, data);
        const auto depth = [](const Image& image, uint32_t x, uint32_t y) {
            const double found = image.at(x, y, 5);
            return std::isnan(found) ? std::numeric_limits<double>::infinity() : found;
        };
        size_t hits = 0;
        for (uint32_t y = 0; y < seen.size_px.y; ++y)
            for (uint32_t x = 0; x < seen.size_px.x; ++x) {
                // Truth's pictures hold floats as well.
                const double ulp = 0x1p-23 * 150.0;
                EXPECT_GE(depth(seen, x, y), depth(before, x, y) - place_mm - ulp);
                EXPECT_LE(depth(seen, x, y), depth(after, x, y) + place_mm + ulp);
                hits += std::isfinite(depth(seen, x, y));
            }
        EXPECT_GT(hits, 300u);
    }
}

TEST_F(ExactTest, SeveralSurfacesAreTheirTwins) {
    const SceneData data = phantom();
    Scene scene = scene_of(data, RayMode::iso);
    scene.ray_cast->isos = {{-300.0, {0.9, 0.6, 0.5}, 0.35}, {200.0, {1, 0, 0}, 0.5}, {700.0}};
    // Rays that graze a surface within rounding, and normals of flat places, may differ.
    EXPECT_LE(share_beyond(picture(scene, data), render_twin(scene, data), 0.01), 0.002);
}

TEST_F(ExactTest, MissingDataLeavesOutWholeCells) {
    const Grid grid = make_grid({32, 32, 20}, {3.0, 3.0, 4.8}, {-46.5, -46.5, -45.6});
    VolumeEdit edit(sample(gaussian({}, 15.0), grid, ScalarType::f32));
    for (uint32_t i = 0; i < 30; ++i)
        edit.set({10 + i * 7 % 12, 10 + i * 11 % 13, 5 + i * 5 % 10},
                 std::numeric_limits<double>::quiet_NaN());
    const SceneData data{edit.commit(), std::nullopt};
    for (const RayMode mode : {RayMode::alpha, RayMode::mip, RayMode::iso}) {
        Scene scene = scene_of(data, mode);
        if (mode == RayMode::alpha)
            scene.ray_cast->transfer = detail_of_one_entry(0, 1100, 0.02);
        // The twin's cells; rays along a face may see the other side of it.
        EXPECT_LE(share_beyond(picture(scene, data), render_twin(scene, data), 2e-3), 0.003);
    }
}

TEST_F(ExactTest, LabelsSlicesClipPlanesStereoAreItsTwins) {
    SceneData data = phantom();
    Scene scene = scene_of(data, RayMode::alpha);
    scene.slices = {SliceLayer{}, SliceLayer{{0, 0, 0}, {0, 1, 0.2}, Interpolation::cubic}};
    scene.slice_transfer = window_function(-1000, 1200, 1.0);
    scene.clip_planes = {{{10, 0, 0}, {1, 0.1, 0}}, {{0, 0, 30}, {0, 0, -1}}};
    scene.stereo = StereoSettings{};
    data.labels = sample(checkerboard(20.0, 5), make_grid({60, 50, 40}, {3, 3, 4}, {-90, -75, -80}),
                         ScalarType::u8);
    scene.labels = LabelLayer{};
    scene.labels->styles = {{}, {{1, 0, 0}, true}, {{0, 1, 0}, false}};
    const double bound = alpha_bound(scene, data) + 4.0 / 4095.0; // a slice's entry
    // A border between labels on a slice may fall on the other side.
    EXPECT_LE(share_beyond(picture(scene, data), render_twin(scene, data, 1), bound), 0.002);
    scene.camera.projection = Projection::orthographic;
    scene.ray_cast->transfer = window_function(-1000, 1200, 1.0);
    for (const RayMode mode : {RayMode::mip, RayMode::iso}) {
        scene.ray_cast->mode = mode;
        EXPECT_LE(share_beyond(picture(scene, data), render_twin(scene, data, 1), 0.01), 0.004);
    }
}

// Labels cut rays too: with the transfer function of a gentle ramp, error against truth is that of
// the table, wherever a label ends.
TEST_F(ExactTest, HiddenLabelsEndWhereTheyEnd) {
    SceneData data = phantom();
    Scene scene = scene_of(data, RayMode::alpha);
    scene.ray_cast->transfer = window_function(-1000, 1200, 0.02);
    data.labels = sample(checkerboard(23.0, 3),
                         make_grid({50, 50, 40}, {3.3, 3.6, 4.1}, {-80, -88, -80}), ScalarType::u8);
    scene.labels = LabelLayer{};
    scene.labels->styles = {{}, {{1, 0, 0}, true}, {{0, 1, 0}, false}};
    scene.ray_cast->transfer = detail_of_one_entry(-1000, 1200, 0.02);
    EXPECT_LE(
        share_beyond(picture(scene, data), render_truth(scene, data), alpha_bound(scene, data)),
        0.0);
}

TEST_F(ExactTest, TwoFramesAreTheSameBits) {
    const SceneData data = phantom();
    Scene scene = scene_of(data, RayMode::alpha);
    scene.value_and_depth = false; // alpha has none: they are NaN
    EXPECT_EQ(picture(scene, data).samples, picture(scene, data).samples);
}

// Hard cases that do not ask how a ray is integrated; the others name `exact` themselves.
class ExactPainter : public cases::Painter {
 public:
    explicit ExactPainter(GpuDevice& device) : painter_(device) {}
    Image draw(const Scene& scene, const SceneData& data, const cases::Choices& choices) override {
        Scene exact = scene;
        if (exact.ray_cast)
            exact.ray_cast->integrator = Integrator::exact;
        return painter_.draw(exact, data, choices);
    }
    // Corners of cells are read unfiltered.
    double weight_rounding() const override { return 0.0; }

 private:
    cases::GpuPainter painter_;
};

TEST_F(ExactTest, PassesTheHardCases) {
    ExactPainter painter(device());
    for (const cases::HardCase& hard_case : cases::hard_cases()) {
        const std::string_view name = hard_case.name;
        if (name == "R2" || name == "R18" || name == "R19") // have scenes of each integrator
            continue;
        SCOPED_TRACE(hard_case.name);
        expect_pass(cases::run(hard_case, painter));
    }
}

} // namespace
} // namespace palpate
