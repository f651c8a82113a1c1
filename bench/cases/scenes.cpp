#include "bench/cases/scenes.h"

#include <cmath>
#include <limits>

#include "engine/volume/builder.h"

namespace palpate::cases {

void run_all(const std::vector<Case>& cases, Painter& painter, Findings& findings,
             const Choices& choices) {
    for (const Case& one : cases) {
        findings.in(one.name);
        one.check(painter.draw(one.scene, one.data, choices), findings);
    }
}

void run_all(const std::vector<Same>& cases, Painter& painter, Findings& findings) {
    for (const Same& one : cases) {
        const Image first = painter.draw(one.variants[0].first, one.variants[0].second);
        for (size_t v = 1; v < one.variants.size(); ++v) {
            findings.in(fmt::format("{}, variant {}", one.name, v));
            const Image other = painter.draw(one.variants[v].first, one.variants[v].second);
            findings.within(largest_difference(first, other), one.max_difference);
        }
    }
}

double largest_difference(const Image& a, const Image& b) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (a.size_px != b.size_px || a.channels != b.channels)
        return kInfinity;
    double largest = 0.0;
    for (size_t i = 0; i < a.samples.size(); ++i) {
        if (std::isnan(a.samples[i]) && std::isnan(b.samples[i]))
            continue;
        const double difference = std::abs(double{a.samples[i]} - b.samples[i]);
        largest = std::max(largest, std::isnan(difference) ? kInfinity : difference);
    }
    return largest;
}

std::vector<Integrator> integrators() {
    return {Integrator::fast, Integrator::preintegrated, Integrator::exact};
}

const char* name_of(Integrator integrator) {
    switch (integrator) {
        case Integrator::fast:
            return "fast";
        case Integrator::preintegrated:
            return "preintegrated";
        case Integrator::exact:
            return "exact";
    }
    return "";
}

TransferFunction constant(double tau_per_mm, double unit_mm, glm::dvec3 color) {
    return {{{0.0, color}}, {{0.0, -std::expm1(-tau_per_mm * unit_mm)}}, unit_mm};
}

TransferFunction linear_extinction(double tau) {
    TransferFunction function{{{0.0, glm::dvec3(1.0)}}, {}, 1.0};
    for (int i = 0; i <= 512; ++i)
        function.opacities.push_back({i / 512.0, -std::expm1(-tau * i / 512.0)});
    return function;
}

Volume filled(const Grid& grid, double value) {
    return make_volume(grid, ScalarType::f32, [&](glm::uvec3) { return value; });
}

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

double chord(const Ray& ray, glm::dvec3 low, glm::dvec3 high, double from) {
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

void for_each_pixel(const Scene& scene, Findings& findings,
                    const std::function<void(uint32_t, uint32_t, const Ray&)>& check) {
    const View view = make_view(scene.camera, scene.size_px);
    for (uint32_t y = 0; y < scene.size_px.y; ++y)
        for (uint32_t x = 0; x < scene.size_px.x; ++x) {
            findings.at(x, y);
            check(x, y, ray_through(view, {x, y}, scene.size_px));
        }
    findings.at(0, 0);
}

std::function<void(const Image&, Findings&)> box_of(const Scene& scene, glm::dvec3 size_mm,
                                                    double tau, double margin_mm, double near_mm) {
    return [=](const Image& image, Findings& findings) {
        const View view = make_view(scene.camera, scene.size_px);
        for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
            const double start = near_mm / glm::dot(ray.direction, view.forward);
            const double least =
                chord(ray, glm::dvec3(margin_mm), size_mm - glm::dvec3(margin_mm), start);
            const double most =
                chord(ray, glm::dvec3(-margin_mm), size_mm + glm::dvec3(margin_mm), start);
            const double low = -std::expm1(-tau * least);
            const double high = -std::expm1(-tau * most);
            const double seen = image.at(x, y, 3);
            findings.expect(std::isfinite(seen), "a number");
            // Along the ray, both ends may be a place off. A ray that meets nothing hides nothing.
            findings.within(std::max({low - seen, seen - high, 0.0}),
                            most == 0.0 ? 0.0 : 2.0 * tau * kPlaceMm);
            for (size_t c = 0; c < 3; ++c) // white on black
                findings.near(image.at(x, y, c), seen, 1e-6);
        });
    };
}

SceneData bar(double length_mm) {
    return {filled(make_grid({2, 2, 2}, {length_mm, 4.0, 4.0}), 0.5), {}};
}

Scene through_bar(double step_mm) {
    Scene scene = parallel({1, 0, 0}, {0, 2, 2}, 1.0, {1, 1});
    scene.camera.eye_mm = {-16, 2, 2};
    scene.ray_cast->step_mm = step_mm;
    return scene;
}

} // namespace palpate::cases
