#include "haptics/proxy/swept_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "haptics/proxy/coupler.h"
#include "haptics/proxy/patch.h"
#include "haptics/proxy/planes.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

// Off the faces by more than what floats round: the same vertex comes out of two windows up to 4e-6
// mm apart, and a point that was in front of a face may be found so far behind it.
constexpr double kSkin_mm = 1e-4, kBehind_mm = 1e-5, kResting_mm = 1e-7;

dvec3 moved(const glm::dmat4& m, dvec3 p) {
    return dvec3(m * glm::dvec4(p, 1.0));
}
dvec3 turned(const glm::dmat4& m, dvec3 v) {
    return dvec3(m * glm::dvec4(v, 0.0));
}

} // namespace

namespace {

// How much of the way from a point of the box, 0 .. 1, lies within it.
double share_within(dvec3 from, dvec3 to, dvec3 low, dvec3 high) {
    double share = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double way = to[axis] - from[axis];
        if (to[axis] > high[axis])
            share = std::min(share, std::max(0.0, (high[axis] - from[axis]) / way));
        if (to[axis] < low[axis])
            share = std::min(share, std::max(0.0, (low[axis] - from[axis]) / way));
    }
    return share;
}

} // namespace

Rest come_to_rest(const TriangleSpan& surface, dvec3 from, dvec3 goal, dvec3 low, dvec3 high) {
    Rest rest{.point = from};
    std::array<Plane, 3> planes;
    uint32_t count = 0, oldest = 0;
    dvec3 settled = from; // where it was when it last looked straight at the goal
    for (; rest.iterations < 48; ++rest.iterations) {
        const Projection way = project_to_planes(goal, {planes.data(), count});
        dvec3 target = way.is_feasible ? way.point : rest.point;
        const double share = share_within(rest.point, target, low, high);
        target = rest.point + share * (target - rest.point);
        const SurfacePoint hit = first_crossing(surface, rest.point, target, kBehind_mm);
        if (hit.found) {
            // Back on its way, which is known to be free, until it is off the face: straight off
            // the face there may be another one, in a crease. The plane may be further out than
            // that; then the next step, which is swept, too, goes there.
            const dvec3 direction = unit_or_zero(target - rest.point);
            const double descent = -glm::dot(hit.face_normal, direction);
            rest.point +=
                std::max(0.0, hit.distance - kSkin_mm / std::max(descent, 1e-9)) * direction;
            rest.face_normal = hit.face_normal;
            rest.shaded_normal = hit.shaded_normal;
            rest.touching = true;
            const Plane plane{hit.face_normal, glm::dot(hit.face_normal, hit.point) + kSkin_mm};
            if (count < 3) {
                planes[count++] = plane;
            } else { // a fourth one: the one met longest ago lets go
                planes[oldest] = plane;
                oldest = (oldest + 1) % 3;
            }
            continue;
        }
        rest.point = target;
        if (share < 1.0) {
            rest.reached_side = true;
            return rest;
        }
        if (count == 0) {
            rest.touching = false;
            return rest;
        }
        if (glm::distance(rest.point, settled) < kResting_mm)
            return rest;
        settled = rest.point;
        count = oldest = 0;
    }
    return rest;
}

