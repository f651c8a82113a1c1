// R16, R17, R20, R21: missing data, far places, borders of bricks, labels.

#include <cmath>
#include <limits>

#include "bench/cases/scenes.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate::cases {

void missing_data(Painter& painter, Findings& findings) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), tau = 0.2;
    const SceneData data{make_volume(make_grid({9, 9, 9}, {1, 1, 1}), ScalarType::f32,
                                     [=](glm::uvec3 i) { return i == glm::uvec3(4) ? nan : 0.5; }),
                         {}};
    findings.in("one of 729 samples");
    findings.part("samples without data counted");
    findings.near(static_cast<double>(data.volume.no_data_count()), 1.0, 0.0);
    std::vector<Case> cases;
    const glm::dvec3 directions[] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}};
    for (const glm::dvec3 direction : directions)
        for (const bool shaded : {false, true}) {
            // Pixel centres are 0.5 mm apart and 0.25 mm off the faces of cells.
            Scene scene = parallel(direction, glm::dvec3(4.0), 0.5, {16, 16});
            scene.ray_cast->transfer = constant(tau);
            scene.ray_cast->step_mm = 0.5;
            if (shaded)
                scene.ray_cast->shading = Shading{};
            cases.push_back(
                {fmt::format("alpha along {} {} {}{}", direction.x, direction.y, direction.z,
                             shaded ? ", shaded" : ""),
                 scene, data, [=](const Image& image, Findings& found) {
                     for_each_pixel(scene, found, [&](uint32_t x, uint32_t y, const Ray& ray) {
                         const double gap = chord(ray, glm::dvec3(3), glm::dvec3(5));
                         const double length = chord(ray, glm::dvec3(0), glm::dvec3(8)) - gap;
                         found.near(image.at(x, y, 3), -std::expm1(-tau * length),
                                    1e-6 + 2.0 * tau * kPlaceMm);
                         for (size_t c = 0; c < 4; ++c)
                             found.expect(std::isfinite(image.at(x, y, c)), "a number");
                     });
                 }});
        }
    findings.part("opacity round the eight cells of one missing sample");
    run_all(cases, painter, findings);

    Scene scene = parallel({0, 0, 1}, glm::dvec3(4.0), 0.5, {16, 16});
    scene.ray_cast->mode = RayMode::mip;
    scene.ray_cast->transfer = window_function(0.0, 1.0, 1.0);
    scene.value_and_depth = true;
    findings.part("maximum beside a missing sample");
    findings.in("mip");
    const Image image = painter.draw(scene, data);
    for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray&) {
        findings.near(image.at(x, y, 4), 0.5, 0.0);
    });
}

namespace {

// The modes with everything that has a place in space: camera, slices, clip planes.
std::vector<std::pair<std::string, Scene>> scenes_of_all_modes() {
    Scene base;
    base.size_px = {32, 32};
    base.background = {0.1, 0.2, 0.3};
    base.camera.eye_mm = {20.25, -40.5, 15.125}; // short in binary, so that adding 10^7 is exact
    base.camera.target_mm = {6.0, 6.0, 6.5};
    RayCastLayer layer;
    layer.step_mm = 0.5;
    layer.transfer = window_function(-1.5, 1.5, 0.3);

    std::vector<std::pair<std::string, Scene>> scenes;
    for (const Integrator integrator : integrators()) {
        Scene scene = base;
        scene.ray_cast = layer;
        scene.ray_cast->integrator = integrator;
        scene.ray_cast->shading = Shading{};
        scene.clip_planes = {{{4.0, 3.5, 2.0}, {1.0, 0.5, 0.25}}};
        scenes.emplace_back(fmt::format("alpha {}", name_of(integrator)), scene);
    }
    Scene scene = base;
    scene.ray_cast = layer;
    scene.ray_cast->mode = RayMode::mip;
    scenes.emplace_back("mip", scene);
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{-0.5, {1, 0.5, 0}, 0.5}, {0.5, {0, 0.5, 1}, 1.0}};
    scenes.emplace_back("iso", scene);
    scene.camera.projection = Projection::orthographic;
    scene.camera.view_height_mm = 16.0;
    scenes.emplace_back("iso orthographic", scene);
    scene = base;
    scene.slice_transfer = window_function(-1.5, 1.5, 1.0);
    scene.slices = {{{6.0, 6.0, 5.25}, {0.25, 0, 1}, Interpolation::cubic, 2.0, SlabMode::mean},
                    {{6.0, 6.0, 6.0}, {1, 0, 0}}};
    scenes.emplace_back("slices", scene);
    return scenes;
}

