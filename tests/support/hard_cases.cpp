#include "tests/support/hard_cases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/volume/builder.h"

namespace palpate::hard_cases {

namespace {

// fp32 places on a ray: 100 mm from the eye they are 2^-18 mm apart, and a sum of three products
// may be off by twice that.
constexpr double kPlaceMm = 1e-5;

// One opacity for every value.
TransferFunction constant(double tau_per_mm, double unit_mm = 1.0,
                          glm::dvec3 color = glm::dvec3(1.0)) {
    return {{{0.0, color}}, {{0.0, -std::expm1(-tau_per_mm * unit_mm)}}, unit_mm};
}

Volume filled(const Grid& grid, double value) {
    return make_volume(grid, ScalarType::f32, [&](glm::uvec3) { return value; });
}

// Parallel rays along `direction`, pixels pitch_mm apart; where size_px is a power of two, the
// places of rays beside the middle are exact in fp32.
Scene parallel(glm::dvec3 direction, glm::dvec3 target, double pitch_mm, glm::uvec2 size_px) {
    Scene scene;
    scene.size_px = size_px;
    scene.camera.projection = Projection::orthographic;
    scene.camera.target_mm = target;
    const glm::dvec3 forward = glm::normalize(direction);
    scene.camera.eye_mm = target - 64.0 * forward;
    scene.camera.up = std::abs(forward.z) > 0.9 ? glm::dvec3(0, -1, 0) : glm::dvec3(0, 0, 1);
    scene.camera.view_height_mm = pitch_mm * size_px.y;
    scene.ray_cast = RayCastLayer{};
    scene.ray_cast->min_transmittance = 0.0;
    return scene;
}

// Length of the line inside [low, high], beyond `from`; touching counts where a component is 0.
double chord(const Ray& ray, glm::dvec3 low, glm::dvec3 high, double from = 0.0) {
    double to = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        if (ray.direction[axis] == 0.0) {
            if (ray.origin_mm[axis] < low[axis] || ray.origin_mm[axis] > high[axis])
                return 0.0;
            continue;
        }
        const double a = (low[axis] - ray.origin_mm[axis]) / ray.direction[axis];
        const double b = (high[axis] - ray.origin_mm[axis]) / ray.direction[axis];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    }
    return std::max(to - from, 0.0);
}

// A box of one extinction, seen from beyond a plane near_mm in front of the eye: each pixel hides
// by its chord, between those of a box a rounding smaller and larger. With margin 0, lateral places
// are exact and so is the set of pixels hit.
std::function<void(const Image&)> box_of(const Scene& scene, glm::dvec3 size_mm, double tau,
                                         double margin_mm, double near_mm = 0.0) {
    return [=](const Image& image) {
        const View view = make_view(scene.camera, scene.size_px);
        for (uint32_t y = 0; y < image.size_px.y; ++y)
            for (uint32_t x = 0; x < image.size_px.x; ++x) {
                const Ray ray = ray_through(view, {x, y}, scene.size_px);
                const double start = near_mm / glm::dot(ray.direction, view.forward);
                const double least =
                    chord(ray, glm::dvec3(margin_mm), size_mm - glm::dvec3(margin_mm), start);
                const double most =
                    chord(ray, glm::dvec3(-margin_mm), size_mm + glm::dvec3(margin_mm), start);
                const double seen = image.at(x, y, 3);
                // Along the ray, both ends may be a place off.
                EXPECT_GE(seen, -std::expm1(-tau * least) - 2.0 * tau * kPlaceMm) << x << " " << y;
                EXPECT_LE(seen, most == 0.0 ? 0.0 : -std::expm1(-tau * most) + 2.0 * tau * kPlaceMm)
                    << x << " " << y;
                for (size_t c = 0; c < 3; ++c)
                    EXPECT_NEAR(image.at(x, y, c), seen, 1e-6) << "white on black";
            }
    };
}

// A 2x2x2 volume that is `length` mm long in x.
SceneData bar(double length_mm) {
    return {filled(make_grid({2, 2, 2}, {length_mm, 4.0, 4.0}), 0.5), {}};
}

// One ray along x through the middle of a bar, whose near face is 16 mm from the eye.
Scene through_bar(double step_mm) {
    Scene scene = parallel({1, 0, 0}, {0, 2, 2}, 1.0, {1, 1});
    scene.camera.eye_mm = {-16, 2, 2};
    scene.ray_cast->step_mm = step_mm;
    return scene;
}

} // namespace

