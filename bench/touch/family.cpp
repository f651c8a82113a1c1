#include "bench/touch/family.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate::touch {

namespace {

using glm::dvec3;

class Draw { // the same on every machine, unlike std's distributions
 public:
    explicit Draw(uint64_t seed) : random_(seed) {}
    double unit() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
    double within(double low, double high) { return low + (high - low) * unit(); }
    size_t below(size_t count) {
        return std::min(count - 1, static_cast<size_t>(unit() * static_cast<double>(count)));
    }
    dvec3 direction() {
        const double z = within(-1.0, 1.0), turn = within(0.0, 2.0 * std::numbers::pi);
        const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
        return {r * std::cos(turn), r * std::sin(turn), z};
    }

 private:
    std::mt19937_64 random_;
};

dvec3 perpendicular(dvec3 n) {
    return glm::normalize(glm::cross(n, std::abs(n.x) < 0.6 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
}

// ---- edges and noises
// -----------------------------------------------------------------------------

double phi(double x) {
    return 0.5 * std::erfc(-x / std::numbers::sqrt2);
}

// The value of an edge at a distance into material, in coarsest spacings.
double profile(Edge edge, double u) {
    switch (edge) {
        case Edge::erf04:
            return phi(u / 0.4);
        case Edge::erf07:
            return phi(u / 0.7);
        case Edge::erf12:
            return phi(u / 1.2);
        case Edge::ramp1:
            return std::clamp(0.5 + u, 0.0, 1.0);
        case Edge::ramp2:
            return std::clamp(0.5 + 0.5 * u, 0.0, 1.0);
        case Edge::box:
            return std::clamp(0.5 + 3.0 * u, 0.0, 1.0); // of a third of a sample
        case Edge::clipped:
            return std::clamp(2.0 * phi(u / 0.7) - 0.5, 0.0, 1.0);
        // A sharpening kernel: 11 % over and under.
        case Edge::bone: {
            const double x = u / 0.7;
            return phi(x) + x * std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
        }
        case Edge::slice:
            return phi(u / 0.5);
    }
    return 0.0;
}

// Offsets of a sample's values, in spacings of the axes: within its own voxel; in a slice of 1.5.
std::vector<dvec3> offsets_of(Edge edge) {
    std::vector<dvec3> offsets;
    if (edge == Edge::box)
        for (int i = 0; i < 27; ++i)
            offsets.push_back(dvec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1) / 3.0);
    else if (edge == Edge::slice)
        for (int i = -2; i <= 2; ++i)
            offsets.emplace_back(0.0, 0.0, 0.3 * i);
    else
        offsets.emplace_back(0.0);
    return offsets;
}

double noise_at(Noise noise, glm::uvec3 i, glm::uvec3 size, double value, uint64_t seed) {
    const auto white = [&](glm::ivec3 at) { return synthetic::noise(glm::uvec3(at + 64), seed); };
    switch (noise) {
        case Noise::none:
        case Noise::salt:
            return 0.0;
        case Noise::white:
            return white(glm::ivec3(i));
        case Noise::signal:
            return std::sqrt(std::clamp(value, 0.0, 1.0)) * white(glm::ivec3(i));
        case Noise::masked:
            return value > 0.02 ? white(glm::ivec3(i)) : 0.0;
        case Noise::correlated: { // a Gaussian of one sample, scaled to the same deviation
            double sum = 0.0, square = 0.0;
            for (int k = 0; k < 125; ++k) {
                const glm::ivec3 off(k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2);
                const double weight = std::exp(-0.5 * glm::dot(dvec3(off), dvec3(off)));
                sum += weight * white(glm::ivec3(i) + off);
                square += weight * weight;
            }
            return sum / std::sqrt(square);
        }
        case Noise::ring: { // about the middle of each slice, a sample wide
            const double r = glm::length(glm::dvec2(i) - 0.5 * glm::dvec2(size));
            return white({static_cast<int>(r), 7, static_cast<int>(i.z)});
        }
    }
    return 0.0;
}

// ---- grids
// ----------------------------------------------------------------------------------------

struct NamedGrid {
    const char* name;
    dvec3 spacing_mm;
    double turn_rad, shear; // about a diagonal; of y with z
};
constexpr double kTilt = 0.36397023426620234; // tan 20 degrees
const NamedGrid kGrids[] = {{"even", dvec3(0.5), 0.0, 0.0},
                            {"uneven", kUneven_mm, 0.0, 0.0},
                            {"oblique", {0.5, 0.5, 0.8}, 0.6, 0.0},
                            {"sheared", {0.5, 0.5, 0.7}, 0.0, kTilt}};

Grid family_grid(const NamedGrid& named) {
    // A turned or sheared box has to hold the same ball of kReach_mm.
    const double reach = kReach_mm * (named.turn_rad != 0.0 || named.shear != 0.0 ? 1.3 : 1.0);
    const glm::dquat turn = glm::angleAxis(named.turn_rad, glm::normalize(dvec3(1.0, 2.0, 3.0)));
    glm::dmat3 axes = glm::mat3_cast(turn);
    axes[2] += named.shear * axes[1];
    Grid grid;
    grid.size = glm::uvec3(glm::ceil(2.0 * reach / named.spacing_mm) + 1.0);
    const glm::dmat3 steps(axes[0] * named.spacing_mm.x, axes[1] * named.spacing_mm.y,
                           axes[2] * named.spacing_mm.z);
    const dvec3 origin = -steps * (0.5 * (dvec3(grid.size) - 1.0) + dvec3(0.37, 0.21, 0.29));
    grid.world_from_index = glm::dmat4(glm::dmat3(steps));
    grid.world_from_index[3] = glm::dvec4(origin, 1.0);
    return grid;
}

// ---- bodies
// ---------------------------------------------------------------------------------------

// A cone between two balls, exact; the nearest free point lies along the gradient.
Solid round_cone(dvec3 a, dvec3 b, double ra, double rb) {
    Solid solid;
    solid.distance_mm = [=](dvec3 x) {
        const dvec3 axis = b - a;
        const double l = glm::length(axis), along = glm::dot(x - a, axis) / l;
        const double across = std::sqrt(std::max(0.0, glm::dot(x - a, x - a) - along * along));
        const double s = (ra - rb) / l, c = std::sqrt(1.0 - s * s);
        const double k = along * c - across * s; // along the flank
        if (k < 0.0)
            return std::hypot(along, across) - ra;
        if (k > l * c)
            return std::hypot(along - l, across) - rb;
        return across * c + along * s - ra;
    };
    const auto distance = solid.distance_mm;
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        const double d = distance(x);
        if (d >= 0.0)
            return x;
        constexpr double h = 1e-5;
        dvec3 g;
        for (int axis = 0; axis < 3; ++axis) {
            dvec3 off(0.0);
            off[axis] = h;
            g[axis] = (distance(x + off) - distance(x - off)) / (2.0 * h);
        }
        if (std::abs(glm::length(g) - 1.0) > 1e-3) // near the axis
            return {};
        return x - d * glm::normalize(g);
    };
    solid.bulge_mm = std::min(ra, rb);
    return solid;
}

// x sin kz = y cos kz; distance to first order, no nearest free point.
Solid helicoid(double pitch_mm) {
    const double k = 2.0 * std::numbers::pi / pitch_mm;
    Solid solid;
    solid.distance_mm = [=](dvec3 x) {
        const double s = std::sin(k * x.z), c = std::cos(k * x.z);
        const double f = x.y * c - x.x * s, rise = k * (x.y * s + x.x * c);
        return f / std::sqrt(1.0 + rise * rise);
    };
    return solid;
}

// A point of the surface from far out along `up`.
dvec3 surface_along(const Solid& solid, dvec3 up, double from, double to) {
    double low = from, high = to;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (solid.distance_mm(middle * up) > 0.0 ? high : low) = middle;
    }
    return high * up;
}

