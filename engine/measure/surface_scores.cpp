#include "engine/measure/surface_scores.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/segment/label_samples.h"
#include "engine/segment/signed_distance.h"
#include "engine/surface/cell_tables.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

std::array<float, 256> areas_of_cells(glm::dvec3 spacing) {
    std::array<float, 256> areas{};
    for (int code = 0; code < 256; ++code) {
        double sum = 0.0;
        for (const CellLoop& loop : cell_loops(static_cast<uint8_t>(code), 0)) {
            const auto corner = [&](size_t i) {
                const CellEdge edge = cell_edge(loop[i % loop.size()]);
                glm::dvec3 p(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2 & 1);
                p[edge.axis] += 0.5;
                return p * spacing;
            };
            glm::dvec3 twice(0.0);
            for (size_t i = 0; i < loop.size(); ++i)
                twice += glm::cross(corner(i), corner(i + 1));
            sum += 0.5 * glm::length(twice);
        }
        areas[size_t(code)] = static_cast<float>(sum);
    }
    return areas;
}

// The cells of a box with a sample beyond it on every side: which of their corners have the label.
std::vector<uint8_t> cells_of(const Volume& labels, uint16_t label, glm::ivec3 first,
                              glm::ivec3 cells) {
    const glm::ivec3 samples(cells.x + 1, cells.y + 1, 2);
    std::vector<uint16_t> planes(size_t(samples.x) * size_t(samples.y) * 2);
    std::vector<uint8_t> codes(size_t(cells.x) * size_t(cells.y) * size_t(cells.z));
    uint8_t* code = codes.data();
    for (int z = 0; z < cells.z; ++z) {
        read_labels_in_background(labels, first + glm::ivec3(0, 0, z), samples, planes.data());
        for (int y = 0; y < cells.y; ++y)
            for (int x = 0; x < cells.x; ++x, ++code)
                for (int corner = 0; corner < 8; ++corner) {
                    const size_t at = size_t(x + (corner & 1)) +
                                      size_t(samples.x) * (size_t(y + (corner >> 1 & 1)) +
                                                           size_t(samples.y) * size_t(corner >> 2));
                    *code = static_cast<uint8_t>(*code | (planes[at] == label) << corner);
                }
    }
    return codes;
}

bool is_crossed(uint8_t code) {
    return code != 0 && code != 255;
}

struct Sums {
    double area = 0.0, near = 0.0;
    double reached = 0.0, distance = 0.0, squared = 0.0; // of pieces with a distance
    double p95 = 0.0, largest = 0.0;
};

// In the order of distance and area, so that the order of pieces changes no bit.
Sums sums_of(std::vector<SurfacePiece>& pieces, double tolerance_mm) {
    std::sort(pieces.begin(), pieces.end(), [](const SurfacePiece& a, const SurfacePiece& b) {
        return a.distance_mm != b.distance_mm ? a.distance_mm < b.distance_mm
                                              : a.area_mm2 < b.area_mm2;
    });
    Sums out;
    for (const SurfacePiece& piece : pieces) {
        const double d = double{piece.distance_mm}, area = double{piece.area_mm2};
        out.area += area;
        if (std::isinf(d))
            continue;
        out.near += d <= tolerance_mm ? area : 0.0;
        out.reached += area;
        out.distance += area * d;
        out.squared += area * d * d;
        out.largest = d;
    }
    double passed = 0.0;
    for (const SurfacePiece& piece : pieces) {
        if (passed >= 0.95 * out.reached)
            break;
        passed += double{piece.area_mm2};
        out.p95 = double{piece.distance_mm};
    }
    return out;
}

} // namespace

SurfaceScores surface_scores(SurfacePieces pieces, double tolerance_mm) {
    const Sums a = sums_of(pieces.first, tolerance_mm), b = sums_of(pieces.second, tolerance_mm);
    SurfaceScores out{.first_mm2 = a.area, .second_mm2 = b.area};
    const double area = a.area + b.area, reached = a.reached + b.reached;
    if (area > 0.0)
        out.dice = (a.near + b.near) / area;
    if (area > 0.0 && reached == 0.0)
        return out;
    const double whole = reached > 0.0 ? reached : 1.0;
    out.mean_mm = (a.distance + b.distance) / whole;
    out.rms_mm = std::sqrt((a.squared + b.squared) / whole);
    out.p95_mm = std::max(a.p95, b.p95);
    out.largest_mm = std::max(a.largest, b.largest);
    return out;
}

Result<SurfacePieces> surface_pieces(const Volume& first, const Volume& second, uint16_t label,
                                     glm::uvec3 low, glm::uvec3 high, const Task& task) {
    PALPATE_TRY(check_perpendicular(first.grid(), "surface distances"));
    const glm::ivec3 cells = glm::ivec3(high - low) + 2, begin = glm::ivec3(low) - 1;
    const glm::dvec3 spacing = spacing_mm(first.grid());
    const Grid grid = make_grid(glm::uvec3(cells), spacing);
    const std::array<float, 256> areas = areas_of_cells(spacing);
    const std::vector<uint8_t> codes[] = {cells_of(first, label, begin, cells),
                                          cells_of(second, label, begin, cells)};
    SurfacePieces out;
    for (const int one : {0, 1}) {
        const std::vector<uint8_t>&own = codes[one], &other = codes[1 - one];
        if (std::none_of(own.begin(), own.end(), is_crossed))
            continue;
        std::vector<uint8_t> crossed(other.size());
        std::transform(other.begin(), other.end(), crossed.begin(), is_crossed);
        PALPATE_TRY(const Volume away,
                    signed_distance(make_volume<uint8_t>(grid, crossed), {}, task));
        std::vector<SurfacePiece>& pieces = one == 0 ? out.first : out.second;
        std::vector<float> row(size_t(cells.x));
        size_t at = 0;
        for (uint32_t z = 0; z < grid.size.z; ++z)
            for (uint32_t y = 0; y < grid.size.y; ++y) {
                read_row(away, {0, y, z}, grid.size.x, row.data());
                for (const float mm : row)
                    if (const uint8_t code = own[at++]; is_crossed(code))
                        pieces.push_back({crossed[at - 1]  ? 0.0f
                                          : std::isnan(mm) ? INFINITY
                                                           : mm,
                                          areas[code]});
            }
    }
    return out;
}

} // namespace palpate
