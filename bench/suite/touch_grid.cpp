// The grid of `palpate bench touch`: scene x trajectory x algorithm, with a hand that goes its way
// whatever the force says, and with one that holds a simulated device.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "bench/suite/touch.h"
#include "bench/touch/closed_loop.h"
#include "bench/touch/open_loop.h"
#include "engine/base/log.h"

namespace palpate::bench {

namespace {

using haptics::AlgorithmEntry;
using touch::Figures;

// The bounds that the issue sets for a scene; NaN: nothing of this kind.
struct Bound {
    double penetration = NAN, direction = NAN, jump = NAN, free_force = NAN, field_force = NAN;
};
Bound bound_of(const touch::Scene& scene) {
    const touch::TouchCase& body = scene.body;
    const std::string& id = body.id;
    const bool labels = scene.storage.form == touch::Form::labels;
    constexpr double kNone = 1e-9; // N
    if (id == "A10")
        return labels ? Bound{}
                      : Bound{.penetration = body.noise <= 0.05 ? 0.25 : NAN,
                              .direction = 6.0,
                              .jump = body.noise <= 0.05 ? 0.02 : 0.10};
    if (id == "A11") // no truth
        return {};
    if (id == "A12" && body.name != "extremes/plane")
        return {.free_force = kNone};
    if (id == "A13")
        return {.penetration = labels ? NAN : 0.05,
                .direction = labels ? NAN : 1.5,
                .jump = 0.10,
                .free_force = kNone};
    // Trilinear samples of a linear field are exact but for their rounding: floats to 1e-6 of their
    // size. 16 bits err by half a step in some 1000 of a component, and by half in 400 of a slope;
    // of 3 N that is 0.003 and 0.007 N, and a transfer function that rises by 3 N in 4 x 100 steps
    // at most adds 0.004.
    if (id == "A14")
        return {.field_force = scene.storage.form == touch::Form::grey_i16 ? 0.02 : 1e-3};
    if (labels || body.is_thin) // binary samples: no claim on place and direction
        return {};
    const bool first = id <= "A6" || id == "A12";
    return {.penetration = first ? 0.05 : NAN,
            .direction = first ? 1.5 : NAN,
            .jump = 0.02,
            .free_force = kNone};
}

double rounded(double value) { // to four digits: the page holds tens of thousands
    if (!(std::abs(value) > 1e-12) || !std::isfinite(value))
        return 0.0;
    const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 3.0);
    return std::round(value / unit) * unit;
}

Json cell_json(const Figures& f, const touch::Scene& scene) {
    Json cell{{"ticks", f.ticks},
              {"contact_ticks", f.contact_ticks},
              {"pop_throughs", f.pop_throughs},
              {"not_finite", f.not_finite},
              {"penetration_voxels", rounded(f.penetration_voxels)},
              {"excess_jump_n", rounded(f.excess_jump_n)},
              {"free_force_n", rounded(f.free_force_n)},
              {"beyond_spring_n", rounded(f.beyond_spring_n)},
              {"largest_force_n", rounded(f.largest_force_n)},
              {"energy_mj", rounded(f.energy_mj)}};
    if (f.direction_deg.count()) {
        cell["direction_p99_deg"] = rounded(f.direction_deg.percentile(0.99));
        cell["direction_ticks"] = f.direction_deg.count();
        cell["direction_ticks_above_1.5"] = f.direction_deg.above(1.5);
    }
    if (f.magnitude_share.count())
        cell["magnitude_p99"] = rounded(f.magnitude_share.percentile(0.99));
    if (!scene.stages.empty())
        cell["edit_jump_n"] = rounded(f.edit_jump_n);
    if (scene.body.force_n)
        cell["closed_form_n"] = rounded(f.closed_form_n);
    return cell;
}

// The figures that are beyond a bound, in words, with the bound; empty where all holds.
std::string beyond(const Figures& f, const Bound& bound) {
    std::string text;
    const auto judge = [&](const char* what, double found, double most) {
        if (found > most)
            text += fmt::format("{}{} {:.3g}, bound {:.3g}", text.empty() ? "" : "; ", what, found,
                                most);
    };
    judge("passed through", double(f.pop_throughs), 0.0);
    judge("not numbers", double(f.not_finite), 0.0);
    judge("penetration in voxels", f.penetration_voxels, bound.penetration);
    judge("direction p99 in degrees", f.direction_deg.percentile(0.99), bound.direction);
    judge("excess jump in N", f.excess_jump_n, bound.jump);
    judge("force where nothing is, in N", f.free_force_n, bound.free_force);
    judge("distance to the closed form, in N", f.closed_form_n, bound.field_force);
    return text;
}

double direction(const Figures& f) {
    return f.direction_deg.percentile(0.99);
}
double jump(const Figures& f) {
    return f.excess_jump_n;
}
double penetration(const Figures& f) {
    return f.penetration_voxels;
}

// A figure of the cells of scenes A<first> .. A<last>, as far as they have a true surface, grey
// values and no thin walls.
struct Gauge {
    const char* key;
    int first, last;
    double (*figure)(const Figures& f);
    double least_noise = 0.0, most_noise = 1.0; // of the scene
    bool pools_directions = false;
};
constexpr Gauge kGauges[] = {
    {"penetration_voxels", 1, 6, penetration},
    {"penetration_noise", 10, 10, penetration, 0.0, 0.05},
    {"penetration_noise5", 10, 10, penetration, 0.05, 0.05},
    {"direction_p99_deg", 1, 9, direction},
    {"direction_p99_deg", 12, 12, direction},
    {"direction_flat", 1, 3, direction},
    {"direction_clean", 1, 9, direction, 0.0, 1.0, true},
    {"direction_noise", 10, 10, direction},
    {"direction_noise10", 10, 10, direction, 0.1, 0.1, true},
    {"magnitude", 1, 3, [](const Figures& f) { return f.magnitude_share.percentile(0.99); }},
    {"excess_jump_n", 1, 9, jump},
    {"excess_jump_n", 12, 12, jump},
    {"jump_clean", 1, 3, jump},
    {"jump_hollow", 4, 4, jump},
    {"jump_hollow", 6, 6, jump},
    {"jump_noise", 10, 10, jump},
    {"jump_edit", 13, 13, jump},
    {"edit_jump_n", 13, 13, jump},
};

void add(TouchTotals& t, const Figures& f, const touch::Scene& scene, const Bound& bound,
         const std::string& cell) {
    const int number = std::stoi(scene.body.id.substr(1));
    const bool is_patient = number == 11, is_thin = scene.body.is_thin;
    const bool is_labels = scene.storage.form == touch::Form::labels;
    const char* passed = is_patient || number == 14 ? nullptr // no truth of place
                         : is_thin                  ? "pop_throughs_thin_walls"
                         : is_labels                ? "pop_throughs_labels"
                                                    : "pop_throughs";
    for (const std::string key : {"pop_throughs", "pop_throughs_labels", "pop_throughs_thin_walls"})
        t.counts[key] += passed && key == passed ? f.pop_throughs : 0;
    t.counts["cells"] += 1;
    t.counts["ticks"] += f.ticks;
    t.counts["not_finite"] += f.not_finite;
    t.counts["outside_bounds"] += !beyond(f, bound).empty();
    for (const Gauge& gauge : kGauges) {
        const bool counts = passed && !is_thin && !is_labels && number >= gauge.first &&
                            number <= gauge.last && scene.body.noise >= gauge.least_noise &&
                            scene.body.noise <= gauge.most_noise;
        t.worst[gauge.key].keep(counts ? gauge.figure(f) : 0.0, cell);
        if (gauge.pools_directions) {
            const auto pooled = t.pooled.try_emplace(gauge.key, 0.05).first;
            if (counts)
                pooled->second.add(f.direction_deg);
        }
    }
    t.worst["beyond_spring_n"].keep(is_patient ? f.beyond_spring_n : 0.0, cell);
    t.worst["edit_jump_n"].keep(is_patient ? 0.0 : f.edit_jump_n, cell);
    t.worst["free_force_n"].keep(is_patient || std::isnan(bound.free_force) ? 0.0 : f.free_force_n,
                                 cell);
}

// One row of the grid for each trajectory of a scene, run on all cores; run(trajectory, entry)
// gives a cell. An empty cell says why.
template <class Run>
std::vector<Json> rows_of(const touch::Scene& scene, const std::string& stored,
                          const std::vector<touch::Trajectory>& paths,
                          const std::vector<AlgorithmEntry>& entries, const Run& run) {
    std::vector<Json> cells(paths.size() * entries.size());
    tbb::parallel_for(size_t{0}, cells.size(), [&](size_t i) {
        const AlgorithmEntry& entry = entries[i % entries.size()];
        const touch::Trajectory& path = paths[i / entries.size()];
        const std::string empty = why_empty(entry, scene);
        cells[i] = empty.empty() ? run(path, entry) : Json{{"why", empty}};
    });
    std::vector<Json> rows;
    for (size_t p = 0; p < paths.size(); ++p) {
        Json row{{"id", scene.body.id},
                 {"scene", scene.body.name},
                 {"stored", stored},
                 {"trajectory", paths[p].id + " " + paths[p].name}};
        for (size_t e = 0; e < entries.size(); ++e)
            row["cells"][entries[e].name] = std::move(cells[p * entries.size() + e]);
        rows.push_back(std::move(row));
    }
    return rows;
}

// Measures what a hand feels that goes its way whatever the force says.
class OpenLoop {
 public:
    OpenLoop(const TouchPlan& plan, const TouchParts& parts, AllTotals& totals)
        : plan_(plan), parts_(parts), totals_(totals) {}

