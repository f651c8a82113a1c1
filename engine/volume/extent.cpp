#include "engine/volume/extent.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate {

WorldBox world_box(const Grid& grid, double margin) {
    const glm::dvec3 low(-margin), high = glm::dvec3(grid.size) - 1.0 + margin;
    WorldBox box{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 p = world_point(
            grid, glm::mix(low, high, glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2)));
        box.low = glm::min(box.low, p);
        box.high = glm::max(box.high, p);
    }
    return box;
}

std::string text_of(const WorldBox& box) {
    const glm::dvec3 a = box.low, b = box.high;
    return fmt::format(
        "left {:.4g} .. {:.4g}, posterior {:.4g} .. {:.4g}, superior {:.4g} .. "
        "{:.4g} mm",
        a.x, b.x, a.y, b.y, a.z, b.z);
}

std::vector<HalfSpace> half_spaces(const Grid& grid, double margin) {
    const glm::dmat4 m = index_from_world(grid); // row i gives index i of a point
    std::vector<HalfSpace> spaces;
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 row(m[0][axis], m[1][axis], m[2][axis]);
        const double last = static_cast<double>(grid.size[axis]) - 1.0;
        spaces.push_back({row, -margin - m[3][axis]});
        spaces.push_back({-row, m[3][axis] - last - margin});
    }
    return spaces;
}

std::vector<HalfSpace> half_spaces(const WorldBox& box) {
    std::vector<HalfSpace> spaces;
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 along(0.0);
        along[axis] = 1.0;
        spaces.push_back({along, box.low[axis]});
        spaces.push_back({-along, -box.high[axis]});
    }
    return spaces;
}

bool have_common_point(std::span<const HalfSpace> given, double slack_mm) {
    std::vector<HalfSpace> spaces(given.begin(), given.end());
    for (HalfSpace& space : spaces) {
        const double length = glm::length(space.normal);
        space = {space.normal / length, space.offset / length};
    }
    constexpr double kParallel = 1e-9; // of a determinant of unit normals
    for (size_t i = 0; i < spaces.size(); ++i)
        for (size_t j = i + 1; j < spaces.size(); ++j)
            for (size_t k = j + 1; k < spaces.size(); ++k) {
                const HalfSpace &a = spaces[i], &b = spaces[j], &c = spaces[k];
                const glm::dvec3 bc = glm::cross(b.normal, c.normal);
                const double volume = glm::dot(a.normal, bc);
                if (std::abs(volume) < kParallel)
                    continue;
                const glm::dvec3 corner =
                    (a.offset * bc + b.offset * glm::cross(c.normal, a.normal) +
                     c.offset * glm::cross(a.normal, b.normal)) /
                    volume;
                if (std::all_of(spaces.begin(), spaces.end(), [&](const HalfSpace& space) {
                        return glm::dot(space.normal, corner) >= space.offset - slack_mm;
                    }))
                    return true;
            }
    return false;
}

std::string apart_text(const std::string& what, const Grid& grid, const Grid& volume) {
    std::vector<HalfSpace> both = half_spaces(grid, 0.5);
    const std::vector<HalfSpace> others = half_spaces(volume);
    both.insert(both.end(), others.begin(), others.end());
    if (have_common_point(both, slack_mm(volume)))
        return {};
    return fmt::format("{} lies outside the volume: it is within {}, the volume within {} (LPS)",
                       what, text_of(world_box(grid)), text_of(world_box(volume)));
}

Result<void> check_grid(const Grid& grid) {
    if (glm::any(glm::equal(grid.size, glm::uvec3(0))))
        return fail("expected a grid of one sample or more on each axis, found {} x {} x {}",
                    grid.size.x, grid.size.y, grid.size.z);
    const double cell = glm::determinant(glm::dmat3(grid.world_from_index));
    if (!std::isfinite(cell) || cell == 0.0)
        return fail("expected a grid whose matrix has an inverse, found the determinant {}", cell);
    return {};
}

double smallest_spacing_mm(const Grid& grid) {
    const glm::dvec3 spacing = spacing_mm(grid);
    return std::min({spacing.x, spacing.y, spacing.z});
}

double largest_spacing_mm(const Grid& grid) {
    const glm::dvec3 spacing = spacing_mm(grid);
    return std::max({spacing.x, spacing.y, spacing.z});
}

double slack_mm(const Grid& grid) {
    return 1e-4 * smallest_spacing_mm(grid);
}

} // namespace palpate