void move(Scene& scene, glm::dvec3 by) {
    scene.camera.eye_mm += by;
    scene.camera.target_mm += by;
    for (SliceLayer& slice : scene.slices)
        slice.point_mm += by;
    for (ClipPlane& plane : scene.clip_planes)
        plane.point_mm += by;
}

void scale(Scene& scene, double by) {
    scene.camera.eye_mm *= by;
    scene.camera.target_mm *= by;
    scene.camera.view_height_mm *= by;
    for (SliceLayer& slice : scene.slices) {
        slice.point_mm *= by;
        slice.slab_mm *= by;
    }
    for (ClipPlane& plane : scene.clip_planes)
        plane.point_mm *= by;
    if (scene.ray_cast) {
        scene.ray_cast->step_mm *= by;
        scene.ray_cast->transfer.opacity_unit_mm *= by;
    }
}

} // namespace

void far_or_tiny(Painter& painter, Findings& findings) {
    const glm::uvec3 size(13, 13, 14);
    const Volume volume =
        synthetic::sample(synthetic::gyroid(8.0), make_grid(size, {1, 1, 1}), ScalarType::f32);
    std::vector<Same> moves, scales;
    for (const auto& [name, scene] : scenes_of_all_modes()) {
        Same moved{name, {{scene, {volume, {}}}}, 0.0};
        for (const glm::dvec3 by :
             {glm::dvec3(1e3, 0, -1e3), glm::dvec3(-1e5, 1e5, 17), glm::dvec3(1e7, -1e7, 1e7)}) {
            Scene there = scene;
            move(there, by);
            const Grid grid = make_grid(size, {1, 1, 1}, by);
            moved.variants.push_back({there, {with_grid(volume, grid), {}}});
        }
        moves.push_back(std::move(moved));
        Same scaled{name, {{scene, {volume, {}}}}, 0.0};
        for (const int power : {-20, -3, 1, 10}) { // spacing 1e-6 .. 1e3
            Scene other = scene;
            const double by = std::ldexp(1.0, power);
            scale(other, by);
            const Grid grid = make_grid(size, glm::dvec3(by));
            scaled.variants.push_back({other, {with_grid(volume, grid), {}}});
        }
        scales.push_back(std::move(scaled));
    }
    findings.part("change of the picture, moved by up to 1e7 mm");
    run_all(moves, painter, findings);
    findings.part("change of the picture, spacing 2^-20 .. 2^10");
    run_all(scales, painter, findings);
}

