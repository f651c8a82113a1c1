// R14, R15, R22, R23: normals, cuts, maxima and surfaces between samples.

#include <cmath>

#include "bench/cases/scenes.h"
#include "engine/reference/truth.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate::cases {

// The light of a purely diffuse surface is the cosine between its normal and the ray, so that a
// picture shows the normal's error.
void gradient_operator(Painter& painter, Findings& findings) {
    struct Sphere {
        glm::dvec3 spacing_mm;
        double radius_mm;
    };
    for (const auto& [spacing, radius] : {Sphere{{1, 1, 1}, 12.0}, Sphere{{0.5, 0.5, 3.0}, 24.0}}) {
        const glm::uvec3 size(glm::dvec3(2.0 * radius + 12.0) / spacing);
        const Grid grid = make_grid(size, spacing, -0.5 * (glm::dvec3(size) - 1.0) * spacing);
        const SceneData data{
            synthetic::sample(synthetic::sphere_distance({}, radius), grid, ScalarType::f32), {}};
        // Central differences of a field of |gradient| 1 whose third derivatives are at most
        // 1.16 / r^2: h^2 / 6 of them from the difference itself, h^2 / 8 of three of them from the
        // interpolation of its ends, on each of three axes: an angle of 1.1 h^2 / r^2, and as much
        // again for what comes after these terms. r is the least radius among the samples used. A
        // sampler's weights err by 3 axes' share of a step of slope 1, at both ends.
        const double h = std::max({spacing.x, spacing.y, spacing.z});
        const double least = radius - std::sqrt(3.0) * h;
        const double bound = 2.2 * h * h / (least * least) + 3.0 * painter.weight_rounding() + 1e-4;
        findings.in(fmt::format("sphere of {} mm, spacing {} {} {}", radius, spacing.x, spacing.y,
                                spacing.z));
        double sum = 0.0, count = 0.0;
        for (const glm::dvec3 direction : {glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0),
                                           glm::dvec3(1, -2, 0.5), glm::dvec3(-1, 1, 1)}) {
            Scene scene = parallel(direction, glm::dvec3(0.0), 2.5 * radius / 32, {32, 32});
            scene.ray_cast->mode = RayMode::iso;
            scene.ray_cast->isos = {{0.0, glm::dvec3(1.0)}};
            scene.ray_cast->step_mm = 0.5;
            scene.ray_cast->shading = Shading{0.0, 1.0, 0.0, 1.0};
            const Image image = painter.draw(scene, data);
            findings.part("radians that a normal is off");
            for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
                const double along = glm::dot(ray.origin_mm, ray.direction);
                const double across = glm::length(ray.origin_mm - along * ray.direction);
                if (across > 0.95 * radius) // the surface itself moves there
                    return;
                const double cosine = std::sqrt(1.0 - across * across / (radius * radius));
                // The surface is where interpolation has it, up to h^2 / 4r off; the normal turns
                // by as much over the radius and the cosine.
                const double moved = h * h / (4.0 * radius * radius * cosine);
                const double angle = std::abs(std::acos(std::min<double>(image.at(x, y, 0), 1.0)) -
                                              std::acos(cosine));
                // If the cosine is nearly 1 a small error of it is a large one of the angle.
                const double seen = cosine > 0.995 ? std::abs(image.at(x, y, 0) - cosine) : angle;
                findings.within(seen, bound + moved);
                sum += seen;
                count += 1.0;
            });
        }
        findings.part("radians that normals are off in the mean");
        findings.within(sum / count, 0.5 * bound);
    }
}

