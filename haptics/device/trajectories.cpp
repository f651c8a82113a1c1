#include <algorithm>
#include <cmath>

#include "haptics/device/hand_path.h"

// Motions by name. All are sampled every 0.1 ms, so that between two poses a straight line differs
// from 20 Hz of 40 mm by less than 1 um: A (2 pi f dt)^2 / 8 = 0.8 um.
namespace palpate::haptics {

namespace {

constexpr double kStep_s = 1e-4;
constexpr double kTau = 6.283185307179586;

glm::dvec3 across(glm::dvec3 direction) {
    const glm::dvec3 size = glm::abs(direction);
    const glm::dvec3 axis = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                            : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                 : glm::dvec3(0, 0, 1);
    return glm::normalize(glm::cross(direction, axis));
}

// From 0 to 1 with the least jerk, at rest at both ends (Flash & Hogan, J. Neuroscience 1985).
double minimum_jerk(double share) {
    const double s = std::clamp(share, 0.0, 1.0);
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
}

// xorshift64*: the same numbers on every machine.
struct Random {
    uint64_t state;
    double operator()() { // 0 .. 1
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        return static_cast<double>(state * 0x2545F4914F6CDD1Dull >> 11) * 0x1p-53;
    }
};

// Axes of the motion: `in` along the approach, `right` and `up` across it.
struct Frame {
    explicit Frame(const TrajectoryShape& shape)
        : in(glm::normalize(shape.direction)), right(across(in)), up(glm::cross(in, right)) {}
    glm::dvec3 in, right, up;
};

template <class Position>
HandPath sampled(double duration_s, const Position& position) {
    const size_t count = static_cast<size_t>(std::ceil(duration_s / kStep_s)) + 1;
    std::vector<HandPose> poses(count);
    for (size_t i = 0; i < count; ++i) {
        poses[i].time_s = static_cast<double>(i) * kStep_s;
        poses[i].tool.position_mm = position(poses[i].time_s);
    }
    return HandPath(std::move(poses));
}

// Straight in at constant speed to the depth, hold, straight out.
HandPath press(const TrajectoryShape& s) {
    const Frame frame(s);
    const double length = s.distance_mm + s.depth_mm, way_s = length / s.speed_mm_per_s;
    return sampled(2 * way_s + s.duration_s, [&](double t) {
        const double done = std::clamp(std::min(t, 2 * way_s + s.duration_s - t) / way_s, 0.0, 1.0);
        return s.at_mm + frame.in * (done * length - s.distance_mm);
    });
}

// The same with minimum jerk.
HandPath touch(const TrajectoryShape& s) {
    const Frame frame(s);
    const double length = s.distance_mm + s.depth_mm, way_s = length / s.speed_mm_per_s;
    return sampled(2 * way_s + s.duration_s, [&](double t) {
        const double done = minimum_jerk(std::min(t, 2 * way_s + s.duration_s - t) / way_s);
        return s.at_mm + frame.in * (done * length - s.distance_mm);
    });
}

HandPath sine(const TrajectoryShape& s) {
    const Frame frame(s);
    return sampled(s.duration_s, [&](double t) {
        return s.at_mm + frame.in * (s.depth_mm * std::sin(kTau * s.frequency_hz * t));
    });
}

HandPath cross(const TrajectoryShape& s) {
    const Frame frame(s);
    const double length = 2 * s.distance_mm;
    return sampled(length / s.speed_mm_per_s, [&](double t) {
        return s.at_mm + frame.in * (s.speed_mm_per_s * t - s.distance_mm);
    });
}

// A Lissajous figure at depth, entered and left slowly.
HandPath slide(const TrajectoryShape& s) {
    const Frame frame(s);
    const double ramp_s = std::min(0.5, s.duration_s / 4);
    return sampled(s.duration_s, [&](double t) {
        const double in = minimum_jerk(std::min(t, s.duration_s - t) / ramp_s);
        const double turn = kTau * s.frequency_hz * t;
        return s.at_mm + frame.in * (in * (s.depth_mm + 2.0) - 2.0) +
               frame.right * (s.distance_mm * std::sin(turn)) +
               frame.up * (s.distance_mm * std::sin(1.5 * turn));
    });
}

HandPath circle(const TrajectoryShape& s) {
    const Frame frame(s);
    return sampled(s.duration_s, [&](double t) {
        const double turn = kTau * s.frequency_hz * t;
        return s.at_mm + s.distance_mm * (frame.in * std::cos(turn) + frame.right * std::sin(turn));
    });
}

// Reaches of a person: minimum jerk between points near the surface, with a tremor of 50 um at
// 8 to 12 Hz.
HandPath reach(const TrajectoryShape& s) {
    const Frame frame(s);
    Random random{s.seed * 0x9E3779B97F4A7C15ull | 1};
    struct Leg {
        double start_s, way_s;
        glm::dvec3 from, to;
    };
    std::vector<Leg> legs;
    glm::dvec3 here = s.at_mm - frame.in * s.distance_mm;
    for (double t = 0; t < s.duration_s;) {
        const double right = (2 * random() - 1) * s.distance_mm / 2;
        const double up = (2 * random() - 1) * s.distance_mm / 2;
        const double in = (2 * random() - 1) * s.depth_mm;
        const glm::dvec3 to = s.at_mm + frame.right * right + frame.up * up + frame.in * in;
        const double way_s = std::max(0.15, glm::length(to - here) / s.speed_mm_per_s);
        legs.push_back({t, way_s, here, to});
        t += way_s;
        here = to;
    }
    const double tremor_hz[3] = {8 + 4 * random(), 8 + 4 * random(), 8 + 4 * random()};
    size_t leg = 0;
    return sampled(s.duration_s, [&](double t) {
        while (leg + 1 < legs.size() && t >= legs[leg + 1].start_s)
            ++leg;
        const Leg& now = legs[leg];
        const double done = minimum_jerk((t - now.start_s) / now.way_s);
        return now.from + done * (now.to - now.from) +
               0.05 * glm::dvec3(std::sin(kTau * tremor_hz[0] * t),
                                 std::sin(kTau * tremor_hz[1] * t),
                                 std::sin(kTau * tremor_hz[2] * t));
    });
}

// Jumps of up to the distance every 10 ms: what a broken sensor says, and no hand does.
HandPath walk(const TrajectoryShape& s) {
    Random random{s.seed * 0x9E3779B97F4A7C15ull | 1};
    glm::dvec3 here = s.at_mm;
    int64_t last = 0;
    return sampled(s.duration_s, [&](double t) {
        if (const int64_t now = std::llround(t * 1000) / 10; now != last) {
            last = now;
            const double x = 2 * random() - 1, y = 2 * random() - 1, z = 2 * random() - 1;
            here = s.at_mm + s.distance_mm * glm::dvec3(x, y, z);
        }
        return here;
    });
}

} // namespace

const std::vector<TrajectoryEntry>& trajectories() {
    static const std::vector<TrajectoryEntry> entries{
        {"press", "straight in at constant speed, hold, straight out", press},
        {"touch", "in, hold and out with minimum jerk", touch},
        {"sine", "to and fro along the direction", sine},
        {"cross", "straight through at constant speed", cross},
        {"slide", "a Lissajous figure across the surface, at depth", slide},
        {"circle", "round the point, in the plane of the direction", circle},
        {"reach", "minimum-jerk reaches between random points, with tremor", reach},
        {"walk", "random jumps every 10 ms, as a broken sensor", walk},
    };
    return entries;
}

const TrajectoryEntry* find_trajectory(const std::string& name) {
    for (const TrajectoryEntry& entry : trajectories())
        if (name == entry.name)
            return &entry;
    return nullptr;
}

} // namespace palpate::haptics
