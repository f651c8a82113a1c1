// R1 .. R4: rays along axes, through faces, from inside, past edges, and past what is thin.

#include <cmath>

#include "bench/cases/scenes.h"
#include "engine/reference/twin.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate::cases {

namespace {

SceneData box() {
    return {filled(make_grid({5, 5, 5}, {1, 1, 1}), 0.5), {}};
}
constexpr glm::dvec3 kBoxMm(4.0);

double beside(float face, float towards) {
    return static_cast<double>(std::nextafter(face, towards));
}

// At the centre; on a face, an edge and a corner; one fp32 step inside and outside of two faces.
std::vector<std::pair<std::string, glm::dvec3>> eyes_inside() {
    std::vector<std::pair<std::string, glm::dvec3>> eyes{
        {"centre", {2, 2, 2}}, {"face", {4, 2, 2}}, {"edge", {4, 0, 2}}, {"corner", {0, 4, 0}}};
    for (const float towards : {2.0f, 8.0f})
        eyes.emplace_back("beside the far face", glm::dvec3(beside(4.0f, towards), 2, 2));
    for (const float towards : {2.0f, -2.0f})
        eyes.emplace_back("beside the near face", glm::dvec3(beside(0.0f, towards), 2, 2));
    return eyes;
}

Scene looking(glm::dvec3 eye, glm::dvec3 forward, double near_mm) {
    Scene scene;
    scene.size_px = {16, 16};
    scene.camera.eye_mm = eye;
    scene.camera.target_mm = eye + forward;
    scene.camera.view_angle_deg = 100.0;
    scene.ray_cast = RayCastLayer{};
    scene.ray_cast->min_transmittance = 0.0;
    scene.ray_cast->step_mm = 0.75;
    if (near_mm > 0.0)
        scene.clip_planes = {{eye + near_mm * glm::normalize(forward), forward}};
    return scene;
}

// A gyroid of slope at most 2 pi / 8 * sqrt(3) per mm, from inside, against the fp64 twin. A place
// is kPlaceMm off, so that a value errs by less than one entry of the table (3 / 4095 = 7e-4) and
// takes the neighbour's at most: its colour, and its extinction over the box's diagonal of 7 mm.
void gyroid_from_inside(Painter& painter, Findings& findings) {
    const SceneData data{
        synthetic::sample(synthetic::gyroid(8.0), make_grid({5, 5, 5}, {1, 1, 1}), ScalarType::f32),
        {}};
    const double slope = 2.0 * 3.14159265 / 8.0 * 3.0;
    const double value_error = kPlaceMm * slope + 3.0 * painter.weight_rounding() * slope;
    const double entry = 1.0 / 4095.0, entries = 1.0 + std::floor(value_error / (3.0 * entry));
    for (const RayMode mode : {RayMode::alpha, RayMode::mip})
        for (const Integrator integrator : integrators()) {
            if (mode == RayMode::mip && integrator != Integrator::fast)
                continue;
            findings.part(
                mode == RayMode::mip
                    ? "gyroid against the fp64 twin, MIP value"
                    : fmt::format("gyroid against the fp64 twin, colour, {}", name_of(integrator)));
            for (const auto& [name, eye] : eyes_inside())
                for (const glm::dvec3 forward : {glm::dvec3(1, 0, 0), glm::dvec3(-0.5, 0.75, 0.25)})
                    for (const double near_mm : {0.0, 0.7}) {
                        Scene scene = looking(eye, forward, near_mm);
                        scene.ray_cast->mode = mode;
                        scene.ray_cast->integrator = integrator;
                        scene.ray_cast->transfer = window_function(-1.5, 1.5, 0.1);
                        scene.value_and_depth = true;
                        findings.in(fmt::format("{}, cut {} mm off", name, near_mm));
                        const Image seen = painter.draw(scene, data);
                        const Image twin = render_twin(scene, data);
                        // -ln(1 - 0.1) = 0.105 per mm at the end; d tau / d opacity is 1.11 there.
                        const double bound = entries * entry * (1.0 + 0.1 * 1.11 * 7.0) + 1e-6;
                        for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray&) {
                            if (mode == RayMode::mip) {
                                const float value = twin.at(x, y, 4);
                                // A stretch of a rounding may be there for one of the two only.
                                if (std::isnan(value) || std::isnan(seen.at(x, y, 4)))
                                    findings.near(seen.at(x, y, 3), twin.at(x, y, 3), 0.11);
                                else
                                    findings.near(seen.at(x, y, 4), value, value_error + 1e-6);
                            } else {
                                for (size_t c = 0; c < 4; ++c)
                                    findings.near(seen.at(x, y, c), twin.at(x, y, c), bound);
                            }
                        });
                    }
        }
}

} // namespace

