// R5 .. R10: optical depth, from sharp transfer functions to the last partial step.

#include <cmath>

#include "bench/cases/scenes.h"
#include "engine/volume/builder.h"

namespace palpate::cases {

// A plane ramp s = x through a triangular peak of opacity: the depth is the integral of tau over s,
// divided by the slope along the ray, wherever the lattice lies.
void sharp_transfer(Painter& painter, Findings& findings) {
    const double range = 64.0, half_width = 0.01 * range, top = 0.9, middle = 33.3;
    const Volume volume = make_volume(make_grid({65, 9, 9}, {1, 1, 1}), ScalarType::f32,
                                      [](glm::uvec3 i) { return static_cast<double>(i.x); });
    TransferFunction peak{{{0.0, glm::dvec3(1.0)}},
                          {{0.0, 0.0},
                           {middle - half_width, 0.0},
                           {middle, top},
                           {middle + half_width, 0.0},
                           {range, 0.0}},
                          1.0};
    // The integral of -ln(1 - top u) for u from 0 to 1, twice half_width.
    const double integral = 2.0 * half_width * ((1.0 - top) * std::log1p(-top) + top) / top;
    const double highest = -std::log1p(-top);
    for (const Integrator integrator : integrators())
        for (const double step : {0.35, 1.0, 3.0})
            for (const glm::dvec3 direction : {glm::dvec3(1, 0, 0), glm::dvec3(1, 0.05, -0.03)}) {
                findings.part(fmt::format("depth of a peak 2 % wide, {}", name_of(integrator)));
                const glm::dvec3 forward = glm::normalize(direction);
                const double depth = integral / forward.x;
                // Midpoint sums of a function that rises once and falls once are one step times its
                // height off at most: `fast` is at its Nyquist limit and beyond. The field is
                // linear, so that preintegration is exact but for the width of each segment in
                // entries of the table: places are kPlaceMm off at both ends, positions in the
                // table are 2^-12 apart there and rounded twice. `exact` does the same with pieces
                // of a cell, whatever the step.
                const double segment = integrator == Integrator::exact ? 1.0 / 8 : step;
                const double entry = range / 4095.0;
                const double width_error =
                    4.0 * 0x1p-12 + 2.0 * (2.0 * kPlaceMm + painter.weight_rounding()) / entry;
                const double exact = depth * width_error / (segment * forward.x / entry) + 1e-5;
                double least = 1e9, most = 0.0;
                for (int phase = 0; phase < 16; ++phase) {
                    Scene scene = parallel(direction, {32.0, 4.0, 4.0}, 1.0, {1, 1});
                    scene.camera.eye_mm -= phase / 16.0 * step * forward;
                    scene.ray_cast->integrator = integrator;
                    scene.ray_cast->step_mm = step;
                    scene.ray_cast->transfer = peak;
                    findings.in(
                        fmt::format("step {}, phase {}/16, slope {:.3f}", step, phase, forward.x));
                    const double seen =
                        -std::log1p(-double{painter.draw(scene, {volume, {}}).at(0, 0, 3)});
                    least = std::min(least, seen);
                    most = std::max(most, seen);
                    findings.near(seen, depth,
                                  integrator == Integrator::fast ? step * highest : exact);
                }
                if (integrator == Integrator::fast)
                    continue;
                findings.part(
                    fmt::format("spread over the phases of the lattice, {}", name_of(integrator)));
                findings.within(most - least, 2.0 * exact);
            }
}

void opacity_correction(Painter& painter, Findings& findings) {
    const double tau = 0.01, length = 70.0;
    const glm::dvec3 spacings[] = {{1, 1, 1}, {1, 1, 5}, {1, 2, 7}};
    for (const Integrator integrator : integrators()) {
        findings.part(fmt::format("opacity of a slab of 70 mm, {}", name_of(integrator)));
        double least = 1.0, most = 0.0;
        for (const glm::dvec3 spacing : spacings)
            for (int axis = 0; axis < 3; ++axis) {
                const Grid grid = make_grid(glm::uvec3(glm::round(length / spacing)) + 1u, spacing);
                glm::dvec3 direction(0.0);
                direction[axis] = 1.0;
                Scene scene = parallel(direction, glm::dvec3(35.0), 1.0, {1, 1});
                scene.ray_cast->integrator = integrator;
                scene.ray_cast->transfer = constant(tau);
                findings.in(fmt::format("spacing {} {} {} along axis {}", spacing.x, spacing.y,
                                        spacing.z, axis));
                const double seen = painter.draw(scene, {filled(grid, 0.5), {}}).at(0, 0, 3);
                findings.near(seen, -std::expm1(-tau * length), 1e-6 + 2.0 * tau * kPlaceMm);
                least = std::min(least, seen);
                most = std::max(most, seen);
            }
        findings.part(fmt::format("spread over spacings and axes, {}", name_of(integrator)));
        findings.within(most - least, 1e-4); // the line of the study; each is held closer above
    }
}

void cancellation(Painter& painter, Findings& findings) {
    const double step = 1.0 / 128; // exact in fp32, as is every place on its lattice
    const double steps = 10000.0;
    findings.part("relative opacity after 10^4 steps of depth 1e-6 .. 10");
    for (const double depth_per_step : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0}) {
        Scene scene = through_bar(step);
        scene.ray_cast->transfer = constant(depth_per_step / step, step);
        findings.in(fmt::format("optical depth {} a step", depth_per_step));
        const double hidden = -std::expm1(-steps * depth_per_step);
        findings.near(painter.draw(scene, bar(steps * step)).at(0, 0, 3) / hidden, 1.0, 1e-5);
    }
}