std::vector<Case> zero_components_and_faces() {
    std::vector<Case> cases;
    const glm::dvec3 size(4.0);
    const double tau = 0.1;
    const SceneData data{filled(make_grid({5, 5, 5}, {1, 1, 1}), 0.5), {}};
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const glm::dvec3 direction(x, y, z);
                const int components = std::abs(x) + std::abs(y) + std::abs(z);
                if (components == 0)
                    continue;
                for (const double beside : {0.0, 1.0 / (1 << 20), -1.0 / (1 << 20)}) {
                    // Along an axis, pixel centres are at multiples of 0.5 from -1.5 to 6 (or
                    // mirrored), so faces, edges and corners are met to the bit.
                    Scene scene = parallel(direction, glm::dvec3(2.25 + beside), 0.5, {16, 16});
                    scene.ray_cast->transfer = constant(tau);
                    scene.ray_cast->step_mm = 0.75;
                    cases.push_back({fmt::format("direction {} {} {}, beside {}", x, y, z, beside),
                                     scene, data,
                                     box_of(scene, size, tau, components == 1 ? 0.0 : kPlaceMm)});
                }
            }
    return cases;
}

std::vector<Case> camera_inside() {
    std::vector<Case> cases;
    const glm::dvec3 size(4.0);
    const double tau = 0.3;
    const SceneData data{filled(make_grid({5, 5, 5}, {1, 1, 1}), 0.5), {}};
    const auto beside = [](float face, float towards) {
        return static_cast<double>(std::nextafter(face, towards));
    };
    // At the centre; on a face, an edge and a corner; one fp32 step inside and outside of either.
    std::vector<std::pair<std::string, glm::dvec3>> eyes{
        {"centre", {2, 2, 2}}, {"face", {4, 2, 2}}, {"edge", {4, 0, 2}}, {"corner", {0, 4, 0}}};
    for (const float towards : {2.0f, 8.0f})
        eyes.emplace_back("beside the far face", glm::dvec3(beside(4.0f, towards), 2, 2));
    for (const float towards : {2.0f, -2.0f})
        eyes.emplace_back("beside the near face", glm::dvec3(beside(0.0f, towards), 2, 2));
    for (const auto& [name, eye] : eyes)
        for (const glm::dvec3 forward : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0),
                                         glm::dvec3(0, 1, 0), glm::dvec3(-0.5, 0.75, 0.25)})
            for (const double near_mm : {0.0, 0.7})
                for (const Integrator integrator : {Integrator::fast, Integrator::preintegrated}) {
                    Scene scene;
                    scene.size_px = {16, 16};
                    scene.camera.eye_mm = eye;
                    scene.camera.target_mm = eye + forward;
                    scene.camera.view_angle_deg = 100.0;
                    scene.ray_cast = RayCastLayer{};
                    scene.ray_cast->integrator = integrator;
                    scene.ray_cast->min_transmittance = 0.0;
                    scene.ray_cast->transfer = constant(tau);
                    scene.ray_cast->step_mm = 0.75;
                    if (near_mm > 0.0)
                        scene.clip_planes = {{eye + near_mm * glm::normalize(forward), forward}};
                    cases.push_back(
                        {fmt::format("{}, looking {} {} {}, cut {} mm off, {}", name, forward.x,
                                     forward.y, forward.z, near_mm, static_cast<int>(integrator)),
                         scene, data, box_of(scene, size, tau, kPlaceMm, near_mm)});
                }
    return cases;
}

