#include "engine/render/residency.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/base/assert.h"

namespace palpate {

namespace {

size_t count_of(glm::uvec3 n) {
    return size_t{n.x} * n.y * n.z;
}

template <class Visit>
void for_each_in(glm::uvec3 low, glm::uvec3 high, const Visit& visit) {
    for (uint32_t z = low.z; z < high.z; ++z)
        for (uint32_t y = low.y; y < high.y; ++y)
            for (uint32_t x = low.x; x < high.x; ++x)
                visit(glm::uvec3(x, y, z));
}

bool same_constant(const Brick& a, const Brick& b) {
    return a.is_constant() && b.is_constant() &&
           std::memcmp(a.pin().bytes, b.pin().bytes, bytes_per_sample(a.type())) == 0;
}

// Cuts the volume into parts, front to back.
class Planner {
 public:
    Planner(glm::uvec3 count, const BrickMask& needed, size_t capacity, uint32_t reach)
        : count_(count), needed_(needed), capacity_(capacity), reach_(reach) {}

    // Whether it worked; parts() are in order.
    bool cut(glm::uvec3 low, glm::uvec3 high, uint32_t eyes, const Viewpoint& view) {
        Part part{low, high, eyes, {}};
        const glm::uvec3 around_low = low - glm::min(low, glm::uvec3(reach_));
        const glm::uvec3 around_high = glm::min(high + reach_, count_);
        bool any = false;
        for_each_in(around_low, around_high, [&](glm::uvec3 p) {
            if (!needed_[p.x + count_.x * (p.y + size_t{count_.y} * p.z)])
                return;
            part.bricks.push_back(p);
            any = any ||
                  (glm::all(glm::greaterThanEqual(p, low)) && glm::all(glm::lessThan(p, high)));
        });
        if (!any)
            return true; // nothing to be seen
        if (part.bricks.size() <= capacity_) {
            parts_.push_back(std::move(part));
            return true;
        }
        const glm::uvec3 size = high - low;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        if (size[axis] == 1) {
            most_ = std::max(most_, part.bricks.size());
            return false;
        }
        const uint32_t plane = low[axis] + size[axis] / 2;
        glm::uvec3 first_high = high, second_low = low;
        first_high[axis] = second_low[axis] = plane;
        const bool low_first = view.parallel
                                   ? view.direction[axis] >= 0.0
                                   : view.eye[axis] < static_cast<double>(plane * kBrickSide);
        return low_first ? cut(low, first_high, eyes, view) && cut(second_low, high, eyes, view)
                         : cut(second_low, high, eyes, view) && cut(low, first_high, eyes, view);
    }

    std::vector<Part>& parts() { return parts_; }
    size_t most() const { return most_; }

 private:
    glm::uvec3 count_;
    const BrickMask& needed_;
    size_t capacity_;
    uint32_t reach_; // bricks
    std::vector<Part> parts_;
    size_t most_ = 0;
};

} // namespace

bool is_near_occupied(glm::uvec3 brick, std::span<const uint8_t> distances, glm::uvec3 cells,
                      uint32_t side, uint32_t reach) {
    PALPATE_ASSERT_CMP(distances.size(), ==, count_of(cells));
    // The brick's first sample lies in the cell below, too, where a cell begins with it.
    const glm::uvec3 first = (brick * kBrickSide + (side - 1)) / side;
    const glm::uvec3 low = first - glm::min(first, glm::uvec3(reach + 1));
    const glm::uvec3 high =
        glm::min(((brick + 1u) * kBrickSide + (side - 1)) / side + reach, cells);
    for (uint32_t z = low.z; z < high.z; ++z)
        for (uint32_t y = low.y; y < high.y; ++y)
            if (low.x < high.x &&
                std::memchr(&distances[low.x + cells.x * (y + size_t{cells.y} * z)], 0,
                            high.x - low.x) != nullptr)
                return true;
    return false;
}

bool varies(const Volume& volume, glm::uvec3 brick) {
    const Brick& held = volume.brick(brick);
    if (!held.is_constant())
        return true;
    bool same = true;
    for_each_in(brick, glm::min(brick + 2u, volume.brick_count()),
                [&](glm::uvec3 above) { same = same && same_constant(held, volume.brick(above)); });
    return !same;
}

Viewpoint viewpoint_of(const View& view, const Grid& grid) {
    const glm::dmat3 turn(index_from_world(grid));
    return {index_point(grid, view.eye_mm), turn * view.forward,
            view.projection == Projection::orthographic};
}

Result<std::vector<Part>> plan_parts(glm::uvec3 brick_count, const BrickMask& needed,
                                     size_t capacity, double reach_samples,
                                     std::span<const Viewpoint> views) {
    PALPATE_ASSERT_CMP(needed.size(), ==, count_of(brick_count));
    const auto reach = static_cast<uint32_t>(std::ceil(std::max(0.0, reach_samples) / kBrickSide));
    const uint32_t all_eyes = (1u << views.size()) - 1u;
    Planner planner(brick_count, needed, capacity, reach);
    const auto total = static_cast<size_t>(std::count(needed.begin(), needed.end(), 1));
    if (total <= capacity) {
        planner.cut(glm::uvec3(0), brick_count, all_eyes, views[0]);
    } else {
        for (uint32_t eye = 0; eye < views.size(); ++eye)
            if (!planner.cut(glm::uvec3(0), brick_count, 1u << eye, views[eye]))
                return fail(
                    "the volume: expected room for {} bricks at once on the device, found room "
                    "for {}",
                    planner.most(), capacity);
    }
    if (planner.parts().empty())
        planner.parts().push_back({glm::uvec3(0), brick_count, all_eyes, {}});
    return std::move(planner.parts());
}

} // namespace palpate