// A sphere cut open by planes: where a plane cuts into it, a cap lies in the plane and has its
// normal.
void clipped_surface(Painter& painter, Findings& findings) {
    const double radius = 10.0;
    const Grid grid = make_grid({27, 27, 27}, {1, 1, 1}, glm::dvec3(-13.0));
    const SceneData sphere{
        synthetic::sample(synthetic::sphere_distance({}, radius), grid, ScalarType::f32), {}};
    // Uniform but for its edge, where there is no gradient to light a cut by.
    const SceneData ball{
        synthetic::sample(synthetic::sphere({}, radius, 0.5), grid, ScalarType::f32), {}};
    const ClipPlane planes[] = {{{0, -2, 0}, {0, 1, 0}},
                                {{1, 1, 0}, {1, 1, 0}},
                                {{3, 0, -4}, {0.3, 0.5, -0.8}},
                                {{0, 9, 0}, {0, 1, 0.2}}};
    for (const ClipPlane& plane : planes)
        for (const glm::dvec3 direction : {glm::dvec3(0, 1, 0), glm::dvec3(1, 0.7, -0.4)}) {
            const glm::dvec3 normal = glm::normalize(plane.normal);
            const double cosine = glm::dot(normal, glm::normalize(direction));
            if (cosine < 0.1) // seen from behind or along the plane
                continue;
            Scene scene = parallel(direction, glm::dvec3(0.0), 0.75, {32, 32});
            scene.ray_cast->mode = RayMode::iso;
            scene.ray_cast->isos = {{0.0, glm::dvec3(1.0)}};
            scene.ray_cast->step_mm = 0.5;
            scene.ray_cast->shading = Shading{0.0, 1.0, 0.0, 1.0}; // its light is the cosine
            scene.clip_planes = {plane};
            scene.value_and_depth = true;
            findings.in(fmt::format("plane {:.1f} {:.1f} {:.1f}, along {:.1f} {:.1f} {:.1f}",
                                    normal.x, normal.y, normal.z, direction.x, direction.y,
                                    direction.z));
            const Image cut = painter.draw(scene, sphere);
            scene.ray_cast->mode = RayMode::alpha;
            scene.ray_cast->transfer = {
                {{0.0, glm::dvec3(1.0)}}, {{499.0, 0.0}, {500.0, 1.0}}, 1.0};
            const Image uniform = painter.draw(scene, ball);
            for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
                const double t = glm::dot(plane.point_mm - ray.origin_mm, normal) / cosine;
                const double from_centre = glm::length(ray.origin_mm + t * ray.direction);
                if (from_centre < radius - 0.1) { // interpolation moves the sphere by 0.03
                    findings.part("mm that a cap is off its plane");
                    findings.near(cut.at(x, y, 5), t, 2.0 * kPlaceMm);
                    findings.part("cosine of a cap's normal off its plane's");
                    findings.near(cut.at(x, y, 0), cosine, 1e-5);
                }
                if (from_centre < radius - 6.0) { // a difference's cells end 3 mm before the edge
                    findings.part("light on a cut through uniform matter, alpha");
                    findings.near(uniform.at(x, y, 0), 1.0, 1e-5);
                }
            });
        }
}

