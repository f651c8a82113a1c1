// Touch: scenes x trajectories x algorithms with a recorded hand, the same through a simulated
// device, time of a tick, and how stiff a wall stays still.

#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "bench/suite/suites.h"
#include "bench/touch/closed_loop.h"
#include "bench/touch/open_loop.h"
#include "engine/base/log.h"
#include "engine/image/png.h"
#include "engine/surface/marching_cubes.h"
#include "haptics/proxy/field.h"
#include "haptics/proxy/swept_mesh.h"
#include "haptics/servo/histogram.h"

namespace palpate::bench {

namespace {

using touch::Figures;

struct Plan {
    size_t ticks; // of a trajectory, at most
    bool all;     // every angle, thickness and speed
    bool uneven;  // the storages beyond 0.5 mm floats
    uint32_t z_columns, z_rows;
    size_t timed_ticks;
};

Plan plan_of(const Options& options) {
    if (options.tiny)
        return {120, false, false, 2, 2, 300};
    if (options.full)
        return {8000, true, true, 12, 9, 1'000'000};
    return {1500, false, true, 10, 7, 20'000};
}

struct NamedStorage {
    const char* name;
    touch::Storage storage;
};
std::vector<NamedStorage> storages(const Plan& plan) {
    std::vector<NamedStorage> list{{"0.5 mm, f32", {}}};
    if (plan.uneven) {
        list.push_back({"0.4 x 0.4 x 1.2 mm, i16",
                        {.spacing_mm = touch::kUneven_mm, .form = touch::Form::grey_i16}});
        list.push_back({"0.5 mm, labels", {.form = touch::Form::labels}});
    }
    return list;
}

haptics::TouchParameters parameters_for(const touch::Scene& scene) {
    haptics::TouchParameters parameters = touch::scene_parameters(scene);
    if (scene.storage.form == touch::Form::labels)
        parameters.source = haptics::TouchSource::labels;
    else
        tune(parameters, *scene.touch.grey);
    for (haptics::HapticTransfer& transfer : parameters.transfer)
        transfer = {.strength_n = 3.0};
    parameters.transfer[1] = {}; // no friction
    return parameters;
}

// Bounds of the issue; NaN: none for this kind.
struct Bound {
    double penetration = NAN, direction = NAN, jump = NAN;
};
Bound bound_of(const touch::TouchCase& body, touch::Form form) {
    if (form == touch::Form::labels) // binary samples: no claim on place and direction
        return {};
    if (body.id == "A10")
        return {body.noise <= 0.05 ? 0.25 : NAN, 6.0, body.noise <= 0.05 ? 0.02 : 0.10};
    const bool first = body.id <= "A6";
    return {first ? 0.05 : NAN, first ? 1.5 : NAN, 0.02};
}

Value cell_json(const Figures& f) {
    Value cell{{"ticks", f.ticks},
               {"contact_ticks", f.contact_ticks},
               {"pop_throughs", f.pop_throughs},
               {"not_finite", f.not_finite},
               {"penetration_voxels", f.penetration_voxels},
               {"excess_jump_n", f.excess_jump_n},
               {"largest_force_n", f.largest_force_n},
               {"energy_mj", f.energy_mj}};
    if (f.direction_deg.count())
        cell["direction_p99_deg"] = f.direction_deg.percentile(0.99);
    if (f.magnitude_share.count())
        cell["magnitude_p99"] = f.magnitude_share.percentile(0.99);
    return cell;
}

// What an algorithm can be asked: sampled tools and label papers have no grey form and so on.
bool applies(const haptics::AlgorithmEntry& algorithm, touch::Form form) {
    const std::string_view name = algorithm.name;
    if (name == "none")
        return false;
    return form != touch::Form::labels || !(name.starts_with("wish") || name == "swept-mesh");
}

struct Totals { // of one algorithm over everything
    uint64_t ticks = 0, pop_throughs = 0, not_finite = 0, cells = 0, broken = 0;
    double penetration = 0, direction = 0, jump = 0;
};

Value open_loop_grid(const Plan& plan, Report& report, std::map<std::string, Totals>& totals) {
    Value grid = Value::array();
    for (const NamedStorage& stored : storages(plan))
        for (const touch::TouchCase& body : touch::touch_cases(stored.storage, plan.all)) {
            touch::Scene scene = touch::make_scene(body, stored.storage);
            if (scene.touch.grey)
                scene.touch.touch_mesh =
                    haptics::make_touch_mesh(std::make_shared<Mesh>(marching_cubes(
                                                 *scene.touch.grey, static_cast<float>(scene.iso))),
                                             2.0 * touch::voxel_mm(stored.storage));
            const haptics::TouchParameters parameters = parameters_for(scene);
            const Bound bound = bound_of(body, stored.storage.form);
            for (const touch::Trajectory& trajectory :
                 touch::trajectories(body, plan.ticks, 1, plan.all))
                for (const haptics::AlgorithmEntry& entry : haptics::algorithms()) {
                    if (entry.name == std::string_view("none"))
                        continue;
                    Value row{{"id", body.id},
                              {"scene", body.name},
                              {"stored", stored.name},
                              {"trajectory", trajectory.id + " " + trajectory.name},
                              {"algorithm", entry.name},
                              {"as_printed", entry.as_printed}};
                    if (!applies(entry, stored.storage.form)) {
                        row["cell"] = Value();
                        grid.push_back(std::move(row));
                        continue;
                    }
                    const auto algorithm = entry.make();
                    const Figures f = touch::open_loop(*algorithm, scene, trajectory, parameters);
                    row["cell"] = cell_json(f);
                    Totals& t = totals[entry.name];
                    ++t.cells;
                    t.ticks += f.ticks;
                    t.not_finite += f.not_finite;
                    t.pop_throughs += f.pop_throughs;
                    const bool graded = stored.storage.form != touch::Form::labels;
                    if (graded && body.id <= "A6")
                        t.penetration = std::max(t.penetration, f.penetration_voxels);
                    if (graded && body.noise == 0.0)
                        t.direction = std::max(t.direction, f.direction_deg.percentile(0.99));
                    if (graded)
                        t.jump = std::max(t.jump, f.excess_jump_n);
                    const bool broken = f.pop_throughs > 0 || f.not_finite > 0 ||
                                        f.penetration_voxels > bound.penetration ||
                                        f.direction_deg.percentile(0.99) > bound.direction ||
                                        f.excess_jump_n > bound.jump;
                    row["within_bounds"] = !broken;
                    t.broken += broken;
                    // Only what no scene excuses makes the run fail.
                    if (entry.name == std::string_view("swept-point") &&
                        (f.not_finite > 0 ||
                         (f.pop_throughs > 0 && stored.storage.form != touch::Form::labels)))
                        report.failures.push_back(fmt::format(
                            "{} on {}, {}: passed through {} times, {} not numbers", entry.name,
                            body.name, trajectory.name, f.pop_throughs, f.not_finite));
                    grid.push_back(std::move(row));
                }
        }
    return grid;
}

Value closed_loop_grid(const Plan& plan) {
    Value grid = Value::array();
    const touch::Storage storage;
    for (const touch::TouchCase& body : touch::touch_cases(storage, false)) {
        if (body.noise > 0.0 || body.id == "A8" || body.id == "A9")
            continue;
        const touch::Scene scene = touch::make_scene(body, storage);
        haptics::TouchParameters parameters = parameters_for(scene);
        parameters.stiffness_n_per_m = 500.0;
        for (const haptics::DevicePreset& preset : haptics::device_presets())
            for (const haptics::AlgorithmEntry& entry : haptics::algorithms()) {
                const std::string_view name = entry.name;
                if (name != "swept-point" && name != "eriksson-2006" && name != "koerner-1999")
                    continue;
                touch::Path path = touch::press(body, 40.0, body.deepest_mm * 0.75, 0.8);
                if (path.size() > plan.ticks)
                    path.resize(plan.ticks);
                const auto algorithm = entry.make();
                const touch::LoopResult found = touch::closed_loop(
                    *algorithm, scene, path, parameters, {.device = &preset, .hand = {}});
                grid.push_back({{"id", body.id},
                                {"scene", body.name},
                                {"device", preset.name},
                                {"algorithm", entry.name},
                                {"pop_throughs", found.figures.pop_throughs},
                                {"penetration_voxels", found.figures.penetration_voxels},
                                {"largest_force_n", found.figures.largest_force_n},
                                {"motor_work_mj", found.work_mj},
                                {"limit_cycle_um", 1e3 * found.limit_cycle_mm}});
            }
    }
    return grid;
}

// Time of a tick: the phantom of 512^3 is for the long form, a ball of noise else.
Value tick_times(const Plan& plan) {
    const auto us = [](uint64_t ns) { return 1e-3 * static_cast<double>(ns); };
    Value rows = Value::array();
    touch::TouchCase body{.id = "A2", .name = "ball/15mm"};
    body.solid = touch::ball({0, 0, -15.0}, 15.0);
    const touch::Scene scene = touch::make_scene(body, {.noise = 0.02});
    for (const haptics::AlgorithmEntry& entry : haptics::algorithms())
        for (const uint32_t samples : {340u, 2000u}) {
            const std::string_view name = entry.name;
            const bool sampled = name == "swept-tool" || name == "vidholm-2004";
            if (name == "none" || (!sampled && samples != 340))
                continue;
            haptics::TouchParameters parameters = parameters_for(scene);
            parameters.tool_samples = samples;
            parameters.tool_radius_mm = sampled ? 2.5 : 0.0;
            touch::TouchCase raised = body;
            raised.touch_mm.z += parameters.tool_radius_mm;
            const auto algorithm = entry.make();
            const auto cpu = std::make_unique<haptics::Histogram>(); // ns
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
                    cpu->add(static_cast<uint64_t>(1e3 * (touch::thread_cpu_us() - before)));
                }
            }
            rows.push_back({{"algorithm", entry.name},
                            {"samples", sampled ? samples : 1},
                            {"ticks", cpu->count()},
                            {"p50_us", us(cpu->percentile(0.5))},
                            {"p99_us", us(cpu->percentile(0.99))},
                            {"p999_us", us(cpu->percentile(0.999))},
                            {"max_us", us(cpu->max())}});
        }
    return rows;
}

Result<Value> z_width_json(const Bench& bench, const Plan& plan) {
    Value maps = Value::array();
    for (const char* device : {"falcon", "touch", "omega"}) {
        const haptics::DevicePreset* preset = haptics::find_device_preset(device);
        if (!preset)
            continue;
        const auto cells = touch::z_width("swept-point", *preset, plan.z_columns, plan.z_rows);
        constexpr uint32_t kPixels = 24;
        Image picture =
            make_image({kPixels * plan.z_columns, kPixels * plan.z_rows}, {"R", "G", "B"});
        Value list = Value::array();
        double stiffest = 0.0;
        for (size_t i = 0; i < cells.size(); ++i) {
            const touch::ZWidthCell& cell = cells[i];
            const auto column = static_cast<uint32_t>(i % plan.z_columns);
            const auto row = static_cast<uint32_t>(plan.z_rows - 1 - i / plan.z_columns);
            // Green holds still; from yellow to red it shakes, by the logarithm of how much.
            const float shake = static_cast<float>(
                std::clamp(std::log10(std::max(cell.limit_cycle_mm, 1e-3) / 0.05) / 2.0, 0.0, 1.0));
            const glm::vec3 color = cell.stable ? glm::vec3(0.2f, 0.6f, 0.3f)
                                                : glm::vec3(0.9f, 0.75f - 0.65f * shake, 0.15f);
            for (uint32_t y = 1; y < kPixels; ++y)
                for (uint32_t x = 1; x < kPixels; ++x)
                    for (size_t c = 0; c < 3; ++c)
                        picture.at(column * kPixels + x, row * kPixels + y, c) =
                            color[static_cast<int>(c)];
            if (cell.stable)
                stiffest = std::max(stiffest, cell.stiffness_n_per_m);
            list.push_back({{"stiffness_n_per_m", cell.stiffness_n_per_m},
                            {"damping_n_s_per_m", cell.damping_n_s_per_m},
                            {"limit_cycle_um", 1e3 * cell.limit_cycle_mm},
                            {"stable", cell.stable}});
        }
        const std::string name = fmt::format("z_width_{}.png", device);
        if (const auto saved = save_png(bench.options().out / name, picture); !saved)
            return fail("{}", saved.error().message);
        maps.push_back({{"device", device},
                        {"png", name},
                        {"stiffest_stable_n_per_m", stiffest},
                        {"cells", std::move(list)}});
    }
    return maps;
}

// Our figures beside what papers and programs report; none of them reports the first four.
Value beside(const std::map<std::string, Totals>& totals, const Value& times) {
    const auto found = totals.find("swept-point");
    const Totals ours = found == totals.end() ? Totals{} : found->second;
    Value rows = Value::array();
    const auto add = [&](const char* what, Value figure, const char* others) {
        rows.push_back({{"what", what}, {"ours", std::move(figure)}, {"others", others}});
    };
    add("passed through, all scenes", ours.pop_throughs, "not reported by anyone");
    add("deepest proxy on A1 - A6, voxels", ours.penetration, "not reported by anyone");
    add("direction error p99, clean, degrees", ours.direction, "not reported by anyone");
    add("largest excess jump, N", ours.jump, "not reported by anyone");
    for (const Value& row : times) {
        if (row["algorithm"] == "swept-tool")
            add(row["samples"] == 340 ? "tick of a tool of 340 samples, p99.9, us"
                                      : "tick of a tool of 2000 samples, p99.9, us",
                row["p999_us"],
                row["samples"] == 340
                    ? "340 samples at 1 kHz (Vidholm & Agmund 2004); times not reported"
                    : "points of thousands at 1 kHz with distance fields (Barbic & James 2007)");
        if (row["algorithm"] == "swept-point")
            add("tick of a point, p99.9, us", row["p999_us"],
                "1 kHz (all five papers); local marching cubes 0.4 ms on average (UEA)");
    }
    return rows;
}

} // namespace

