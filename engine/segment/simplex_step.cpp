#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "engine/base/clones.h"
#include "engine/segment/simplex_geometry.h"
#include "engine/segment/simplex_mesh.h"

namespace palpate {

namespace {

constexpr size_t kLanes = 64;   // vertices that are worked on at once
constexpr size_t kGrain = 1024; // a multiple of it, for a thread

// One number of each of some vertices.
using Lanes = std::array<float, kLanes>;

struct Around {
    Lanes edge, middle_x, middle_y, middle_z, normal_x, normal_y, normal_z, radius, off, flat,
        curvature; // curvature in 1/mm, other lengths in edges
};
using Offsets = std::array<Lanes, 9>; // of three neighbours from the vertex, mm

PALPATE_CLONES void look_around(const Offsets& in, Around& out) {
    for (size_t i = 0; i < kLanes; ++i) {
        const SimplexPlaces<float> at =
            simplex_places(in[0][i], in[1][i], in[2][i], in[3][i], in[4][i], in[5][i], in[6][i],
                           in[7][i], in[8][i]);
        out.edge[i] = at.edge;
        out.middle_x[i] = at.middle_x, out.middle_y[i] = at.middle_y, out.middle_z[i] = at.middle_z;
        out.normal_x[i] = at.normal_x, out.normal_y[i] = at.normal_y, out.normal_z[i] = at.normal_z;
        out.radius[i] = at.radius, out.off[i] = at.off, out.flat[i] = at.flat;
        out.curvature[i] = simplex_curvature(at.height, at.radius, at.aside, at.flat) / at.edge;
    }
}

// The internal force in mm, x, y and z apart.
PALPATE_CLONES void pull_inside(const Around& at, const Lanes& curvature, Lanes& x, Lanes& y,
                                Lanes& z) {
    for (size_t i = 0; i < kLanes; ++i) {
        const float aimed = simplex_height(at.radius[i], at.off[i], curvature[i] * at.edge[i]);
        const float height = at.flat[i] > 0.0f ? 0.0f : aimed;
        x[i] = at.edge[i] * (at.middle_x[i] + height * at.normal_x[i]);
        y[i] = at.edge[i] * (at.middle_y[i] + height * at.normal_y[i]);
        z[i] = at.edge[i] * (at.middle_z[i] + height * at.normal_z[i]);
    }
}

glm::dvec3 cut(glm::dvec3 v, double most) {
    const double length = glm::length(v);
    return length > most ? v * (most / length) : v;
}

template <class Work>
void for_each_range(size_t count, size_t grain, const Work& work) {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, (count + grain - 1) / grain, 1),
                      [&](const tbb::blocked_range<size_t>& range) {
                          for (size_t n = range.begin(); n < range.end(); ++n)
                              work(n * grain, std::min(n * grain + grain, count));
                      });
}

Around around(const SimplexMesh& mesh, size_t begin, size_t end) {
    Offsets offsets;
    for (size_t i = 0; i < kLanes; ++i) {
        const size_t vertex = std::min(begin + i, end - 1);
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 by =
                mesh.positions[mesh.neighbours[vertex][k]] - mesh.positions[vertex];
            for (int axis = 0; axis < 3; ++axis)
                offsets[size_t(3 * k + axis)][i] = float(by[axis]);
        }
    }
    Around out;
    look_around(offsets, out);
    return out;
}

std::vector<glm::dvec3> pulled_by_hand(const SimplexMesh& mesh,
                                       std::span<const SimplexPull> pulls) {
    std::vector<glm::dvec3> pulled(pulls.empty() ? 0 : mesh.positions.size(), glm::dvec3(0.0));
    for (const SimplexPull& pull : pulls) {
        std::set<uint32_t> vertices;
        for (const uint32_t f : pull.faces)
            vertices.insert(mesh.face_vertices.begin() + mesh.face_first[f],
                            mesh.face_vertices.begin() + mesh.face_first[f + 1]);
        for (const uint32_t v : vertices)
            pulled[v] += pull.by_mm;
    }
    return pulled;
}

} // namespace

double simplex_step(SimplexMesh& mesh, const SimplexForce& force,
                    std::span<const SimplexPull> pulls, const SimplexOptions& options) {
    const size_t count = mesh.positions.size();
    std::vector<Around> blocks((count + kLanes - 1) / kLanes);
    std::vector<float> curvature(count), evened(count);
    for_each_range(count, kGrain, [&](size_t begin, size_t end) {
        for (size_t at = begin; at < end; at += kLanes) {
            const size_t last = std::min(at + kLanes, end);
            Around& block = blocks[at / kLanes];
            block = around(mesh, at, last);
            std::copy_n(block.curvature.begin(), last - at, curvature.begin() + ptrdiff_t(at));
        }
    });
    for (uint32_t pass = 0; pass < options.rigidity; ++pass) {
        for_each_range(count, 4 * kGrain, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                const glm::uvec3 n = mesh.neighbours[i];
                evened[i] =
                    0.25f * (curvature[i] + curvature[n.x] + curvature[n.y] + curvature[n.z]);
            }
        });
        curvature.swap(evened);
    }
    const std::vector<glm::dvec3> pulled = pulled_by_hand(mesh, pulls);
    std::vector<glm::dvec3> moved(count);
    std::vector<double> largest((count + kGrain - 1) / kGrain, 0.0);
    for_each_range(count, kGrain, [&](size_t begin, size_t end) {
        for (size_t at = begin; at < end; at += kLanes) {
            const size_t lanes = std::min(at + kLanes, end) - at;
            const Around& block = blocks[at / kLanes];
            Lanes aimed{}, x, y, z;
            std::copy_n(curvature.begin() + ptrdiff_t(at), lanes, aimed.begin());
            pull_inside(block, aimed, x, y, z);
            std::array<SimplexPlace, kLanes> places;
            std::array<glm::dvec3, kLanes> drawn;
            for (size_t i = 0; i < lanes; ++i)
                places[i] = {mesh.positions[at + i],
                             block.flat[i] > 0.0f
                                 ? glm::dvec3(0.0)
                                 : glm::dvec3(glm::vec3(block.normal_x[i], block.normal_y[i],
                                                        block.normal_z[i]))};
            if (force)
                force(std::span(places.data(), lanes), std::span(drawn.data(), lanes));
            for (size_t i = 0; i < lanes; ++i) {
                const glm::dvec3 p = mesh.positions[at + i];
                const double most = options.largest_step * double{block.edge[i]};
                glm::dvec3 sum = options.internal * glm::dvec3(glm::vec3(x[i], y[i], z[i]));
                if (force && !(block.flat[i] > 0.0f))
                    sum += options.external * cut(drawn[i], most);
                if (!pulled.empty())
                    sum += pulled[at + i];
                const glm::dvec3 velocity = (1.0 - options.damping) * (p - mesh.before[at + i]);
                const glm::dvec3 by = cut(velocity + sum / options.mass, most);
                moved[at + i] = p + by;
                largest[begin / kGrain] = std::max(largest[begin / kGrain], glm::length(by));
            }
        }
    });
    mesh.before.swap(mesh.positions);
    mesh.positions.swap(moved);
    return largest.empty() ? 0.0 : *std::max_element(largest.begin(), largest.end());
}

} // namespace palpate
