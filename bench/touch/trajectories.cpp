#include "bench/touch/trajectories.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace palpate::touch {

namespace {

using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kClear_mm = 2.0; // from the surface, before and after
// Random points stay within the scene's volume, projections to the surface included: beyond its
// faces there is no material, and a hand may walk round.
constexpr double kInside_mm = 11.0;

double unit(std::mt19937_64& random) { // the same on every machine, unlike std's distributions
    return static_cast<double>(random() >> 11) * 0x1p-53;
}

dvec3 across(const TouchCase& body) {
    return glm::cross(body.normal, body.along);
}

dvec3 at(const TouchCase& body, double height, double u = 0.0, double v = 0.0) {
    return body.touch_mm + height * body.normal + u * body.along + v * across(body);
}

void line_to(Path& path, dvec3 end, double speed_mm_s) {
    const dvec3 start = path.back();
    const auto steps = static_cast<size_t>(
        std::max(1.0, std::ceil(glm::distance(start, end) / (speed_mm_s * kTick_s))));
    for (size_t i = 1; i <= steps; ++i)
        path.push_back(glm::mix(start, end, static_cast<double>(i) / static_cast<double>(steps)));
}

void hold(Path& path, double seconds) {
    path.insert(path.end(), static_cast<size_t>(seconds / kTick_s), dvec3(path.back()));
}

// A speed ramp, so that a periodic motion starts at rest from the free start.
Path about(const TouchCase& body, double seconds, double approach_mm_s,
           const std::function<dvec3(double t)>& motion) {
    Path path{at(body, kClear_mm)};
    line_to(path, motion(0.0), approach_mm_s);
    const auto steps = static_cast<size_t>(seconds / kTick_s);
    for (size_t i = 1; i <= steps; ++i)
        path.push_back(motion(static_cast<double>(i) * kTick_s));
    return path;
}

} // namespace

Path press(const TouchCase& body, double speed_mm_s, double depth, double hold_s) {
    Path path{at(body, kClear_mm)};
    line_to(path, at(body, -depth), speed_mm_s);
    hold(path, hold_s);
    line_to(path, at(body, kClear_mm), speed_mm_s);
    return path;
}

Path crossing(const TouchCase& body, double speed_mm_s, double reach_mm) {
    Path path{at(body, kClear_mm)};
    hold(path, 0.005);
    line_to(path, at(body, -reach_mm, 0.11 * reach_mm, 0.07 * reach_mm), speed_mm_s);
    hold(path, 0.02);
    line_to(path, at(body, kClear_mm), speed_mm_s);
    return path;
}

Path slide(const TouchCase& body, double depth, double width, double seconds) {
    return about(body, seconds, 20.0, [&](double t) {
        return at(body, -depth, width * std::sin(kTwoPi * 0.5 * t),
                  0.7 * width * std::sin(kTwoPi * 0.35 * t));
    });
}

Path hand(const TouchCase& body, double depth, double seconds, uint64_t seed) {
    // Minimum-jerk reaches (Flash & Hogan 1985) between random points, with a tremor of 50 um.
    std::mt19937_64 random(seed);
    Path path{at(body, kClear_mm)};
    dvec3 from = path.back();
    const double phase = kTwoPi * unit(random), hertz = 8.0 + 4.0 * unit(random);
    while (static_cast<double>(path.size()) * kTick_s < seconds) {
        const dvec3 to = at(body, kClear_mm - (kClear_mm + depth) * unit(random),
                            6.0 * (unit(random) - 0.5), 6.0 * (unit(random) - 0.5));
        const auto steps = static_cast<size_t>(200.0 + 300.0 * unit(random));
        for (size_t i = 1; i <= steps; ++i) {
            const double s = static_cast<double>(i) / static_cast<double>(steps);
            const double reach = s * s * s * (10.0 + s * (6.0 * s - 15.0));
            const double t = static_cast<double>(path.size()) * kTick_s;
            const double tremor = 0.05 * std::sin(kTwoPi * hertz * t + phase);
            path.push_back(glm::mix(from, to, reach) + tremor * (body.along + body.normal));
        }
        from = to;
    }
    return path;
}