namespace {

void ramp_over_bricks(Painter& painter, Findings& findings) {
    // One, two, three bricks a side; iso-values all along, round every border.
    for (const uint32_t size : {31u, 32u, 33u, 34u, 63u, 65u, 96u}) {
        const SceneData data{
            make_volume(make_grid({size, size, 3}, {1, 1, 1}), ScalarType::f32,
                        [](glm::uvec3 i) { return static_cast<double>(i.x + i.y); }),
            {}};
        const double last = size - 1.0;
        for (double place = std::max(last - 66.0, 1.0); place < last; place += 3.1) {
            Scene scene = parallel({1, 0, 0}, {0, 0.5 * last, 1.0}, 1.0, {1, 1});
            scene.camera.eye_mm.x = -16.0;
            scene.ray_cast->mode = RayMode::iso;
            scene.ray_cast->isos = {{0.5 * last + place}};
            scene.ray_cast->step_mm = 0.7;
            scene.value_and_depth = true;
            findings.in(fmt::format("size {}, surface at {}", size, place));
            const Image image = painter.draw(scene, data);
            findings.expect(image.at(0, 0, 3) == 1.0f, "a surface");
            // Values up to 190 are 2^-16 apart, places 112 mm away 2^-17; two axes have a slope.
            findings.near(image.at(0, 0, 5), 16.0 + place, 5e-5 + 2.0 * painter.weight_rounding());
        }
    }
}

// The same 13 mm of a gyroid, cut out by clip planes, in volumes whose brick borders (at sample
// 32) pass through it at every phase. Volumes of 1, 2, 3 and 8 bricks.
std::vector<Same> bricks_at_all_phases(bool mip, double weight_rounding) {
    const double pad_mm[] = {0, 20, 22, 24, 26, 28, 30};
    const synthetic::Field gyroid = synthetic::gyroid(8.0);
    std::vector<Same> cases;
    for (int axes = 1; axes <= 3; ++axes) {
        // Table entries are 1/4096 of the range apart; a value that rounding moves across the
        // middle between two changes colour by as much, weighted by one sample's opacity 0.15.
        // Weights of few bits move values by 3 * 2.4 / 3 of the range times their rounding.
        Same same{fmt::format("borders on {} axes", axes),
                  {},
                  (mip ? 3e-4 : 1e-4) * (1.0 + 2.4 * weight_rounding * 4096.0)};
        for (const double pad : pad_mm) {
            glm::dvec3 before(0.0);
            for (int axis = 0; axis < axes; ++axis)
                before[axis] = pad;
            const Grid grid = make_grid(glm::uvec3(before) + 16u, {1, 1, 1}, -before);
            Scene scene;
            scene.size_px = {24, 24};
            scene.camera.eye_mm = {30, -40, 21};
            scene.camera.target_mm = {7, 7, 7};
            scene.camera.view_angle_deg = 20.0;
            scene.ray_cast = RayCastLayer{};
            scene.ray_cast->mode = mip ? RayMode::mip : RayMode::alpha;
            scene.ray_cast->step_mm = 0.5;
            scene.ray_cast->transfer = window_function(-1.5, 1.5, 0.3);
            scene.clip_planes = {{{1, 1, 1}, {1, 0, 0}},     {{1, 1, 1}, {0, 1, 0}},
                                 {{1, 1, 1}, {0, 0, 1}},     {{14, 14, 14}, {-1, 0, 0}},
                                 {{14, 14, 14}, {0, -1, 0}}, {{14, 14, 14}, {0, 0, -1}}};
            same.variants.push_back(
                {scene, {synthetic::sample(gyroid, grid, ScalarType::f32), {}}});
        }
        cases.push_back(std::move(same));
    }
    return cases;
}

// The bits of pictures from one image of the volume, and from an atlas of its bricks.
void atlas_of_bricks(Painter& painter, Findings& findings) {
    const Grid grid = make_grid({70, 66, 36}, {0.19, 0.2, 0.36}); // 3 x 3 x 2 bricks
    const SceneData data{synthetic::sample(synthetic::gyroid(8.0), grid, ScalarType::f32), {}};
    for (const auto& [name, scene] : scenes_of_all_modes()) {
        const auto draw = [&, &drawn = scene](Residency residency) {
            return painter.draw(drawn, data,
                                {.residency = residency, .sampling = Sampling::by_hand});
        };
        const Image dense = draw(Residency::dense), atlas = draw(Residency::atlas);
        findings.in(name);
        for (size_t i = 0; i < dense.samples.size(); ++i)
            if (!(std::isnan(dense.samples[i]) && std::isnan(atlas.samples[i])))
                findings.within(atlas.samples[i] - dense.samples[i], 0.0);
    }
}

} // namespace