TouchCase draw_body(Draw& draw, double voxel) {
    const dvec3 up = draw.direction(), along = perpendicular(up);
    TouchCase made{.id = "F"};
    made.normal = up;
    made.along = along;
    made.deepest_mm = 2.0;
    const auto set = [&](const char* name, Solid solid, bool judge_jumps) {
        made.name = name;
        made.solid = std::move(solid);
        made.judge_jumps = judge_jumps;
    };
    const auto on_surface = [&](double from, double to) {
        made.touch_mm = surface_along(made.solid, up, from, to);
    };
    switch (draw.below(12)) {
        case 0:
            set("plane", plane({}, up), true);
            break;
        case 1: {
            const double r = draw.within(2.0 * voxel, 12.0);
            set("ball", ball(-r * up, r), true);
            made.deepest_mm = std::min(2.0, 0.5 * r);
            break;
        }
        case 2: {
            const double r = draw.within(4.0 * voxel, 12.0);
            set("cavity", cavity(r * up, r), true);
            made.free_mm = std::min(made.free_mm, r); // beyond its middle the other side is near
            break;
        }
        case 3: {
            const double tube = draw.within(3.0 * voxel, 4.0), ring = tube + draw.within(2.0, 4.0);
            // Touched where its normal is `up`; it lies about z.
            const dvec3 out = glm::normalize(dvec3(up.x, up.y, 0.0));
            set("torus", torus(-ring * out - tube * up, ring, tube), true);
            made.deepest_mm = 0.5 * tube;
            break;
        }
        case 4: {
            const double r = draw.within(3.0 * voxel, 5.0);
            set("cylinder", capped_cylinder(-r * up, along, 7.0, r, std::min(0.5 * r, 2.5 * voxel)),
                true);
            made.deepest_mm = std::min(2.0, 0.5 * r);
            break;
        }
        case 5:
        case 6: {
            const bool hollow = draw.below(2) == 0;
            const auto n = wedge_normals(draw.within(50.0, 150.0), hollow ? up : -up, along);
            const double fillet = (hollow ? draw.within(1.5, 3.0) : draw.within(2.5, 4.0)) * voxel;
            set(hollow ? "groove" : "edge",
                hollow ? hollow_corner({}, n, fillet) : solid_corner({}, n, fillet), hollow);
            on_surface(-8.0, 8.0);
            break;
        }
        case 7: {
            const double r = draw.within(4.0, 8.0);
            set("shell", shell(-r * up, r, draw.within(2.0, 4.0) * voxel, 0.7 * voxel), false);
            on_surface(-0.5, 6.0);
            break;
        }
        case 8: {
            const double a = draw.within(1.5 * voxel, 2.0 * voxel);
            set("needle", round_cone(-9.0 * up, {}, 1.3 * a, a), false);
            made.touch_mm = a * up;
            made.deepest_mm = 0.5 * a;
            break;
        }
        case 9: {
            const double big = draw.within(5.0, 7.0), tip = draw.within(2.0, 4.0) * voxel;
            set("cone", round_cone(-12.0 * up, {}, big, tip), true);
            made.touch_mm = tip * up;
            made.deepest_mm = 0.5 * tip;
            break;
        }
        case 10: // its free channel is sqrt(3) / 4 of the period wide: room for a hand 5 mm off
            set("gyroid", gyroid(draw.within(24.0, 32.0)), false);
            break;
        default:
            set("helicoid", helicoid(draw.within(16.0, 40.0)), false);
            made.normal = {0, 1, 0};
            made.along = {1, 0, 0};
    }
    if (made.name == "gyroid")
        made.normal = glm::normalize(dvec3(-1.0));
    if (made.name == "gyroid")
        made.along = perpendicular(made.normal);
    return made;
}

} // namespace

