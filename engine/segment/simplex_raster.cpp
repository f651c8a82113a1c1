#include <algorithm>
#include <cmath>

#include "engine/segment/rows.h"
#include "engine/segment/simplex_mesh.h"

namespace palpate {

namespace {

struct Crossing {
    double x;
    int turn; // of the winding number, going up along x
};

// Lines along x through sample centres, in index space, and where triangles cross them.
class Crossings {
 public:
    Crossings(const Mesh& mesh, const Grid& grid)
        : size_(grid.size), rows_(size_t{grid.size.y} * grid.size.z) {
        const glm::dmat4 to_index = index_from_world(grid) * mesh.world_from_mesh;
        for (const glm::vec3 p : mesh.positions)
            points_.emplace_back(to_index * glm::dvec4(glm::dvec3(p), 1.0));
        for (const glm::uvec3 t : mesh.triangles)
            add(t);
        for (std::vector<Crossing>& row : rows_)
            std::sort(row.begin(), row.end(), [](const Crossing& a, const Crossing& b) {
                return a.x != b.x ? a.x < b.x : a.turn < b.turn;
            });
    }
    const std::vector<Crossing>& row(uint32_t y, uint32_t z) const {
        return rows_[y + size_t{size_.y} * z];
    }

 private:
    // Twice the area of a, b and (y, z); both triangles at an edge compute the same number, for b,
    // a with the other sign.
    double side(uint32_t a, uint32_t b, double y, double z) const {
        const double sign = a < b ? 1.0 : -1.0;
        const glm::dvec3 p = points_[std::min(a, b)], q = points_[std::max(a, b)];
        return sign * ((q.y - p.y) * (z - p.z) - (q.z - p.z) * (y - p.y));
    }
    // Owns a line on an edge: it belongs to one of the two triangles there.
    bool owns(uint32_t a, uint32_t b) const {
        const glm::dvec3 along = points_[b] - points_[a];
        return along.y > 0.0 || (along.y == 0.0 && along.z > 0.0);
    }

    void add(glm::uvec3 t) {
        const glm::dvec3 p[] = {points_[t.x], points_[t.y], points_[t.z]};
        const double area =
            (p[1].y - p[0].y) * (p[2].z - p[0].z) - (p[1].z - p[0].z) * (p[2].y - p[0].y);
        if (area == 0.0)
            return; // lines along it do not cross it
        const int turn = area > 0.0 ? 1 : -1;
        const auto range = [](double a, double b, double c, uint32_t size) {
            const double low = std::max(std::ceil(std::min({a, b, c})), 0.0);
            const double high = std::min(std::floor(std::max({a, b, c})), double(size) - 1.0);
            return std::pair(low, high);
        };
        const auto [y0, y1] = range(p[0].y, p[1].y, p[2].y, size_.y);
        const auto [z0, z1] = range(p[0].z, p[1].z, p[2].z, size_.z);
        for (double z = z0; z <= z1; ++z)
            for (double y = y0; y <= y1; ++y) {
                double weight[3];
                bool in = true;
                for (int k = 0; k < 3; ++k) {
                    const uint32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
                    weight[k] = turn * side(a, b, y, z);
                    in = in && (weight[k] > 0.0 ||
                                (weight[k] == 0.0 && (turn > 0 ? owns(a, b) : owns(b, a))));
                }
                const double sum = weight[0] + weight[1] + weight[2];
                if (!in || !(sum > 0.0))
                    continue;
                const double x =
                    (weight[0] * p[0].x + weight[1] * p[1].x + weight[2] * p[2].x) / sum;
                rows_[size_t(y) + size_t{size_.y} * size_t(z)].push_back({x, turn});
            }
    }

    glm::uvec3 size_;
    std::vector<glm::dvec3> points_;
    std::vector<std::vector<Crossing>> rows_;
};

template <class T>
Result<Volume> fill(const Crossings& crossings, const Grid& grid, T label, const Task& task) {
    return make_rows<T>(grid, task, [&](uint32_t y, uint32_t z, std::span<T> row) {
        int winding = 0;
        double from = 0.0;
        for (const Crossing& crossing : crossings.row(y, z)) {
            const double to = std::clamp(std::ceil(crossing.x), 0.0, double(row.size()));
            if (winding != 0)
                std::fill(row.begin() + ptrdiff_t(from), row.begin() + ptrdiff_t(to), label);
            from = to;
            winding += crossing.turn;
        }
    });
}

} // namespace

Result<Volume> rasterised(const SimplexMesh& mesh, const Grid& grid, uint16_t label,
                          const Task& task) {
    const Crossings crossings(triangles_of(mesh), grid);
    if (label > 255)
        return fill<uint16_t>(crossings, grid, label, task);
    return fill<uint8_t>(crossings, grid, uint8_t(label), task);
}

} // namespace palpate
