#include "bench/segment/live_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <queue>

#include "engine/base/timer.h"
#include "engine/segment/live_wire.h"
#include "engine/segment/signed_distance.h"
#include "engine/segment/simplex_mesh.h"
#include "engine/volume/box.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

// -1 .. 1, a function of a sample's place.
double noise_at(glm::uvec3 i) {
    uint32_t h = i.x * 374761393u + i.y * 668265263u + i.z * 2147483647u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return double(h ^ (h >> 16)) / 2147483648.0 - 1.0;
}

// A ball with waves, of radius `radius` of the box, 100 HU in 0, an edge of four samples, noise of
// +-20: what a path along its surface meets.
Volume bumpy_ball(glm::uvec3 size) {
    const glm::dvec3 middle = 0.5 * glm::dvec3(size - 1u);
    const double radius = 0.35 * size.x;
    return make_volume(make_grid(size, {0.7, 0.7, 0.7}), ScalarType::i16, [=](glm::uvec3 i) {
        const glm::dvec3 p = (glm::dvec3(i) - middle) * glm::dvec3(1, 1, size.z > 1 ? 1 : 0);
        const double waves = 6.0 * std::sin(0.05 * p.x) * std::cos(0.06 * p.y);
        const double off = glm::length(p) - radius - waves;
        return 100.0 * std::clamp(0.5 - 0.25 * off, 0.0, 1.0) + 20.0 * noise_at(i);
    });
}

// Dijkstra's method with a heap, as plainly as it can be: what the path to a sample costs.
uint64_t least_cost(const LiveWire& wire, glm::uvec3 from, glm::uvec3 to) {
    const LiveWireRegion& region = wire.region();
    const glm::uvec3 n = region.size;
    const auto number = [&](glm::uvec3 p) { return p.x + n.x * (p.y + size_t{n.y} * p.z); };
    std::vector<uint32_t> cost(region.cost.size(), UINT32_MAX);
    using Entry = std::pair<uint32_t, size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    cost[number(from)] = 0;
    queue.push({0, number(from)});
    while (!queue.empty()) {
        const auto [so_far, at] = queue.top();
        queue.pop();
        if (at == number(to))
            return so_far;
        if (so_far > cost[at])
            continue;
        const glm::uvec3 p(at % n.x, at / n.x % n.y, at / (size_t{n.x} * n.y));
        for (const LiveWire::Step& step : wire.steps()) {
            const glm::uvec3 q(glm::ivec3(p) + step.by);
            if (q.x >= n.x || q.y >= n.y || q.z >= n.z)
                continue;
            const size_t there = number(q);
            const uint32_t next =
                so_far + step.length * (uint32_t{region.cost[at]} + region.cost[there]);
            if (next < cost[there]) {
                cost[there] = next;
                queue.push({next, there});
            }
        }
    }
    return UINT64_MAX;
}

// The cursor goes along the ball's surface, four samples from one picture to the next, up to 160
// samples' way from the anchor; then the anchor is set where the cursor is, as a person does.
Result<LiveTimes> follow(const Volume& volume, const Task& task) {
    const glm::uvec3 size = volume.size();
    PALPATE_TRY(LiveWireRegion region, live_wire_region(volume, glm::uvec3(0), size, {}, task));
    LiveWire wire(std::move(region));
    const double radius = 0.35 * size.x;
    const auto cursor = [&](int step) {
        const double turn = 4.0 * step / radius;
        glm::dvec3 at = 0.5 * glm::dvec3(size - 1u);
        at += radius * glm::dvec3(std::cos(turn), std::sin(turn), 0.0);
        if (size.z > 1)
            at.z += 0.3 * radius * std::sin(0.5 * turn);
        return glm::uvec3(glm::clamp(glm::round(at), glm::dvec3(0.0), glm::dvec3(size - 1u)));
    };
    LiveTimes out;
    constexpr int kSteps = 40;
    for (int anchor = 0; anchor < 3; ++anchor) {
        const int begin = anchor * kSteps;
        for (int step = 1; step <= kSteps; ++step) {
            const Timer timer;
            if (step == 1)
                wire.set_anchor(cursor(begin));
            const std::vector<glm::uvec3> path = wire.path(cursor(begin + step));
            out.ms.push_back(timer.ms());
        }
        if (anchor == 0) {
            const glm::uvec3 to = cursor(begin + kSteps);
            out.errors.push_back(
                std::abs(double(wire.cost_of(to)) - double(least_cost(wire, cursor(begin), to))));
        }
    }
    return out;
}

