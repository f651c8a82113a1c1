#include "haptics/proxy/swept_point.h"

#include <algorithm>
#include <array>
#include <span>

#include "haptics/proxy/coupler.h"
#include "haptics/proxy/sweep.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr uint32_t kMostSteps = 16;
constexpr double kPointConverged_mm = 1e-4;
// Below this slope across a sample, as a share of the contrast, a normal is doubtful.
constexpr double kFlat = 0.004;

struct State : Felt {
    double confidence = 1.0;
};

class SweptPoint final : public Algorithm {
 public:
    void reset(const TickInput& input) noexcept override {
        state_ = State{};
        if (is_place(input.tool.position_mm))
            state_.proxy = input.tool.position_mm;
        coupler_.reset(state_.proxy);
    }
    TickOutput tick(const TickInput& input) noexcept override;
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    struct Normal {
        dvec3 direction{0.0};
        double confidence = 1.0;
    };
    Normal normal_at(dvec3 p);
    bool is_solid(dvec3 p) { return field_.value(p) >= field_.iso() + 1e-6 * field_.contrast(); }
    void move(dvec3 hand, Geometry& geometry);
    uint32_t settle(dvec3 goal);
    dvec3 slide(dvec3 p, dvec3 normal, dvec3 step, bool& on_surface);
    bool pass_bump(dvec3 goal, dvec3 normal, bool& on_surface);
    bool push_out(dvec3 goal);
    bool push_out_along(std::span<const dvec3> ways, double sample_mm);

    State state_;
    Coupler coupler_;
    Budget budget_;
    Field field_;
};

// The smoothed field's normal where it has one and the sharp field agrees; else the sharp one's;
// else the last.
SweptPoint::Normal SweptPoint::normal_at(dvec3 p) {
    const FieldSample smooth = field_.smooth(p);
    const double slope = glm::length(smooth.gradient) * field_.voxel_mm();
    const double floor = kFlat * field_.contrast();
    if (slope < 0.25 * floor) {
        const FieldSample sharp = field_.sharp(p);
        if (glm::length(sharp.gradient) * field_.voxel_mm() < floor)
            return {state_.normal, slope / floor};
        return {-unit_or_zero(sharp.gradient), 0.5};
    }
    return {-smooth.gradient / glm::length(smooth.gradient), std::min(1.0, slope / floor)};
}