std::vector<Case> grazing_an_edge() {
    std::vector<Case> cases;
    const glm::dvec3 size(4.0);
    const double tau = 0.5;
    const SceneData data{filled(make_grid({5, 5, 5}, {1, 1, 1}), 0.5), {}};
    // Pixels from 0.03 mm outside to 0.03 mm inside a silhouette: chords of 0 .. 0.06 mm.
    for (const glm::dvec3 direction : {glm::dvec3(1, 1, 0), glm::dvec3(1, 1, 0.5)}) {
        Scene scene = parallel(direction, {0, 4, 2}, 1.0 / 512, {32, 4});
        scene.ray_cast->transfer = constant(tau);
        scene.ray_cast->step_mm = 0.25;
        cases.push_back({"vertical edge", scene, data, box_of(scene, size, tau, kPlaceMm)});
        scene = parallel(direction, {0, 4, 4}, 1.0 / 512, {32, 32});
        scene.ray_cast->transfer = constant(tau);
        cases.push_back({"corner", scene, data, box_of(scene, size, tau, kPlaceMm)});
    }
    return cases;
}

std::vector<Case> same_slab_other_spacing() {
    std::vector<Case> cases;
    const double tau = 0.01, length = 70.0;
    const glm::dvec3 spacings[] = {{1, 1, 1}, {1, 1, 5}, {1, 2, 7}};
    for (const glm::dvec3 spacing : spacings)
        for (int axis = 0; axis < 3; ++axis) {
            const Grid grid = make_grid(glm::uvec3(glm::round(length / spacing)) + 1u, spacing);
            glm::dvec3 direction(0.0);
            direction[axis] = 1.0;
            Scene scene = parallel(direction, glm::dvec3(35.0), 1.0, {1, 1});
            scene.ray_cast->transfer = constant(tau);
            cases.push_back({fmt::format("spacing {} {} {} along axis {}", spacing.x, spacing.y,
                                         spacing.z, axis),
                             scene, SceneData{filled(grid, 0.5), {}}, [=](const Image& image) {
                                 EXPECT_NEAR(image.at(0, 0, 3), -std::expm1(-tau * length),
                                             1e-6 + 2.0 * tau * kPlaceMm);
                             }});
        }
    return cases;
}

std::vector<Case> tiny_and_huge_depth() {
    std::vector<Case> cases;
    const double step = 1.0 / 128; // exact in fp32, as is every place on its lattice
    const double steps = 10000.0;
    for (const double depth_per_step : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0}) {
        Scene scene = through_bar(step);
        scene.ray_cast->transfer = constant(depth_per_step / step, step);
        cases.push_back({fmt::format("optical depth {} a step", depth_per_step), scene,
                         bar(steps * step), [=](const Image& image) {
                             const double hidden = -std::expm1(-steps * depth_per_step);
                             EXPECT_NEAR(image.at(0, 0, 3) / hidden, 1.0, 1e-5);
                         }});
    }
    return cases;
}

std::vector<Case> ten_thousand_faint() {
    const double step = 1.0 / 128, steps = 10000.0, depth_per_step = 1e-5;
    const glm::dvec3 color(0.25, 0.5, 1.0), behind(1.0, 0.0, 0.5);
    Scene scene = through_bar(step);
    scene.background = behind;
    scene.ray_cast->transfer = constant(depth_per_step / step, step, color);
    return {{"10^4 samples of opacity 1e-5", scene, bar(steps * step), [=](const Image& image) {
                 const double hidden = -std::expm1(-steps * depth_per_step);
                 for (int c = 0; c < 3; ++c) // increments are 2^-17 of a sum near 1
                     EXPECT_NEAR(image.at(0, 0, static_cast<size_t>(c)),
                                 hidden * color[c] + (1.0 - hidden) * behind[c], 1e-6);
             }}};
}

