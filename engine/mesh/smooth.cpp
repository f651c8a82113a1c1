#include "engine/mesh/smooth.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/assert.h"
#include "engine/mesh/topology.h"

namespace palpate {

namespace {

using Points = std::vector<glm::dvec3>;

// The mean of the neighbours less the vertex; 0 where vertices stay.
glm::dvec3 pull(const Neighbors& neighbors, const Points& points, size_t v) {
    const uint32_t begin = neighbors.first[v], end = neighbors.first[v + 1];
    if (begin == end || neighbors.open[v])
        return glm::dvec3(0.0);
    glm::dvec3 sum(0.0);
    for (uint32_t i = begin; i < end; ++i)
        sum += points[neighbors.vertices[i]];
    return sum / double(end - begin) - points[v];
}

Points moved(const Neighbors& neighbors, const Points& points, double share) {
    Points next(points.size());
    tbb::parallel_for(size_t{0}, points.size(),
                      [&](size_t v) { next[v] = points[v] + share * pull(neighbors, points, v); });
    return next;
}

// Runs a filter on the positions, in double, and reports.
template <class Filter>
SmoothReport smooth(Mesh& mesh, const Filter& filter) {
    const MeshTopology before = topology(mesh);
    const std::vector<glm::vec3> old = mesh.positions;
    const Points points = filter(neighbors_of(mesh), Points(old.begin(), old.end()));
    const glm::dmat3 linear(mesh.world_from_mesh);
    SmoothReport report{.volume_before_mm3 = before.volume_mm3, .area_before_mm2 = before.area_mm2};
    for (size_t v = 0; v < old.size(); ++v) {
        mesh.positions[v] = glm::vec3(points[v]);
        report.largest_shift_mm = std::max(report.largest_shift_mm,
                                           glm::length(linear * (points[v] - glm::dvec3(old[v]))));
    }
    if (!mesh.normals.empty())
        mesh.normals = vertex_normals(mesh);
    const MeshTopology after = topology(mesh);
    report.volume_after_mm3 = after.volume_mm3;
    report.area_after_mm2 = after.area_mm2;
    return report;
}

} // namespace

Neighbors neighbors_of(const Mesh& mesh) {
    const TrianglesOfVertex incident = triangles_of_vertices(mesh);
    const size_t count = mesh.positions.size();
    Neighbors neighbors{.first = std::vector<uint32_t>(count + 1, 0),
                        .vertices = {},
                        .open = std::vector<uint8_t>(count, 0)};
    std::vector<uint32_t> ends;
    for (size_t v = 0; v < count; ++v) {
        ends.clear();
        for (uint32_t i = incident.first[v]; i < incident.first[v + 1]; ++i)
            for (int c = 0; c < 3; ++c)
                if (const uint32_t end = mesh.triangles[incident.triangles[i]][c]; end != v)
                    ends.push_back(end);
        std::sort(ends.begin(), ends.end());
        for (size_t i = 0; i < ends.size();) {
            const size_t same =
                static_cast<size_t>(std::upper_bound(ends.begin() + static_cast<std::ptrdiff_t>(i),
                                                     ends.end(), ends[i]) -
                                    ends.begin());
            if (same - i == 1)
                neighbors.open[v] = 1;
            neighbors.vertices.push_back(ends[i]);
            i = same;
        }
        neighbors.first[v + 1] = static_cast<uint32_t>(neighbors.vertices.size());
    }
    return neighbors;
}

SmoothReport mean_filter(Mesh& mesh, uint32_t passes, double share) {
    return smooth(mesh, [&](const Neighbors& neighbors, Points points) {
        for (uint32_t pass = 0; pass < passes; ++pass)
            points = moved(neighbors, points, share);
        return points;
    });
}

SmoothReport taubin_filter(Mesh& mesh, uint32_t passes, double lambda, double mu) {
    PALPATE_ASSERT(lambda > 0.0 && lambda < -mu);
    return smooth(mesh, [&](const Neighbors& neighbors, Points points) {
        for (uint32_t pass = 0; pass < passes; ++pass)
            points = moved(neighbors, moved(neighbors, points, lambda), mu);
        return points;
    });
}

std::vector<double> windowed_sinc_coefficients(uint32_t terms, double pass_band) {
    PALPATE_ASSERT(terms >= 1 && pass_band > 0.0 && pass_band < 2.0);
    const double pi = std::numbers::pi;
    const double band = std::min(pi, std::acos(1.0 - 0.5 * pass_band) + 2.0 * pi / (terms + 1.0));
    std::vector<double> c(terms + 1);
    double sum = 0.0;
    for (uint32_t i = 0; i <= terms; ++i) {
        const double window = 0.54 + 0.46 * std::cos(pi * i / (terms + 1.0));
        c[i] = window * (i == 0 ? band / pi : 2.0 * std::sin(i * band) / (i * pi));
        sum += c[i];
    }
    for (double& value : c)
        value /= sum;
    return c;
}

// Chebyshev's recurrence in X = 1 - k / 2, of which X p = p + pull(p) / 2.
SmoothReport windowed_sinc_filter(Mesh& mesh, uint32_t terms, double pass_band) {
    return smooth(mesh, [&](const Neighbors& neighbors, Points points) {
        const std::vector<double> c = windowed_sinc_coefficients(terms, pass_band);
        Points last = points, now = moved(neighbors, points, 0.5), sum(points.size());
        for (size_t v = 0; v < sum.size(); ++v)
            sum[v] = c[0] * last[v] + c[1] * now[v];
        for (uint32_t i = 2; i <= terms; ++i) {
            tbb::parallel_for(size_t{0}, sum.size(), [&](size_t v) {
                last[v] = 2.0 * now[v] + pull(neighbors, now, v) - last[v];
                sum[v] += c[i] * last[v];
            });
            std::swap(last, now);
        }
        return sum;
    });
}

} // namespace palpate
