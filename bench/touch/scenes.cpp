#include "bench/touch/scenes.h"

#include <cmath>
#include <numbers>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"

namespace palpate::touch {

namespace {

using glm::dvec3;

dvec3 any_perpendicular(dvec3 n) {
    return glm::normalize(glm::cross(n, std::abs(n.x) < 0.6 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
}

TouchCase case_of(std::string id, std::string name, Solid solid, dvec3 touch, dvec3 normal) {
    TouchCase made{.id = std::move(id), .name = std::move(name), .solid = std::move(solid)};
    made.touch_mm = touch;
    made.normal = glm::normalize(normal);
    made.along = any_perpendicular(made.normal);
    return made;
}

// A direction that shares no plane with the axes.
const dvec3 kTilted = glm::normalize(dvec3(0.31, 0.43, 0.85));

void add_planes(std::vector<TouchCase>& cases, bool all) {
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const dvec3 n(x, y, z);
                if (n == dvec3(0.0) || (!all && n != dvec3(0, 0, 1) && n != dvec3(1, 1, 1)))
                    continue;
                const dvec3 on = glm::dot(dvec3(0.07, 0.11, -0.13), n) / glm::dot(n, n) * n;
                cases.push_back(
                    case_of("A1", fmt::format("plane/{},{},{}", x, y, z), plane(on, n), on, n));
            }
    cases.push_back(case_of("A1", "plane/tilted", plane(dvec3(0.0), kTilted), {}, kTilted));
}

void add_round(std::vector<TouchCase>& cases, bool all) {
    for (const double radius : all ? std::vector{1.0, 3.0, 15.0, 60.0} : std::vector{3.0, 15.0}) {
        TouchCase made = case_of("A2", fmt::format("ball/{}mm", radius),
                                 ball(-radius * kTilted, radius), {}, kTilted);
        made.deepest_mm = std::min(4.0, 0.5 * radius);
        cases.push_back(made);
    }
    for (const double radius : {3.0, 15.0})
        cases.push_back(case_of("A3", fmt::format("cavity/{}mm", radius),
                                cavity(radius * kTilted, radius), {}, kTilted));
}

void add_corners(std::vector<TouchCase>& cases, double voxel, bool all) {
    // Free space's corners may be sharper than material's: the spline fills them rather than
    // shaves.
    const double hollow_fillet = 1.5 * voxel, solid_fillet = 2.5 * voxel;
    const dvec3 along = any_perpendicular(kTilted);
    const auto corner = [&](const char* id, const std::string& name, double angle, bool hollow) {
        const std::vector<dvec3> n = wedge_normals(angle, hollow ? kTilted : -kTilted, along);
        // The rounded edge's crest lies at the origin.
        const double fillet = hollow ? hollow_fillet : solid_fillet;
        const double crest = fillet * (1.0 / std::sin(angle * std::numbers::pi / 360.0) - 1.0);
        TouchCase made = case_of(id, name,
                                 hollow ? hollow_corner(-crest * kTilted, n, fillet)
                                        : solid_corner(crest * kTilted, n, fillet),
                                 {}, kTilted);
        made.along = glm::cross(kTilted, along); // across the edge
        made.judge_jumps = hollow; // the proxy slips off a convex edge: no projection does
        cases.push_back(made);
    };
    for (const double angle : all ? std::vector{30.0, 60.0, 90.0, 120.0, 150.0} : std::vector{90.0})
        corner("A4", fmt::format("corner/2x{}", angle), angle, true);
    const std::vector<dvec3> cube{glm::normalize(dvec3(1, 0.2, 0.1)),
                                  glm::normalize(dvec3(-0.2, 1, 0.1)),
                                  glm::normalize(dvec3(-0.1, -0.1, 1))};
    const dvec3 up = glm::normalize(cube[0] + cube[1] + cube[2]);
    const auto three = [&](const char* id, const char* name, bool hollow) {
        const std::vector<dvec3> n{hollow ? cube[0] : -cube[0], hollow ? cube[1] : -cube[1],
                                   hollow ? cube[2] : -cube[2]};
        Solid solid =
            hollow ? hollow_corner({}, n, hollow_fillet) : solid_corner({}, n, solid_fillet);
        // From far out along `up` to the surface.
        double low = -20.0, high = 20.0;
        for (int i = 0; i < 60; ++i) {
            const double middle = 0.5 * (low + high);
            (solid.distance_mm(middle * up) > 0.0 ? high : low) = middle;
        }
        cases.push_back(case_of(id, name, std::move(solid), high * up, up));
        cases.back().judge_jumps = hollow;
    };
    three("A4", "corner/3", true);
    for (const double angle : all ? std::vector{60.0, 90.0, 120.0} : std::vector{90.0})
        corner("A5", fmt::format("edge/{}", angle), angle, false);
    three("A5", "edge/cube", false);
    for (const double angle : all ? std::vector{10.0, 20.0, 30.0, 60.0} : std::vector{30.0})
        corner("A6", fmt::format("groove/{}", angle), angle, true);
}

void add_walls(std::vector<TouchCase>& cases, const Storage& storage, bool all) {
    const double voxel = voxel_mm(storage), edge = edge_mm(storage);
    for (const double samples :
         all ? std::vector{1.0, 1.5, 2.0, 3.0, 4.0, 8.0} : std::vector{1.5, 3.0}) {
        const double thickness = samples * voxel;
        if (thickness < 1.4 * edge) // blurred, it is no longer there
            continue;
        const auto add = [&](const char* kind, Solid solid) {
            TouchCase made = case_of("A7", fmt::format("{}/{}voxels", kind, samples),
                                     std::move(solid), {}, kTilted);
            made.judge_jumps = false; // the far side is nearest beyond the middle
            made.is_thin = samples < 1.5;
            double low = 0.0, high = 2.0 * thickness + 4.0 * edge;
            for (int i = 0; i < 60; ++i) {
                const double middle = 0.5 * (low + high);
                (made.solid.distance_mm(middle * kTilted) > 0.0 ? high : low) = middle;
            }
            made.touch_mm = high * kTilted;
            cases.push_back(made);
        };
        add("wall", slab({}, kTilted, thickness, edge));
        cases.back().reach_mm = kWallReach_mm;
        add("shell", shell(-7.0 * kTilted, 7.0, thickness, edge));
    }
}

void add_shapes(std::vector<TouchCase>& cases) {
    // The level of a Gaussian is a sphere; what is stored is the Gaussian itself.
    Solid gaussian = ball({-9.0, 0.0, 0.0}, 9.0);
    constexpr double sigma = 7.0;
    gaussian.density = [](dvec3 x, double) {
        const double r2 = glm::dot(x + dvec3(9, 0, 0), x + dvec3(9, 0, 0));
        return 0.5 * std::exp((81.0 - r2) / (2.0 * sigma * sigma));
    };
    cases.push_back(case_of("A8", "gaussian", std::move(gaussian), {}, {1, 0, 0}));
    TouchCase ring = case_of("A9", "torus", torus({0, -9.0, 0}, 6.0, 3.0), {}, {0, 1, 0});
    ring.deepest_mm = 1.5;
    cases.push_back(ring);
    cases.push_back(
        case_of("A9", "cylinder", capped_cylinder({0, 0, -6.0}, {0.2, 0.1, 1.0}, 6.0, 6.0, 1.0),
                dvec3(0, 0, -6.0) + 6.0 * glm::normalize(dvec3(0.2, 0.1, 1.0)), {0.2, 0.1, 1.0}));
    TouchCase balls =
        case_of("A9", "two-balls", two_balls({-6, 0, -4}, {6, 0, -4}, 6.0), {-6, 0, 2}, {0, 0, 1});
    balls.judge_jumps = false; // the groove between them has no closed form here
    cases.push_back(balls);
    TouchCase minimal = case_of("A9", "gyroid", gyroid(12.0), {}, {-1, -1, -1});
    minimal.judge_jumps = false;
    cases.push_back(minimal);
}

} // namespace

double voxel_mm(const Storage& storage) {
    return std::max({storage.spacing_mm.x, storage.spacing_mm.y, storage.spacing_mm.z});
}

double edge_mm(const Storage& storage) {
    return kEdgeSamples * voxel_mm(storage);
}

std::vector<TouchCase> touch_cases(const Storage& storage, bool all) {
    std::vector<TouchCase> cases;
    add_planes(cases, all);
    add_round(cases, all);
    add_corners(cases, voxel_mm(storage), all);
    add_walls(cases, storage, all);
    add_shapes(cases);
    std::vector<TouchCase> clean;
    add_planes(clean, false);
    add_round(clean, false);
    for (const TouchCase& body : clean)
        for (const double noise : all ? std::vector{0.02, 0.05, 0.1} : std::vector{0.05, 0.1}) {
            if (body.name == "ball/1mm")
                continue;
            TouchCase noisy = body;
            noisy.id = "A10";
            noisy.name += fmt::format("/noise{}%", std::lround(100.0 * noise));
            noisy.noise = noise;
            cases.push_back(std::move(noisy));
        }
    return cases;
}

Grid scene_grid(const Storage& storage, double reach_mm) {
    const glm::uvec3 size(glm::ceil(2.0 * reach_mm / storage.spacing_mm) + 1.0);
    return make_grid(size, storage.spacing_mm,
                     dvec3(-reach_mm) + 0.37 * storage.spacing_mm * dvec3(1, 0.6, 0.8));
}

namespace {

double stored_value(const Solid& solid, const Storage& storage, double noise, glm::uvec3 index,
                    dvec3 mm) {
    const double value = solid.density(mm, edge_mm(storage));
    if (storage.form == Form::labels)
        return value >= 0.5 ? 1.0 : 0.0;
    return 1000.0 * (value + (noise > 0.0 ? noise * synthetic::noise(index, storage.seed) : 0.0));
}

// A later snapshot that holds another body: only what differs is written, as an edit does.
Volume edited(const Volume& before, const Solid& solid, const Storage& storage) {
    VolumeEdit edit(before);
    const glm::uvec3 size = before.size();
    const double full = storage.form == Form::labels ? 1.0 : 1000.0;
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const glm::uvec3 at(x, y, z);
                const dvec3 mm = world_point(before.grid(), dvec3(at));
                // Beyond six widths of the edge the density is 0 or 1 to 1e-9.
                const double d = solid.distance_mm(mm);
                const double value = std::abs(d) > 6.0 * edge_mm(storage)
                                         ? (d > 0.0 ? 0.0 : full)
                                         : stored_value(solid, storage, 0.0, at, mm);
                if (std::abs(value - double{before.value(at)}) > 1e-3)
                    edit.set(at, value);
            }
    return edit.commit();
}

void add_stages(Scene& scene) {
    const bool labels = scene.storage.form == Form::labels;
    haptics::TouchScene touch = scene.touch;
    std::optional<Volume>& felt = labels ? touch.labels : touch.grey;
    const Volume first = *felt;
    for (const EditStep& step : scene.body.edits) {
        if (!scene.stages.empty())
            felt = step.is_undo ? first : edited(*felt, step.solid, scene.storage);
        touch.version = scene.stages.size() + 1;
        scene.stages.push_back({step.ticks, step.solid, touch});
    }
}

} // namespace

size_t Scene::stage_at(size_t tick) const {
    size_t all = 0, stage = 0;
    for (const Stage& one : stages)
        all += one.ticks;
    for (tick = all ? tick % all : 0; stage < stages.size() && tick >= stages[stage].ticks; ++stage)
        tick -= stages[stage].ticks;
    return stage;
}

Scene make_scene(const TouchCase& body, const Storage& storage) {
    Scene scene{.body = body, .storage = storage};
    scene.touch.version = 1;
    if (storage.form == Form::labels)
        scene.iso = 0.5;
    if (body.store) {
        body.store(body, storage, scene.touch, scene.iso);
        return scene;
    }
    const Grid grid = scene_grid(storage, body.reach_mm);
    const double noise = storage.noise + body.noise;
    const Volume volume = make_volume(grid,
                                      storage.form == Form::labels     ? ScalarType::u8
                                      : storage.form == Form::grey_i16 ? ScalarType::i16
                                                                       : ScalarType::f32,
                                      [&](glm::uvec3 index) {
                                          return stored_value(body.solid, storage, noise, index,
                                                              world_point(grid, dvec3(index)));
                                      });
    (storage.form == Form::labels ? scene.touch.labels : scene.touch.grey) = volume;
    if (!body.edits.empty())
        add_stages(scene);
    return scene;
}

} // namespace palpate::touch