std::shared_ptr<const TouchMesh> make_touch_mesh(std::shared_ptr<const Mesh> mesh, double cell_mm) {
    auto made = std::make_shared<TouchMesh>();
    made->mesh = mesh;
    made->mesh_from_world = glm::inverse(mesh->world_from_mesh);
    glm::vec3 low(0.0f), high(0.0f);
    if (!mesh->positions.empty())
        low = high = mesh->positions[0];
    for (const glm::vec3 p : mesh->positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    double cell = std::max(cell_mm, 1e-3);
    const auto cells_of = [&] { return glm::ivec3((high - low) / static_cast<float>(cell)) + 1; };
    while (double(cells_of().x) * cells_of().y * cells_of().z > 4194304.0)
        cell *= 1.26;
    made->low_mm = low;
    made->cell_mm = static_cast<float>(cell);
    made->cells = cells_of();
    const size_t count = size_t(made->cells.x) * size_t(made->cells.y) * size_t(made->cells.z);
    made->first.assign(count + 1, 0);
    const auto for_cells = [&](const glm::uvec3 t, const auto& visit) {
        const glm::vec3 a = mesh->positions[t.x], b = mesh->positions[t.y],
                        c = mesh->positions[t.z];
        const glm::ivec3 last = made->cells - 1;
        const glm::ivec3 from = glm::clamp(
            glm::ivec3((glm::min(glm::min(a, b), c) - low) / made->cell_mm), glm::ivec3(0), last);
        const glm::ivec3 to = glm::clamp(
            glm::ivec3((glm::max(glm::max(a, b), c) - low) / made->cell_mm), glm::ivec3(0), last);
        for (int z = from.z; z <= to.z; ++z)
            for (int y = from.y; y <= to.y; ++y)
                for (int x = from.x; x <= to.x; ++x)
                    visit(size_t(x) +
                          size_t(made->cells.x) * (size_t(y) + size_t(made->cells.y) * size_t(z)));
    };
    for (const glm::uvec3 t : mesh->triangles)
        for_cells(t, [&](size_t c) { ++made->first[c + 1]; });
    for (size_t c = 0; c < count; ++c)
        made->first[c + 1] += made->first[c];
    made->which.resize(made->first[count]);
    std::vector<uint32_t> at(made->first.begin(), made->first.end() - 1);
    for (uint32_t i = 0; i < mesh->triangles.size(); ++i)
        for_cells(mesh->triangles[i], [&](size_t c) { made->which[at[c]++] = i; });
    return made;
}

namespace {

// What both have in common: a proxy among triangles that `Surface` gives for a place.
template <class Surface>
class SweptTriangles final : public Algorithm {
 public:
    void reset(const TickInput& input) noexcept override {
        has_proxy_ = touching_ = slipping_ = false;
        if (is_place(input.tool.position_mm))
            proxy_ = input.tool.position_mm;
        coupler_.reset(proxy_);
    }

    TickOutput tick(const TickInput& input) noexcept override {
        const TouchParameters& q = *input.parameters;
        if (!is_sane(input) || !surface_.follow(input))
            return coupler_.unknown();
        const dvec3 x = input.tool.position_mm;
        if (!has_proxy_)
            proxy_ = x;
        Geometry geometry;
        const bool is_first = !has_proxy_;
        geometry.was_replaced = is_first || surface_.is_new();
        has_proxy_ = true;
        if (geometry.was_replaced && !is_first)
            put_back();

        // In stretches that the triangles at hand reach.
        const dvec3 start = proxy_;
        Rest rest{.point = surface_.from_world(proxy_)};
        for (int stretch = 0; stretch < 12; ++stretch) {
            const dvec3 here = rest.point;
            surface_.gather(here);
            const uint32_t before = geometry.iterations;
            rest = come_to_rest(surface_.span(), here, surface_.from_world(x), surface_.low_mm(),
                                surface_.high_mm());
            geometry.iterations = before + rest.iterations + 1;
            if (!rest.reached_side || glm::distance(rest.point, here) < 1e-4)
                break;
        }
        proxy_ = surface_.to_world(rest.point);
        const dvec3 face = surface_.turn_to_world(rest.face_normal);

        // Friction: it stays behind by as much as the cone allows, over the face.
        const Feel& feel = coupler_.feel();
        const double friction = slipping_ ? feel.friction_dynamic : feel.friction_static;
        if (rest.touching && touching_ && friction > 0.0) {
            const double depth = std::max(0.0, glm::dot(proxy_ - x, face) - coupler_.yielded_mm());
            const dvec3 way = start - proxy_;
            const double across = glm::length(way);
            slipping_ = across > friction * depth + 1e-6;
            if (across > 0.0) {
                const double back = std::min(across, friction * depth) / across;
                const Rest held = come_to_rest(surface_.span(), rest.point,
                                               surface_.from_world(proxy_ + back * way),
                                               surface_.low_mm(), surface_.high_mm());
                proxy_ = surface_.to_world(held.point);
            }
        } else {
            slipping_ = glm::distance(proxy_, start) > 1e-5;
        }
        touching_ = rest.touching;
        geometry.proxy_mm = proxy_;
        geometry.touching = touching_;
        geometry.normal = surface_.turn_to_world(rest.shaded_normal);
        geometry.contacts = touching_;
        geometry.lacks_data = surface_.lacks_data();
        TickOutput output =
            coupler_.couple(input, geometry, plain_feel(q), surface_.grain_mm(), [&](dvec3 p) {
                // Free where the nearest face is seen from outside.
                const SurfacePoint near = nearest_point(surface_.span(), surface_.from_world(p));
                return near.found &&
                       glm::dot(surface_.from_world(p) - near.point, near.face_normal) > 0.0;
            });
        // Force shading: what is frictionless acts along the blended normal.
        if (touching_ && q.friction_static == 0.0 && output.contact == Contact::touching)
            output.force_n = glm::length(output.force_n) * output.normal;
        proxy_ = geometry.proxy_mm;
        touching_ = geometry.touching;
        return output;
    }

 private:
    // The surface moved: from inside of it out to the nearest face, if that is near.
    void put_back() {
        const dvec3 p = surface_.from_world(proxy_);
        surface_.gather(p);
        const SurfacePoint near = nearest_point(surface_.span(), p);
        if (near.found && glm::dot(p - near.point, near.face_normal) < 0.0)
            proxy_ = surface_.to_world(near.point + kSkin_mm * near.face_normal);
    }

    Surface surface_;
    Coupler coupler_;
    bool has_proxy_ = false, touching_ = false, slipping_ = false;
    dvec3 proxy_{0.0};
};

// The triangles of a mesh within 4 cells of a place.
class MeshSurface {
 public:
    bool follow(const TickInput& input) {
        const TouchMesh* mesh = input.scene->touch_mesh.get();
        is_new_ = mesh != mesh_ || input.scene->version != version_;
        mesh_ = mesh;
        version_ = input.scene->version;
        return mesh != nullptr;
    }
    bool is_new() const { return is_new_; }
    dvec3 from_world(dvec3 p) const { return moved(mesh_->mesh_from_world, p); }
    dvec3 to_world(dvec3 p) const { return moved(mesh_->mesh->world_from_mesh, p); }
    dvec3 turn_to_world(dvec3 v) const {
        return unit_or_zero(turned(mesh_->mesh->world_from_mesh, v));
    }
    void gather(dvec3 at) {
        const double cell = mesh_->cell_mm;
        const dvec3 low(mesh_->low_mm), index = glm::clamp((at - low) / cell, -1e6, 1e6);
        // As far as the table holds all triangles; each is taken once, at its first cell.
        for (int reach = 4;; --reach) {
            const glm::ivec3 from = glm::max(glm::ivec3(glm::floor(index)) - reach, glm::ivec3(0));
            const glm::ivec3 to = glm::min(glm::ivec3(glm::floor(index)) + reach, mesh_->cells - 1);
            low_ = low + cell * (glm::floor(index) - double(reach));
            high_ = low + cell * (glm::floor(index) + double(reach) + 1.0);
            count_ = 0;
            bool fits = true;
            for (int z = from.z; z <= to.z && fits; ++z)
                for (int y = from.y; y <= to.y && fits; ++y)
                    for (int x = from.x; x <= to.x && fits; ++x)
                        fits = take(glm::ivec3(x, y, z), from);
            if (fits || reach == 0)
                return;
        }
    }
    TriangleSpan span() const {
        return {mesh_->mesh->positions, mesh_->mesh->normals, {triangles_.data(), count_}};
    }
    dvec3 low_mm() const { return low_; }
    dvec3 high_mm() const { return high_; }
    bool lacks_data() const { return false; }
    double grain_mm() const { return mesh_->cell_mm; }

 private:
    bool take(glm::ivec3 cell, glm::ivec3 from) {
        const Mesh& mesh = *mesh_->mesh;
        const size_t at =
            size_t(cell.x) +
            size_t(mesh_->cells.x) * (size_t(cell.y) + size_t(mesh_->cells.y) * size_t(cell.z));
        for (uint32_t i = mesh_->first[at]; i < mesh_->first[at + 1]; ++i) {
            const glm::uvec3 t = mesh.triangles[mesh_->which[i]];
            const glm::vec3 least =
                glm::min(glm::min(mesh.positions[t.x], mesh.positions[t.y]), mesh.positions[t.z]);
            const glm::ivec3 own = glm::clamp(glm::ivec3((least - mesh_->low_mm) / mesh_->cell_mm),
                                              glm::ivec3(0), mesh_->cells - 1);
            if (glm::max(own, from) != cell)
                continue;
            if (count_ == triangles_.size())
                return false;
            triangles_[count_++] = t;
        }
        return true;
    }

    const TouchMesh* mesh_ = nullptr;
    uint64_t version_ = 0;
    bool is_new_ = false;
    dvec3 low_{0.0}, high_{0.0};
    size_t count_ = 0;
    std::array<glm::uvec3, 2048> triangles_;
};

// The marching-cubes surface about a place, made when it is asked for.
class LocalWindow {
 public:
    LocalWindow() : patch_(Patch::kMostSide) {}
    bool follow(const TickInput& input) {
        const TouchParameters& q = *input.parameters;
        const std::optional<Volume>& volume =
            q.source == TouchSource::labels ? input.scene->labels : input.scene->grey;
        if (!volume)
            return false;
        is_new_ = volume->version() != version_ || q.iso != iso_ || q.source != source_ ||
                  !(q.opacity == opacity_);
        version_ = volume->version();
        iso_ = q.iso;
        source_ = q.source;
        opacity_ = q.opacity;
        volume_ = &*volume;
        parameters_ = &q;
        to_mesh_ = Patch::mesh_from_world(*volume);
        to_world_ = world_from_mesh(volume->grid());
        lacks_data_ = false;
        return true;
    }
    bool is_new() const { return is_new_; }
    dvec3 from_world(dvec3 p) const { return moved(to_mesh_, p); }
    dvec3 to_world(dvec3 p) const { return moved(to_world_, p); }
    dvec3 turn_to_world(dvec3 v) const { return unit_or_zero(turned(to_world_, v)); }
    void gather(dvec3 at) {
        patch_.extract(*volume_, to_world(at), *parameters_);
        lacks_data_ |= patch_.lacked_brick();
    }
    const TriangleSpan& span() const { return patch_.span(); }
    dvec3 low_mm() const { return patch_.low_mm(); }
    dvec3 high_mm() const { return patch_.high_mm(); }
    bool lacks_data() const { return lacks_data_; }
    double grain_mm() const { return (high_mm().x - low_mm().x) / (Patch::kMostSide - 1.0); }

 private:
    Patch patch_;
    const Volume* volume_ = nullptr;
    const TouchParameters* parameters_ = nullptr;
    uint64_t version_ = 0;
    double iso_ = 0.0;
    TouchSource source_ = TouchSource::grey;
    HapticTransfer opacity_;
    bool is_new_ = false, lacks_data_ = false;
    glm::dmat4 to_mesh_{1.0}, to_world_{1.0};
};

} // namespace

std::unique_ptr<Algorithm> make_swept_mesh() {
    return std::make_unique<SweptTriangles<MeshSurface>>();
}
std::unique_ptr<Algorithm> make_swept_local() {
    return std::make_unique<SweptTriangles<LocalWindow>>();
}

} // namespace palpate::haptics
