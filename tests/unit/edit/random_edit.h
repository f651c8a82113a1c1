#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "engine/edit/operation.h"
#include "engine/edit/sweep.h"
#include "engine/volume/builder.h"

// Grids, poses, tools and operations drawn by chance, for twins and properties.
namespace palpate {

inline const glm::dquat kUpright(1, 0, 0, 0);
using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
inline int pick(Random& random, int low, int high) { // both included
    return std::uniform_int_distribution<int>(low, high)(random);
}

inline glm::dvec3 random_direction(Random& random) {
    for (;;) {
        const glm::dvec3 d(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
        if (const double length = glm::length(d); length > 0.1 && length <= 1.0)
            return d / length;
    }
}

inline glm::dquat random_turn(Random& random) {
    const glm::dquat q(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1),
                       uniform(random, -1, 1));
    return glm::normalize(q);
}

// Spacings up to 1:1:5, some axes turned or against the patient's, some oblique.
inline Grid random_grid(Random& random, glm::uvec3 size) {
    glm::dvec3 spacing(0.7);
    const int kind = pick(random, 0, 3);
    if (kind == 1)
        spacing.z = 3.5;
    else if (kind == 2)
        spacing = {uniform(random, 0.3, 2), uniform(random, 0.3, 2), uniform(random, 0.3, 2)};
    Grid grid = make_grid(size, spacing);
    glm::dmat3 turn(1.0);
    if (pick(random, 0, 1))
        turn = glm::mat3_cast(random_turn(random));
    for (int axis = 0; axis < 3; ++axis)
        if (pick(random, 0, 2) == 0)
            turn[axis] = -turn[axis];
    const glm::dmat3 linear = turn * glm::dmat3(grid.world_from_index);
    grid.world_from_index = glm::dmat4(linear);
    grid.world_from_index[3] = glm::dvec4(uniform(random, -100, 100), uniform(random, -100, 100),
                                          uniform(random, -100, 100), 1.0);
    return grid;
}

// Somewhere in the volume, or a little beyond.
inline StrokePose random_pose(Random& random, const Grid& grid, double time_s = 0.0) {
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    const glm::dvec3 index(uniform(random, -0.1, 1.1) * last.x, uniform(random, -0.1, 1.1) * last.y,
                           uniform(random, -0.1, 1.1) * last.z);
    return {time_s, {world_point(grid, index), random_turn(random)}};
}

inline std::vector<StrokePose> random_path(Random& random, const Grid& grid, int poses) {
    std::vector<StrokePose> path{random_pose(random, grid)};
    while (int(path.size()) < poses) {
        StrokePose next = path.back();
        next.time_s += uniform(random, 0.0, 0.01);
        next.tool.position_mm += uniform(random, 0.0, 5.0) * random_direction(random);
        if (pick(random, 0, 1))
            next.tool.rotation = random_turn(random);
        path.push_back(next);
    }
    return path;
}

inline std::string operation_name(const testing::TestParamInfo<OperationKind>& kind) {
    return name_of(kind.param);
}

// Balls come most often: of them the twin knows the sweep in closed form.
inline Tool random_tool(Random& random) {
    const double r = uniform(random, 1.0, 6.0);
    Tool tool;
    tool.marks_origin = pick(random, 0, 3) == 0;
    switch (pick(random, 0, 9)) {
        case 0:
            tool.shape = make_box({r, 2 * r, 0.5 * r});
            break;
        case 1:
            tool.shape = make_capsule(0.5 * r, r);
            break;
        case 2:
            tool.shape = make_cylinder(0.6 * r, r);
            break;
        case 3:
            tool.shape = make_ellipsoid({r, 0.5 * r, 0.7 * r});
            break;
        case 4:
            tool.shape = make_burr(r, 4, 0.3 * r);
            break;
        case 5:
            tool.marks_origin = true; // a point
            break;
        default:
            tool.shape = make_ball(r);
    }
    return tool;
}

// Whether the segment between two tips meets the cell of a sample, by clipping its three slabs.
inline bool passes_cell(const Grid& grid, const StrokePose& from, const StrokePose& to,
                        glm::dvec3 index) {
    const glm::dvec3 a = index_point(grid, from.tool.position_mm),
                     d = index_point(grid, to.tool.position_mm) - a;
    double first = 0.0, last = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = index[axis] - 0.5 - a[axis], high = index[axis] + 0.5 - a[axis];
        if (d[axis] == 0.0) {
            if (low > 0.0 || high < 0.0)
                return false;
            continue;
        }
        first = std::max(first, std::min(low / d[axis], high / d[axis]));
        last = std::min(last, std::max(low / d[axis], high / d[axis]));
    }
    return first <= last;
}

} // namespace palpate
