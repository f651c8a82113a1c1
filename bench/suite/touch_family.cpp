// The family of bodies, edges, noises, grids and hands (bench/touch/family.h), for the four
// repaired algorithms: the worst cell beside all of them.

#include <tbb/parallel_for.h>

#include <cmath>
#include <mutex>

#include "bench/suite/touch.h"
#include "bench/touch/family.h"
#include "bench/touch/open_loop.h"
#include "engine/base/log.h"
#include "haptics/field/field.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate::bench {

namespace {

using haptics::AlgorithmEntry;

// Figures of the table with what is asked of the worst cell, without noise, at 5 and at 10 %.
struct Asked {
    const char* key;
    const char* text;
    double clean, noise5, noise10, salt;
};
constexpr double kNothing = INFINITY; // is asked
constexpr Asked kAsked[] = {
    {"passes", "passed through", 0.0, 0.0, 0.0, 0.0},
    {"penetration_voxels", "penetration, voxels", 0.10, 0.35, kNothing, kNothing},
    {"direction_p99_deg", "direction p99, degrees", 3.0, kNothing, 8.0, kNothing},
    {"jump_n", "jump beyond k |dx|, N", 0.02, 0.10, 0.10, kNothing},
    {"rest_n", "change in a tick at rest, N", 0.02, 0.02, 0.02, 0.02},
    {"slide_n", "slides: difference to the spring's own force, N", 0.1, kNothing, kNothing,
     kNothing},
    {"behind_share", "share of ticks behind", kNothing, kNothing, kNothing, kNothing},
};
constexpr const char* kClasses[] = {"clean", "noise 5 %", "noise 10 %", "salt 0.2 %"};

size_t class_of(touch::NoiseLevel level) {
    if (level.noise == touch::Noise::none)
        return 0;
    return level.noise == touch::Noise::salt ? 3 : level.share < 0.07 ? 1 : 2;
}

struct Totals {
    std::map<std::string, WorstCell> worst;
    std::map<std::string, touch::Histogram> cells; // of the figures
    touch::Histogram direction{0.05};              // of all ticks
    uint64_t ticks = 0;
};
using FamilyTotals = std::map<std::string, std::array<Totals, std::size(kClasses)>>;

// One algorithm under one hand.
std::map<std::string, double> figures_of(const AlgorithmEntry& entry, const touch::Scene& scene,
                                         const touch::FamilyHand& hand,
                                         const haptics::TouchParameters& parameters,
                                         touch::Figures& figures) {
    touch::Trajectory moved = hand.trajectory;
    for (glm::dvec3& x : moved.path)
        x += parameters.tool_radius_mm * scene.body.normal;
    const touch::Solid truth = touch::grown(scene.body.solid, parameters.tool_radius_mm);
    const bool judges_slide = hand.slides && scene.body.judge_jumps && truth.nearest_free;
    const double k = 1e-3 * parameters.stiffness_n_per_m;
    double slide_n = 0.0, rest_n = 0.0;
    glm::dvec3 last_n{0.0};
    size_t tick = 0;
    const auto algorithm = entry.make();
    figures = touch::open_loop(
        *algorithm, scene, moved, parameters, false,
        [&](const haptics::TickInput& input, const haptics::TickOutput& out) {
            const glm::dvec3 x = input.tool.position_mm;
            const double depth = -truth.distance_mm(x), force = glm::length(out.force_n);
            if (judges_slide && depth < scene.body.deepest_mm && truth.nearest_free(x))
                slide_n = std::max(slide_n, std::abs(force - k * std::max(0.0, depth)));
            const bool is_still = tick > 0 && x == moved.path[tick - 1];
            if (tick > hand.rests_from && is_still)
                rest_n = std::max(rest_n, glm::distance(out.force_n, last_n));
            last_n = out.force_n;
            ++tick;
        });
    const auto ticks = static_cast<double>(figures.ticks);
    std::map<std::string, double> found{
        {"passes", static_cast<double>(figures.pop_throughs + figures.not_finite)},
        {"penetration_voxels", figures.penetration_voxels},
        {"jump_n", figures.excess_jump_n},
        {"behind_share", static_cast<double>(figures.behind_ticks) / ticks}};
    if (figures.direction_deg.count() >= 50)
        found["direction_p99_deg"] = figures.direction_deg.percentile(0.99);
    if (judges_slide)
        found["slide_n"] = slide_n;
    if (hand.rests_from < moved.path.size())
        found["rest_n"] = rest_n;
    return found;
}

Json rows_of(const FamilyTotals& totals) {
    Json rows = Json::array();
    for (size_t c = 0; c < std::size(kClasses); ++c)
        for (const Asked& asked : kAsked) {
            const double gates[] = {asked.clean, asked.noise5, asked.noise10, asked.salt};
            Json row{{"class", kClasses[c]}, {"figure", asked.text}, {"figures", Json::object()}};
            if (std::isfinite(gates[c]))
                row["asked"] = gates[c];
            std::string line =
                fmt::format("| {} | {} | {} |", kClasses[c], asked.text,
                            std::isfinite(gates[c]) ? fmt::format("{}", gates[c]) : "");
            for (const auto& [name, classes] : totals) {
                const Totals& total = classes[c];
                const auto worst = total.worst.find(asked.key);
                if (worst == total.worst.end())
                    continue;
                const auto& [figure, where] = worst->second;
                const double pooled = asked.key == std::string_view("direction_p99_deg")
                                          ? total.direction.percentile(0.99)
                                          : total.cells.at(asked.key).percentile(0.95);
                row["figures"][name] = {{"worst", figure},
                                        {"cell", where},
                                        {"pooled", pooled},
                                        {"within", figure <= gates[c]}};
                const char* bold = figure <= gates[c] ? "" : "**";
                line +=
                    fmt::format(" {0}{1:.3g}{0} ({2:.3g})<br>{3} |", bold, figure, pooled, where);
            }
            log::info("{}", line);
            rows.push_back(std::move(row));
        }
    return rows;
}

} // namespace

