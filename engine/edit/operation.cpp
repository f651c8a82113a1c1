#include "engine/edit/operation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/edit/sweep.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {
constexpr std::array kNames{"draw", "erase",   "erode", "dilate", "smooth",
                            "fill", "islands", "cut",   "mill"};
constexpr double kMostSmoothReach = 64.0; // samples

// Checks what the reader of stroke files ensures: operations made in code are checked here alone.
Result<void> check_values(const Operation& op) {
    const char* name = name_of(op.kind);
    if (op.names_label() && op.label == 0)
        return fail("{}: expected a label from 1 to 65535, found 0", name);
    for (size_t i = 0; i < op.spared.size(); ++i)
        if (op.spared[i] == 0 || (i > 0 && op.spared[i - 1] >= op.spared[i]))
            return fail("{}: expected spared labels from 1 on that rise, found {}{}", name,
                        op.spared[i],
                        i > 0 ? fmt::format(" after {}", op.spared[i - 1]) : std::string());
    const std::vector<uint16_t>& of = op.area.labels;
    for (size_t i = 0; i < of.size(); ++i)
        if (of[i] == 0 || (i > 0 && of[i - 1] >= of[i]))
            return fail("{}: expected an area of labels from 1 on that rise, found {}", name,
                        of[i]);
    if (op.names_label() && op.spares(op.label))
        return fail("{}: label {} is locked", name, op.label);
    using enum OperationKind;
    const bool by_neighbours =
        op.kind == erode || op.kind == dilate || op.kind == fill || op.kind == islands;
    if (by_neighbours && op.neighbours != 6 && op.neighbours != 18 && op.neighbours != 26)
        return fail("{}: expected 6, 18 or 26 neighbours, found {}", name, op.neighbours);
    if (op.only_values && !(op.only_values->first <= op.only_values->second))
        return fail("{}: expected only_values that rise, found {} to {}", name,
                    op.only_values->first, op.only_values->second);
    if (op.alike && !op.on_labels())
        return fail("{}: expected alike on labels alone", name);
    if (op.alike && !(*op.alike >= 0.0 && *op.alike <= 100.0))
        return fail("{}: expected alike of 0 to 100 deviations, found {}", name, *op.alike);
    if (op.kind == OperationKind::smooth && !(op.radius_mm >= 0.0))
        return fail("{}: expected a radius of at least 0 mm, found {}", name, op.radius_mm);
    if (op.kind == OperationKind::islands && !(op.smallest_mm3 >= 0.0))
        return fail("{}: expected a smallest volume of at least 0 mm3, found {}", name,
                    op.smallest_mm3);
    if (!op.on_labels() && op.to_value && !std::isfinite(*op.to_value))
        return fail("{}: expected a number as to_value, found {}", name, *op.to_value);
    if (!op.on_labels() && op.surface_value && !std::isfinite(*op.surface_value))
        return fail("{}: expected a number as surface_value, found {}", name, *op.surface_value);
    if (op.kind != OperationKind::mill)
        return {};
    if (!(op.falloff_mm >= 0.0))
        return fail("{}: expected a falloff of at least 0 mm, found {}", name, op.falloff_mm);
    if (op.rates.empty())
        return fail("{}: expected at least one rate, found none", name);
    for (size_t i = 0; i < op.rates.size(); ++i) {
        const auto [value, per_s] = op.rates[i];
        if (!std::isfinite(value) || !(per_s >= 0.0 && std::isfinite(per_s)))
            return fail("{}: expected rates of at least 0 per second, found {} at {}", name, per_s,
                        value);
        if (i > 0 && !(op.rates[i - 1].value < value))
            return fail("{}: expected rates whose values rise, found {} after {}", name, value,
                        op.rates[i - 1].value);
    }
    return {};
}

} // namespace

const char* name_of(OperationKind kind) {
    return kNames[static_cast<size_t>(kind)];
}

bool Operation::is_over(uint32_t value) const {
    return !over || std::find(over->begin(), over->end(), value) != over->end();
}

bool Operation::overwrites() const {
    using enum OperationKind;
    return kind == draw || kind == dilate || kind == fill || kind == smooth;
}

bool Operation::spares(uint32_t label) const {
    return std::binary_search(spared.begin(), spared.end(), label);
}

Operation settled(Operation operation, const Volume& volume) {
    if (operation.on_labels() || operation.to_value)
        return operation;
    const ValueRange range = volume.range();
    operation.to_value = range.empty() ? 0.0 : double{range.min};
    return operation;
}