void ray_components(Painter& painter, Findings& findings) {
    const double tau = 0.1;
    const SceneData data = box();
    std::vector<Case> cases;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const glm::dvec3 direction(x, y, z);
                const int components = std::abs(x) + std::abs(y) + std::abs(z);
                if (components == 0)
                    continue;
                for (const double off : {0.0, 1.0 / (1 << 20), -1.0 / (1 << 20)}) {
                    // Along an axis, pixel centres are at multiples of 0.5 from -1.5 to 6 (or
                    // mirrored), so faces, edges and corners are met to the bit.
                    Scene scene = parallel(direction, glm::dvec3(2.25 + off), 0.5, {16, 16});
                    scene.ray_cast->transfer = constant(tau);
                    scene.ray_cast->step_mm = 0.75;
                    cases.push_back({fmt::format("direction {} {} {}, beside {}", x, y, z, off),
                                     scene, data,
                                     box_of(scene, kBoxMm, tau, components == 1 ? 0.0 : kPlaceMm)});
                }
            }
    findings.part("opacity of a box, 26 directions");
    run_all(cases, painter, findings);
}

void camera_inside(Painter& painter, Findings& findings) {
    const double tau = 0.3;
    const SceneData data = box();
    for (const Integrator integrator : integrators()) {
        std::vector<Case> cases;
        for (const auto& [name, eye] : eyes_inside())
            for (const glm::dvec3 forward : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0),
                                             glm::dvec3(0, 1, 0), glm::dvec3(-0.5, 0.75, 0.25)})
                for (const double near_mm : {0.0, 0.7}) {
                    Scene scene = looking(eye, forward, near_mm);
                    scene.ray_cast->integrator = integrator;
                    scene.ray_cast->transfer = constant(tau);
                    cases.push_back({fmt::format("{}, looking {} {} {}, cut {} mm off", name,
                                                 forward.x, forward.y, forward.z, near_mm),
                                     scene, data, box_of(scene, kBoxMm, tau, kPlaceMm, near_mm)});
                }
        findings.part(fmt::format("opacity of a box from inside, {}", name_of(integrator)));
        run_all(cases, painter, findings);
    }
    gyroid_from_inside(painter, findings);
}

void grazing(Painter& painter, Findings& findings) {
    const double tau = 0.5;
    const SceneData data = box();
    std::vector<Case> cases;
    // Pixels from 0.03 mm outside to 0.03 mm inside a silhouette: chords of 0 .. 0.06 mm.
    for (const glm::dvec3 direction : {glm::dvec3(1, 1, 0), glm::dvec3(1, 1, 0.5)}) {
        Scene scene = parallel(direction, {0, 4, 2}, 1.0 / 512, {32, 4});
        scene.ray_cast->transfer = constant(tau);
        scene.ray_cast->step_mm = 0.25;
        cases.push_back({"vertical edge", scene, data, box_of(scene, kBoxMm, tau, kPlaceMm)});
        scene = parallel(direction, {0, 4, 4}, 1.0 / 512, {32, 32});
        scene.ray_cast->transfer = constant(tau);
        cases.push_back({"corner", scene, data, box_of(scene, kBoxMm, tau, kPlaceMm)});
    }
    findings.part("opacity beside a silhouette");
    run_all(cases, painter, findings);
}