Result<Json> touch_family(const TouchParts& parts, bool held, uint64_t seeds,
                          const std::stop_token& stop) {
    FamilyTotals totals;
    for (const char* name : {"swept-point", "swept-tool", "swept-local", "swept-mesh"})
        if (parts.has(name))
            totals[name];
    std::mutex mutex;
    uint64_t ticks = 0;
    const uint64_t first = (held ? touch::kHeldSeeds : 0) + 1;
    struct Task {
        uint64_t seed;
        touch::FamilyCell cell;
    };
    std::vector<Task> tasks;
    for (uint64_t seed = first; seed < first + seeds; ++seed)
        for (const touch::FamilyCell& cell : touch::family_cells(seed))
            tasks.push_back({seed, cell});
    tbb::parallel_for(size_t{0}, tasks.size(), [&](size_t i) {
        if (stop.stop_requested())
            return;
        const auto& [seed, cell] = tasks[i];
        touch::FamilyScene made = touch::family_scene(seed, cell.edge, cell.level);
        touch::Scene& scene = made.scene;
        haptics::TouchParameters parameters = touch::scene_parameters(scene);
        tune(parameters, *scene.touch.grey);
        if (parts.takes(haptics::kTakesMesh))
            scene.touch.touch_mesh = haptics::make_touch_mesh(
                std::make_shared<Mesh>(haptics::touch_surface(*scene.touch.grey, parameters)),
                0.5 * std::cbrt(scene.storage.spacing_mm.x * scene.storage.spacing_mm.y *
                                scene.storage.spacing_mm.z));
        for (const AlgorithmEntry& entry : parts.algorithms) {
            const auto of_class = totals.find(entry.name);
            if (of_class == totals.end())
                continue;
            haptics::TouchParameters own = parameters;
            if (entry.takes(haptics::kTakesSamples))
                own.tool_radius_mm = 1.5 * touch::voxel_mm(scene.storage);
            for (const touch::FamilyHand& hand : touch::family_hands(scene.body, seed)) {
                touch::Figures figures;
                const auto found = figures_of(entry, scene, hand, own, figures);
                const std::lock_guard lock(mutex);
                Totals& total = of_class->second[class_of(cell.level)];
                ticks += figures.ticks;
                total.direction.add(figures.direction_deg);
                for (const auto& [key, value] : found) {
                    total.worst[key].keep(value, made.name + ", " + hand.trajectory.name);
                    total.cells.try_emplace(key, 0.001).first->second.add(value);
                }
            }
        }
    });
    if (stop.stop_requested())
        return fail("interrupted in the family of touch");
    return Json{{"seeds", {first, first + seeds - 1}},
                {"held", held},
                {"scenes", tasks.size()},
                {"ticks", ticks},
                {"rows", rows_of(totals)}};
}

} // namespace palpate::bench