    std::vector<Json> rows(const touch::Scene& scene, const std::string& stored) {
        const haptics::TouchParameters shared = touch_parameters(scene);
        const Bound bound = bound_of(scene);
        return rows_of(
            scene, stored, touch::trajectories(scene.body, plan_.ticks, 1, plan_.all),
            parts_.algorithms, [&](const touch::Trajectory& path, const AlgorithmEntry& entry) {
                return cell(scene, stored, path, entry, bound, parameters_of(entry, scene, shared));
            });
    }
    std::vector<std::string> failures() {
        std::sort(failures_.begin(), failures_.end());
        return std::move(failures_);
    }

 private:
    Json cell(const touch::Scene& scene, const std::string& stored, const touch::Trajectory& path,
              const AlgorithmEntry& entry, const Bound& bound,
              const haptics::TouchParameters& parameters) {
        touch::Trajectory moved = path;
        for (glm::dvec3& x : moved.path)
            x += parameters.tool_radius_mm * scene.body.normal;
        const auto run = [&] {
            const auto algorithm = entry.make();
            return touch::open_loop(*algorithm, scene, moved, parameters);
        };
        const Figures f = run();
        // The same hand twice must feel the same, to the bit.
        const bool repeats = path.id != "T6" || run().force_bits == f.force_bits;
        Json cell = cell_json(f, scene);
        const std::string out = beyond(f, bound);
        cell["within_bounds"] = out.empty();
        if (!out.empty())
            cell["beyond"] = out;
        const std::lock_guard lock(mutex_);
        TouchTotals& totals = totals_[entry.name];
        add(totals, f, scene, bound,
            fmt::format("{} {} ({}), {} {}", scene.body.id, scene.body.name, stored, path.id,
                        path.name));
        totals.counts["not_repeated"] += !repeats;
        const std::string where = fmt::format("{} on {} {} ({}), {}", entry.name, scene.body.id,
                                              scene.body.name, stored, path.name);
        // Only what no scene excuses makes the run fail.
        if (!repeats)
            failures_.push_back(where + ": not the same forces twice");
        if (!entry.as_printed && f.not_finite > 0)
            failures_.push_back(fmt::format("{}: {} not numbers", where, f.not_finite));
        if (!entry.as_printed && f.pop_throughs > 0 && scene.storage.form != touch::Form::labels &&
            scene.body.id != "A11" && !scene.body.is_thin)
            failures_.push_back(fmt::format("{}: passed through {} times", where, f.pop_throughs));
        return cell;
    }