void maximum_peak(Painter& painter, Findings& findings) {
    const double sigma = 3.0, peak = 1000.0, curvature = peak / (sigma * sigma);
    // Grey rises to a red middle and on to blue, so that a maximum of colours is not the colour of
    // the maximum.
    TransferFunction transfer{
        {{0.0, {0, 0, 0}}, {500.0, {1, 0, 0}}, {1000.0, {0, 0, 1}}}, {{0.0, 1.0}}, 1.0};
    for (const Integrator integrator : integrators()) {
        if (integrator == Integrator::preintegrated) // maxima are not integrals
            continue;
        for (const glm::dvec3 center : {glm::dvec3(12.0), glm::dvec3(12.3, 11.9, 12.45)})
            for (const glm::dvec3 direction :
                 {glm::dvec3(1, 0, 0), glm::dvec3(0.2, 1, 0.4), glm::dvec3(1, -1, 1)})
                for (const double step : {0.25, 0.5, 1.0, 2.0}) {
                    const SceneData data{
                        synthetic::sample(synthetic::gaussian(center, sigma, peak),
                                          make_grid({25, 25, 25}, {1, 1, 1}), ScalarType::f32),
                        {}};
                    Scene scene = parallel(direction, center, 0.37, {8, 8});
                    scene.ray_cast->mode = RayMode::mip;
                    scene.ray_cast->integrator = integrator;
                    scene.ray_cast->step_mm = step;
                    scene.ray_cast->transfer = transfer;
                    scene.value_and_depth = true;
                    findings.in(fmt::format("step {}, along {:.2f} {:.2f} {:.2f}, peak at {}", step,
                                            direction.x, direction.y, direction.z, center.x));
                    const Image seen = painter.draw(scene, data);
                    const Image truth = render_truth(scene, data);
                    // fp32: a place off by kPlaceMm where the slope is at most 200 per mm, values
                    // up to 1000 in steps of 2^-14.
                    const double rounding = 3.0 * kPlaceMm * 202.0 + 1000.0 * 0x1p-22 +
                                            3.0 * 202.0 * painter.weight_rounding();
                    // A sample lies within half a step of the maximum. On the way the interpolant's
                    // slope is that of differences of the Gaussian no farther than that and a
                    // cell's diagonal from the peak of its ray, where it falls at `curvature` per
                    // mm at most; off the peak by 0.37 * 4 mm in either direction of the picture.
                    const glm::dvec3 forward = glm::abs(glm::normalize(direction));
                    const double slope = curvature * (forward.x + forward.y + forward.z) *
                                         (0.5 * step + std::sqrt(3.0) + 2.1);
                    const double missed =
                        integrator == Integrator::exact ? 0.0 : 0.5 * step * std::min(slope, 202.0);
                    findings.part(
                        fmt::format("maximum below its exact value, {}", name_of(integrator)));
                    for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray&) {
                        findings.near(seen.at(x, y, 4), truth.at(x, y, 4), missed + rounding);
                    });
                    findings.part(
                        fmt::format("maximum above its exact value, {}", name_of(integrator)));
                    for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray&) {
                        findings.within(std::max(0.0, double{seen.at(x, y, 4)} - truth.at(x, y, 4)),
                                        rounding);
                    });
                    findings.part(fmt::format("colour beside that of the maximum found, {}",
                                              name_of(integrator)));
                    for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray&) {
                        const glm::dvec3 color = color_at(transfer, seen.at(x, y, 4));
                        for (int c = 0; c < 3; ++c) // half an entry of 1000 / 4095, slope 1 / 500
                            findings.near(seen.at(x, y, static_cast<size_t>(c)), color[c],
                                          0.5 * 1000.0 / 4095.0 / 500.0 + 2e-6);
                    });
                }
    }
}

namespace {

// Truth at an iso-value a rounding lower and higher: a picture in fp32 may show any of the three.
struct Around {
    Image low, at, high;

