// The metrics of the plan, with their gates, and those that papers and programs report.

#include <algorithm>
#include <cmath>

#include "bench/suite/touch.h"

namespace palpate::bench {

namespace {

constexpr const char* kRepaired[] = {"swept-point", "swept-tool", "swept-local", "swept-mesh"};

// The row of an algorithm in a list of rows; null where there is none.
Json row_of(const Json& rows, const char* algorithm, int samples = 0) {
    for (const Json& row : rows)
        if (row["algorithm"] == algorithm && (samples == 0 || row["samples"] == samples))
            return row;
    return {};
}

Json proved(const char* what, const char* gate, const char* by) {
    return {{"metric", what}, {"gate", gate}, {"proved_by", by}};
}

// Null where there is no map.
Json stiffest(const Json& z_width, const char* device, double unit = 1.0) {
    for (const Json& map : z_width)
        if (map["device"] == device && map["delay_ticks"] == 0)
            return map["stiffest_stable_n_per_m"].number / unit;
    return {};
}

} // namespace

void WorstCell::keep(double value, const std::string& cell) {
    if (value > figure || (value == figure && value > 0.0 && cell < where)) {
        figure = value;
        where = cell;
    }
}

Json total_of(const AllTotals& totals, const char* algorithm, const char* key) {
    const auto found = totals.find(algorithm);
    if (found == totals.end())
        return {};
    const auto& [counts, worst, pooled] = found->second;
    if (const auto count = counts.find(key); count != counts.end())
        return count->second;
    const auto largest = worst.find(key);
    return largest == worst.end() ? Json() : Json(largest->second.figure);
}

Json touch_bounds(const AllTotals& totals, const AllTotals& closed) {
    const struct {
        const char* asked;
        double gate;
        const char* key;
        const AllTotals& of;
    } kAsked[] = {
        {"passed through, grey values, A1 - A10, A12, A13", 0.0, "pop_throughs", totals},
        {"passed through, labels, the same scenes", 0.0, "pop_throughs_labels", totals},
        {"penetration, voxels, A1 - A6", 0.05, "penetration_voxels", totals},
        {"penetration, voxels, A10 at 5 % noise", 0.25, "penetration_noise5", totals},
        {"direction p99 of all ticks, degrees, A1 - A9", 1.5, "direction_clean", totals},
        {"direction p99 of all ticks, degrees, A10 at 10 % noise", 6.0, "direction_noise10",
         totals},
        {"excess jump, N, edits (A13)", 0.10, "jump_edit", totals},
        {"excess jump, N, corners and grooves (A4, A6)", 0.02, "jump_hollow", totals},
        {"excess jump, N, planes, balls and cavities (A1 - A3)", 0.02, "jump_clean", totals},
        {"excess jump, N, the same at up to 10 % noise (A10)", 0.10, "jump_noise", totals},
        // Work and what the spring holds are each known to a step of the encoder.
        {"energy made in the closed loop with the controller, in encoder steps under the largest "
         "force (no edits)",
         2.0, "made_energy", closed},
    };
    Json rows = Json::array();
    for (const auto& [asked, gate, key, of] : kAsked) {
        Json row{{"asked", asked}, {"gate", gate}, {"figures", Json::object()}};
        for (const char* name : kRepaired) {
            const auto found = of.find(name);
            if (found == of.end())
                continue;
            const auto& [counts, worst, pooled] = found->second;
            Json cell{{"figure", total_of(of, name, key)}};
            if (const auto all = pooled.find(key); all != pooled.end())
                cell = {{"figure", all->second.percentile(0.99)},
                        {"ticks", all->second.count()},
                        {"worst_figure", worst.at(key).figure}};
            if (const auto largest = worst.find(key); largest != worst.end())
                cell["worst_cell"] = largest->second.where;
            cell["within"] = cell["figure"].number <= gate;
            row["figures"][name] = std::move(cell);
        }
        rows.push_back(std::move(row));
    }
    return rows;
}

Json touch_metrics(const AllTotals& totals, const Json& times, const Json& laws,
                   const Json& z_width) {
    constexpr struct {
        const char *what, *gate;
        double least, most;
        const char* key; // of totals, laws or times
    } kMetrics[] = {
        {"penetration, A1 - A6, voxels", "0.05", 0.0, 0.05, "penetration_voxels"},
        {"penetration, noise of 5 %, voxels", "0.25", 0.0, 0.25, "penetration_noise"},
        {"passed through, grey values", "0", 0.0, 0.0, "pop_throughs"},
        {"direction p99 of the worst cell, planes, balls, cavities, degrees", "1.5", 0.0, 1.5,
         "direction_flat"},
        {"direction p99 of the worst cell, all clean scenes, degrees", "1.5", 0.0, 1.5,
         "direction_p99_deg"},
        {"direction p99 of the worst cell, noise up to 10 %, degrees", "6", 0.0, 6.0,
         "direction_noise"},
        {"magnitude p99, planes, balls, cavities, share", "0.02", 0.0, 0.02, "magnitude"},
        {"excess jump, clean, N", "0.02", 0.0, 0.02, "excess_jump_n"},
        {"excess jump, noise up to 10 %, N", "0.10", 0.0, 0.10, "jump_noise"},
        {"excess jump on edits (A13), N", "0.10", 0.0, 0.10, "edit_jump_n"},
        {"force where nothing is (A1 - A9, A12, A13), N", "0", 0.0, 1e-9, "free_force_n"},
        {"force beyond its spring on patients (A11), N", "0", 0.0, 1e-9, "beyond_spring_n"},
        {"energy a contact beyond k v T d, without a controller, mJ", "0.02", -INFINITY, 0.02,
         "energy_beyond_mj"},
        {"limit cycle held at 1 N/mm, falcon, um", "50", 0.0, 50.0, "limit_cycle_um"},
        {"force across of a sliding hand, share (friction 0.4)", "0.40, 1 % more at most", 0.396,
         0.404, "friction_share"},
        {"drift of a sticking proxy, um/s", "1", 0.0, 1.0, "stick_drift_um_s"},
        {"force that yields, share of T0", "1, 3 % off", 0.97, 1.03, "yield_share"},
        {"force below T0, share of the spring", "1, 3 % off", 0.97, 1.03, "below_yield_share"},
        {"not numbers", "0", 0.0, 0.0, "not_finite"},
        {"not the same forces twice", "0", 0.0, 0.0, "not_repeated"},
        {"tick, processor time, p50, us (340 samples)", "25", 0.0, 25.0, "p50_us"},
        {"tick, processor time, p99, us (340 samples)", "60", 0.0, 60.0, "p99_us"},
        {"tick, processor time, p99.9, us (340 samples)", "120", 0.0, 120.0, "p999_us"},
        {"tick, processor time, largest, us (340 samples)", "300", 0.0, 300.0, "max_us"},
        {"ticks of more than 1 ms of processor time", "0", 0.0, 0.0, "misses"},
    };
    Json rows = Json::array();
    for (const auto& [what, gate, least, most, key] : kMetrics) {
        Json row{{"metric", what}, {"gate", gate}, {"figures", Json::object()}};
        for (const std::string_view name : kRepaired) {
            Json figure = total_of(totals, name.data(), key);
            const bool has_samples = haptics::find_algorithm(name)->takes(haptics::kTakesSamples);
            for (const Json& of :
                 {row_of(laws, name.data()), row_of(times, name.data(), has_samples ? 340 : 0)})
                if (of.contains(key))
                    figure = of[key];
            Json cell{{"figure", figure}};
            if (!figure.is_null())
                cell["within"] = figure.number <= most && figure.number >= least;
            row["figures"][name.data()] = std::move(cell);
        }
        rows.push_back(std::move(row));
    }
    rows.push_back(
        {{"metric", "stiffest of the walls tried that stays still at 1 kHz, falcon, N/m"},
         {"gate", "not less than before"},
         {"figures", {{"swept-point", {{"figure", stiffest(z_width, "falcon")}}}}}});
    rows.push_back(proved("energy with the controller", "0 net",
                          "Passivity.ObservesAndTakesAwayWhatASampledSpringMakes"));
    rows.push_back(proved("deadlines by the wall clock", "reported, with steal time",
                          "TickTime.Of340SamplesIn512CubedWhileAnEditorCutsAndTheProgramDraws"));
    rows.push_back(proved("memory, locks, page faults in a tick", "0",
                          "TickGuard.NoTickAllocatesFreesLocksOrFaultsWithAnyAlgorithm"));
    rows.push_back(
        proved("races of snapshots and poses", "0",
               "MailboxModel.*, RingModel.* over all interleavings; ServoThread.* with tsan"));
    return rows;
}

Json touch_beside(const AllTotals& totals, const Json& times, const Json& z_width) {
    Json rows = Json::array();
    const auto add = [&](const char* what, Json figure, const std::string& others) {
        rows.push_back({{"what", what}, {"ours", std::move(figure)}, {"others", others}});
    };
    const auto our = [&](const char* key) { return total_of(totals, "swept-point", key); };
    const auto printed = [&](const char* key) {
        const auto text = [&](const char* name) {
            const Json figure = total_of(totals, name, key);
            const bool is_whole = figure.number == std::floor(figure.number);
            return figure.is_null() ? std::string("-")
                   : is_whole       ? json_line(figure)
                                    : fmt::format("{:.3g}", figure.number);
        };
        return fmt::format(
            "not reported; their algorithms as printed, here: Eriksson et al. {}, "
            "Vidholm & Agmund {}",
            text("eriksson-2006"), text("vidholm-2004"));
    };
    add("passed through, all grey scenes", our("pop_throughs"), printed("pop_throughs"));
    add("deepest proxy on A1 - A6, voxels", our("penetration_voxels"),
        printed("penetration_voxels"));
    add("direction error p99, clean, degrees", our("direction_p99_deg"),
        printed("direction_p99_deg") +
            "; people tell 18 to 32 degrees apart (Barbagli et al. 2006)");
    add("largest excess jump, clean, N", our("excess_jump_n"), printed("excess_jump_n"));
    add("largest excess jump on an edit, N", our("edit_jump_n"),
        "not reported; an intermediate surface that is shifted by up to 10 mm and exchanged jumps "
        "by up to 10 N at 1 N/mm (Koerner et al. 1999, worked out)");
    const auto time = [&](const char* what, const char* name, int samples, const char* others) {
        const Json row = row_of(times, name, samples);
        add(what, row.is_null() ? Json() : row["p999_us"], others);
    };
    time("tick of a point, p99.9, us", "swept-point", 0,
         "1 kHz (all five papers); times not reported");
    time("tick with a local surface made in it, p99.9, us", "swept-local", 0,
         "0.4 ms on average for local marching cubes (UEA, 512^3); on a thread of its own, with up "
         "to 10 mm of shift allowed (Koerner et al. 1999)");
    time("tick of a tool of 340 samples, p99.9, us", "swept-tool", 340,
         "340 samples at 1 kHz, 10 to 12 pictures a second beside it (Vidholm & Agmund 2004)");
    time("tick of a tool of 2000 samples, p99.9, us", "swept-tool", 2000,
         "voxel maps and point shells at 1 kHz (McNeely et al. 1999; Barbic & James 2007); "
         "constraint forces in a few us (Ortega et al. 2007)");
    add("stiffest of the walls tried that stays still at 1 kHz, falcon, N/mm",
        stiffest(z_width, "falcon", 1e3),
        "textures feel clean up to 0.33 N/mm at low rates and 0.90 at high ones, of 250 Hz to 40 "
        "kHz (Choi & Tan 2004)");
    return rows;
}

} // namespace palpate::bench