Result<LiveTimes> follow_in_slice(bool tiny, const Task& task) {
    const uint32_t side = tiny ? 64 : 512;
    return follow(bumpy_ball({side, side, 1}), task);
}
Result<LiveTimes> follow_in_volume(bool tiny, const Task& task) {
    return follow(bumpy_ball(glm::uvec3(tiny ? 48 : 512)), task);
}

// A slice of labels from kept arrival times, in each direction in turn.
Result<LiveTimes> slide(bool tiny, const Task&) {
    const uint32_t side = tiny ? 64 : 512;
    const Volume arrival =
        make_volume(make_grid({side, side, side}, {1, 1, 1}), ScalarType::f32, [=](glm::uvec3 i) {
            return glm::length(glm::dvec3(i) - 0.5 * double(side)) + noise_at(i);
        });
    LiveTimes out;
    std::vector<float> times(size_t{side} * side);
    std::vector<uint8_t> labels(times.size());
    for (int step = 0; step < 60; ++step) {
        const int axis = step % 3;
        glm::ivec3 first(0), size(static_cast<int>(side));
        first[axis] = int((side / 2 + uint32_t(step)) % side);
        size[axis] = 1;
        const float threshold = float(side) * float(step) / 60.0f;
        const Timer timer;
        read_box(arrival, first, size, packed(glm::uvec3(size)), times.data());
        for (size_t i = 0; i < times.size(); ++i)
            labels[i] = times[i] <= threshold ? 1 : 0;
        out.ms.push_back(timer.ms());
        size_t wrong = 0;
        for (uint32_t k = 0; k < 64; ++k) { // samples by themselves
            glm::uvec3 at(first);
            at[(axis + 1) % 3] = (37 * k) % side, at[(axis + 2) % 3] = (91 * k) % side;
            const glm::uvec3 p = at - glm::uvec3(first);
            wrong += (arrival.value(at) <= threshold) !=
                     (labels[p.x + uint32_t(size.x) * (p.y + size_t(size.y) * p.z)] != 0);
        }
        out.errors.push_back(double(wrong));
    }
    return out;
}

// A ring of 10,000 vertices drawn to the surface of another one.
Result<LiveTimes> step_mesh(bool tiny, const Task& task) {
    const uint32_t around = tiny ? 20 : 100, across = around / 2;
    const double ring = 40.0, tube = 12.0;
    const Grid grid = make_grid({112, 112, 36}, {1, 1, 1}, {-55.5, -55.5, -17.5});
    const Volume mask = make_volume(grid, ScalarType::u8, [=](glm::uvec3 i) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(i));
        return std::hypot(std::hypot(p.x, p.y) - ring, p.z) <= tube ? 1.0 : 0.0;
    });
    PALPATE_TRY(const Volume distance, signed_distance(mask, {}, task));
    Mesh triangles;
    for (uint32_t i = 0; i < around; ++i)
        for (uint32_t k = 0; k < across; ++k) {
            const double u = 2.0 * std::numbers::pi * i / around;
            const double v = 2.0 * std::numbers::pi * k / across;
            const double r = ring + 0.8 * tube * std::cos(v);
            triangles.positions.emplace_back(r * std::cos(u), r * std::sin(u),
                                             0.8 * tube * std::sin(v));
            const uint32_t next = (i + 1) % around, up = (k + 1) % across;
            const uint32_t a = i * across + k, b = next * across + k;
            triangles.triangles.emplace_back(a, b, next * across + up);
            triangles.triangles.emplace_back(a, next * across + up, i * across + up);
        }
    PALPATE_TRY(SimplexMesh mesh, simplex_mesh(triangles));
    const SimplexForce force = toward_surface(distance);
    LiveTimes out;
    for (int step = 0; step < 300; ++step) {
        const Timer timer;
        simplex_step(mesh, force, {}, {.rigidity = 1});
        out.ms.push_back(timer.ms());
    }
    for (const glm::dvec3 p : mesh.positions)
        out.errors.push_back(std::abs(std::hypot(std::hypot(p.x, p.y) - ring, p.z) - tube));
    return out;
}

} // namespace

std::span<const LiveCase> live_cases() {
    static constexpr std::array<LiveCase, 4> all{{
        {"live-wire slice", "512 x 512, the cursor moves; error against Dijkstra's cost", 8.0,
         follow_in_slice},
        {"live-wire volume", "512 x 512 x 512, the cursor moves; error against Dijkstra's cost",
         100.0, follow_in_volume},
        {"threshold slider", "a slice of 512 x 512 of kept arrival times; error in samples", 30.0,
         slide},
        {"simplex step", "10,000 vertices to a signed distance; error in mm of 1 mm samples", 1.0,
         step_mesh},
    }};
    return all;
}

} // namespace palpate::bench
