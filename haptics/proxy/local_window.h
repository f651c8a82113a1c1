#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/volume/extent.h"
#include "haptics/field/coupling.h"
#include "haptics/field/patch.h"
#include "haptics/proxy/coupler.h"

namespace palpate::haptics {

// The marching-cubes surface about a place, made when it is asked for.
class LocalWindow {
    using dvec3 = glm::dvec3;

 public:
    LocalWindow() : patch_(Patch::kMostSide), samples_(kFiner) {}
    bool follow(const TickInput& input) {
        const std::optional<Volume>& volume = Felt::volume_of(input);
        if (!volume)
            return false;
        samples_.follow(*volume, *input.parameters);
        is_new_ = volume->version() != version_ || samples_.settings() != settings_;
        has_window_ &= !is_new_;
        version_ = volume->version();
        settings_ = samples_.settings();
        volume_ = &*volume;
        space_ = rigid_space(world_from_mesh(volume->grid()));
        from_world_ = glm::inverse(space_.world_from_rigid);
        mesh_from_ = glm::inverse(space_.from_mesh);
        spacing_ = spacing_mm(volume->grid()) / double{kFiner};
        grain_mm_ = smallest_spacing_mm(volume->grid()) / kFiner;
        largest_mm_ = largest_spacing_mm(volume->grid());
        return true;
    }
    bool is_new() const { return is_new_; }
    dvec3 from_world(dvec3 p) const { return dvec3(from_world_ * glm::dvec4(p, 1.0)); }
    dvec3 to_world(dvec3 p) const { return dvec3(space_.world_from_rigid * glm::dvec4(p, 1.0)); }
    dvec3 turn_to_world(dvec3 v) const {
        return unit_or_zero(glm::dmat3(space_.world_from_rigid) * v);
    }
    // How much of a way, from its start, may be leapt over: nothing solid lies about it.
    double clear_share(dvec3 from, dvec3 to) const {
        const dvec3 a = point_of(from), way = point_of(to) - a;
        const double share = std::min(1.0, kLeap / std::max(glm::length(way), 1e-9));
        const dvec3 b = a + share * way;
        const dvec3 low = glm::min(a, b) - 1.0, high = glm::max(a, b) + 1.0;
        if (glm::any(glm::greaterThan(glm::max(glm::abs(low), glm::abs(high)), dvec3(4e6))))
            return 0.0;
        return samples_.is_clear(glm::ivec3(glm::floor(low)), glm::ivec3(glm::ceil(high))) ? share
                                                                                           : 0.0;
    }
    // A window serves places about its middle, too.
    int64_t gather(dvec3 at, double) {
        int64_t points = 0;
        const dvec3 off = glm::abs(point_of(at) - middle_);
        if (!has_window_ || std::max({off.x, off.y, off.z}) > 1.0) {
            points = patch_.extract(samples_, *volume_, to_world(at), space_);
            const dvec3 middle_mm = 0.5 * (patch_.low_mm() + patch_.high_mm());
            dvec3 half_mm = 0.5 * (patch_.high_mm() - patch_.low_mm());
            half_mm *= space_.inner_share(half_mm);
            middle_ = middle_mm / spacing_;
            low_ = space_.from_mesh * middle_mm - half_mm;
            high_ = space_.from_mesh * middle_mm + half_mm;
            has_window_ = true;
        }
        return points;
    }
    int64_t shade() { return patch_.shade(samples_, space_); }
    // Whether the window lies in material, for a window without triangles.
    bool is_solid_amid() const { return patch_.is_solid_amid(); }
    bool is_free_amid() const { return !patch_.is_solid_amid(); }
    // The nearest place with a free sample, within four of the coarsest spacings: along `first`, or
    // one of 26 ways.
    bool find_free(dvec3 from, dvec3 first, dvec3& found) const {
        const double step_mm = 0.5 * largest_mm_;
        for (int i = 1; i <= 8; ++i)
            for (int way = -1; way < 27; ++way) {
                const dvec3 towards =
                    way < 0 ? first : dvec3(way % 3 - 1, way / 3 % 3 - 1, way / 9 - 1);
                found = from + i * step_mm * unit_or_zero(towards);
                const dvec3 sample = glm::clamp(point_of(found) / double{kFiner}, -1e6, 1e6);
                if (towards != dvec3(0.0) && samples_.is_free(glm::ivec3(glm::round(sample))))
                    return true;
            }
        return false;
    }
    const TriangleSpan& span() const { return patch_.span(); }
    dvec3 low_mm() const { return low_; }
    dvec3 high_mm() const { return high_; }
    bool lacks_data(dvec3 world_mm) const {
        return samples_.lacks_data(index_point(volume_->grid(), world_mm));
    }
    double grain_mm() const { return grain_mm_; }

 private:
    static constexpr int kFiner = 4;
    static constexpr double kLeap = 64.0; // points of the lattice

    // The place on the lattice, counted from zero.
    dvec3 point_of(dvec3 p) const { return mesh_from_ * p / spacing_; }

    Patch patch_;
    FineSamples samples_;
    const Volume* volume_ = nullptr;
    uint64_t version_ = 0, settings_ = 0;
    bool is_new_ = false, has_window_ = false;
    dvec3 middle_{0.0}, spacing_{1.0}; // in points of the lattice; mm
    dvec3 low_{0.0}, high_{0.0};       // of a box in the window
    double grain_mm_ = 1.0, largest_mm_ = 1.0;
    RigidSpace space_;
    glm::dmat4 from_world_{1.0};
    glm::dmat3 mesh_from_{1.0};
};

} // namespace palpate::haptics
