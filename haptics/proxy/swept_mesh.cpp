#include "haptics/proxy/swept_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include "engine/volume/extent.h"
#include "haptics/field/samples.h"
#include "haptics/proxy/coupler.h"
#include "haptics/proxy/local_window.h"
#include "haptics/proxy/rest.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

// How far from a proxy a face may lie after an edit for it to be the one that was touched.
constexpr double kSame_mm = 0.01;

dvec3 moved(const glm::dmat4& m, dvec3 p) {
    return dvec3(m * glm::dvec4(p, 1.0));
}
dvec3 turned(const glm::dmat4& m, dvec3 v) {
    return dvec3(m * glm::dvec4(v, 0.0));
}

// Shared by both algorithms: a proxy among triangles that `Surface` gives for a place.
template <class Surface>
class SweptTriangles final : public Algorithm {
 public:
    void reset(const TickInput& input) noexcept override {
        has_proxy_ = touching_ = slipping_ = is_on_its_way_ = is_restarted_ = false;
        if (is_place(input.tool.position_mm))
            proxy_ = input.tool.position_mm;
        coupler_.reset(proxy_);
    }

    TickOutput tick(const TickInput& input) noexcept override {
        looks_left_ = kMostLooks;
        if (!is_sane(input) || !surface_.follow(input))
            return coupler_.unknown();
        const auto before =
            std::tuple(touching_, slipping_, is_on_its_way_, proxy_, hand_, normal_);
        const bool was_inside = coupler_.is_inside();
        const dvec3 x = coupler_.hand(input, surface_.grain_mm(),
                                      [&](dvec3 p) { return is_free(surface_.from_world(p)); });
        if (coupler_.has_come_out()) {
            proxy_ = coupler_.place_mm();
            touching_ = slipping_ = is_on_its_way_ = false;
        }
        if (!has_proxy_)
            proxy_ = x;
        Geometry geometry;
        const bool is_first = !has_proxy_;
        geometry.was_replaced = is_first || is_restarted_ || surface_.is_new();
        has_proxy_ = true;
        is_restarted_ = false;
        if (!coupler_.is_inside())
            move(x, is_first, geometry);
        geometry.lacks_data =
            surface_.lacks_data(coupler_.is_inside() ? coupler_.place_mm() : proxy_);
        geometry.iterations = static_cast<uint32_t>(kMostLooks - looks_left_);
        const TickOutput output = coupler_.couple(input, geometry, feel(input, geometry));
        if (geometry.lacks_data) {
            std::tie(touching_, slipping_, is_on_its_way_, proxy_, hand_, normal_) = before;
            is_restarted_ = was_inside || coupler_.is_at_hand();
            if (is_restarted_) {
                proxy_ = input.tool.position_mm;
                touching_ = slipping_ = is_on_its_way_ = false;
            }
        }
        return output;
    }
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    void gather(dvec3 at, double way_mm) { looks_left_ -= surface_.gather(at, way_mm); }
    // Before blended normals are asked for: on the way to where it rests a point needs none.
    void shade() { looks_left_ -= surface_.shade(); }
    TriangleSpan span() {
        TriangleSpan span = surface_.span();
        span.looks_left = &looks_left_;
        return span;
    }
    std::optional<Feel> feel(const TickInput& input, const Geometry& geometry) const {
        const std::optional<Volume>& volume = Felt::volume_of(input);
        FeelMean mean(*input.parameters);
        if (mean.is_plain() || !volume)
            return plain_feel(*input.parameters);
        const dvec3 place = coupler_.is_inside() ? coupler_.place_mm() : proxy_;
        const dvec3 normal = geometry.touching ? geometry.normal : dvec3(0.0);
        const Grid& grid = volume->grid();
        const dvec3 inward_mm = -0.5 * smallest_spacing_mm(grid) * normal;
        const dvec3 index = index_point(grid, place);
        mean.add(*volume, index, index_point(grid, place + inward_mm) - index);
        return mean.feel();
    }
    // Geometry's part of a tick, for a hand at x.
    void move(dvec3 x, bool is_first, Geometry& geometry) {
        if (geometry.was_replaced && !is_first)
            put_back();
        const dvec3 start = proxy_;
        stepped_mm_ = is_first ? 0.0 : glm::distance(x, hand_);
        hand_ = x;
        const dvec3 goal =
            touching_ ? coupler_.rubbed(x, proxy_, surface_.turn_to_world(normal_), slipping_) : x;
        Rest rest = follow(goal, geometry);
        if (!rest.touching && goal != x)
            rest = follow(x, geometry);
        proxy_ = surface_.to_world(rest.point);
        const dvec3 end = rest.touching ? goal : x;
        const dvec3 felt =
            rest.curved == surface_.from_world(end) ? end : surface_.to_world(rest.curved);
        if (!(rest.touching && touching_))
            slipping_ = glm::distance(proxy_, start) > 1e-5;
        touching_ = rest.touching;
        if (touching_)
            normal_ = rest.shaded_normal;
        geometry.proxy_mm = felt;
        geometry.touching = touching_;
        geometry.normal = surface_.turn_to_world(rest.shaded_normal);
        geometry.contacts = touching_;
        // A proxy that rests on a face tells enough of what is touched, even if work has ended.
        is_on_its_way_ = rest.reached_side;
        geometry.is_behind = is_on_its_way_;
    }