    const TouchPlan& plan_;
    const TouchParts& parts_;
    std::mutex mutex_; // of what follows, which does not depend on the order of cells
    AllTotals& totals_;
    std::vector<std::string> failures_;
};

// The motions that a hand may mean to do with a device: the first of each of T1 to T6, and T1,
// which ends in a hold, on every device.
struct Intended {
    touch::Trajectory path;
    const haptics::DevicePreset* device;
};
std::vector<Intended> intended_paths(const touch::TouchCase& body, const TouchPlan& plan) {
    std::vector<Intended> intended;
    std::string last;
    for (touch::Trajectory& path : touch::trajectories(body, plan.ticks, 1, false)) {
        if (path.id == last || path.id.size() != 2 || path.id > "T6")
            continue;
        last = path.id;
        if (path.id == "T1") {
            path.path = touch::press(body, 40.0, 0.75 * body.deepest_mm, 0.8);
            path.path.resize(std::min(path.path.size(), plan.ticks));
            path.name = "press/40mm_s";
        }
        for (const char* device : {"falcon", "touch", "omega"})
            if (path.id == "T1" || device == std::string_view("falcon")) {
                intended.push_back({path, haptics::find_device_preset(device)});
                intended.back().path.name += fmt::format(", {}", device);
            }
    }
    return intended;
}

// Keeps the sum of work done and energy held by the spring, in steps of the encoder under the
// largest force sent, below which no observer sees.
void keep_energy(TouchTotals& totals, const touch::LoopResult& found,
                 const haptics::DevicePreset& device, const std::string& cell) {
    const double step_mj = 1e3 * found.largest_sent_n * device.capabilities.resolution_m;
    totals.worst["made_energy"].keep(
        step_mj > 0.0 ? (found.work_mj + found.held_mj) / step_mj : 0.0, cell);
}

std::vector<Json> closed_rows(const touch::Scene& scene, const std::string& stored,
                              const TouchPlan& plan, const TouchParts& parts, AllTotals& totals) {
    const haptics::TouchParameters shared = touch_parameters(scene);
    const std::vector<Intended> intended = intended_paths(scene.body, plan);
    std::vector<touch::Trajectory> paths;
    for (const Intended& one : intended)
        paths.push_back(one.path);
    std::mutex mutex; // of the totals, which do not depend on the order of cells
    return rows_of(scene, stored, paths, parts.algorithms,
                   [&](const touch::Trajectory& path, const AlgorithmEntry& entry) {
                       haptics::TouchParameters parameters = parameters_of(entry, scene, shared);
                       parameters.stiffness_n_per_m = 500.0; // what every device holds still
                       touch::Path moved = path.path;
                       for (glm::dvec3& x : moved)
                           x += parameters.tool_radius_mm * scene.body.normal;
                       const auto algorithm = entry.make();
                       const auto* device =
                           intended[static_cast<size_t>(&path - paths.data())].device;
                       const touch::LoopResult found = touch::closed_loop(
                           *algorithm, scene, moved, parameters,
                           {.device = device, .hand = {}, .is_controlled = true});
                       Json cell{{"pop_throughs", found.figures.pop_throughs},
                                 {"not_finite", found.figures.not_finite},
                                 {"penetration_voxels", rounded(found.figures.penetration_voxels)},
                                 {"largest_force_n", rounded(found.figures.largest_force_n)},
                                 {"motor_work_mj", rounded(found.work_mj)}};
                       if (path.id == "T1")
                           cell["limit_cycle_um"] = rounded(1e3 * found.limit_cycle_mm);
                       if (scene.body.edits.empty()) {
                           const std::lock_guard lock(mutex);
                           keep_energy(totals[entry.name], found, *device,
                                       fmt::format("{} {} ({}), {} {}", scene.body.id,
                                                   scene.body.name, stored, path.id, path.name));
                       }
                       return cell;
                   });
}

} // namespace

