#include "engine/render/needed_bricks.h"

#include <algorithm>
#include <cmath>

#include "engine/render/volume_parts.h"

namespace palpate {

namespace {

// Samples beyond a slab that cubic interpolation reads, and one for rounding.
constexpr double kFilterReach = 3.0;

// A slab about a plane in index space, where signed distances in mm are dot(normal, index) +
// offset.
struct Slab {
    Slab(const SliceLayer& slice, const Grid& grid) {
        const glm::dvec3 unit = glm::normalize(slice.normal);
        normal = glm::transpose(glm::dmat3(grid.world_from_index)) * unit;
        offset = glm::dot(unit, glm::dvec3(grid.world_from_index[3]) - slice.point_mm);
        half_mm = 0.5 * slice.slab_mm + kFilterReach * glm::length(spacing_mm(grid));
    }
    bool meets(glm::dvec3 low, glm::dvec3 high) const {
        double least = offset, most = offset;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = normal[axis] * low[axis], b = normal[axis] * high[axis];
            least += std::min(a, b);
            most += std::max(a, b);
        }
        return least <= half_mm && most >= -half_mm;
    }

    glm::dvec3 normal;
    double offset, half_mm;
};

glm::dvec3 low_of(glm::uvec3 brick) {
    return glm::dvec3(brick * kBrickSide);
}

// Calls visit(brick) for the bricks that a slab meets: column by column along the axis that it cuts
// most squarely, so that the cost follows the plane and not the volume.
template <class Visit>
void for_each_met(const Slab& slab, glm::uvec3 count, const Visit& visit) {
    const glm::dvec3 size = glm::abs(slab.normal);
    const int along = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int u = (along + 1) % 3, v = (along + 2) % 3;
    for (uint32_t j = 0; j < count[v]; ++j)
        for (uint32_t i = 0; i < count[u]; ++i) {
            glm::uvec3 brick(0);
            brick[u] = i;
            brick[v] = j;
            // The column's middle line crosses the slab about `centre`, its corners within `off`.
            glm::dvec3 middle = low_of(brick) + 0.5 * kBrickSide;
            middle[along] = 0.0;
            const double off = slab.half_mm + 0.5 * kBrickSide * (size[u] + size[v] + size[along]);
            const double centre = -(glm::dot(slab.normal, middle) + slab.offset);
            const double a = (centre - off) / slab.normal[along] / kBrickSide;
            const double b = (centre + off) / slab.normal[along] / kBrickSide;
            const double last = count[along] - 1.0;
            const auto from =
                static_cast<uint32_t>(std::clamp(std::floor(std::min(a, b)) - 1.0, 0.0, last));
            const auto to =
                static_cast<uint32_t>(std::clamp(std::floor(std::max(a, b)) + 1.0, 0.0, last));
            for (brick[along] = from; brick[along] <= to; ++brick[along])
                if (slab.meets(low_of(brick), low_of(brick) + double{kBrickSide}))
                    visit(brick);
        }
}

// The bricks that may be needed for a changed one's cells: [low, high). `reach` in cells.
struct Bricks {
    glm::uvec3 low, high;
};
Bricks about(const ChangedBrick& brick, const CellMap& cells, uint32_t reach, glm::uvec3 count) {
    const CellBox box =
        widened(changed_cells(brick, cells.side(), cells.count()), reach, cells.count());
    return {glm::min(box.low * cells.side() / kBrickSide, count - 1u),
            glm::min(box.high * cells.side() / kBrickSide, count - 1u) + 1u};
}

} // namespace

NeededBricks::NeededBricks(const Volume& volume)
    : count_(volume.brick_count()), flags_(size_t{count_.x} * count_.y * count_.z, 0) {}

template <class Visit>
void NeededBricks::for_each(const Visit& visit) const {
    for (uint32_t z = 0; z < count_.z; ++z)
        for (uint32_t y = 0; y < count_.y; ++y)
            for (uint32_t x = 0; x < count_.x; ++x)
                visit(glm::uvec3(x, y, z));
}

template <class Visit>
std::vector<glm::uvec3> NeededBricks::list(const Visit& is_listed) const {
    std::vector<glm::uvec3> bricks;
    for_each([&](glm::uvec3 p) {
        if (is_listed(flags_[index_of(p)]))
            bricks.push_back(p);
    });
    return bricks;
}

BrickMask NeededBricks::seen() const {
    BrickMask mask;
    mask.reserve(flags_.size());
    for (const uint8_t flags : flags_)
        mask.push_back((flags & kSeen) != 0);
    return mask;
}

std::vector<glm::uvec3> NeededBricks::sliced() const {
    return list([](uint8_t flags) { return (flags & kSliced) != 0; });
}

std::vector<glm::uvec3> NeededBricks::all() const {
    return list([](uint8_t flags) { return (flags & (kSeen | kSliced)) != 0; });
}