    // Whether all agree that there is a surface, or that there is none.
    bool sure(uint32_t x, uint32_t y) const {
        const bool here = at.at(x, y, 3) > 0.0f;
        return here == (low.at(x, y, 3) > 0.0f) && here == (high.at(x, y, 3) > 0.0f);
    }
    double nearest(uint32_t x, uint32_t y) const {
        return std::min({low.at(x, y, 5), at.at(x, y, 5), high.at(x, y, 5)});
    }
    double farthest(uint32_t x, uint32_t y) const {
        return std::max({low.at(x, y, 5), at.at(x, y, 5), high.at(x, y, 5)});
    }
};

Around truth_around(Scene scene, const SceneData& data, double rounding) {
    const double iso = scene.ray_cast->isos[0].value;
    const auto at = [&](double value) {
        scene.ray_cast->isos[0].value = value;
        return render_truth(scene, data);
    };
    return {at(iso - rounding), at(iso), at(iso + rounding)};
}

Scene surface(glm::dvec3 direction, glm::dvec3 target, double pitch, glm::uvec2 size, double iso,
              double step, Integrator integrator) {
    Scene scene = parallel(direction, target, pitch, size);
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->integrator = integrator;
    scene.ray_cast->isos = {{iso}};
    scene.ray_cast->step_mm = step;
    scene.value_and_depth = true;
    return scene;
}

// Spheres: a ray that is inside for more than a step must show its first crossing, whichever
// integrator draws; and none shows a surface where there is none.
void spheres(Painter& painter, Findings& findings, Integrator integrator) {
    const double radius = 10.0;
    const Grid grid = make_grid({27, 27, 27}, {1, 1, 1}, glm::dvec3(-13.0));
    const SceneData data{
        synthetic::sample(synthetic::sphere_distance({}, radius), grid, ScalarType::f32), {}};
    const double rounding = 3.0 * kPlaceMm + 3.0 * painter.weight_rounding();
    for (const double step : {0.3, 1.0, 2.5})
        for (const glm::dvec3 direction : {glm::dvec3(0, 1, 0), glm::dvec3(1, 0.7, -0.4)}) {
            const Scene scene =
                surface(direction, glm::dvec3(0.0), 0.75, {32, 32}, 0.0, step, integrator);
            findings.in(fmt::format("sphere, step {}, along {} {} {}", step, direction.x,
                                    direction.y, direction.z));
            const Image seen = painter.draw(scene, data);
            const Around truth = truth_around(scene, data, rounding);
            for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
                const double along = glm::dot(ray.origin_mm, ray.direction);
                const double across = glm::length(ray.origin_mm - along * ray.direction);
                const bool hit = seen.at(x, y, 3) > 0.0f;
                findings.part(fmt::format("silhouettes, {}", name_of(integrator)));
                findings.expect(!hit || truth.at.at(x, y, 3) > 0.0f || !truth.sure(x, y),
                                "no surface where there is none");
                // Interpolation lowers the distance by up to 1/8 of its two curvatures, 1 / r each.
                const double least = radius - 0.25 / (radius - std::sqrt(3.0));
                const double chord_mm =
                    across < least ? 2.0 * std::sqrt(least * least - across * across) : 0.0;
                if (chord_mm <= step + 2.0 * kPlaceMm)
                    return;
                findings.expect(hit, "a surface on every ray inside for more than a step");
                // Along the ray the slope falls from cosine c by at most (h + 2 cells) / radius
                // over a bracket; false position started on it leaves h times the fifth power of
                // that share after four turns.
                const double cosine = std::sqrt(1.0 - across * across / (radius * radius));
                const double bend = (step + 2.0) / radius / cosine;
                if (bend > 0.5 || !truth.sure(x, y))
                    return;
                findings.part(
                    fmt::format("mm that a sphere's depth is off, {}", name_of(integrator)));
                findings.near(
                    seen.at(x, y, 5), truth.at.at(x, y, 5),
                    step * std::pow(bend, 5.0) + 2.0 * rounding / (cosine * (1.0 - bend)));
            });
        }
}

// Held where a ray crosses a surface twice, `apart` mm from the first time to the second: the exact
// integrator misses none, the others none that are more than a step apart. depth_bound is for the
// exact one; the others find the crossing within the bracket that a step makes.
void expect_first_of_two(Findings& findings, const Image& seen, const Scene& scene, uint32_t x,
                         uint32_t y, double apart, double depth, double depth_bound) {
    const Integrator integrator = scene.ray_cast->integrator;
    const bool hit = seen.at(x, y, 3) > 0.0f;
    const bool exact = integrator == Integrator::exact;
    findings.part(fmt::format("crossings missed, {}", name_of(integrator)));
    if (exact || apart > scene.ray_cast->step_mm + 2.0 * kPlaceMm)
        findings.within(hit ? 0.0 : 1.0, 0.0);
    if (!hit)
        return;
    findings.part(
        fmt::format("mm that the first of two crossings is off, {}", name_of(integrator)));
    findings.near(seen.at(x, y, 5), depth, exact ? depth_bound : scene.ray_cast->step_mm);
}

// Two surfaces d apart, d / step = 0.1 .. 2: what rises to 1 on one plane of samples and falls
// again.
void two_sheets(Painter& painter, Findings& findings, Integrator integrator) {
    const SceneData data{make_volume(make_grid({17, 33, 33}, {1, 1, 1}), ScalarType::f32,
                                     [](glm::uvec3 i) { return i.x == 8 ? 1.0 : 0.0; }),
                         {}};
    for (const double step : {0.5, 1.0, 3.0})
        for (const double ratio : {0.1, 0.3, 0.7, 1.0, 1.5, 2.0})
            for (const glm::dvec3 direction : {glm::dvec3(1, 0, 0), glm::dvec3(1, 0.6, -0.3)}) {
                const double d = ratio * step;
                if (d >= 2.0) // there is no more than the sheet
                    continue;
                const Scene scene = surface(direction, {8.1, 16.2, 15.9}, 0.37, {16, 16},
                                            1.0 - 0.5 * d, step, integrator);
                findings.in(fmt::format("sheets {} apart, step {}, along {} {} {}", d, step,
                                        direction.x, direction.y, direction.z));
                const Image seen = painter.draw(scene, data);
                for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
                    const double cosine = ray.direction.x; // the slope along the ray
                    expect_first_of_two(
                        findings, seen, scene, x, y, d / cosine,
                        (8.0 - 0.5 * d - ray.origin_mm.x) / cosine,
                        (3.0 * kPlaceMm + painter.weight_rounding()) / cosine + kPlaceMm);
                });
            }
}