Path walk(const TouchCase& body, double largest_jump, size_t ticks, uint64_t seed) {
    std::mt19937_64 random(seed);
    Path path{at(body, kClear_mm)};
    while (path.size() < ticks) {
        const bool jump = unit(random) < 0.02;
        const double reach = jump ? largest_jump : 0.2;
        dvec3 next =
            path.back() + reach * (2.0 * dvec3(unit(random), unit(random), unit(random)) - 1.0);
        if (!jump) // drawn back towards the surface
            next += 0.01 * (body.touch_mm - next);
        path.push_back(glm::clamp(next, -kInside_mm, kInside_mm));
    }
    return path;
}

Path quantised(Path path, double step_mm) {
    for (dvec3& x : path)
        x = step_mm * glm::round(x / step_mm);
    return path;
}

std::vector<Trajectory> trajectories(const TouchCase& body, size_t ticks, uint64_t seed, bool all) {
    std::vector<Trajectory> made;
    const double deep = body.deepest_mm;
    const auto add = [&](const char* id, std::string name, Path path, bool judge_jumps,
                         bool judge_direction = true) {
        if (path.size() > ticks)
            path.resize(ticks);
        made.push_back({id, std::move(name), std::move(path), judge_jumps, judge_direction});
    };
    for (const double speed :
         all ? std::vector{1.0, 5.0, 20.0, 60.0, 200.0} : std::vector{20.0, 200.0})
        add("T1", fmt::format("press/{}mm_s", speed), press(body, speed, 0.75 * deep, 0.2), true);
    for (const double hertz : all ? std::vector{0.5, 2.0, 8.0, 20.0} : std::vector{2.0, 20.0})
        add("T2", fmt::format("sine/{}Hz", hertz),
            about(body, 3.0 / hertz, 20.0,
                  [&](double t) {
                      return at(body,
                                kClear_mm * 0.5 - (0.5 * kClear_mm + 0.5 * deep) *
                                                      (0.5 - 0.5 * std::cos(kTwoPi * hertz * t)));
                  }),
            true);
    for (const double speed :
         all ? std::vector{10.0, 100.0, 500.0, 1000.0, 2000.0, 5000.0} : std::vector{100.0, 5000.0})
        add("T3", fmt::format("crossing/{}m_s", speed / 1000.0), crossing(body, speed, 10.0), false,
            body.solid.free_is_convex);
    add("T4", "slide", slide(body, 0.5 * deep, 3.0, 4.0), true);
    add("T5", "circle",
        about(body, 3.0, 20.0,
              [&](double t) {
                  return at(body, -0.4 * deep, 2.5 * std::cos(kTwoPi * t),
                            2.5 * std::sin(kTwoPi * t));
              }),
        true);
    add("T6", "hand", hand(body, 0.6 * deep, 5.0, seed), true);
    add("T7", "walk", walk(body, 100.0, ticks, seed + 1), false, false);
    std::mt19937_64 random(seed + 2);
    Path noise{at(body, kClear_mm)};
    while (noise.size() < std::min<size_t>(ticks, 2000)) {
        const double reach = std::exp2(20.0 * unit(random) - 14.0); // 0.06 um to 64 mm
        const dvec3 x =
            body.touch_mm + reach * (2.0 * dvec3(unit(random), unit(random), unit(random)) - 1.0);
        noise.push_back(glm::clamp(x, -kInside_mm, kInside_mm));
    }
    add("T8", "fuzz", std::move(noise), false, false);
    for (const double step : all ? std::vector{0.049, 0.063, 0.005, 0.001} : std::vector{0.049})
        add("T9", fmt::format("slide/encoder{}um", std::lround(1000 * step)),
            quantised(slide(body, 0.5 * deep, 3.0, 3.0), step), true);
    Path dropped = hand(body, 0.6 * deep, 4.0, seed + 3);
    for (size_t i = 4; i + 4 < dropped.size(); ++i) {
        const double what = unit(random);
        if (what < 0.01)
            std::swap(dropped[i], dropped[i + 2]);
        else if (what < 0.03)
            dropped[i] = dropped[i - 1];
        else if (what < 0.035)
            std::fill(dropped.begin() + static_cast<long>(i),
                      dropped.begin() + static_cast<long>(i) + 4, dvec3(dropped[i]));
    }
    add("T10", "dropouts", std::move(dropped), false);
    return made;
}

} // namespace palpate::touch
