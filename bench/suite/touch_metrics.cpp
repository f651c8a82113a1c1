// What the plan measures, with its gates, and what papers and programs report.

#include <algorithm>
#include <cmath>

#include "bench/suite/touch.h"

namespace palpate::bench {

namespace {

constexpr const char* kRepaired[] = {"swept-point", "swept-tool", "swept-local", "swept-mesh"};

const TouchTotals* totals_of(const AllTotals& all, const char* name) {
    const auto found = all.find(name);
    return found == all.end() ? nullptr : &found->second;
}

// The row of an algorithm in a list of rows; null where there is none.
Value row_of(const Value& rows, const char* algorithm, int samples = 0) {
    for (const Value& row : rows)
        if (row["algorithm"] == algorithm && (samples == 0 || row["samples"] == samples))
            return row;
    return {};
}

// `figure(name)` is null where there is none; `gate` as a sentence, `least` and `most` as numbers.
template <class Figure>
Value metric(const char* what, const char* gate, double least, double most, const Figure& figure) {
    Value row{{"metric", what}, {"gate", gate}, {"figures", Value::object()}};
    for (const char* name : kRepaired) {
        const Value found = figure(name);
        Value cell{{"figure", found}};
        if (found.is_number() && std::isfinite(most))
            cell["within"] = found.get<double>() <= most && found.get<double>() >= least;
        row["figures"][name] = cell;
    }
    return row;
}

Value proved(const char* what, const char* gate, const char* by) {
    return {{"metric", what}, {"gate", gate}, {"proved_by", by}};
}

// Null where there is no map.
Value stiffest(const Value& z_width, const char* device, double unit = 1.0) {
    for (const Value& map : z_width)
        if (map["device"] == device && map["delay_ticks"] == 0)
            return map["stiffest_stable_n_per_m"].get<double>() / unit;
    return {};
}

} // namespace

void WorstCell::keep(double value, const std::string& cell) {
    if (value > figure || (value == figure && value > 0.0 && cell < where)) {
        figure = value;
        where = cell;
    }
}

Value touch_bounds(const AllTotals& totals, const AllClosedTotals& closed) {
    Value rows = Value::array();
    const auto add = [&](const char* asked, double gate, const auto& cell_of) {
        Value row{{"asked", asked}, {"gate", gate}, {"figures", Value::object()}};
        for (const char* name : kRepaired)
            if (const TouchTotals* t = totals_of(totals, name)) {
                Value cell = cell_of(t->bounds);
                cell["within"] = cell["figure"].template get<double>() <= gate;
                row["figures"][name] = std::move(cell);
            }
        rows.push_back(std::move(row));
    };
    const auto most = [](WorstCell TouchBounds::*member) {
        return [=](const TouchBounds& b) {
            return Value{{"figure", (b.*member).figure}, {"worst_cell", (b.*member).where}};
        };
    };
    const auto pooled = [](touch::Histogram TouchBounds::*all, WorstCell TouchBounds::*member) {
        return [=](const TouchBounds& b) {
            return Value{{"figure", (b.*all).percentile(0.99)},
                         {"ticks", (b.*all).count()},
                         {"worst_figure", (b.*member).figure},
                         {"worst_cell", (b.*member).where}};
        };
    };
    add("passed through, grey values, A1 - A10, A12, A13", 0.0, [](const TouchBounds& b) {
        return Value{{"figure", b.passed_grey}};
    });
    add("passed through, labels, the same scenes", 0.0, [](const TouchBounds& b) {
        return Value{{"figure", b.passed_labels}};
    });
    add("penetration, voxels, A1 - A6", 0.05, most(&TouchBounds::penetration));
    add("penetration, voxels, A10 at 5 % noise", 0.25, most(&TouchBounds::penetration_noise5));
    add("direction p99 of all ticks, degrees, A1 - A9", 1.5,
        pooled(&TouchBounds::pooled_clean, &TouchBounds::direction_clean));
    add("direction p99 of all ticks, degrees, A10 at 10 % noise", 6.0,
        pooled(&TouchBounds::pooled_noise, &TouchBounds::direction_noise));
    add("excess jump, N, edits (A13)", 0.10, most(&TouchBounds::jump_edit));
    add("excess jump, N, corners and grooves (A4, A6)", 0.02, most(&TouchBounds::jump_hollow));
    add("excess jump, N, planes, balls and cavities (A1 - A3)", 0.02,
        most(&TouchBounds::jump_clean));
    add("excess jump, N, the same at up to 10 % noise (A10)", 0.10, most(&TouchBounds::jump_noise));
    // Work and what the spring holds are each known to a step of the encoder.
    constexpr double kMostSteps = 2.0;
    Value energy{{"asked",
                  "energy made in the closed loop with the controller, in encoder steps under the "
                  "largest force (no edits)"},
                 {"gate", kMostSteps},
                 {"figures", Value::object()}};
    for (const char* name : kRepaired)
        if (const auto found = closed.find(name); found != closed.end()) {
            const WorstCell& made = found->second.made_energy;
            energy["figures"][name] = {{"figure", made.figure},
                                       {"worst_cell", made.where},
                                       {"within", made.figure <= kMostSteps}};
        }
    rows.push_back(std::move(energy));
    return rows;
}

Value touch_metrics(const AllTotals& totals, const Value& times, const Value& laws,
                    const Value& z_width) {
    Value rows = Value::array();
    const auto total = [&](const char* what, const char* gate, double most,
                           const auto TouchTotals::*member) {
        rows.push_back(metric(what, gate, 0.0, most, [&](const char* name) -> Value {
            const TouchTotals* t = totals_of(totals, name);
            return t ? Value(t->*member) : Value();
        }));
    };
    const auto law = [&](const char* what, const char* gate, double least, double most,
                         const char* key) {
        rows.push_back(metric(what, gate, least, most, [&](const char* name) -> Value {
            const Value row = row_of(laws, name);
            return row.is_null() ? Value() : row[key];
        }));
    };
    total("penetration, A1 - A6, voxels", "0.05", 0.05, &TouchTotals::penetration);
    total("penetration, noise of 5 %, voxels", "0.25", 0.25, &TouchTotals::penetration_noise5);
    total("passed through, grey values", "0", 0.0, &TouchTotals::pop_throughs);
    total("direction p99 of the worst cell, planes, balls, cavities, degrees", "1.5", 1.5,
          &TouchTotals::direction_flat);
    total("direction p99 of the worst cell, all clean scenes, degrees", "1.5", 1.5,
          &TouchTotals::direction);
    total("direction p99 of the worst cell, noise up to 10 %, degrees", "6", 6.0,
          &TouchTotals::direction_noise);
    total("magnitude p99, planes, balls, cavities, share", "0.02", 0.02, &TouchTotals::magnitude);
    total("excess jump, clean, N", "0.02", 0.02, &TouchTotals::jump);
    total("excess jump, noise up to 10 %, N", "0.10", 0.10, &TouchTotals::jump_noise);
    total("excess jump on edits (A13), N", "0.10", 0.10, &TouchTotals::edit_jump);
    total("force where nothing is (A1 - A9, A12, A13), N", "0", 1e-9, &TouchTotals::free_force);
    total("force beyond its spring on patients (A11), N", "0", 1e-9, &TouchTotals::beyond_spring);
    law("energy a contact beyond k v T d, without a controller, mJ", "0.02", -INFINITY, 0.02,
        "energy_beyond_mj");
    law("limit cycle held at 1 N/mm, falcon, um", "50", 0.0, 50.0, "limit_cycle_um");
    law("force across of a sliding hand, share (friction 0.4)", "0.40, 1 % more at most", 0.396,
        0.404, "friction_share");
    law("drift of a sticking proxy, um/s", "1", 0.0, 1.0, "stick_drift_um_s");
    law("force that yields, share of T0", "1, 3 % off", 0.97, 1.03, "yield_share");
    law("force below T0, share of the spring", "1, 3 % off", 0.97, 1.03, "below_yield_share");
    total("not numbers", "0", 0.0, &TouchTotals::not_finite);
    total("not the same forces twice", "0", 0.0, &TouchTotals::not_repeated);
    for (const auto& [key, gate, most] :
         {std::tuple{"p50_us", "25", 25.0}, std::tuple{"p99_us", "60", 60.0},
          std::tuple{"p999_us", "120", 120.0}, std::tuple{"max_us", "300", 300.0},
          std::tuple{"misses", "0", 0.0}}) {
        const std::string what = key == std::string_view("misses")
                                     ? "ticks of more than 1 ms of processor time"
                                     : fmt::format("tick, processor time, {}, us (340 samples)",
                                                   key == std::string_view("max_us")   ? "largest"
                                                   : key == std::string_view("p50_us") ? "p50"
                                                   : key == std::string_view("p99_us") ? "p99"
                                                                                       : "p99.9");
        rows.push_back(metric(what.c_str(), gate, 0.0, most, [&](const char* name) -> Value {
            const Value row = row_of(times, name, name == std::string_view("swept-tool") ? 340 : 0);
            return row.is_null() ? Value() : row[key];
        }));
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

Value touch_beside(const AllTotals& totals, const Value& times, const Value& z_width) {
    const TouchTotals* ours = totals_of(totals, "swept-point");
    const TouchTotals* eriksson = totals_of(totals, "eriksson-2006");
    const TouchTotals* vidholm = totals_of(totals, "vidholm-2004");
    Value rows = Value::array();
    const auto add = [&](const char* what, Value figure, const std::string& others) {
        rows.push_back({{"what", what}, {"ours", std::move(figure)}, {"others", others}});
    };
    const auto our = [&](auto TouchTotals::*member) {
        return ours ? Value(ours->*member) : Value();
    };
    const auto printed = [](const auto& figure, const TouchTotals* a, const TouchTotals* b) {
        return fmt::format(
            "not reported; their algorithms as printed, here: Eriksson et al. {}, "
            "Vidholm & Agmund {}",
            a ? figure(*a) : "-", b ? figure(*b) : "-");
    };
    add("passed through, all grey scenes", our(&TouchTotals::pop_throughs),
        printed([](const TouchTotals& t) { return fmt::format("{}", t.pop_throughs); }, eriksson,
                vidholm));
    add("deepest proxy on A1 - A6, voxels", our(&TouchTotals::penetration),
        printed([](const TouchTotals& t) { return fmt::format("{:.3g}", t.penetration); }, eriksson,
                vidholm));
    add("direction error p99, clean, degrees", our(&TouchTotals::direction),
        printed([](const TouchTotals& t) { return fmt::format("{:.3g}", t.direction); }, eriksson,
                vidholm) +
            "; people tell 18 to 32 degrees apart (Barbagli et al. 2006)");
    add("largest excess jump, clean, N", our(&TouchTotals::jump),
        printed([](const TouchTotals& t) { return fmt::format("{:.3g}", t.jump); }, eriksson,
                vidholm));
    add("largest excess jump on an edit, N", our(&TouchTotals::edit_jump),
        "not reported; an intermediate surface that is shifted by up to 10 mm and exchanged jumps "
        "by up to 10 N at 1 N/mm (Koerner et al. 1999, worked out)");
    const auto time = [&](const char* what, const char* name, int samples, const char* others) {
        const Value row = row_of(times, name, samples);
        add(what, row.is_null() ? Value() : row["p999_us"], others);
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