namespace {

// A volume that is 1 on the middle plane of samples and 0 on all others is a sheet of triangular
// profile, as thin as a grid holds; trilinear interpolation makes its integral along its normal
// exactly one sample. A volume that is `peak` on one line of samples alone is a tube of that kind.
constexpr double kSheetMm = 1.0;

Volume sheet() {
    return make_volume(make_grid({17, 33, 33}, {1, 1, 1}), ScalarType::f32,
                       [](glm::uvec3 i) { return i.x == 8 ? 1.0 : 0.0; });
}
// A tube of radius 0.3 samples covers pi * 0.09 of the sample it runs through.
constexpr double kTubePeak = 0.2827;
Volume tube() {
    return make_volume(make_grid({17, 17, 33}, {1, 1, 1}), ScalarType::f32,
                       [](glm::uvec3 i) { return i.x == 8 && i.y == 8 ? kTubePeak : 0.0; });
}

// One pixel, whose opacity is 1 - exp(-depth); `share` of the depth may be missing or too much.
// The table's nearest entry is at most half of 1 / 4095 off, over `length_mm` of non-zero values.
void thin(Painter& painter, Findings& findings, const Scene& scene, const Volume& volume,
          double depth, double share, double length_mm, double tau) {
    const Image image = painter.draw(scene, {volume, {}});
    const double seen = -std::log1p(-double{image.at(0, 0, 3)});
    const double table = tau * (0.5 / 4095.0 + 3.0 * painter.weight_rounding()) * length_mm;
    findings.near(seen / depth, 1.0, share + (table + 4e-6) / depth);
}

} // namespace

void thin_structures(Painter& painter, Findings& findings) {
    // Midpoint sums of a triangular profile of base 2, samples `d` apart across it, err by at most
    // sum over m of 2 sinc^2(pi m / d) <= d^2 / 3 of its integral (Poisson summation); trapezoids,
    // which preintegration makes of an extinction linear in the value, likewise. A sheet is met by
    // some sample for certain only where d < 2. `exact` takes no samples: whatever the step,
    // nothing is missed.
    const double tau = 0.25;
    const Volume volume = sheet(), thread = tube();
    for (const Integrator integrator : integrators()) {
        const bool samples = integrator != Integrator::exact;
        const double step = samples ? 0.5 : 4.0;
        findings.part(fmt::format("relative depth of a sheet tilted 0 .. 90 degrees, {}",
                                  name_of(integrator)));
        for (const double degrees : {0.0, 7.0, 30.0, 45.0, 60.0, 75.0, 83.0, 90.0})
            for (const double off : {0.0, 0.11, 0.37}) {
                const double angle = degrees * 3.14159265358979 / 180.0;
                const glm::dvec3 direction(degrees == 90.0 ? 0.0 : std::cos(angle),
                                           degrees == 0.0 ? 0.0 : std::sin(angle), 0.0);
                Scene scene = parallel(direction, {8.0, 16.0, 16.0}, 1.0, {1, 1});
                scene.camera.eye_mm -= off * step * direction;
                if (degrees == 90.0) { // in the sheet, `off` beside its middle
                    scene.camera.eye_mm.x += off;
                    scene.camera.target_mm.x += off;
                }
                scene.ray_cast->integrator = integrator;
                scene.ray_cast->step_mm = step;
                scene.ray_cast->transfer = linear_extinction(tau);
                findings.in(fmt::format("{} degrees, {} beside", degrees, off));
                const double across = step * direction.x;
                const double depth =
                    degrees == 90.0 ? tau * (1.0 - off) * 32.0 : tau * kSheetMm / direction.x;
                const double length = degrees == 90.0 ? 32.0 : 2.0 / direction.x;
                thin(painter, findings, scene, volume, depth, samples ? across * across / 3.0 : 0.0,
                     length, tau);
            }
        findings.part(
            fmt::format("relative depth of a tube of radius 0.3, {}", name_of(integrator)));
        for (const double beside : {0.0, 0.2, 0.5})
            for (const double tilt : {0.0, 20.0, 50.0})
                for (const double off : {0.0, 0.29}) {
                    const double angle = tilt * 3.14159265358979 / 180.0;
                    const glm::dvec3 direction(std::cos(angle), 0.0, std::sin(angle));
                    Scene scene = parallel(direction, {8.0, 8.0 + beside, 16.0}, 1.0, {1, 1});
                    scene.camera.eye_mm -= off * step * direction;
                    scene.ray_cast->integrator = integrator;
                    scene.ray_cast->step_mm = step;
                    scene.ray_cast->transfer = linear_extinction(tau);
                    findings.in(fmt::format("{} beside, tilted {}", beside, tilt));
                    const double depth = tau * kTubePeak * (1.0 - beside) / direction.x;
                    const double across = step * direction.x;
                    thin(painter, findings, scene, thread, depth,
                         samples ? across * across / 3.0 : 0.0, 2.0 / direction.x, tau);
                }
    }
}

} // namespace palpate::cases
