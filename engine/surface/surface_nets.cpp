#include "engine/surface/surface_nets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_map>

#include "engine/base/assert.h"
#include "engine/surface/net_layers.h"

namespace palpate {

namespace {

constexpr double kLambda = 0.5, kMu = -0.53;
constexpr double kStrong = 0.6; // (1 - 0.6 k)^5 (1 + 3 k) has no slope at k = 0
constexpr int kStrongSteps = kStepsOfRound - 1;
constexpr double kApart = 0.25; // of the way to a corner of the cell, or of a face

template <class Real>
using Vec = glm::vec<3, Real>;

// Offsets of vertices from the centres of their cells, in samples.
template <class Real>
std::vector<Vec<Real>> first_offsets(const Net& net) {
    std::vector<Vec<Real>> offsets(net.vertices.size(), Vec<Real>(0));
    for (const NetApart& apart : net.apart) {
        Vec<Real> sum(0);
        for (unsigned edges = apart.edges; edges != 0; edges &= edges - 1) {
            const CellEdge edge = cell_edge(std::countr_zero(edges));
            Vec<Real> middle(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2 & 1);
            middle[edge.axis] = Real(0.5);
            sum += middle - Real(0.5);
        }
        offsets[apart.vertex] = Real(kApart) * sum / Real(std::popcount(unsigned{apart.edges}));
    }
    return offsets;
}

// For each vertex those it moves towards: along lines where it lies on one.
struct Adjacency {
    std::vector<uint32_t> first, to;

    explicit Adjacency(const Net& net) : first(net.vertices.size() + 1, 0) {
        std::vector<bool> on_line(net.vertices.size(), false);
        for (const NetLink& link : net.links)
            if (link.is_line)
                on_line[link.a] = on_line[link.b] = true;
        const auto counts = [&](const NetLink& link, uint32_t v) {
            return link.is_line || !on_line[v];
        };
        for (const NetLink& link : net.links) {
            first[link.a + size_t{1}] += counts(link, link.a);
            first[link.b + size_t{1}] += counts(link, link.b);
        }
        for (size_t v = 1; v < first.size(); ++v)
            first[v] += first[v - 1];
        to.resize(first.back());
        std::vector<uint32_t> next(first.begin(), first.end() - 1);
        for (const NetLink& link : net.links) {
            if (counts(link, link.a))
                to[next[link.a]++] = link.b;
            if (counts(link, link.b))
                to[next[link.b]++] = link.a;
        }
    }
};

// The place of a part in a larger volume, and the vertices that are not known there.
struct PartPlace {
    glm::ivec3 first{0};
    const NetMoved* moved = nullptr; // all: none is known

    // Cells of the part: those that moved, and so many more on each side.
    NetCells moved_cells(int grown) const {
        if (!moved)
            return {glm::ivec3(0), glm::ivec3(65535)};
        return {moved->first - first - grown, moved->last - first + grown};
    }
};

// Shares of the way to the mean of a vertex's neighbours, one for each step.
std::vector<double> shares_of(const SurfaceNetsOptions& options) {
    std::vector<double> shares;
    for (uint32_t pass = 0; pass < options.passes; ++pass)
        shares.insert(shares.end(), {kLambda, kMu});
    for (uint32_t round = 0; round < options.rounds; ++round) {
        shares.insert(shares.end(), kStrongSteps, kStrong);
        shares.push_back(-kStrongSteps * kStrong);
    }
    return shares;
}

// Step n of all moves vertices as far about those that are wanted as the steps after it reach.
template <class Real>
void smooth(const Net& net, glm::uvec3 size, const PartPlace& place,
            const SurfaceNetsOptions& options, const std::vector<double>& shares,
            std::vector<Vec<Real>>& offsets) {
    const auto all_steps = static_cast<int>(shares.size());
    const NetCells first_moved = place.moved_cells(all_steps - 1);
    std::vector<uint32_t> near;
    for (uint32_t v = 0; v < net.vertices.size(); ++v)
        if (first_moved.holds(glm::ivec3(net.vertices[v].cell)))
            near.push_back(v);
    const Adjacency adjacency(net);
    const auto bound = static_cast<Real>(options.bound);
    std::vector<Vec<Real>> next(offsets);
    int steps = 0; // that have been made
    const auto step = [&](Real share) {
        ++steps;
        const NetCells moved = place.moved_cells(all_steps - steps);
        tbb::parallel_for(size_t{0}, near.size(), [&](size_t at) {
            const uint32_t v = near[at];
            const uint32_t begin = adjacency.first[v], end = adjacency.first[v + size_t{1}];
            const NetVertex here = net.vertices[v];
            if (!moved.holds(glm::ivec3(here.cell))) {
                next[v] = offsets[v];
                return;
            }
            Vec<Real> sum(0);
            for (uint32_t i = begin; i < end; ++i) {
                const uint32_t n = adjacency.to[i];
                // Neighbouring cells are one sample apart: differences of small whole numbers.
                sum += offsets[n] +
                       Vec<Real>(glm::ivec3(net.vertices[n].cell) - glm::ivec3(here.cell));
            }
            next[v] = offsets[v];
            if (begin == end)
                return;
            next[v] += share * (sum / Real(end - begin) - offsets[v]);
            for (int axis = 0; axis < 3; ++axis)
                next[v][axis] = here.cell[axis] == 0 || here.cell[axis] == size[axis]
                                    ? Real(0)
                                    : std::clamp(next[v][axis], -bound, bound);
        });
        std::swap(offsets, next);
    };
    for (size_t n = 0; n < shares.size() && !options.stop.stop_requested(); ++n)
        step(Real(shares[n]));
}

// The net's vertices in millimetres and the triangles of its walls.
template <class Real>
struct Surface {
    std::vector<Vec<Real>> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<uint16_t> labels, outer_labels;
    std::vector<glm::ivec3> owners; // cells of the triangles' walls, where asked for
    std::vector<glm::ivec3> cells;  // of vertices, where asked for
};

// Cuts walls that have a split face on one of their sides: there the side has a vertex of its own,
// an eighth of a sample nearer the corner that is cut off, and the wall is a fan about its middle.
template <class Real>
class SplitWalls {
 public:
    SplitWalls(Surface<Real>& surface, Vec<Real> spacing) : surface_(surface), spacing_(spacing) {}