std::vector<Case> early_termination() {
    std::vector<Case> cases;
    // A black veil 10 mm thick that lets 1/512 through, then white to the end.
    const double veil_mm = 10.0, tau = std::log(512.0) / veil_mm;
    const Grid grid = make_grid({21, 2, 2}, {1.0, 4.0, 4.0});
    const SceneData data{
        make_volume(grid, ScalarType::f32, [](glm::uvec3 i) { return static_cast<double>(i.x); }),
        {}};
    for (const double bound : {0.0, 1.0 / 4096, 1.0 / 1024, 1.0 / 256}) {
        Scene scene = through_bar(0.5); // the middle of no step lies at the change of colour
        scene.ray_cast->transfer = {{{0.0, glm::dvec3(0.0)},
                                     {veil_mm, glm::dvec3(0.0)},
                                     {veil_mm, glm::dvec3(1.0)},
                                     {20.0, glm::dvec3(1.0)}},
                                    {{0.0, -std::expm1(-tau)}},
                                    1.0};
        scene.ray_cast->min_transmittance = bound;
        cases.push_back(
            {fmt::format("stops below {}", bound), scene, data, [=](const Image& image) {
                 const double white =
                     std::exp(-tau * veil_mm) * -std::expm1(-tau * (20.0 - veil_mm));
                 const double through = std::exp(-tau * 20.0);
                 // fp32 sums near 1 are good to some 2^-24.
                 EXPECT_NEAR(image.at(0, 0, 0), white, bound + 1e-6);
                 EXPECT_LE(image.at(0, 0, 0), white + 1e-6);
                 EXPECT_NEAR(image.at(0, 0, 3), 1.0 - through, bound + 1e-6);
             }});
    }
    return cases;
}

std::vector<Case> partial_steps() {
    std::vector<Case> cases;
    const double tau = 0.3;
    for (const Integrator integrator : {Integrator::fast, Integrator::preintegrated})
        for (const double whole : {0.0, 7.0})
            for (double part = 0.1; part < 1.0; part += 0.1)
                for (const double start : {-16.0, -16.37}) {
                    Scene scene = through_bar(1.0);
                    scene.camera.eye_mm.x = start;
                    scene.ray_cast->integrator = integrator;
                    scene.ray_cast->transfer = constant(tau);
                    const double length = whole + part;
                    cases.push_back({fmt::format("{} steps from {}, integrator {}", length, start,
                                                 static_cast<int>(integrator)),
                                     scene, bar(length), [=](const Image& image) {
                                         // Places 25 mm from the eye are 2^-19 mm apart.
                                         EXPECT_NEAR(image.at(0, 0, 3), -std::expm1(-tau * length),
                                                     1e-6);
                                     }});
                }
    return cases;
}

std::vector<Case> every_code_of_a_ramp() {
    std::vector<Case> cases;
    const struct {
        ScalarType type;
        double first, step;
    } ramps[] = {{ScalarType::u8, 0, 1},          {ScalarType::i8, -128, 1},
                 {ScalarType::u16, 0, 257},       {ScalarType::u16, 3840, 1},
                 {ScalarType::i16, -32768, 257},  {ScalarType::i16, -1024, 16},
                 {ScalarType::f32, -1000.5, 0.25}};
    for (const auto& ramp : ramps) {
        Scene scene = parallel({0, 0, 1}, {127.5, 0.5, 0.5}, 1.0, {256, 1});
        scene.ray_cast->mode = RayMode::mip;
        scene.ray_cast->transfer = window_function(ramp.first, ramp.first + 255 * ramp.step, 1.0);
        scene.value_and_depth = true;
        const Grid grid = make_grid({256, 2, 2}, {1, 1, 1});
        cases.push_back(
            {fmt::format("{} from {} by {}", name_of(ramp.type), ramp.first, ramp.step), scene,
             SceneData{make_volume(grid, ramp.type,
                                   [=](glm::uvec3 i) { return ramp.first + ramp.step * i.x; }),
                       {}},
             [=](const Image& image) {
                 for (uint32_t x = 0; x < 256; ++x) {
                     const double code = ramp.first + ramp.step * x;
                     // A normalised format may round once on either way: 2^-23 of its range.
                     EXPECT_NEAR(image.at(x, 0, 4), code, 65536.0 / (1 << 23)) << x;
                     EXPECT_NEAR(image.at(x, 0, 0), x / 255.0 * image.at(x, 0, 3),
                                 0.5 / 4095 + 1e-6);
                 }
             }});
    }
    return cases;
}