// Two crossings, nearly one, within one cell: from corner to corner its value is 3 u (1 - u).
void one_cell(Painter& painter, Findings& findings, Integrator integrator) {
    const SceneData data{make_volume(make_grid({2, 2, 2}, {1, 1, 1}), ScalarType::f32,
                                     [](glm::uvec3 i) {
                                         const uint32_t sum = i.x + i.y + i.z;
                                         return sum == 0 || sum == 3 ? 0.0 : 1.0;
                                     }),
                         {}};
    for (const double iso : {0.3, 0.7, 0.74, 0.7499, 0.74999})
        for (const double step : {0.1, 1.0, 3.0}) {
            const Scene scene =
                surface({1, 1, 1}, glm::dvec3(0.5), 0.01, {1, 1}, iso, step, integrator);
            findings.in(fmt::format("corner to corner of a cell, iso {}, step {}", iso, step));
            const Image seen = painter.draw(scene, data);
            const double off = std::sqrt(0.25 - iso / 3.0); // of u, to either side of the middle
            // The value errs by a few of 2^-23, its place by that over the slope 6 off, in u.
            const double value_error = 8.0 * 0x1p-23 + 3.0 * painter.weight_rounding();
            const double side = std::sqrt(3.0);
            expect_first_of_two(findings, seen, scene, 0, 0, 2.0 * off * side, 64.0 - off * side,
                                value_error / (6.0 * off) * side + kPlaceMm);
        }
}

// Spherical shells against grid truth, which may have holes where a shell is thinner than a cell.
void shells(Painter& painter, Findings& findings) {
    const double radius = 9.0, rounding = 3.0 * kPlaceMm + 3.0 * painter.weight_rounding();
    for (const double d : {0.1, 0.5, 1.0, 2.0})
        for (const glm::dvec3 direction : {glm::dvec3(0, 1, 0), glm::dvec3(1, 0.7, -0.4)}) {
            const Grid grid = make_grid({25, 25, 25}, {1, 1, 1}, glm::dvec3(-12.0));
            const SceneData data{make_volume(grid, ScalarType::f32,
                                             [&](glm::uvec3 i) {
                                                 const double r = glm::length(glm::dvec3(i) - 12.0);
                                                 return 0.5 * d - std::abs(r - radius);
                                             }),
                                 {}};
            const Scene scene =
                surface(direction, glm::dvec3(0.0), 0.5, {40, 40}, 0.0, 1.0, Integrator::exact);
            findings.in(fmt::format("shells {} apart, along {} {} {}", d, direction.x, direction.y,
                                    direction.z));
            const Image seen = painter.draw(scene, data);
            const Around truth = truth_around(scene, data, rounding);
            for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray&) {
                if (!truth.sure(x, y))
                    return;
                const bool hit = seen.at(x, y, 3) > 0.0f, there = truth.at.at(x, y, 3) > 0.0f;
                findings.part("crossings missed or invented on shells, exact");
                findings.within(hit == there ? 0.0 : 1.0, 0.0);
                if (!hit || !there)
                    return;
                // Between the depths at iso-values a rounding lower and higher.
                const double depth = seen.at(x, y, 5);
                findings.part("mm that a shell's depth is off its place give or take a rounding");
                findings.within(
                    std::max({truth.nearest(x, y) - depth, depth - truth.farthest(x, y), 0.0}),
                    2.0 * kPlaceMm);
            });
        }
}

} // namespace

void iso_crossings(Painter& painter, Findings& findings) {
    for (const Integrator integrator : integrators()) {
        if (integrator == Integrator::preintegrated) // surfaces are not integrals
            continue;
        spheres(painter, findings, integrator);
        two_sheets(painter, findings, integrator);
        one_cell(painter, findings, integrator);
    }
    shells(painter, findings);
}

} // namespace palpate::cases