const char* name_of(Edge edge) {
    constexpr const char* kNames[] = {"erf/0.4", "erf/0.7", "erf/1.2", "ramp/1", "ramp/2",
                                      "box",     "clipped", "bone",    "slice"};
    return kNames[static_cast<size_t>(edge)];
}

std::string name_of(NoiseLevel level) {
    constexpr const char* kNames[] = {"clean",  "white", "correlated", "signal",
                                      "masked", "ring",  "salt"};
    const char* name = kNames[static_cast<size_t>(level.noise)];
    return level.share > 0.0 ? fmt::format("{} {:.0f} %", name, 100.0 * level.share) : name;
}

FamilyScene family_scene(uint64_t seed, Edge edge, NoiseLevel level) {
    Draw draw(seed * 977 + 5);
    const NamedGrid& named = kGrids[(seed + static_cast<size_t>(edge)) % std::size(kGrids)];
    const Storage storage{.spacing_mm = named.spacing_mm, .seed = seed};
    const double voxel = voxel_mm(storage);
    TouchCase body = draw_body(draw, voxel);
    body.store = [=](const TouchCase& of, const Storage&, haptics::TouchScene& touch, double&) {
        const Grid grid = family_grid(named);
        const std::vector<dvec3> offsets = offsets_of(edge);
        touch.grey = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            double value = 0.0;
            for (const dvec3& off : offsets)
                value +=
                    profile(edge, -of.solid.distance_mm(world_point(grid, dvec3(i) + off)) / voxel);
            value /= static_cast<double>(offsets.size());
            value += level.share * noise_at(level.noise, i, grid.size, value, seed);
            if (level.noise == Noise::salt) {
                const double grain = synthetic::noise(i, seed + 17);
                value = grain > 3.09 ? 1.0 : grain < -3.09 ? 0.0 : value; // 0.1 % each
            }
            return 1000.0 * value;
        });
    };
    std::string name = fmt::format("{}, {}, {}, {}, seed {}", body.name, name_of(edge),
                                   name_of(level), named.name, seed);
    return {make_scene(body, storage), std::move(name)};
}