    // Outside of the nearest face, and of the blended normals there: of two faces that meet in an
    // edge one alone may see a place from the wrong side. Where no face is near, the surface knows.
    bool is_free(dvec3 p) {
        gather(p, 0.0);
        shade();
        const SurfacePoint near = nearest_point(span(), p);
        if (!near.found)
            return surface_.is_free_amid();
        const dvec3 off = p - near.point;
        return glm::dot(off, near.face_normal) > 0.0 && glm::dot(off, near.shaded_normal) > 0.0;
    }

    // Finds the place that the proxy goes to when the tool is at x.
    Rest follow(dvec3 x, const Geometry& geometry) {
        const dvec3 goal = surface_.from_world(x);
        Rest rest{.point = surface_.from_world(proxy_), .curved = surface_.from_world(proxy_)};
        const auto settle_there = [&](const Rest& from) {
            return settle(span(), from, goal, surface_.low_mm(), surface_.high_mm(),
                          surface_.grain_mm());
        };
        // In contact it slides on from where it was, if that is there still. Not where the last
        // tick ended on the way: a slide may lead back, to where that way began, but the way over
        // the faces never leads away from the goal, so that a hand at rest is caught up with.
        std::optional<Rest> slid;
        Rest held; // where it was
        if (touching_ && !is_on_its_way_) {
            gather(rest.point, glm::distance(rest.point, goal));
            shade();
            rest.point = off_the_faces(span(), rest.point);
            held = rest_at(span(), rest.point, geometry.was_replaced ? kSame_mm : INFINITY);
            const Rest near = settle_there(held);
            if (near.settled)
                return near;
            if (near.touching)
                slid = near;
            rest.point = near.point;
        }
        // Else, or where that leads nowhere, over the faces: in stretches that the triangles at
        // hand reach. What is left of a long way the next tick goes on with.
        // Under a hand that went no farther in this tick than a slide does, 16 steps of half a
        // grain, four windows at most, which pass four grains each: twice as far.
        const bool is_slow = slid && stepped_mm_ <= 8.0 * surface_.grain_mm();
        const int most = is_slow ? 4 : 16;
        bool has_walked = false;
        for (int stretch = 0; stretch < most && looks_left_ > 0; ++stretch) {
            const dvec3 here = rest.point;
            has_walked = true;
            if (const double share = surface_.clear_share(here, goal); share > 0.0) {
                rest = {.point = here + share * (goal - here)};
                rest.curved = rest.point = share < 1.0 ? rest.point : goal;
                if (share < 1.0)
                    continue;
                break;
            }
            gather(here, glm::distance(here, goal));
            rest = come_to_rest(span(), off_the_faces(span(), here), goal, surface_.low_mm(),
                                surface_.high_mm());
            if (!rest.reached_side)
                shade();
            if (!rest.touching && !rest.reached_side)
                rest = rest_under_bulge(span(), goal);
            if (rest.touching && !rest.reached_side)
                rest = settle_there(rest_at(span(), rest.point, INFINITY));
            if (looks_left_ > 0 && glm::distance(rest.point, here) < 1e-4)
                rest.reached_side = false; // it cannot go on
            if (!rest.reached_side)
                break;
        }
        // The slide may have taken all looks: then it ended on the way, too.
        if (slid && !has_walked)
            return *slid;
        if (!slid || !rest.reached_side)
            return rest;
        // Its work ended on the way through bumps. A slow hand, and one that the way led no nearer
        // to by a grain, is held where the slide ended, or began, if that is no farther: so that
        // bumps do not lead a hand at rest on, nor a slow one by leaps.
        const auto left = [&](const Rest& at) { return glm::distance(at.point, goal); };
        Rest still = left(*slid) < left(held) ? *slid : held;
        still.reached_side = false;
        if (is_slow || left(still) - left(rest) < surface_.grain_mm())
            return still;
        return rest;
    }

    // The surface moved: from inside of it out to the nearest face; where none is at hand, to the
    // nearest place that is free, from where it goes on to the surface.
    void put_back() {
        const dvec3 p = surface_.from_world(proxy_);
        gather(p, INFINITY);
        SurfacePoint near = nearest_point(span(), p);
        if (!near.found) {
            dvec3 free = p;
            if (!surface_.is_solid_amid() || !surface_.find_free(p, normal_, free))
                return;
            proxy_ = surface_.to_world(free);
            gather(free, INFINITY);
            near = nearest_point(span(), free);
            if (!near.found || glm::dot(free - near.point, near.face_normal) >= 0.0)
                return;
        } else if (glm::dot(p - near.point, near.face_normal) >= 0.0) {
            return;
        }
        proxy_ = surface_.to_world(near.point + kSkin_mm * near.face_normal);
    }

