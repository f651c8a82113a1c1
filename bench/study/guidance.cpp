#include "bench/study/guidance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>

#include "bench/study/liver_phantom.h"
#include "bench/study/simulated_user.h"
#include "engine/segment/guide_field.h"
#include "engine/segment/methods.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/grid.h"
#include "engine/volume/sample.h"
#include "haptics/device/simulated.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/servo/servo.h"

namespace palpate::bench {

namespace {

using glm::dvec3;

constexpr double kTick_s = 1e-3, kWait_s = 0.4; // until the soft start gives all force
constexpr double kAim_mm = 3.0, kWander_mm = 2.0, kTremor_mm = 0.2;

// Tremor of 8 to 12 Hz: three sines an axis.
class Tremor {
 public:
    explicit Tremor(Draw& draw) {
        for (auto& axis : waves_)
            for (Wave& wave : axis)
                wave = {draw.between(8.0, 12.0), draw.between(0.0, 2.0 * std::numbers::pi)};
    }
    dvec3 at(double time_s) const {
        dvec3 sum(0.0);
        for (int k = 0; k < 3; ++k)
            for (const Wave& wave : waves_[size_t(k)])
                sum[k] += kTremor_mm * std::sqrt(2.0 / 3.0) *
                          std::sin(2.0 * std::numbers::pi * wave.hertz * time_s + wave.phase);
        return sum;
    }

 private:
    struct Wave {
        double hertz, phase;
    };
    std::array<std::array<Wave, 3>, 3> waves_;
};

// A wander of standard deviation kWander_mm, of waves 20 to 60 mm long.
class Wander {
 public:
    explicit Wander(Draw& draw) {
        for (Wave& wave : waves_)
            wave = {draw.between(20.0, 60.0), draw.between(0.0, 2.0 * std::numbers::pi)};
    }
    double at(double way_mm) const {
        double sum = 0.0;
        for (const Wave& wave : waves_)
            sum += std::sin(2.0 * std::numbers::pi * way_mm / wave.length_mm + wave.phase);
        return kWander_mm * std::sqrt(2.0 / double(waves_.size())) * sum;
    }

 private:
    struct Wave {
        double length_mm, phase;
    };
    std::array<Wave, 3> waves_;
};

struct Drawn {
    std::vector<dvec3> hand_mm, proxy_mm; // a millisecond each, after the wait
};
struct Loads {
    double energy_mj = -1e30, force_n = 0.0;
    uint32_t faults = 0;
};

// A hand means to be at meant(t) for `end_s` seconds, after a rest at meant(0).
Drawn draw(const Volume* field, const char* algorithm, const GuidanceOptions& options,
           const std::function<dvec3(double)>& meant, double end_s, Loads& loads) {
    std::vector<haptics::HandPose> poses{{.time_s = 0.0, .tool = {meant(0.0)}}};
    for (int i = 0; i <= int(end_s / kTick_s); ++i)
        poses.push_back({.time_s = kWait_s + i * kTick_s, .tool = {meant(i * kTick_s)}});
    const haptics::HandPath path(std::move(poses));
    const haptics::DevicePreset& preset = *haptics::find_device_preset("touch");
    const haptics::Workspace workspace = haptics::workspace_around(path, preset.capabilities, 1.0);
    haptics::SimulatedDevice device(preset, {}, path, workspace);
    haptics::TouchScene scene{.version = 1};
    if (field)
        scene.field[0] = *field;
    Mailbox<haptics::TouchScene> scenes(std::make_unique<const haptics::TouchScene>(scene));
    haptics::TouchParameters how{.stiffness_n_per_m = options.stiffness_n_per_m,
                                 .yield_n = options.largest_n};
    Mailbox<haptics::TouchParameters> parameters(
        std::make_unique<const haptics::TouchParameters>(how));
    const auto guide = haptics::find_algorithm(algorithm)->make();
    haptics::Servo::Options servo_options;
    servo_options.limits.ramp_s = 0.2;
    haptics::Servo servo({device, *guide, scenes, parameters}, workspace, servo_options);
    servo.arm();
    Drawn drawn;
    const auto period_ns = int64_t(std::llround(1e9 * kTick_s));
    for (int64_t i = 0; i < int64_t((kWait_s + end_s) / kTick_s); ++i) {
        const haptics::ServoTick tick = servo.tick(i * period_ns, i * period_ns);
        loads.energy_mj = std::max(loads.energy_mj, 1e3 * device.motor_work_j());
        loads.force_n = std::max(loads.force_n, glm::length(tick.sent_world_n));
        loads.faults |= tick.faults;
        if (double(i) * kTick_s < kWait_s)
            continue;
        drawn.hand_mm.push_back(tick.tool.position_mm);
        drawn.proxy_mm.push_back(tick.touched.proxy.position_mm);
    }
    return drawn;
}

double signed_mm(SampleCursor& distance, const Grid& grid, dvec3 mm) {
    return distance.value(index_point(grid, mm));
}
dvec3 outward(SampleCursor& distance, const Grid& grid, dvec3 mm) {
    const dvec3 slope = world_gradient(grid, distance.gradient(index_point(grid, mm)));
    return glm::length(slope) > 1e-6 ? glm::normalize(slope) : dvec3(0.0, 0.0, 1.0);
}

double share(size_t part, size_t whole) {
    return whole ? double(part) / double(whole) : 0.0;
}

// Results of one task, without (0) and with force (1).
struct Off {
    std::vector<double> hand_mm, proxy_mm, apart2_mm2;
    size_t trials = 0, hand_outside = 0, proxy_outside = 0;
    Loads loads;

