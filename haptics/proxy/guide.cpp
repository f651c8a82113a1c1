#include "haptics/proxy/guide.h"

#include <algorithm>
#include <cmath>

#include "engine/volume/grid.h"
#include "haptics/field/coupling.h"
#include "haptics/field/field.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

// Samples that the spline reads beyond a place, sharpening included.
constexpr double kReach = 3.0;

class Guide final : public Algorithm {
 public:
    explicit Guide(bool both_sides) : both_sides_(both_sides) {}
    void reset(const TickInput& input) noexcept override {
        if (is_place(input.tool.position_mm))
            last_mm_ = input.tool.position_mm;
    }
    TickOutput tick(const TickInput& input) noexcept override;
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    struct Distance {
        double mm;
        dvec3 slope; // mm per mm
        bool lacks_data;
    };
    Distance distance_at(const Volume& field, dvec3 tool_mm);

    bool both_sides_;
    dvec3 last_mm_{0.0};
    Field field_;
};

Guide::Distance Guide::distance_at(const Volume& field, dvec3 tool_mm) {
    const dvec3 index = field_.index_of(tool_mm), last = dvec3(field.size()) - 1.0;
    dvec3 within = index;
    for (int k = 0; k < 3; ++k) {
        const double margin = std::min(kReach, 0.5 * last[k]);
        within[k] = std::clamp(index[k], margin, last[k] - margin);
    }
    const dvec3 place = world_point(field.grid(), within);
    const FieldSample found = field_.sharp(place);
    // The chain rule of d(clamp(x)): no slope along a clamped axis of the grid.
    const glm::dmat3 world_from_index(field.grid().world_from_index);
    dvec3 slope = glm::transpose(world_from_index) * found.gradient; // per sample
    for (int k = 0; k < 3; ++k)
        if (within[k] != index[k])
            slope[k] = 0.0;
    return {found.value, world_gradient(field.grid(), slope), field_.lacks_data(place)};
}

TickOutput Guide::tick(const TickInput& input) noexcept {
    if (!is_sane(input))
        return unknown_output(last_mm_);
    const TouchParameters& p = *input.parameters;
    const dvec3 tool_mm = input.tool.position_mm;
    TickOutput output;
    output.proxy = input.tool;
    last_mm_ = tool_mm;
    const std::optional<Volume>& field = input.scene->field[0];
    if (!field)
        return output;
    field_.follow(*field, TouchSource::grey, 0.0, 0.0);
    const Distance d = distance_at(*field, tool_mm);
    if (d.lacks_data || !std::isfinite(d.mm) || !is_finite(d.slope))
        return unknown_output(tool_mm);
    const double off_mm = both_sides_ ? d.mm : std::max(d.mm, 0.0);
    const double spring_n = 1e-3 * p.stiffness_n_per_m * std::abs(off_mm);
    const bool is_held = p.yield_n == 0.0 || spring_n < p.yield_n;
    const double pull_n = std::copysign(is_held ? spring_n : p.yield_n, off_mm);
    output.force_n = -pull_n * d.slope;
    const double length = glm::length(d.slope);
    if (off_mm == 0.0 || !(length > 1e-3))
        return output;
    const dvec3 along = d.slope / length;
    if (is_held)
        output.force_n -=
            1e-3 * p.damping_n_s_per_m * glm::dot(input.velocity_mm_per_s, along) * along;
    // The slope of a distance that is not exact may be above 1, and damping adds
    // to the spring.
    if (const double felt_n = glm::length(output.force_n); p.yield_n > 0.0 && felt_n > p.yield_n)
        output.force_n *= p.yield_n / felt_n;
    output.contact = is_held ? Contact::touching : Contact::yielding;
    output.normal = off_mm > 0.0 ? -along : along;
    output.depth_mm = std::abs(pull_n) * 1e3 / std::max(p.stiffness_n_per_m, 1e-9);
    output.proxy.position_mm = tool_mm + output.depth_mm * output.normal;
    output.contacts = 1;
    return output;
}

} // namespace

std::unique_ptr<Algorithm> make_guide_inside() {
    return std::make_unique<Guide>(false);
}

std::unique_ptr<Algorithm> make_guide_onto() {
    return std::make_unique<Guide>(true);
}

} // namespace palpate::haptics