    Surface surface_;
    int64_t looks_left_ = 0;
    Coupler coupler_;
    bool has_proxy_ = false, touching_ = false, slipping_ = false;
    bool is_restarted_ = false;  // after a gap in the data: at the hand, whatever is there
    bool is_on_its_way_ = false; // the last tick ended before the proxy was where it is drawn
    double stepped_mm_ = 0.0;    // by the hand in this tick
    dvec3 proxy_{0.0}, hand_{0.0};
    dvec3 normal_{0.0}; // where it last touched, from_world()
};

// The triangles of a mesh within 2 to 8 grains of a place.
class MeshSurface {
 public:
    bool follow(const TickInput& input) {
        const TouchMesh* mesh = input.scene->touch_mesh.get();
        is_new_ = mesh != mesh_ || input.scene->version != version_;
        mesh_ = mesh;
        version_ = input.scene->version;
        const std::optional<Volume>& volume = Felt::volume_of(input);
        made_of_ = mesh && mesh->is_of_samples && volume && volume->no_data_count() > 0 ? &*volume
                                                                                        : nullptr;
        return mesh != nullptr;
    }
    bool is_new() const { return is_new_; }
    dvec3 from_world(dvec3 p) const { return moved(mesh_->mesh_from_world, p); }
    dvec3 to_world(dvec3 p) const { return moved(mesh_->mesh->world_from_mesh, p); }
    dvec3 turn_to_world(dvec3 v) const {
        return unit_or_zero(turned(mesh_->mesh->world_from_mesh, v));
    }
    double clear_share(dvec3, dvec3) const { return 0.0; }
    bool is_solid_amid() const { return false; }
    bool is_free_amid() const { return false; } // it is not known: then nothing changes
    bool find_free(dvec3, dvec3, dvec3&) const { return false; }
    // For a way of that length, or the first part of it; for an infinite one, all about the place.
    // Returns how many points it had to make.
    int64_t gather(dvec3 at, double way_mm) {
        const double cell = mesh_->cell_mm, grain = mesh_->grain_mm;
        const double reach =
            grain * (std::isfinite(way_mm) ? std::clamp(way_mm / grain + 1.0, 2.0, 4.0) : 8.0);
        low_ = at - reach;
        high_ = at + reach;
        // And one cell more, for what floats round.
        const auto cell_of = [&](dvec3 p) {
            return glm::ivec3(glm::floor(glm::clamp((p - dvec3(mesh_->low_mm)) / cell, -1e6, 1e6)));
        };
        from_ = glm::max(cell_of(low_) - 1, glm::ivec3(0));
        to_ = glm::min(cell_of(high_) + 1, mesh_->cells - 1);
        return 0;
    }
    int64_t shade() { return 0; } // it has its normals
    TriangleSpan span() const {
        const double per_mm = 1.0 / double{mesh_->cell_mm};
        return {mesh_->mesh->positions,
                mesh_->mesh->normals,
                mesh_->triangles,
                mesh_->bulge_mm,
                {glm::dmat3(per_mm), -per_mm * dvec3(mesh_->low_mm), mesh_->cells, from_, to_,
                 mesh_->first}};
    }
    dvec3 low_mm() const { return low_; }
    dvec3 high_mm() const { return high_; }
    // Next to samples without data a mesh that was made of them is no surface.
    bool lacks_data(dvec3 world_mm) const {
        if (!made_of_)
            return false;
        constexpr int kReach = 4; // of the filters, and a cell's corners
        const dvec3 index = index_point(made_of_->grid(), world_mm);
        const glm::ivec3 cell(glm::floor(glm::clamp(index, -1e6, 1e6)));
        return has_no_data(*made_of_, cell - 1 - kReach, cell + 2 + kReach);
    }
    double grain_mm() const { return mesh_->grain_mm; }

 private:
    const TouchMesh* mesh_ = nullptr;
    const Volume* made_of_ = nullptr; // where some of it has no data
    uint64_t version_ = 0;
    bool is_new_ = false;
    dvec3 low_{0.0}, high_{0.0};
    glm::ivec3 from_{0}, to_{0};
};

} // namespace

std::unique_ptr<Algorithm> make_swept_mesh() {
    return std::make_unique<SweptTriangles<MeshSurface>>();
}
std::unique_ptr<Algorithm> make_swept_local() {
    return std::make_unique<SweptTriangles<LocalWindow>>();
}

} // namespace palpate::haptics
