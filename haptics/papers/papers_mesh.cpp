#include "haptics/papers/papers_mesh.h"

#include "haptics/field/coupling.h"
#include "haptics/field/patch.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

const Volume* felt_volume(const TickInput& input) {
    const std::optional<Volume>& volume =
        input.parameters->source == TouchSource::labels ? input.scene->labels : input.scene->grey;
    return volume ? &*volume : nullptr;
}

dvec3 turned(const glm::dmat4& m, dvec3 v) {
    return dvec3(m * glm::dvec4(v, 0.0));
}
dvec3 moved(const glm::dmat4& m, dvec3 p) {
    return dvec3(m * glm::dvec4(p, 1.0));
}

// ---- Koerner et al. 1999 ----------------------------------------------------------------------

class Koerner1999 final : public Algorithm {
 public:
    Koerner1999() : patches_{Patch(7), Patch(7)} {}
    void reset(const TickInput& input) noexcept override {
        has_surface_ = touching_ = false;
        waiting_s_ = -1.0;
        has_last_ = is_place(input.tool.position_mm);
        last_tool_ = has_last_ ? input.tool.position_mm : dvec3(0.0);
        rendered_ = last_tool_;
        shift_ = dvec3(0.0);
    }
    TickOutput tick(const TickInput& input) noexcept override;
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    void track(dvec3 from, dvec3 tool, const TouchParameters& parameters);

    std::array<Patch, 2> patches_;
    uint32_t front_ = 0;
    bool has_surface_ = false, touching_ = false, has_last_ = false;
    double waiting_s_ = -1.0; // until the surface that was asked for is there; < 0: none was
    dvec3 asked_{0.0};        // where
    dvec3 last_tool_{0.0}, rendered_{0.0};
    dvec3 shift_{0.0};                 // of the object, mesh space
    dvec3 contact_{0.0}, normal_{0.0}; // mesh space, object moved back
};

// The proxy on the surface at hand: enters where the tool passes a triangle, then is the nearest
// point to where friction lets it go.
void Koerner1999::track(dvec3 from, dvec3 tool, const TouchParameters& q) {
    const TriangleSpan& surface = patches_[front_].span();
    if (!touching_) {
        const SurfacePoint hit = first_crossing(surface, from, tool);
        if (!hit.found)
            return;
        touching_ = true;
        contact_ = hit.point;
        normal_ = hit.shaded_normal;
    }
    const dvec3 d = tool - contact_;
    const double depth = std::max(0.0, -glm::dot(d, normal_));
    const dvec3 across = d + depth * normal_;
    const double length = glm::length(across);
    const double go = std::max(0.0, length - q.friction_dynamic * depth);
    const SurfacePoint next = nearest_point(surface, contact_ + go * unit_or_zero(across));
    if (!next.found) {
        touching_ = false;
        return;
    }
    contact_ = next.point;
    normal_ = next.shaded_normal;
    touching_ = glm::dot(tool - contact_, next.face_normal) < 0.0;
}

TickOutput Koerner1999::tick(const TickInput& input) noexcept {
    const Volume* volume = felt_volume(input);
    if (!is_sane(input) || !volume)
        return unknown_output(rendered_);
    const TouchParameters& q = *input.parameters;
    const dvec3 x = input.tool.position_mm;
    if (!has_last_)
        last_tool_ = rendered_ = x;
    has_last_ = true;
    const glm::dmat4 to_mesh = Patch::mesh_from_world(*volume);
    const glm::dmat4 to_world = world_from_mesh(volume->grid());

    // The other thread: one surface at a time, asked for at the tool, there after the delay.
    bool is_new = false;
    if (waiting_s_ >= 0.0 && (waiting_s_ -= input.dt_s) < 0.0) {
        front_ ^= 1u;
        patches_[front_].extract(*volume, asked_, q);
        is_new = has_surface_ = true;
    }
    if (waiting_s_ < 0.0) {
        asked_ = x;
        waiting_s_ = q.surface_delay_s;
    }
    const dvec3 was = moved(to_mesh, last_tool_);
    const dvec3 is = moved(to_mesh, x);
    if (is_new) {
        // Put back at once, and contact sought anew: inside of the nearest triangle, or not.
        shift_ = dvec3(0.0);
        const SurfacePoint nearest = nearest_point(patches_[front_].span(), is);
        touching_ = nearest.found && glm::dot(is - nearest.point, nearest.face_normal) < 0.0;
        contact_ = nearest.point;
        normal_ = nearest.shaded_normal;
    } else if (has_surface_) {
        const Patch& patch = patches_[front_];
        const dvec3 inside = glm::clamp(is - shift_, patch.low_mm(), patch.high_mm());
        const dvec3 before = was - shift_;
        shift_ = is - inside; // dragged along
        track(before, inside, q);
    }
    const dvec3 proxy = touching_ ? moved(to_world, contact_ + shift_) : x;
    TickOutput output;
    output.force_n = coupling_n(q.stiffness_n_per_m, touching_ ? q.damping_n_s_per_m : 0.0, x,
                                proxy, input.velocity_mm_per_s, (proxy - rendered_) / input.dt_s);
    if (touching_) {
        // Force shading: the size of the spring's normal part along the blended normal.
        output.normal = unit_or_zero(turned(to_world, normal_));
        const double along = glm::dot(output.force_n, output.normal);
        if (q.friction_dynamic == 0.0 && along > 0.0)
            output.force_n = glm::length(output.force_n) * output.normal;
    }
    last_tool_ = x;
    rendered_ = proxy;
    output.proxy = input.tool;
    output.proxy.position_mm = proxy;
    output.depth_mm = glm::distance(proxy, x);
    output.contact = touching_ ? Contact::touching : Contact::free;
    output.contacts = touching_;
    if (!is_finite(output.force_n))
        return unknown_output(proxy);
    return output;
}