void accumulation(Painter& painter, Findings& findings) {
    const double step = 1.0 / 128, steps = 10000.0, depth_per_step = 1e-5;
    const glm::dvec3 color(0.25, 0.5, 1.0), behind(1.0, 0.0, 0.5);
    Scene scene = through_bar(step);
    scene.background = behind;
    scene.ray_cast->transfer = constant(depth_per_step / step, step, color);
    findings.part("colour of 10^4 samples of opacity 1e-5");
    findings.in("faint bar");
    const Image image = painter.draw(scene, bar(steps * step));
    const double hidden = -std::expm1(-steps * depth_per_step);
    for (int c = 0; c < 3; ++c) // increments are 2^-17 of a sum near 1
        findings.near(image.at(0, 0, static_cast<size_t>(c)),
                      hidden * color[c] + (1.0 - hidden) * behind[c], 1e-6);
}

void early_termination(Painter& painter, Findings& findings) {
    // A black veil 10 mm thick that lets 1/512 through, then white to the end.
    const double veil_mm = 10.0, tau = std::log(512.0) / veil_mm;
    const Grid grid = make_grid({21, 2, 2}, {1.0, 4.0, 4.0});
    const SceneData data{
        make_volume(grid, ScalarType::f32, [](glm::uvec3 i) { return static_cast<double>(i.x); }),
        {}};
    findings.part("colour behind a veil, beside the bound a ray may stop at");
    for (const double bound : {0.0, 1.0 / 4096, 1.0 / 1024, 1.0 / 256}) {
        Scene scene = through_bar(0.5); // the middle of no step lies at the change of colour
        scene.ray_cast->transfer = {{{0.0, glm::dvec3(0.0)},
                                     {veil_mm, glm::dvec3(0.0)},
                                     {veil_mm, glm::dvec3(1.0)},
                                     {20.0, glm::dvec3(1.0)}},
                                    {{0.0, -std::expm1(-tau)}},
                                    1.0};
        scene.ray_cast->min_transmittance = bound;
        findings.in(fmt::format("stops below {}", bound));
        const Image image = painter.draw(scene, data);
        const double white = std::exp(-tau * veil_mm) * -std::expm1(-tau * (20.0 - veil_mm));
        const double through = std::exp(-tau * 20.0);
        const double seen = image.at(0, 0, 0); // fp32 sums near 1 are good to some 2^-24
        findings.near(seen, white, bound + 1e-6);
        findings.within(std::max(seen - white, 0.0), 1e-6); // never more than there is
        findings.near(image.at(0, 0, 3), 1.0 - through, bound + 1e-6);
    }
}

void partial_steps(Painter& painter, Findings& findings) {
    const double tau = 0.3;
    for (const Integrator integrator : integrators()) {
        findings.part(fmt::format("opacity of slabs of 0.1 .. 7.9 steps, {}", name_of(integrator)));
        for (const double whole : {0.0, 7.0})
            for (double part = 0.1; part < 1.0; part += 0.1)
                for (const double start : {-16.0, -16.37}) {
                    Scene scene = through_bar(1.0);
                    scene.camera.eye_mm.x = start;
                    scene.ray_cast->integrator = integrator;
                    scene.ray_cast->transfer = constant(tau);
                    const double length = whole + part;
                    findings.in(fmt::format("{} steps from {}", length, start));
                    // Places 25 mm from the eye are 2^-19 mm apart.
                    findings.near(painter.draw(scene, bar(length)).at(0, 0, 3),
                                  -std::expm1(-tau * length), 1e-6);
                }
    }
}

} // namespace palpate::cases