    // Adds the corners of the wall's rim, those between them included.
    size_t rim(const NetWall& wall, const NetSplit& split, std::array<uint32_t, 8>& corners) {
        size_t count = 0;
        for (size_t side = 0; side < 4; ++side) {
            const uint32_t a = wall.corners[side], b = wall.corners[(side + 1) % 4];
            corners[count++] = a;
            if (split.corner[side] >= 0)
                corners[count++] = between(a, b, split, side);
        }
        return count;
    }
    uint32_t middle(const NetWall& wall) {
        Vec<Real> sum(0);
        for (const uint32_t v : wall.corners)
            sum += surface_.positions[v];
        surface_.positions.push_back(Real(0.25) * sum);
        return static_cast<uint32_t>(surface_.positions.size() - 1);
    }

 private:
    uint32_t between(uint32_t a, uint32_t b, const NetSplit& split, size_t side) {
        const auto [at, is_new] =
            made_.try_emplace(split.face[side] * 8 + static_cast<uint64_t>(split.corner[side]),
                              static_cast<uint32_t>(surface_.positions.size()));
        if (is_new) {
            const int axis = split.axis[side], corner = split.corner[side];
            Vec<Real> towards(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
            towards[axis] = 0;
            surface_.positions.push_back(Real(0.5) *
                                             (surface_.positions[a] + surface_.positions[b]) +
                                         Real(0.5 * kApart) * towards * spacing_);
        }
        return at->second;
    }

    Surface<Real>& surface_;
    Vec<Real> spacing_;
    std::unordered_map<uint64_t, uint32_t> made_;
};

template <class Real>
Surface<Real> make_surface(const Volume& labels, const SurfaceNetsOptions& options,
                           const PartPlace& place = {}, bool with_cells = false) {
    const glm::ivec3 first = place.first;
    PALPATE_ASSERT(options.bound >= 0.0 && options.bound < 0.5);
    Surface<Real> surface;
    const std::vector<double> shares = shares_of(options);
    const NetCells linked = shares.empty() ? NetCells{glm::ivec3(0), glm::ivec3(-1)}
                                           : place.moved_cells(static_cast<int>(shares.size()));
    const Net net = make_net(labels, linked, options.stop);
    if (options.stop.stop_requested())
        return surface;
    std::vector<Vec<Real>> offsets = first_offsets<Real>(net);
    if (!shares.empty())
        smooth(net, labels.size(), place, options, shares, offsets);
    const Vec<Real> spacing(spacing_mm(labels.grid()));
    surface.positions.resize(offsets.size());
    const NetCells moved = place.moved_cells(0);
    if (with_cells)
        surface.cells.resize(offsets.size());
    tbb::parallel_for(size_t{0}, offsets.size(), [&](size_t v) {
        const glm::ivec3 cell(net.vertices[v].cell);
        if (with_cells)
            surface.cells[v] = first + cell;
        if (moved.holds(cell)) {
            surface.positions[v] = (Vec<Real>(first + cell) - Real(0.5) + offsets[v]) * spacing;
            return;
        }
        uint32_t n = 0; // of the cell's vertices, which follow each other
        while (n < v && glm::ivec3(net.vertices[v - n - 1].cell) == cell)
            ++n;
        surface.positions[v] = Vec<Real>(place.moved->known(first + cell, n));
    });
    const size_t walls = net.walls.size();
    surface.triangles.resize(2 * walls);
    surface.labels.resize(2 * walls);
    surface.outer_labels.resize(2 * walls);
    const auto owner = [&](const NetWall& wall) { // the third corner is in the cell itself
        return first + glm::ivec3(net.vertices[wall.corners[2]].cell);
    };
    const auto put = [&](size_t n, const NetWall& wall, glm::uvec3 triangle) {
        surface.triangles[n] = triangle;
        surface.labels[n] = wall.label;
        surface.outer_labels[n] = wall.outer;
    };
    tbb::parallel_for(size_t{0}, walls, [&](size_t w) {
        const NetWall& wall = net.walls[w];
        const auto& c = wall.corners;
        const auto square = [&](uint32_t a, uint32_t b) {
            const Vec<Real> d = surface.positions[a] - surface.positions[b];
            return glm::dot(d, d);
        };
        const bool across = square(c[0], c[2]) <= square(c[1], c[3]); // the shorter diagonal
        put(2 * w, wall, {c[0], c[1], across ? c[2] : c[3]});
        put(2 * w + 1, wall, {across ? c[0] : c[1], c[2], c[3]});
    });
    for (size_t w = 0; with_cells && w < walls; ++w)
        surface.owners.resize(2 * w + 2, owner(net.walls[w]));
    // The few with split faces: their first two triangles are made anew, the others follow at the
    // end.
    SplitWalls<Real> split_walls(surface, spacing);
    for (const NetSplit& split : net.splits) {
        const NetWall& wall = net.walls[split.wall];
        std::array<uint32_t, 8> rim;
        const size_t count = split_walls.rim(wall, split, rim);
        const uint32_t middle = split_walls.middle(wall);
        for (size_t i = 0; i < count; ++i) {
            const glm::uvec3 triangle(middle, rim[i], rim[(i + 1) % count]);
            if (i < 2) {
                put(2 * size_t{split.wall} + i, wall, triangle);
                continue;
            }
            surface.triangles.push_back(triangle);
            surface.labels.push_back(wall.label);
            surface.outer_labels.push_back(wall.outer);
        }
        if (with_cells)
            surface.owners.resize(surface.triangles.size(), owner(wall));
    }
    return surface;
}

// The volume that each label encloses; a unit cube of the positions has `scale` cubic millimetres.
template <class Real>
std::vector<LabelVolume> volumes_of(const Surface<Real>& surface, double scale) {
    std::vector<double> sums(65536, 0.0);
    std::vector<bool> is_there(65536, false);
    for (size_t n = 0; n < surface.triangles.size(); ++n) {
        const glm::uvec3 t = surface.triangles[n];
        const glm::dvec3 a(surface.positions[t.x]), b(surface.positions[t.y]);
        const double volume = glm::dot(a, glm::cross(b, glm::dvec3(surface.positions[t.z]))) / 6.0;
        sums[surface.labels[n]] += volume;
        is_there[surface.labels[n]] = true;
        if (!surface.outer_labels.empty()) {
            sums[surface.outer_labels[n]] -= volume;
            is_there[surface.outer_labels[n]] = true;
        }
    }
    std::vector<LabelVolume> volumes;
    for (size_t label = 1; label < sums.size(); ++label)
        if (is_there[label])
            volumes.push_back({static_cast<uint16_t>(label), scale * sums[label]});
    return volumes;
}

double volume_scale(const glm::dmat4& world_from) {
    return std::abs(glm::determinant(glm::dmat3(world_from)));
}

} // namespace

Mesh surface_nets(const Volume& labels, const SurfaceNetsOptions& options) {
    Surface<float> surface = make_surface<float>(labels, options);
    return {.positions = std::move(surface.positions),
            .triangles = std::move(surface.triangles),
            .labels = std::move(surface.labels),
            .outer_labels = std::move(surface.outer_labels),
            .world_from_mesh = world_from_mesh(labels.grid())};
}

NetPart surface_nets_part(const Volume& part, glm::ivec3 first, const NetMoved& moved,
                          const SurfaceNetsOptions& options) {
    Surface<float> surface = make_surface<float>(part, options, {first, &moved}, true);
    return {{.positions = std::move(surface.positions),
             .triangles = std::move(surface.triangles),
             .labels = std::move(surface.labels),
             .outer_labels = std::move(surface.outer_labels),
             .world_from_mesh = world_from_mesh(part.grid())},
            std::move(surface.owners),
            std::move(surface.cells)};
}

std::vector<LabelVolume> surface_nets_volumes_fp64(const Volume& labels,
                                                   const SurfaceNetsOptions& options) {
    return volumes_of(make_surface<double>(labels, options),
                      volume_scale(world_from_mesh(labels.grid())));
}

} // namespace palpate