std::vector<Case> one_sample_without_data() {
    std::vector<Case> cases;
    const double nan = std::numeric_limits<double>::quiet_NaN(), tau = 0.2;
    const SceneData data{make_volume(make_grid({9, 9, 9}, {1, 1, 1}), ScalarType::f32,
                                     [=](glm::uvec3 i) { return i == glm::uvec3(4) ? nan : 0.5; }),
                         {}};
    const glm::dvec3 directions[] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}};
    for (const glm::dvec3 direction : directions)
        for (const bool shaded : {false, true}) {
            // Pixel centres are 0.5 mm apart and 0.25 mm off the faces of cells.
            Scene scene = parallel(direction, glm::dvec3(4.0), 0.5, {16, 16});
            scene.ray_cast->transfer = constant(tau);
            scene.ray_cast->step_mm = 0.5;
            if (shaded)
                scene.ray_cast->shading = Shading{};
            cases.push_back({fmt::format("alpha along {} {} {}{}", direction.x, direction.y,
                                         direction.z, shaded ? ", shaded" : ""),
                             scene, data, [=](const Image& image) {
                                 const View view = make_view(scene.camera, scene.size_px);
                                 for (uint32_t y = 0; y < 16; ++y)
                                     for (uint32_t x = 0; x < 16; ++x) {
                                         const Ray ray = ray_through(view, {x, y}, scene.size_px);
                                         const double gap =
                                             chord(ray, glm::dvec3(3), glm::dvec3(5));
                                         const double length =
                                             chord(ray, glm::dvec3(0), glm::dvec3(8)) - gap;
                                         EXPECT_NEAR(image.at(x, y, 3), -std::expm1(-tau * length),
                                                     1e-6 + 2.0 * tau * kPlaceMm);
                                         for (size_t c = 0; c < 4; ++c)
                                             EXPECT_TRUE(std::isfinite(image.at(x, y, c)));
                                     }
                             }});
        }
    Scene scene = parallel({0, 0, 1}, glm::dvec3(4.0), 0.5, {16, 16});
    scene.ray_cast->mode = RayMode::mip;
    scene.ray_cast->transfer = window_function(0.0, 1.0, 1.0);
    scene.value_and_depth = true;
    cases.push_back({"mip", scene, data, [](const Image& image) {
                         for (uint32_t y = 0; y < 16; ++y)
                             for (uint32_t x = 0; x < 16; ++x)
                                 EXPECT_EQ(image.at(x, y, 4), 0.5f);
                     }});
    return cases;
}

std::vector<Case> ramp_over_bricks() {
    std::vector<Case> cases;
    // One, two, three bricks a side; iso-values at every tenth of a sample round the first border.
    for (const uint32_t size : {31u, 32u, 33u, 34u, 63u, 65u, 96u}) {
        const Grid grid = make_grid({size, size, 3}, {1, 1, 1});
        const SceneData data{
            make_volume(grid, ScalarType::f32,
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
            cases.push_back({fmt::format("size {}, surface at {}", size, place), scene, data,
                             [=](const Image& image) {
                                 EXPECT_EQ(image.at(0, 0, 3), 1.0f);
                                 // Values up to 190 are 2^-16 apart, places 112 mm away 2^-17.
                                 EXPECT_NEAR(image.at(0, 0, 5), 16.0 + place, 5e-5);
                             }});
        }
    }
    return cases;
}

} // namespace palpate::hard_cases
