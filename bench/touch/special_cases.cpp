#include "bench/touch/special_cases.h"

#include <cmath>
#include <limits>

#include "engine/volume/builder.h"

namespace palpate::touch {

namespace {

using glm::dvec3;

const dvec3 kTiltedNormal = glm::normalize(dvec3(0.31, 0.43, 0.85));
const dvec3 kAlong = glm::normalize(glm::cross(kTiltedNormal, dvec3(1, 0, 0)));

TouchCase case_of(const char* id, const char* name, Solid solid) {
    return {.id = id,
            .name = name,
            .solid = std::move(solid),
            .normal = kTiltedNormal,
            .along = kAlong,
            .deepest_mm = 4.0};
}

Solid tilted_plane(double height_mm = 0.0) {
    return plane(height_mm * kTiltedNormal, kTiltedNormal);
}

using Value = std::function<double(glm::uvec3 index, dvec3 mm)>;
using Store = decltype(TouchCase::store);

// Puts a value for each sample where the storage's form has it.
Store store_values(Value value, std::optional<ScalarType> type = {}) {
    return [=](const TouchCase&, const Storage& storage, haptics::TouchScene& touch, double& iso) {
        const Grid grid = scene_grid(storage);
        const bool labels = storage.form == Form::labels;
        const ScalarType stored = type                             ? *type
                                  : labels                         ? ScalarType::u8
                                  : storage.form == Form::grey_i16 ? ScalarType::i16
                                                                   : ScalarType::f32;
        (labels ? touch.labels : touch.grey) = make_volume(grid, stored, [&](glm::uvec3 index) {
            return value(index, world_point(grid, dvec3(index)));
        });
        iso = labels ? 0.5 : iso;
    };
}

// A number from 0 to 1 for each sample.
double chance(glm::uvec3 index) {
    uint64_t h = index.x + 4096ull * (index.y + 4096ull * index.z);
    h = (h ^ h >> 31) * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 29) * 0xbf58476d1ce4e5b9u;
    return static_cast<double>(h >> 11) * 0x1p-53;
}

} // namespace

std::vector<TouchCase> cases_of_no_surface(const Storage& storage) {
    const bool floats = storage.form == Form::grey_f32, labels = storage.form == Form::labels;
    const double edge = edge_mm(storage);
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const std::string whole = floats ? "" : "whole numbers have no NaN";
    std::vector<TouchCase> cases;
    cases.push_back(case_of("A12", "constant/free", nothing(0.0)));
    cases.push_back(case_of("A12", "constant/solid", nothing(1.0)));

    TouchCase all = case_of("A12", "no-data/all", nothing());
    all.store = store_values([](glm::uvec3, dvec3) { return kNaN; });
    all.why_not = whole;
    cases.push_back(all);
    TouchCase half = case_of("A12", "no-data/half", nothing());
    half.store = store_values(
        [](glm::uvec3, dvec3 mm) { return glm::dot(mm, kTiltedNormal) < 0.0 ? kNaN : 0.0; });
    half.why_not = whole;
    cases.push_back(half);
    TouchCase holes = case_of("A12", "no-data/holes", nothing());
    holes.solid.free_is_convex = false; // a plane with holes: there is no truth but that of numbers
    holes.judge_jumps = false;
    holes.store =
        store_values([density = tilted_plane().density, edge](glm::uvec3 index, dvec3 mm) {
            const double c = chance(index);
            return c < 0.01 ? kNaN : c < 0.02 ? double{INFINITY} : 1000.0 * density(mm, edge);
        });
    holes.why_not = whole;
    cases.push_back(holes);

    TouchCase extremes = case_of("A12", "extremes/plane", tilted_plane());
    extremes.store = [=](const TouchCase& body, const Storage& s, haptics::TouchScene& touch,
                         double& iso) {
        const auto density = body.solid.density;
        if (labels)
            store_values([&](glm::uvec3, dvec3 mm) { return density(mm, edge) >= 0.5 ? 65535 : 0; },
                         ScalarType::u16)(body, s, touch, iso);
        else
            store_values([&](glm::uvec3, dvec3 mm) {
                return -32768.0 + 65535.0 * density(mm, edge);
            })(body, s, touch, iso);
        iso = labels ? iso : -0.5;
    };
    cases.push_back(extremes);

    TouchCase flat = case_of("A12", "spacing/zero", nothing());
    flat.why_not = "readers refuse a spacing of 0: no grid has one";
    cases.push_back(flat);
    TouchCase none = case_of("A12", "size/none", nothing());
    none.store = [](const TouchCase&, const Storage&, haptics::TouchScene&, double&) {};
    cases.push_back(none);
    for (const bool solid : {false, true}) {
        TouchCase one = case_of("A12", solid ? "size/1-solid" : "size/1", nothing());
        // Space beyond a volume is free, so a lone solid sample is matter: it may be felt.
        one.solid.free_is_convex = !solid;
        one.judge_jumps = !solid;
        one.store = [=](const TouchCase&, const Storage& s, haptics::TouchScene& touch,
                        double& iso) {
            const ScalarType type = labels   ? ScalarType::u8
                                    : floats ? ScalarType::f32
                                             : ScalarType::i16;
            (labels ? touch.labels : touch.grey) =
                make_volume(make_grid(glm::uvec3(1), s.spacing_mm), type, [=](glm::uvec3) {
                    return !solid ? 0.0 : labels ? 1.0 : 1000.0;
                });
            iso = labels ? 0.5 : iso;
        };
        cases.push_back(one);
    }
    return cases;
}

