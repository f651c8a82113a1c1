#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "engine/surface/cell_tables.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/trilinear_cell.h"

// Marching cubes as one would write it first: every cell, every edge, maps, doubles. It shares the
// tables with the engine and nothing else, and sorts its vertices and triangles into the order that
// marching_cubes() promises.
namespace palpate::testing {

struct NaiveMesh {
    std::vector<glm::dvec3> positions; // mm
    std::vector<glm::dvec3> normals;   // by gradient; (0, 0, 0) within cells
    std::vector<double> slopes;        // the gradient's length: value units per mm
    std::vector<glm::uvec3> triangles;
};

class Naive {
 public:
    Naive(const Volume& volume, float iso, const SurfaceOptions& options)
        : volume_(volume),
          iso_(iso),
          options_(options),
          size_(volume.size()),
          spacing_(spacing_mm(volume.grid())) {}

    NaiveMesh extract() {
        const int lead = options_.closed_at_border ? 1 : 0;
        for (int z = -lead; z < size_.z + lead - 1; ++z)
            for (int y = -lead; y < size_.y + lead - 1; ++y)
                for (int x = -lead; x < size_.x + lead - 1; ++x)
                    add_cell({x, y, z});
        NaiveMesh mesh;
        std::map<Key, uint32_t> number;
        for (const auto& [key, vertex] : vertices_) { // in order of their keys
            number[key] = static_cast<uint32_t>(mesh.positions.size());
            mesh.positions.push_back(vertex.position);
            mesh.normals.push_back(vertex.normal);
            mesh.slopes.push_back(vertex.slope);
        }
        for (const auto& [key, corners] : triangles_)
            mesh.triangles.push_back(
                {number.at(corners[0]), number.at(corners[1]), number.at(corners[2])});
        return mesh;
    }

 private:
    // Brick, block, kind (edge, inner), sample, axis or running number: z before y before x.
    using Key = std::tuple<int, int, int, int, int, int, int, int, int, int, int>;
    struct Vertex {
        glm::dvec3 position, normal;
        double slope;
    };

    static int floor_divided(int a, int b) {
        return static_cast<int>(std::floor(static_cast<double>(a) / b));
    }
    static Key key(glm::ivec3 s, int kind, int last) {
        const auto brick = [](int i) { return floor_divided(i, 32); };
        const auto block = [](int i) { return floor_divided(i, 8); };
        return {brick(s.z), brick(s.y), brick(s.x), block(s.z), block(s.y), block(s.x),
                kind,       s.z,        s.y,        s.x,        last};
    }

    // NaN where there is no data.
    double value(glm::ivec3 s) const {
        if (glm::any(glm::lessThan(s, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(s, size_)))
            return NAN;
        return volume_.value(glm::uvec3(s));
    }
    bool is_inside(glm::ivec3 s) const { return value(s) >= double{iso_}; }

    // Central differences; beyond the border and at gaps, the sample itself counts again.
    glm::dvec3 gradient(glm::ivec3 s) const {
        glm::dvec3 g;
        for (int a = 0; a < 3; ++a) {
            glm::ivec3 step(0);
            step[a] = 1;
            const double low = value(s - step), high = value(s + step);
            g[a] = ((std::isnan(high) ? value(s) : high) - (std::isnan(low) ? value(s) : low)) /
                   (2.0 * spacing_[a]);
        }
        return g;
    }

    Vertex on_edge(glm::ivec3 s, int axis) const {
        glm::ivec3 step(0);
        step[axis] = 1;
        const double a = value(s), b = value(s + step);
        glm::dvec3 outward(0.0);
        outward[axis] = is_inside(s) ? 1.0 : -1.0;
        double t = std::clamp((iso_ - a) / (b - a), 0x1p-12, 1.0 - 0x1p-12);
        glm::dvec3 normal = outward;
        double slope = 1.0; // a wall's normal is exact
        if (std::isnan(b)) {
            t = 0x1p-12;
        } else if (std::isnan(a)) {
            t = 1.0 - 0x1p-12;
        } else {
            const glm::dvec3 g = glm::mix(gradient(s), gradient(s + step), t);
            slope = glm::length(g);
            if (slope > 0.0)
                normal = -g / slope;
        }
        glm::dvec3 p(s);
        p[axis] += t;
        return {p * spacing_, normal, slope};
    }

    void add_cell(glm::ivec3 cell) {
        std::array<float, 8> values;
        uint8_t inside = 0;
        for (int c = 0; c < 8; ++c) {
            const glm::ivec3 s = cell + glm::ivec3(c & 1, c >> 1 & 1, c >> 2);
            values[c] = static_cast<float>(value(s));
            inside |= static_cast<uint8_t>(is_inside(s) << c);
        }
        CellSurface surface;
        if (options_.topology == SurfaceTopology::correct && correct_table().needs_values(inside))
            surface = correct_table().surface(inside, corner_values(values, iso_));
        else
            surface = fill_with_discs(cell_loops(inside, 0));
        const auto edge_key = [&](int e) {
            const CellEdge edge = cell_edge(e);
            return key(cell + glm::ivec3(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2),
                       0, edge.axis);
        };
        std::vector<Key> inner_keys;
        for (size_t i = 0; i < surface.inner.size(); ++i) {
            const Key k = key(cell, 1, static_cast<int>(i));
            Vertex v{glm::dvec3(0.0), glm::dvec3(0.0), 0.0};
            for (int e = 0; e < 12; ++e)
                if (surface.inner[i].weight[e] > 0.0f) {
                    const CellEdge edge = cell_edge(e);
                    v.position += double{surface.inner[i].weight[e]} *
                                  on_edge(cell + glm::ivec3(edge.corner & 1, edge.corner >> 1 & 1,
                                                            edge.corner >> 2),
                                          edge.axis)
                                      .position;
                }
            vertices_[k] = v;
            inner_keys.push_back(k);
        }
        int number = 0;
        for (const auto& t : surface.triangles) {
            std::array<Key, 3> corners;
            for (int k = 0; k < 3; ++k) {
                if (t[k] >= 12) {
                    corners[k] = inner_keys[t[k] - 12];
                    continue;
                }
                corners[k] = edge_key(t[k]);
                if (!vertices_.count(corners[k])) {
                    const CellEdge edge = cell_edge(t[k]);
                    vertices_[corners[k]] = on_edge(
                        cell + glm::ivec3(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2),
                        edge.axis);
                }
            }
            triangles_[key(cell, 0, number++)] = corners;
        }
    }

    const Volume& volume_;
    float iso_;
    SurfaceOptions options_;
    glm::ivec3 size_;
    glm::dvec3 spacing_;
    std::map<Key, Vertex> vertices_;
    std::map<Key, std::array<Key, 3>> triangles_;
};

} // namespace palpate::testing
