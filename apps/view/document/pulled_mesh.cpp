#include "apps/view/document/pulled_mesh.h"

#include <array>
#include <limits>

namespace palpate::view {

namespace {

// World positions of a triangle of a mesh.
std::array<glm::dvec3, 3> corners(const Mesh& mesh, glm::uvec3 triangle) {
    std::array<glm::dvec3, 3> at;
    for (int i = 0; i < 3; ++i)
        at[static_cast<size_t>(i)] =
            glm::dvec3(mesh.world_from_mesh * glm::dvec4(mesh.positions[triangle[i]], 1.0));
    return at;
}

} // namespace

PulledMesh::PulledMesh(SimplexMesh mesh, uint16_t label) : mesh_(std::move(mesh)), label_(label) {
    mesh_.before = mesh_.positions; // at rest
    show();
}

void PulledMesh::show() {
    surface_ = std::make_shared<const Mesh>(triangles_of(mesh_));
}

// By Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection" (1997).
std::optional<glm::dvec3> PulledMesh::met(const Ray& ray) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const glm::uvec3 triangle : surface_->triangles) {
        const auto [a, b, c] = corners(*surface_, triangle);
        const glm::dvec3 ab = b - a, ac = c - a, across = glm::cross(ray.direction, ac);
        const double volume = glm::dot(ab, across);
        if (volume == 0.0)
            continue;
        const glm::dvec3 from = ray.origin_mm - a, other = glm::cross(from, ab);
        const double u = glm::dot(from, across) / volume;
        const double v = glm::dot(ray.direction, other) / volume;
        const double t = glm::dot(ac, other) / volume;
        if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < nearest)
            nearest = t;
    }
    if (nearest == std::numeric_limits<double>::infinity())
        return std::nullopt;
    return ray.origin_mm + nearest * ray.direction;
}

glm::dvec3 PulledMesh::middle_of(uint32_t face) const {
    glm::dvec3 sum(0.0);
    for (uint32_t i = mesh_.face_first[face]; i < mesh_.face_first[face + 1]; ++i)
        sum += mesh_.positions[mesh_.face_vertices[i]];
    return sum / double(mesh_.face_first[face + 1] - mesh_.face_first[face]);
}

uint32_t PulledMesh::nearest_face(glm::dvec3 point_mm) const {
    uint32_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (uint32_t face = 0; face < mesh_.faces(); ++face)
        if (const double away = glm::distance(middle_of(face), point_mm); away < least) {
            least = away;
            nearest = face;
        }
    return nearest;
}

std::optional<glm::dvec3> PulledMesh::near(glm::dvec3 point_mm, double within_mm) const {
    const glm::dvec3 middle = middle_of(nearest_face(point_mm));
    return glm::distance(middle, point_mm) <= within_mm ? std::optional(middle) : std::nullopt;
}

std::vector<std::pair<glm::dvec3, glm::dvec3>> PulledMesh::cut(glm::dvec3 point_mm,
                                                               glm::dvec3 normal) const {
    std::vector<std::pair<glm::dvec3, glm::dvec3>> pieces;
    for (const glm::uvec3 triangle : surface_->triangles) {
        const auto at = corners(*surface_, triangle);
        std::vector<glm::dvec3> ends;
        for (size_t i = 0; i < 3; ++i) {
            const glm::dvec3 &a = at[i], &b = at[(i + 1) % 3];
            const double from = glm::dot(a - point_mm, normal), to = glm::dot(b - point_mm, normal);
            if ((from < 0.0) != (to < 0.0)) // a corner on the plane is above it
                ends.push_back(a + from / (from - to) * (b - a));
        }
        if (ends.size() == 2)
            pieces.emplace_back(ends[0], ends[1]);
    }
    return pieces;
}

void PulledMesh::hold(glm::dvec3 point_mm, uint32_t reach) {
    const uint32_t face = nearest_face(point_mm);
    held_ = {.patch = {patch_of_faces(mesh_, face, reach), glm::dvec3(0.0)},
             .face = face,
             .beside_mm = point_mm - middle_of(face),
             .positions = mesh_.positions,
             .stays = std::vector<bool>(mesh_.positions.size(), true)};
    for (const uint32_t bent : patch_of_faces(mesh_, face, 3 * reach + 4))
        for (uint32_t i = mesh_.face_first[bent]; i < mesh_.face_first[bent + 1]; ++i)
            held_->stays[mesh_.face_vertices[i]] = false;
}

void PulledMesh::pull(glm::dvec3 goal_mm) {
    if (!held_)
        return;
    // Nothing draws the mesh back but its own force, which makes it smooth round the patch; what is
    // farther away stays.
    constexpr SimplexOptions kOptions{.damping = 0.7, .rigidity = 4};
    constexpr double kShare = 0.3;  // of the way, in a step
    constexpr double kThere = 0.02; // of the mean distance to the neighbours
    const double edge_mm =
        glm::distance(mesh_.positions[mesh_.face_vertices[mesh_.face_first[held_->face]]],
                      mesh_.positions[mesh_.face_vertices[mesh_.face_first[held_->face] + 1]]);
    for (int step = 0; step < kMostSteps; ++step) {
        const glm::dvec3 way = goal_mm - (middle_of(held_->face) + held_->beside_mm);
        if (glm::length(way) <= kThere * edge_mm)
            break;
        held_->patch.by_mm = kShare * way;
        simplex_step(mesh_, {}, std::span(&held_->patch, 1), kOptions);
        for (size_t v = 0; v < held_->stays.size(); ++v)
            if (held_->stays[v])
                mesh_.positions[v] = mesh_.before[v] = held_->positions[v];
    }
    show();
}

void PulledMesh::let_go(bool keep) {
    if (!held_)
        return;
    if (!keep)
        mesh_.positions = held_->positions;
    is_pulled_ |= mesh_.positions != held_->positions;
    mesh_.before = mesh_.positions; // at rest
    held_.reset();
    show();
}

} // namespace palpate::view