    Json json(const char* task, bool on) const {
        const auto figures = [](std::vector<double> off) {
            double sum = 0.0;
            for (const double mm : off)
                sum += mm;
            std::sort(off.begin(), off.end());
            return Json{{"mean", sum / double(off.size())}, {"p95", off[off.size() * 95 / 100]}};
        };
        Json row{{"task", task},
                 {"force", on},
                 {"trials", trials},
                 {"largest_energy_mj", loads.energy_mj},
                 {"largest_force_n", loads.force_n},
                 {"faults", loads.faults}};
        if (!hand_mm.empty())
            row.update({{"hand_mm", figures(hand_mm)}, {"proxy_mm", figures(proxy_mm)}});
        else
            row.update({{"hand_outside_share", share(hand_outside, trials)},
                        {"proxy_outside_share", share(proxy_outside, trials)}});
        if (!apart2_mm2.empty()) {
            double sum = 0.0;
            for (const double mm2 : apart2_mm2)
                sum += mm2;
            row["apart_mm"] = std::sqrt(sum / double(apart2_mm2.size()));
        }
        return row;
    }
    // Repeats of one line; `off` is a place's distance from where it should be.
    void add_lines(const std::vector<Drawn>& lines, const std::function<double(dvec3)>& off) {
        trials += lines.size();
        for (size_t a = 0; a < lines.size(); ++a) {
            for (size_t i = 0; i < lines[a].hand_mm.size(); i += 10) {
                hand_mm.push_back(std::abs(off(lines[a].hand_mm[i])));
                proxy_mm.push_back(std::abs(off(lines[a].proxy_mm[i])));
                for (size_t b = 0; b < a; ++b) {
                    const dvec3 apart = lines[a].proxy_mm[i] - lines[b].proxy_mm[i];
                    apart2_mm2.push_back(glm::dot(apart, apart));
                }
            }
        }
    }
};
using OffAndOn = std::array<Off, 2>;

// Seeds wanted 0.5 to 8 mm below the liver's surface; the hand comes from 12 mm deeper, misses by
// its aim, and clicks after a second.
Result<void> place_seeds(const LiverPhantom& phantom, uint64_t number,
                         const GuidanceOptions& options, OffAndOn& tallies, const Task& task) {
    SimulatedUser user(1000003 * number + 7, {});
    PALPATE_TRY(std::vector<SeedBall> first, user.seeds(phantom.truth, 5, task));
    std::erase_if(first, [&](const SeedBall& ball) {
        return !seed_map(phantom.volume, std::span(&ball, 1));
    });
    PALPATE_TRY(const Volume seeds, seed_map(phantom.volume, first));
    PALPATE_TRY(const Segmented found,
                segment(*find_segment_method("fast-marching"),
                        SegmentInput{phantom.volume, seeds, first, 0}, {}, task));
    PALPATE_TRY(const Volume field,
                guide_to_labels(found.labels, std::numeric_limits<double>::infinity(), task));
    PALPATE_TRY(const Volume truth, signed_distance(phantom.truth, {}, task));
    const Grid& grid = truth.grid();
    SampleCursor wanted(truth), guide(field);
    Draw random(77 * number + 1);
    for (uint32_t n = 0; n < options.seeds;) {
        const dvec3 target = world_point(
            grid,
            dvec3(random.below(grid.size.x), random.below(grid.size.y), random.below(grid.size.z)));
        const double depth = -signed_mm(wanted, grid, target);
        const dvec3 away = outward(wanted, grid, target);
        const dvec3 start = target - 12.0 * away;
        // The force begins where the hand is free of it.
        if (!(depth > 0.5 && depth < 8.0) || !(signed_mm(wanted, grid, start) < -6.0) ||
            !(signed_mm(guide, field.grid(), start) < -3.0))
            continue;
        ++n;
        const dvec3 aimed =
            target + kAim_mm * dvec3{random.normal(), random.normal(), random.normal()};
        const Tremor tremor(random);
        for (const bool on : {false, true}) {
            Off& off = tallies[on];
            const Drawn drawn = draw(
                on ? &field : nullptr, "guide-inside", options,
                [&](double t) {
                    return glm::mix(start, aimed, std::min(1.0, t / 0.6)) + tremor.at(t);
                },
                1.0, off.loads);
            ++off.trials;
            off.hand_outside += signed_mm(wanted, grid, drawn.hand_mm.back()) > 0.0;
            off.proxy_outside += signed_mm(wanted, grid, drawn.proxy_mm.back()) > 0.0;
        }
    }
    return {};
}

// Lines of 3 s at 25 mm/s along the liver's surface in an axial slice, a repeat each of its own
// wander.
Result<void> draw_edges(const LiverPhantom& phantom, uint64_t number,
                        const GuidanceOptions& options, OffAndOn& tallies, const Task& task) {
    PALPATE_TRY(const Volume field, guide_to_edges(phantom.volume, {}, task));
    PALPATE_TRY(const Volume truth, signed_distance(phantom.truth, {}, task));
    const Grid& grid = truth.grid();
    SampleCursor wanted(truth), guide(field);
    Draw random(77 * number + 2);
    // From a place near the surface, where no force is, along it: a step, then back to the surface.
    dvec3 place(0.0);
    do {
        place = world_point(grid, dvec3(random.below(grid.size.x), random.below(grid.size.y),
                                        random.below(grid.size.z)));
        place -= signed_mm(wanted, grid, place) * outward(wanted, grid, place);
    } while (!(std::abs(signed_mm(wanted, grid, place)) < 0.5) ||
             !(signed_mm(guide, field.grid(), place) <= 0.0));
    std::vector<dvec3> line, normals;
    for (int i = 0; i <= 3000; ++i) {
        dvec3 normal = outward(wanted, grid, place);
        place -= signed_mm(wanted, grid, place) * normal;
        line.push_back(place);
        normal.z = 0.0;
        normals.push_back(glm::length(normal) > 1e-6 ? glm::normalize(normal) : dvec3(1, 0, 0));
        place += 0.025 * dvec3(-normals.back().y, normals.back().x, 0.0);
    }
    for (const bool on : {false, true}) {
        std::vector<Drawn> lines;
        for (uint32_t r = 0; r < options.repeats; ++r) {
            Draw own(1000 * number + r);
            const Tremor tremor(own);
            const Wander wander(own);
            lines.push_back(draw(
                on ? &field : nullptr, "guide-inside", options,
                [&](double t) {
                    const size_t i = std::min<size_t>(size_t(t / kTick_s), 3000);
                    // It begins on the line, where no force is.
                    const double gone = std::min(1.0, t / 0.3);
                    return line[i] + gone * (wander.at(25.0 * t) * normals[i] + tremor.at(t));
                },
                3.0, tallies[on].loads));
        }
        tallies[on].add_lines(lines, [&](dvec3 mm) { return signed_mm(wanted, grid, mm); });
    }
    return {};
}

// Lines of 3 s in a plane through the liver, turned at random.
Result<void> draw_planes(const LiverPhantom& phantom, uint64_t number,
                         const GuidanceOptions& options, OffAndOn& tallies) {
    const Grid& grid = phantom.volume.grid();
    Draw random(77 * number + 3);
    const dvec3 middle = world_point(grid, 0.5 * (dvec3(grid.size) - 1.0));
    const dvec3 normal = glm::normalize(dvec3{random.normal(), random.normal(), random.normal()});
    const dvec3 along = glm::normalize(glm::cross(normal, dvec3(0.3, 0.5, 0.8)));
    PALPATE_TRY(const Volume field, guide_to_plane(grid, middle, normal));
    for (const bool on : {false, true}) {
        std::vector<Drawn> lines;
        for (uint32_t r = 0; r < options.repeats; ++r) {
            Draw own(1000 * number + 500 + r);
            const Tremor tremor(own);
            const Wander wander(own);
            lines.push_back(draw(
                on ? &field : nullptr, "guide-onto", options,
                [&](double t) {
                    return middle + 25.0 * t * along +
                           std::min(1.0, t / 0.3) * (wander.at(25.0 * t) * normal + tremor.at(t));
                },
                3.0, tallies[on].loads));
        }
        tallies[on].add_lines(lines, [&](dvec3 mm) { return glm::dot(mm - middle, normal); });
    }
    return {};
}

} // namespace

Result<Json> guidance_study(const GuidanceOptions& options, const Task& task) {
    OffAndOn seeds, edges, planes;
    for (uint32_t i = 0; i < options.phantoms; ++i) {
        const uint64_t number = options.first_phantom + i;
        const LiverPhantom phantom = liver_phantom(number);
        const Task part{task.stop, {}};
        PALPATE_TRY(place_seeds(phantom, number, options, seeds, part));
        PALPATE_TRY(draw_edges(phantom, number, options, edges, part));
        PALPATE_TRY(draw_planes(phantom, number, options, planes));
        if (task.progress)
            task.progress(double(i + 1) / double(options.phantoms));
    }
    Json rows = Json::array();
    for (const bool on : {false, true})
        for (const auto& [name, tally] :
             {std::pair("seeds", &seeds), {"edge", &edges}, {"plane", &planes}})
            rows.push_back((*tally)[on].json(name, on));
    return Json{{"rows", std::move(rows)}};
}

} // namespace palpate::bench
