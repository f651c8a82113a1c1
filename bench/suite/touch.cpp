// Touch: scenes x trajectories x algorithms with a recorded hand, the same through a simulated
// device, time of a tick, and how stiff a wall stays still.

#include "bench/suite/touch.h"

#include <memory>

#include "bench/touch/laws.h"
#include "bench/touch/open_loop.h"
#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "haptics/servo/histogram.h"

namespace palpate::bench {

namespace {

// Time of a tick on a ball with noise, of a hand that slides and leaves.
Json tick_times(const TouchPlan& plan, const TouchParts& parts) {
    constexpr double kDeadline_us = 1000.0;
    const auto us = [](uint64_t ns) { return 1e-3 * static_cast<double>(ns); };
    Json rows = Json::array();
    touch::TouchCase body{.id = "A2", .name = "ball/15mm"};
    body.solid = touch::ball({0, 0, -15.0}, 15.0);
    const touch::Scene scene = touch::make_scene(body, {.noise = 0.02});
    for (const haptics::AlgorithmEntry& entry : parts.algorithms)
        for (const uint32_t samples : {340u, 2000u}) {
            const bool sampled = entry.takes(haptics::kTakesSamples);
            if (entry.takes(haptics::kTakesMesh) || (!sampled && samples != 340))
                continue; // a mesh costs what it is made of
            haptics::TouchParameters parameters = touch_parameters(scene);
            parameters.tool_samples = samples;
            parameters.tool_radius_mm = sampled ? 2.5 : 0.0;
            touch::TouchCase raised = body;
            raised.touch_mm.z += parameters.tool_radius_mm;
            const auto algorithm = entry.make();
            const auto cpu = std::make_unique<haptics::Histogram>(); // ns
            uint64_t misses = 0;
            for (uint64_t seed = 1; cpu->count() < plan.timed_ticks; ++seed) {
                haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
                touch::Path path = touch::hand(raised, 1.5, 5.0, seed);
                input.tool.position_mm = path.front();
                algorithm->reset(input);
                for (const glm::dvec3 x : path) {
                    input.velocity_mm_per_s = (x - input.tool.position_mm) / touch::kTick_s;
                    input.tool.position_mm = x;
                    const double before = touch::thread_cpu_us();
                    algorithm->tick(input);
                    const double took = touch::thread_cpu_us() - before;
                    misses += took > kDeadline_us;
                    cpu->add(static_cast<uint64_t>(1e3 * took));
                }
            }
            rows.push_back({{"algorithm", entry.name},
                            {"as_printed", entry.as_printed},
                            {"samples", sampled ? samples : 1},
                            {"ticks", cpu->count()},
                            {"p50_us", us(cpu->percentile(0.5))},
                            {"p99_us", us(cpu->percentile(0.99))},
                            {"p999_us", us(cpu->percentile(0.999))},
                            {"max_us", us(cpu->max())},
                            {"misses", misses}});
        }
    return rows;
}

Json algorithms_json(const AllTotals& totals) {
    Json list = Json::array();
    for (const haptics::AlgorithmEntry& entry : haptics::algorithms()) {
        if (!totals.contains(entry.name))
            continue;
        list.push_back(
            {{"name", entry.name}, {"purpose", entry.purpose}, {"as_printed", entry.as_printed}});
        for (const char* key : {"cells", "ticks", "outside_bounds", "pop_throughs",
                                "pop_throughs_thin_walls", "not_finite", "penetration_voxels",
                                "direction_p99_deg", "excess_jump_n", "edit_jump_n"})
            list.items.back()[key] = total_of(totals, entry.name, key);
    }
    return list;
}

} // namespace

Json touch_laws(const TouchParts& parts) {
    Json list = Json::array();
    for (const haptics::AlgorithmEntry& entry : parts.algorithms) {
        const touch::Laws laws = touch::laws_of(entry);
        list.push_back({{"algorithm", entry.name},
                        {"as_printed", entry.as_printed},
                        {"energy_beyond_mj", laws.energy_beyond_mj},
                        {"friction_share", laws.friction_share},
                        {"stick_drift_um_s", laws.stick_drift_um_s},
                        {"yield_share", laws.yield_share},
                        {"below_yield_share", laws.below_yield_share},
                        {"limit_cycle_um", laws.limit_cycle_um}});
    }
    return list;
}

Result<Report> run_touch(Bench& bench) {
    const Options& options = bench.options();
    const TouchPlan plan = touch_plan(options);
    PALPATE_TRY(const TouchParts parts, touch_parts(options.only));
    Report report;
    report.json["notes"] = Json::array();
    AllTotals totals;
    Json seconds;
    Timer timer;
    const auto done = [&](const char* name) {
        seconds[name] = timer.ms() / 1000.0;
        log::info("touch: {} after {:.0f} s", name, timer.ms() / 1000.0);
        timer = Timer();
    };
    Json times = Json::array(), laws = Json::array();
    Result<Json> maps = Json::array();
    if (parts.times) {
        times = tick_times(plan, parts); // first: all alone
        done("times");
    }
    PALPATE_TRY(TouchGrid grid, touch_grid(plan, parts, options, report, totals));
    done("grid");
    if (parts.laws) {
        laws = touch_laws(parts);
        done("laws");
    }
    Json family = Json::array();
    for (const bool held : {false, true})
        if (held ? parts.family_held : parts.family) {
            PALPATE_TRY(Json rows, touch_family(parts, held, plan.family_seeds, options.stop));
            family.push_back(std::move(rows));
            done(held ? "family_held" : "family");
        }
    if (parts.z_width) {
        maps = touch_z_width(plan, options);
        if (!maps)
            return pass_on(maps);
        done("z_width");
    }
    Json metrics = touch_metrics(totals, times, laws, *maps);
    Json beside = touch_beside(totals, times, *maps);
    Json bounds{{"form", options.tiny   ? "tiny"
                         : options.full ? "full"
                                        : "short"},
                {"parts", parts.names()},
                {"most_ticks", plan.ticks},
                {"rows", touch_bounds(totals, grid.closed_totals)}};
    for (const haptics::AlgorithmEntry& entry : parts.algorithms)
        bounds["algorithms"].push_back(entry.name);
    report.json["touch"] = {{"seconds", std::move(seconds)},
                            {"algorithms", algorithms_json(totals)},
                            {"bounds", std::move(bounds)},
                            {"metrics", std::move(metrics)},
                            {"beside", std::move(beside)},
                            {"times", std::move(times)},
                            {"laws", std::move(laws)},
                            {"z_width", std::move(*maps)},
                            {"family", std::move(family)},
                            {"grid", std::move(grid.open)},
                            {"closed_loop", std::move(grid.closed)}};
    return report;
}

} // namespace palpate::bench