std::vector<FamilyCell> family_cells(uint64_t seed) {
    std::vector<FamilyCell> cells;
    for (size_t edge = 0; edge < kEdges; ++edge)
        cells.push_back({static_cast<Edge>(edge), {Noise::none, 0.0}});
    for (size_t i = 0; i < kNoises.size(); ++i)
        cells.push_back({static_cast<Edge>((seed + i) % kEdges), kNoises[i]});
    return cells;
}

std::vector<FamilyHand> family_hands(const TouchCase& body, uint64_t seed) {
    constexpr double kDepth_mm = 0.6, kRates_hz[] = {1000.0, 200.0, 4000.0, 8000.0};
    Draw draw(seed * 31 + 1);
    const double depth_mm = std::min(kDepth_mm, body.deepest_mm);
    const auto at = [&](double along, double height) {
        return body.touch_mm + std::min(height, body.free_mm) * body.normal + along * body.along;
    };
    std::vector<FamilyHand> hands;
    const auto line = [](Trajectory& t, dvec3 to, double speed) {
        const dvec3 from = t.path.back();
        const auto n = static_cast<size_t>(std::ceil(glm::distance(from, to) / (speed * t.tick_s)));
        for (size_t i = 1; i <= n; ++i)
            t.path.push_back(glm::mix(from, to, static_cast<double>(i) / static_cast<double>(n)));
    };
    for (const double speed : {10.0, 100.0, 300.0, 1000.0}) {
        const double rate = kRates_hz[draw.below(std::size(kRates_hz))];
        FamilyHand hand{.trajectory = {.id = "S",
                                       .name = fmt::format("slide {} mm/s, {} Hz", speed, rate),
                                       .path = {at(0.0, 2.0)},
                                       .tick_s = 1.0 / rate},
                        .slides = true};
        // From where it is free, over the touched point.
        line(hand.trajectory, at(0.0, -depth_mm), 100.0);
        const double reach = speed < 50.0 ? 0.5 : 3.0;
        line(hand.trajectory, at(reach, -depth_mm), speed);
        line(hand.trajectory, at(-reach, -depth_mm), speed);
        line(hand.trajectory, at(0.0, -depth_mm), speed);
        line(hand.trajectory, at(0.0, 3.0), 300.0);
        hands.push_back(std::move(hand));
    }
    FamilyHand tap{.trajectory = {.id = "T", .name = "tap 3 m/s", .path = {at(0.0, 5.0)}}};
    line(tap.trajectory, at(0.0, -0.75 * body.deepest_mm), 3000.0);
    tap.rests_from = tap.trajectory.path.size() + 200;
    for (int i = 0; i < 400; ++i)
        tap.trajectory.path.push_back(tap.trajectory.path.back());
    line(tap.trajectory, at(0.0, 5.0), 3000.0);
    tap.trajectory.judge_jumps = false;
    hands.push_back(std::move(tap));
    FamilyHand held{.trajectory = {.id = "H", .name = "hold", .path = {at(0.3, 1.0)}}};
    line(held.trajectory, at(0.3, -depth_mm), 20.0);
    held.rests_from = held.trajectory.path.size() + 200;
    for (int i = 0; i < 500; ++i)
        held.trajectory.path.push_back(held.trajectory.path.back());
    hands.push_back(std::move(held));
    FamilyHand brownian{.trajectory = {.id = "B", .name = "brownian", .path = {at(0.0, 1.0)}}};
    for (int i = 0; i < 600; ++i) {
        const dvec3 x = brownian.trajectory.path.back();
        brownian.trajectory.path.push_back(
            x + 0.05 * (2.0 * dvec3(draw.unit(), draw.unit(), draw.unit()) - 1.0) +
            0.01 * (at(0.0, -0.5 * depth_mm) - x));
    }
    hands.push_back(std::move(brownian));
    return hands;
}

} // namespace palpate::touch