Result<TouchGrid> touch_grid(const TouchPlan& plan, const TouchParts& parts, const Options& options,
                             Report& report, AllTotals& totals) {
    TouchGrid grid{Json::array(), Json::array(), {}};
    OpenLoop open(plan, parts, totals);
    std::string first_stored, last_stored;
    const auto visit = [&](const touch::Scene& scene, const std::string& stored) -> Result<void> {
        const bool is_patient = scene.body.id == "A11";
        if (is_patient ? parts.patients : parts.open_loop)
            for (Json& row : open.rows(scene, stored))
                grid.open.push_back(std::move(row));
        if (first_stored.empty()) {
            first_stored = stored;
            last_stored = stored;
        }
        if (stored != last_stored)
            log::info("touch: {} is done", std::exchange(last_stored, stored));
        const bool is_place = is_patient && scene.body.name.ends_with("/1");
        if (parts.closed_loop && (plan.all || stored == first_stored || is_place))
            for (Json& row : closed_rows(scene, stored, plan, parts, grid.closed_totals))
                grid.closed.push_back(std::move(row));
        return {};
    };
    PALPATE_TRY(for_each_touch_scene(plan, parts, options, report.json["notes"], visit));
    for (std::string& sentence : open.failures())
        report.failures.push_back(std::move(sentence));
    return grid;
}

} // namespace palpate::bench