void brick_seams(Painter& painter, Findings& findings) {
    findings.part("mm that a surface is off at borders of bricks");
    ramp_over_bricks(painter, findings);
    for (const bool mip : {true, false}) {
        findings.part(
            fmt::format("change of colour with borders at all phases, {}", mip ? "mip" : "alpha"));
        run_all(bricks_at_all_phases(mip, painter.weight_rounding()), painter, findings);
    }
    findings.part("change of the picture from an atlas of bricks, sampled in fp32");
    atlas_of_bricks(painter, findings);
}

void labels(Painter& painter, Findings& findings) {
    const glm::dvec3 colors[] = {{1, 1, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const Grid grid = make_grid({8, 8, 8}, {1, 1, 1});
    const double tau = 0.4;
    LabelLayer layer;
    layer.slice_opacity = 1.0;
    layer.ray_cast_weight = 1.0;
    layer.outline_px = 0.0;
    layer.edges = LabelEdges::voxels;
    for (const glm::dvec3 color : colors)
        layer.styles.push_back({color, true});
    // Labels 1 and 3 alone, alternating: between them an interpolated id would be 2.
    for (const double spacing : {1.0, 0.75}) {
        const Grid label_grid = make_grid({8, 8, 8}, glm::dvec3(spacing), glm::dvec3(0.5));
        const auto id = [](glm::uvec3 i) { return (i.x + i.y) % 2 ? 1.0 : 3.0; };
        const SceneData data{filled(grid, 0.5), make_volume(label_grid, ScalarType::u8, id)};
        // The label of the nearest voxel; 0 beyond half a voxel outside the map.
        const auto label_at = [&](const Ray& ray) {
            const glm::dvec2 index = (glm::dvec2(ray.origin_mm) - 0.5) / spacing;
            const glm::dvec2 nearest = glm::floor(index + 0.5);
            if (nearest.x < 0 || nearest.y < 0 || nearest.x > 7 || nearest.y > 7)
                return 0;
            return static_cast<int>(id({nearest, 0u}));
        };
        // Pixel centres are odd multiples of 1/32 mm from the middle, never on a tie.
        Scene scene = parallel({0, 0, 1}, glm::dvec3(3.5), 1.0 / 16, {64, 64});
        scene.labels = layer;

        findings.in(fmt::format("label voxels of {} mm", spacing));
        findings.part("colour of a slice with opaque labels");
        Scene slice = scene;
        slice.ray_cast.reset();
        slice.slices = {{{0, 0, 3.5}, {0, 0, 1}}};
        slice.slice_transfer = window_function(0.0, 1.0, 1.0);
        Image image = painter.draw(slice, data);
        for_each_pixel(slice, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
            const int label = label_at(ray);
            for (int c = 0; c < 3; ++c) // unlabelled is the grey of 0.5, by the table's half entry
                findings.near(image.at(x, y, static_cast<size_t>(c)),
                              label == 0 ? 0.5 : colors[label][c], 0.5 / 4095 + 1e-6);
        });

        // Along z, behind a clip plane so that rays see labelled matter alone.
        findings.part("colour of ray-cast labels");
        scene.ray_cast->transfer = constant(tau);
        scene.ray_cast->step_mm = 0.5;
        scene.clip_planes = {{{0, 0, 1}, {0, 0, 1}}, {{0, 0, 5}, {0, 0, -1}}};
        const double hidden = -std::expm1(-tau * 4.0);
        for (const bool shown : {true, false}) {
            scene.labels->styles[3].visible = shown;
            image = painter.draw(scene, data);
            for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
                const int label = label_at(ray);
                const double opacity = label == 3 && !shown ? 0.0 : hidden;
                findings.near(image.at(x, y, 3), opacity, 1e-6 + 2.0 * tau * kPlaceMm);
                for (int c = 0; c < 3; ++c)
                    findings.near(image.at(x, y, static_cast<size_t>(c)),
                                  opacity * colors[label][c], 1e-6 + 2.0 * tau * kPlaceMm);
            });
        }
    }
}

} // namespace palpate::cases