// To a cube's faces, edges and corners.
std::array<dvec3, 26> all_around() {
    std::array<dvec3, 26> ways;
    size_t count = 0;
    for (int i = 0; i < 27; ++i)
        if (i != 13)
            ways[count++] = glm::normalize(dvec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
    return ways;
}

// A tangential step with a short lift off the surface and down again. Where the surface falls away
// faster than the step is long, the proxy is in the air.
dvec3 SweptPoint::slide(dvec3 p, dvec3 normal, dvec3 step, bool& on_surface) {
    double lift = 0.3 * field_.voxel_mm();
    for (int i = 0; i < 4 && is_solid(p + lift * normal); ++i)
        lift *= 0.5;
    if (is_solid(p + lift * normal))
        lift = 0.0;
    const dvec3 raised = p + lift * normal;
    const Sweep along = sweep(field_, raised, raised + step, budget_);
    dvec3 over = along.point_mm;
    if (along.hit) // back from what is in the way, so that the way down is free
        over = raised + (along.point_mm - raised) * 0.98;
    const double drop = lift + std::max(0.25 * field_.voxel_mm(), glm::length(step));
    const Sweep down = sweep(field_, over, over - drop * normal, budget_);
    on_surface = down.hit;
    return down.hit ? down.point_mm : over;
}

// Passes over a bump, met on the way to a goal that lies above the surface by the smooth normal: in
// a lifted step, if that leads nearer to the goal. Not where the two views do not agree on which
// side is free: between thin walls the smooth one may see the other wall more.
bool SweptPoint::pass_bump(dvec3 goal, dvec3 normal, bool& on_surface) {
    const dvec3 d = goal - state_.proxy, lifted = state_.proxy + 0.3 * field_.voxel_mm() * normal;
    if (glm::dot(field_.sharp(state_.proxy).gradient, normal) >= 0.0 ||
        sweep(field_, state_.proxy, lifted, budget_).hit)
        return false;
    dvec3 step = d - glm::dot(d, normal) * normal;
    const double length = glm::length(step), most = 0.5 * field_.voxel_mm();
    if (length > most)
        step *= most / length;
    bool lands = true;
    const dvec3 next = slide(state_.proxy, normal, step, lands);
    if (glm::distance(next, goal) > glm::length(d) - kPointConverged_mm)
        return false;
    state_.proxy = next;
    on_surface = lands;
    return true;
}

// Moves the proxy to where a frictionless (or sticking) point would rest.
uint32_t SweptPoint::settle(dvec3 goal) {
    State& s = state_;
    const dvec3 start = s.proxy;
    const Feel& feel = coupler_.feel();
    const double friction = s.slipping ? feel.friction_dynamic : feel.friction_static;
    bool on_surface = s.touching;
    Normal normal = on_surface ? normal_at(s.proxy) : Normal{};
    dvec3 last_residual(0.0), last_step(0.0);
    double gain = 1.0;
    uint32_t i = 0;
    for (; i < kMostSteps; ++i) {
        const dvec3 d = goal - s.proxy;
        const double depth = -glm::dot(d, normal.direction);
        if (!on_surface || depth <= 0.0) {
            // Free, or pulled off: straight to the tool.
            const Sweep way = sweep(field_, s.proxy, goal, budget_);
            s.proxy = way.point_mm;
            on_surface = way.hit;
            if (!way.hit)
                break;
            normal = normal_at(s.proxy);
            last_step = dvec3(0.0);
            if (glm::dot(goal - s.proxy, normal.direction) <= 0.0)
                continue;
            if (pass_bump(goal, normal.direction, on_surface)) {
                if (on_surface)
                    normal = normal_at(s.proxy);
                continue;
            }
            // The surface met does not hold against the tool: its normal is in doubt there.
            normal = {-unit_or_zero(goal - s.proxy), 0.5};
            continue;
        }
        dvec3 residual = d + depth * normal.direction;
        const double across = glm::length(residual);
        const double held = friction * depth;
        residual *= across > held ? 1.0 - held / across : 0.0;
        if (glm::length(residual) < kPointConverged_mm)
            break;
        // The step that the last one's success suggests: in a hollow less than the residual, on a
        // bulge more (Barzilai & Borwein 1988).
        if (last_step != dvec3(0.0)) {
            const dvec3 change = last_residual - residual;
            const double curvature = glm::dot(last_step, change);
            if (curvature > 1e-18)
                gain = std::clamp(glm::dot(last_step, last_step) / curvature, 0.1, 3.0);
            else
                gain = 0.5;
        }
        dvec3 step = gain * residual;
        const double most = 4.0 * field_.voxel_mm();
        if (glm::length(step) > most)
            step *= most / glm::length(step);
        const dvec3 before = s.proxy;
        s.proxy = slide(s.proxy, normal.direction, step, on_surface);
        last_residual = residual;
        last_step = s.proxy - before;
        if (on_surface) {
            normal = normal_at(s.proxy);
            if (glm::length(last_step) < 0.1 * kPointConverged_mm)
                break;
        }
    }
    s.slipping = on_surface && glm::distance(s.proxy, start) > 1e-5;
    s.touching = on_surface;
    if (on_surface) {
        s.normal = normal.direction;
        s.confidence = normal.confidence;
    } else {
        s.confidence = 1.0;
    }
    return i;
}

// Out of material that came over the proxy: straight along the last normal, the smoothed field's,
// or away from the tool, whichever is free first; where none is, since so deep in material nothing
// has a slope that could be trusted, any of 26 directions, within 4 samples of the coarsest axis.
// Gradients are not followed on the way: inside sharp new material they point anywhere.
bool SweptPoint::push_out(dvec3 goal) {
    State& s = state_;
    const std::array<dvec3, 3> known{s.touching ? s.normal : dvec3(0.0),
                                     -unit_or_zero(field_.smooth(s.proxy).gradient),
                                     unit_or_zero(s.proxy - goal)};
    return push_out_along(known, field_.voxel_mm()) ||
           push_out_along(all_around(), field_.coarsest_mm());
}

// The way that is free first, within 4 samples.
bool SweptPoint::push_out_along(std::span<const dvec3> ways, double sample_mm) {
    State& s = state_;
    for (int i = 1; i <= 16; ++i)
        for (const dvec3& way : ways) {
            const dvec3 next = s.proxy + 0.25 * i * sample_mm * way;
            if (way == dvec3(0.0) || is_solid(next))
                continue;
            s.proxy = sweep(field_, next, s.proxy, budget_).point_mm;
            s.touching = true;
            s.normal = way;
            return true;
        }
    return false;
}

TickOutput SweptPoint::tick(const TickInput& input) noexcept {
    State& s = state_;
    const TouchParameters& q = *input.parameters;
    const std::optional<Volume>& volume = Felt::volume_of(input);
    if (!is_sane(input) || !volume)
        return coupler_.unknown();
    field_.follow(*volume, q);
    budget_ = Budget{};
    const State before = s;
    const bool was_inside = coupler_.is_inside();
    const dvec3 x = coupler_.hand(input, field_.voxel_mm(), [&](dvec3 p) { return !is_solid(p); });
    if (coupler_.has_come_out()) {
        s.proxy = coupler_.place_mm();
        s.touching = s.slipping = false;
    }
    Geometry geometry;
    geometry.was_replaced = s.exchange(input, *volume);
    if (!coupler_.is_inside())
        move(x, geometry);

    geometry.lacks_data = field_.lacks_data(coupler_.is_inside() ? coupler_.place_mm() : s.proxy);
    const dvec3 felt = coupler_.is_inside() ? coupler_.place_mm() : s.touching ? s.proxy : x;
    const dvec3 inward = geometry.touching ? -0.5 * field_.voxel_mm() * s.normal : dvec3(0.0);
    FeelMean mean(q);
    mean.add(*volume, field_.index_of(felt), dvec3(field_.offset_of(inward)));
    const TickOutput output = coupler_.couple(input, geometry, mean.feel());
    if (geometry.lacks_data)
        s = before;
    if (geometry.lacks_data && (was_inside || coupler_.is_at_hand())) {
        s = State{};
        s.restart(input.tool.position_mm);
    }
    return output;
}

// Geometry's part of a tick, for a hand at x.
void SweptPoint::move(dvec3 x, Geometry& geometry) {
    State& s = state_;
    // Edits, and a start in material.
    if (geometry.was_replaced && is_solid(s.proxy)) {
        if (!push_out(x)) {
            s.proxy = x;
            s.touching = false;
            geometry.submerged = is_solid(x);
        }
    } else if (!s.touching && is_solid(s.proxy)) {
        s.proxy = x;
        geometry.submerged = is_solid(x);
    }
    // The surface that was touched may be gone: a hand at rest would not notice, so the proxy sets
    // out anew, and where all is as before it is stopped at once.
    if (geometry.was_replaced && !is_solid(s.proxy))
        s.touching = false;
    if (!geometry.submerged)
        geometry.iterations = settle(x);

    geometry.proxy_mm = s.proxy;
    geometry.touching = s.touching;
    geometry.normal = s.normal;
    geometry.confidence = s.confidence;
    geometry.contacts = s.touching;
}

} // namespace

std::unique_ptr<Algorithm> make_swept_point() {
    return std::make_unique<SweptPoint>();
}

} // namespace palpate::haptics