Result<Report> run_touch(Bench& bench) {
    const Plan plan = plan_of(bench.options());
    Report report;
    std::map<std::string, Totals> totals;
    log::info("touch: scenes x trajectories x algorithms");
    Value grid = open_loop_grid(plan, report, totals);
    log::info("touch: closed loop");
    Value closed = closed_loop_grid(plan);
    log::info("touch: time of a tick");
    Value times = tick_times(plan);
    const Result<Value> maps = z_width_json(bench, plan);
    if (!maps)
        return fail("{}", maps.error().message);
    Value algorithms = Value::array();
    for (const haptics::AlgorithmEntry& entry : haptics::algorithms()) {
        const auto t = totals.find(entry.name);
        if (t == totals.end())
            continue;
        algorithms.push_back({{"name", entry.name},
                              {"purpose", entry.purpose},
                              {"as_printed", entry.as_printed},
                              {"cells", t->second.cells},
                              {"ticks", t->second.ticks},
                              {"outside_bounds", t->second.broken},
                              {"pop_throughs", t->second.pop_throughs},
                              {"not_finite", t->second.not_finite},
                              {"penetration_voxels", t->second.penetration},
                              {"direction_p99_deg", t->second.direction},
                              {"excess_jump_n", t->second.jump}});
    }
    report.json["touch"] = {{"algorithms", std::move(algorithms)},
                            {"beside", beside(totals, times)},
                            {"times", std::move(times)},
                            {"z_width", *maps},
                            {"grid", std::move(grid)},
                            {"closed_loop", std::move(closed)}};
    return report;
}

} // namespace palpate::bench