std::vector<TouchCase> cases_of_edits() {
    std::vector<TouchCase> cases;
    const auto add = [&](const char* name, std::vector<EditStep> steps) {
        cases.push_back(case_of("A13", name, tilted_plane()));
        cases.back().edits = std::move(steps);
    };
    const auto in_steps = [](double step_mm) {
        std::vector<EditStep> steps{{200, tilted_plane()}};
        for (int i = 1; i <= 12; ++i)
            steps.push_back({i < 12 ? size_t{15} : size_t{250}, tilted_plane(i * step_mm)});
        steps.push_back({200, tilted_plane(), true});
        return steps;
    };
    add("erosion", in_steps(-0.125));
    add("growth", in_steps(0.125));
    add("removal", {{250, tilted_plane()}, {1'000'000, nothing()}});
    add("undo", {{250, tilted_plane()}, {250, tilted_plane(-1.5)}, {250, tilted_plane(), true}});
    add("flicker", {{2, tilted_plane()}, {3, tilted_plane(0.5)}});
    return cases;
}

std::vector<TouchCase> cases_of_fields(const Storage& storage) {
    constexpr double kStrength_n = 3.0; // as every motion rule of the grid
    // So that 16 bits hold the direction to a third of a degree: steps a mm, over 32 mm.
    constexpr double kSteps = 1000.0;
    std::vector<TouchCase> cases;
    const bool labels = storage.form == Form::labels;
    const auto ramp = [](dvec3 mm) { return 500.0 + kSteps * glm::dot(mm, kTiltedNormal); };
    using Field = std::function<dvec3(dvec3 mm)>;
    const auto add = [&](const char* name, std::optional<Field> field, bool is_step) {
        TouchCase made = case_of("A14", name, nothing());
        made.solid.free_is_convex = false; // force in free space is what is asked for
        made.judge_jumps = false;
        made.felt_by = field ? std::vector<std::string>{"wish-2008-vector"}
                             : std::vector<std::string>{"wish-2008-potential", "wish-2008-vector"};
        made.why_not =
            labels ? "labels have no direction" : "follows surfaces; this is a field, without any";
        haptics::HapticTransfer transfer{.strength_n = kStrength_n};
        if (is_step) {
            transfer.center = 500.0;
            transfer.width = 0.1 * kSteps; // 0.1 mm: from a tenth to nine tenths within 0.44 mm
        }
        made.transfer = transfer;
        // Trilinear interpolation is exact for what is linear, so the field is known exactly.
        made.force_n = [=](dvec3, dvec3 last_proxy) -> std::optional<dvec3> {
            const dvec3 v = field ? (*field)(last_proxy) : kTiltedNormal;
            if (glm::length(v) < 2.0) // near a zero line directions are not in the samples
                return {};
            return strength_n(transfer, ramp(last_proxy)) * glm::normalize(v);
        };
        if (!field)
            made.force_n = [=](dvec3, dvec3 last_proxy) -> std::optional<dvec3> {
                return strength_n(transfer, ramp(last_proxy)) * kTiltedNormal;
            };
        made.store = [=](const TouchCase&, const Storage& s, haptics::TouchScene& touch, double&) {
            const Grid grid = scene_grid(s);
            const ScalarType type = s.form == Form::grey_i16 ? ScalarType::i16 : ScalarType::f32;
            const auto stored = [&](const std::function<double(dvec3)>& value) {
                return make_volume(grid, type, [&](glm::uvec3 index) {
                    return value(world_point(grid, dvec3(index)));
                });
            };
            touch.grey = stored(ramp);
            if (field)
                for (int axis = 0; axis < 3; ++axis)
                    touch.field[static_cast<size_t>(axis)] =
                        stored([&](dvec3 mm) { return kSteps * (*field)(mm)[axis]; });
        };
        cases.push_back(std::move(made));
    };
    const dvec3 across = glm::cross(kTiltedNormal, kAlong);
    add(
        "field/uniform", [=](dvec3) { return 8.0 * kAlong; }, false);
    const auto vortex = [=](dvec3 mm) { return glm::cross(kTiltedNormal, mm); };
    add(
        "field/vortex", [=](dvec3 mm) { return vortex(mm - 7.0 * kAlong); }, false);
    add(
        "field/saddle",
        [=](dvec3 mm) { return glm::dot(mm, kAlong) * kAlong - glm::dot(mm, across) * across; },
        false);
    add("field/zero-line", vortex, false);
    add(
        "transfer/step", [=](dvec3) { return 8.0 * kTiltedNormal; }, true);
    add("potential/ramp", {}, true);
    return cases;
}

std::vector<TouchCase> special_cases(const Storage& storage) {
    std::vector<TouchCase> cases = cases_of_no_surface(storage);
    for (std::vector<TouchCase>& more : std::vector{cases_of_edits(), cases_of_fields(storage)})
        cases.insert(cases.end(), more.begin(), more.end());
    return cases;
}

} // namespace palpate::touch