// ---- drilling in three steps ------------------------------------------------------------------

class DrillThreeStep final : public Algorithm {
 public:
    DrillThreeStep() : patch_(7) {}
    void reset(const TickInput& input) noexcept override {
        step_ = Step::free;
        has_last_ = is_place(input.tool.position_mm);
        last_tool_ = point_ = has_last_ ? input.tool.position_mm : dvec3(0.0);
        heading_ = dvec3(0.0);
    }
    TickOutput tick(const TickInput& input) noexcept override;
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    enum class Step { free, track, drag };
    Patch patch_;
    Step step_ = Step::free;
    bool has_last_ = false;
    bool holds_threshold_ = false; // step 3: force of the threshold while it is deeper than that
    dvec3 last_tool_{0.0}, point_{0.0}, normal_{0.0}, heading_{0.0};
    uint64_t asked_version_ = 0;
};

TickOutput DrillThreeStep::tick(const TickInput& input) noexcept {
    const Volume* volume = felt_volume(input);
    if (!is_sane(input) || !volume)
        return unknown_output(point_);
    const TouchParameters& q = *input.parameters;
    const dvec3 x = input.tool.position_mm;
    if (!has_last_)
        last_tool_ = point_ = x;
    has_last_ = true;
    const glm::dmat4 to_mesh = Patch::mesh_from_world(*volume);
    const glm::dmat4 to_world = world_from_mesh(volume->grid());
    const double threshold = q.drill_threshold_mm;
    const dvec3 last_point = point_;

    const dvec3 motion = x - last_tool_;
    if (glm::length(motion) > 1e-6)
        heading_ = glm::normalize(motion);

    if (step_ == Step::free) {
        patch_.extract(*volume, x, q);
        patch_.mean_filter();
        const SurfacePoint hit =
            first_crossing(patch_.span(), moved(to_mesh, last_tool_), moved(to_mesh, x));
        point_ = x;
        if (hit.found) {
            step_ = Step::track;
            holds_threshold_ = false;
            point_ = moved(to_world, hit.point);
        }
    }
    if (step_ == Step::drag) {
        // Behind the tool's motion, at a constant distance; until it touches a newer triangle.
        const dvec3 before = point_;
        point_ = x - threshold * heading_;
        holds_threshold_ = false;
        patch_.extract(*volume, point_, q);
        patch_.mean_filter();
        if (volume->version() > asked_version_) {
            const SurfacePoint hit =
                first_crossing(patch_.span(), moved(to_mesh, before), moved(to_mesh, point_));
            if (hit.found) {
                step_ = Step::track;
                holds_threshold_ = true;
                point_ = moved(to_world, hit.point);
            }
        }
    }
    if (step_ == Step::track) {
        // Ho & Basdogan: the tool onto the plane of the contact's triangle, then the nearest
        // triangle of the cells about.
        patch_.extract(*volume, point_, q);
        patch_.mean_filter();
        const dvec3 tool = moved(to_mesh, x);
        const SurfacePoint here = nearest_point(patch_.span(), moved(to_mesh, point_));
        if (here.found) {
            const dvec3 on_plane =
                tool - glm::dot(tool - here.point, here.face_normal) * here.face_normal;
            const SurfacePoint next = nearest_point(patch_.span(), on_plane);
            point_ = moved(to_world, next.point);
            normal_ = unit_or_zero(turned(to_world, next.shaded_normal));
            if (glm::dot(tool - next.point, next.face_normal) >= 0.0) {
                step_ = Step::free;
                point_ = x;
            } else if (glm::distance(x, point_) > threshold && threshold > 0.0) {
                step_ = Step::drag; // from step 3, too: it goes on with step 1
                asked_version_ = volume->version();
            } else if (glm::distance(x, point_) <= threshold) {
                holds_threshold_ = false;
            }
        } else {
            step_ = Step::free;
            point_ = x;
        }
    }

    TickOutput output;
    output.proxy = input.tool;
    output.proxy.position_mm = point_;
    output.force_n = coupling_n(q.stiffness_n_per_m, q.damping_n_s_per_m, x, point_,
                                input.velocity_mm_per_s, (point_ - last_point) / input.dt_s);
    if (holds_threshold_ && step_ != Step::free) // step 3: the size stays that of the threshold
        output.force_n = 1e-3 * q.stiffness_n_per_m * threshold * unit_or_zero(output.force_n);
    output.depth_mm = glm::distance(point_, x);
    output.normal = step_ == Step::track ? normal_ : dvec3(0.0);
    output.contact = step_ == Step::free    ? Contact::free
                     : step_ == Step::track ? Contact::touching
                                            : Contact::yielding;
    output.contacts = step_ == Step::track;
    output.carving = step_ == Step::drag ? Carving::at_tool : Carving::rests;
    last_tool_ = x;
    if (!is_finite(output.force_n))
        return unknown_output(point_);
    return output;
}

} // namespace

std::unique_ptr<Algorithm> make_koerner_1999() {
    return std::make_unique<Koerner1999>();
}
std::unique_ptr<Algorithm> make_drill_three_step() {
    return std::make_unique<DrillThreeStep>();
}

} // namespace palpate::haptics