Result<void> check(const Operation& operation, const Volume& volume, const Volume* guide) {
    const char* name = name_of(operation.kind);
    const ScalarType type = volume.type();
    PALPATE_TRY(check_values(operation));
    if (operation.on_labels()) {
        if (type != ScalarType::u8 && type != ScalarType::u16)
            return fail("{}: expected labels stored as u8 or u16, found {}", name, name_of(type));
    }
    if (operation.needs_guide()) {
        const bool on_labels = operation.on_labels();
        if (!guide)
            return fail("{}: {} needs a guide, a volume of {}", name,
                        on_labels                  ? operation.only_values ? "only_values" : "alike"
                        : operation.spared.empty() ? "its area"
                                                   : "spared",
                        on_labels ? "grey values" : "labels");
        if (!on_labels && guide->type() != ScalarType::u8 && guide->type() != ScalarType::u16)
            return fail("{}: {}: expected labels stored as u8 or u16, found {}", name,
                        operation.spared.empty() ? "its area" : "spared", name_of(guide->type()));
        if (const Result<void> serves = check_guide(*guide, volume); !serves)
            return fail("{}: {}", name, serves.error().message);
    }
    if (!operation.on_labels() && operation.to_value) {
        const auto [least, most] = visit_scalar(type, [](auto t) {
            using Limits = std::numeric_limits<decltype(t)>;
            return std::pair(double{Limits::lowest()}, double{Limits::max()});
        });
        if (!(*operation.to_value >= least && *operation.to_value <= most))
            return fail(
                "{}: expected a to_value within {:g} .. {:g}, which the volume's type {} holds, "
                "found {:g}",
                name, least, most, name_of(type), *operation.to_value);
    }
    if (operation.kind == OperationKind::smooth) {
        const double reach = operation.radius_mm / smallest_spacing_mm(volume.grid());
        if (!(reach <= kMostSmoothReach))
            return fail(
                "{}: expected a radius of at most {} samples, found {} mm, which are {:.3g}", name,
                kMostSmoothReach, operation.radius_mm, reach);
    }
    return {};
}

Result<void> check_guide(const Volume& guide, const Volume& volume) {
    const glm::uvec3 is = guide.size(), wanted = volume.size();
    if (is != wanted)
        return fail("expected a guide of {} x {} x {} samples, found {} x {} x {}", wanted.x,
                    wanted.y, wanted.z, is.x, is.y, is.z);
    // Places differ by an affine function of the index: the most at a corner.
    glm::dvec3 farthest(0.0);
    double most_mm = 0.0;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index =
            glm::dvec3(wanted - 1u) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        const double away_mm =
            glm::length(world_point(guide.grid(), index) - world_point(volume.grid(), index));
        if (away_mm > most_mm) {
            most_mm = away_mm;
            farthest = index;
        }
    }
    const double allowed_mm = Sweep::tolerance_for(volume.grid());
    if (most_mm <= allowed_mm)
        return {};
    const glm::dvec3 a = spacing_mm(volume.grid()), b = spacing_mm(guide.grid());
    const glm::dvec3 from(volume.grid().world_from_index[3]), to(guide.grid().world_from_index[3]);
    return fail(
        "expected a guide whose samples lie where the volume's do, within {:.3g} mm, found sample "
        "({}, {}, {}) {:.4g} mm away (spacing {:g} x {:g} x {:g} and {:g} x {:g} x {:g} mm, origin "
        "({:g}, {:g}, {:g}) and ({:g}, {:g}, {:g}) mm)",
        allowed_mm, farthest.x, farthest.y, farthest.z, most_mm, a.x, a.y, a.z, b.x, b.y, b.z,
        from.x, from.y, from.z, to.x, to.y, to.z);
}

double rate_at(const std::vector<RatePoint>& rates, double value) {
    if (!(value > rates.front().value))
        return rates.front().per_s;
    for (size_t i = 1; i < rates.size(); ++i)
        if (value <= rates[i].value) {
            const RatePoint a = rates[i - 1], b = rates[i];
            return a.per_s + (value - a.value) / (b.value - a.value) * (b.per_s - a.per_s);
        }
    return rates.back().per_s;
}

double depth_weight(double depth_mm, double falloff_mm, double beyond_mm) {
    const double in_mm = depth_mm + beyond_mm;
    if (in_mm < 0.0)
        return 0.0;
    const double ramp_mm = falloff_mm + beyond_mm;
    return ramp_mm > 0.0 ? std::min(1.0, in_mm / ramp_mm) : 1.0;
}

double share_at_surface(double value, double to, std::optional<double> surface_value) {
    if (!surface_value || value == to)
        return 0.5;
    const double share = (*surface_value - value) / (to - value);
    // Beyond either end there is no surface to place: to_value lies on the side of the matter, or
    // no matter was here.
    return share > 0.0 && share < 1.0 ? share : 0.5;
}

double share_taken(double samples, double at_surface) {
    const double slope = std::min(at_surface, 1.0 - at_surface);
    if (std::abs(samples) <= 1.0)
        return at_surface - slope * samples;
    const double rest = std::max(0.0, kWallReach - std::abs(samples)); // 1 .. 0
    return samples > 0.0 ? (at_surface - slope) * rest : 1.0 - (1.0 - at_surface - slope) * rest;
}

double milled(double value, double rate_per_s, double dose_s, double to) {
    const double by = rate_per_s * dose_s;
    return value > to ? std::max(to, value - by) : std::min(to, value + by);
}

std::vector<glm::ivec3> neighbour_offsets(int neighbours) {
    const int most = neighbours == 6 ? 1 : neighbours == 18 ? 2 : 3; // axes that may differ
    std::vector<glm::ivec3> offsets;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                if (const int axes = x * x + y * y + z * z; axes > 0 && axes <= most)
                    offsets.push_back({x, y, z});
    return offsets;
}

} // namespace palpate