std::vector<glm::uvec3> NeededBricks::take_turned() {
    std::erase_if(turned_, [&](glm::uvec3 brick) {
        uint8_t& flags = flags_[index_of(brick)];
        if (needs(brick) == ((flags & kTold) != 0))
            return true;
        flags ^= kTold;
        return false;
    });
    return std::exchange(turned_, {});
}

void NeededBricks::set(glm::uvec3 brick, Flag flag, bool on) {
    ++bricks_visited_;
    uint8_t& flags = flags_[index_of(brick)];
    const uint8_t before = flags;
    flags = static_cast<uint8_t>(on ? before | flag : before & ~flag);
    const auto turned = [&](uint8_t mask) { // 1, 0 or -1
        return static_cast<size_t>(int{(flags & mask) != 0} - int{(before & mask) != 0});
    };
    seen_ += turned(kSeen);
    sliced_ += turned(kSliced);
    needed_ += turned(kSeen | kSliced);
    if (turned(kSeen | kSliced) != 0)
        turned_.push_back(brick);
}

void NeededBricks::find_planes(const Scene& scene, const Grid& grid) {
    for (const glm::uvec3 brick : std::exchange(on_planes_, {})) {
        set(brick, kOnPlane, false);
        set(brick, kSliced, false);
    }
    for (const SliceLayer& slice : scene.slices)
        for_each_met(Slab(slice, grid), count_, [&](glm::uvec3 brick) {
            if (flags_[index_of(brick)] & kOnPlane)
                return;
            on_planes_.push_back(brick);
            set(brick, kOnPlane, true);
            set(brick, kSliced, flags_[index_of(brick)] & kVaries);
        });
    slices_ = scene.slices;
    world_from_index_ = grid.world_from_index;
}

void NeededBricks::update(const Scene& scene, const Volume& volume,
                          std::optional<std::span<const ChangedBrick>> changed,
                          const CellMap* cells, double step_factor) {
    std::optional<Rays> rays;
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::mip) {
        rays = Rays{true, 0, 0};
    } else if (scene.ray_cast) {
        const double samples = reach_samples(*scene.ray_cast, volume.grid(), step_factor);
        rays = Rays{false, cells->generation(),
                    static_cast<uint32_t>(std::min(std::ceil(samples / cells->side()), 65535.0))};
    }

    const bool ask_what_varies = (rays && rays->mip) || !scene.slices.empty();
    const bool anew = ask_what_varies && (!knows_what_varies_ || !changed);
    std::vector<glm::uvec3> edited; // bricks that may vary now, or no longer
    if (anew)
        for_each([&](glm::uvec3 p) { set(p, kVaries, varies(volume, p)); });
    else if (ask_what_varies)
        for (const ChangedBrick& brick : *changed)
            for (uint32_t corner = 0; corner < 8; ++corner) { // itself, and those below it
                const glm::uvec3 below(corner & 1, corner >> 1 & 1, corner >> 2);
                if (glm::any(glm::lessThan(brick.position, below)))
                    continue;
                edited.push_back(brick.position - below);
                set(edited.back(), kVaries, varies(volume, edited.back()));
            }
    knows_what_varies_ = ask_what_varies;
    const auto varies_now = [&](glm::uvec3 p) { return (flags_[index_of(p)] & kVaries) != 0; };

    const bool all_rays = rays != rays_ || !changed || (rays && rays->mip && anew);
    if (all_rays)
        for_each([&](glm::uvec3 p) {
            set(p, kSeen,
                rays && (rays->mip ? varies_now(p)
                                   : is_near_occupied(p, cells->distances(), cells->count(),
                                                      cells->side(), rays->reach)));
        });
    else if (rays && rays->mip)
        for (const glm::uvec3 p : edited)
            set(p, kSeen, varies_now(p));
    else if (rays) {
        std::vector<glm::uvec3> near;
        for (const ChangedBrick& brick : *changed) {
            const Bricks box = about(brick, *cells, rays->reach, count_);
            for (uint32_t z = box.low.z; z < box.high.z; ++z)
                for (uint32_t y = box.low.y; y < box.high.y; ++y)
                    for (uint32_t x = box.low.x; x < box.high.x; ++x)
                        near.emplace_back(x, y, z);
        }
        const auto before = [&](glm::uvec3 a, glm::uvec3 b) { return index_of(a) < index_of(b); };
        std::sort(near.begin(), near.end(), before);
        near.erase(std::unique(near.begin(), near.end()), near.end());
        for (const glm::uvec3 p : near)
            set(p, kSeen,
                is_near_occupied(p, cells->distances(), cells->count(), cells->side(),
                                 rays->reach));
    }
    rays_ = rays;

    if (anew || scene.slices != slices_ ||
        (!slices_.empty() && volume.grid().world_from_index != world_from_index_))
        find_planes(scene, volume.grid());
    else if (!slices_.empty())
        for (const glm::uvec3 p : edited)
            set(p, kSliced, (flags_[index_of(p)] & kOnPlane) && varies_now(p));
}

} // namespace palpate
