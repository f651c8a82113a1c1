#include "engine/edit/regions.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

constexpr int kPatience = 2048; // samples between two questions whether to go on

uint64_t key_of(const Volume& volume, glm::ivec3 index) {
    const glm::uvec3 brick = glm::uvec3(index) / kBrickSide, count = volume.brick_count();
    return brick.x + count.x * (brick.y + uint64_t{count.y} * brick.z);
}

glm::uvec3 brick_of(const Volume& volume, uint64_t key) {
    const glm::uvec3 count = volume.brick_count();
    return {key % count.x, key / count.x % count.y, key / (uint64_t{count.x} * count.y)};
}

} // namespace

RegionSearch::RegionSearch(const Volume& before, const Operation& operation, Region region)
    : before_(before),
      operation_(operation),
      region_(std::move(region)),
      offsets_(neighbour_offsets(operation.neighbours)),
      sample_mm3_(std::abs(glm::determinant(glm::dmat3(before.grid().world_from_index)))) {
    for (const auto& entry : region_)
        order_.push_back(entry);
    std::sort(order_.begin(), order_.end());
}

bool RegionSearch::member(glm::ivec3 index) const {
    const bool is_label = before_.value(glm::uvec3(index)) == static_cast<float>(operation_.label);
    return is_label == (operation_.kind == OperationKind::islands);
}

bool RegionSearch::in_region(glm::ivec3 index) const {
    const auto found = region_.find(key_of(before_, index));
    return found != region_.end() && found->second->has(glm::uvec3(index) % kBrickSide);
}

void RegionSearch::visit(glm::ivec3 index) {
    if (!in_region(index)) {
        open_ = true;
        return;
    }
    const glm::uvec3 local = glm::uvec3(index) % kBrickSide;
    uint32_t& row = visited_[key_of(before_, index)].row(local.y, local.z);
    if (row >> local.x & 1)
        return;
    row |= uint32_t{1} << local.x;
    component_.push_back(index);
}

void RegionSearch::finish(VolumeEdit& edit) {
    const bool fill = operation_.kind == OperationKind::fill;
    const double volume_mm3 = sample_mm3_ * static_cast<double>(component_.size());
    if (!open_ && (fill || volume_mm3 < operation_.smallest_mm3))
        for (const glm::ivec3 index : component_) {
            const glm::uvec3 i(index);
            const auto had = static_cast<uint16_t>(before_.value(i));
            if (!fill)
                edit.set(i, 0.0);
            else if (operation_.is_free(had))
                edit.set(i, operation_.label);
            else if (operation_.is_over(had) && (met_spared_ == 0 || had < met_spared_))
                met_spared_ = had;
        }
    component_.clear();
    looked_at_ = 0;
    searching_ = open_ = false;
}

bool RegionSearch::work(VolumeEdit& edit, const std::function<bool()>& go_on) {
    const bool fill = operation_.kind == OperationKind::fill;
    const glm::ivec3 last = glm::ivec3(before_.size()) - 1;
    int patience = kPatience;
    const auto tired = [&] {
        if (--patience > 0)
            return false;
        patience = kPatience;
        return !go_on();
    };
    for (;;) {
        for (; looked_at_ < component_.size();) {
            const glm::ivec3 index = component_[looked_at_++];
            const bool at_face =
                glm::any(glm::equal(index, glm::ivec3(0))) || glm::any(glm::equal(index, last));
            open_ = open_ || (fill && at_face);
            for (const glm::ivec3 offset : offsets_) {
                const glm::ivec3 next = index + offset;
                if (glm::all(glm::greaterThanEqual(next, glm::ivec3(0))) &&
                    glm::all(glm::lessThanEqual(next, last)) && member(next))
                    visit(next);
            }
            if (tired())
                return false;
        }
        if (searching_)
            finish(edit);
        // The next seed: a member of T that no component has taken.
        for (; !searching_ && brick_ < order_.size(); row_ = 0, ++brick_) {
            const auto& [key, mask] = order_[brick_];
            const glm::ivec3 origin(brick_of(before_, key) * kBrickSide);
            SampleMask& visited = visited_[key];
            for (; !searching_ && row_ < mask->rows.size(); ++row_) {
                for_each_bit(mask->rows[row_] & ~visited.rows[row_], [&](uint32_t x) {
                    const glm::ivec3 index =
                        origin + glm::ivec3(x, row_ % kBrickSide, row_ / kBrickSide);
                    if (!searching_ && member(index)) {
                        visit(index);
                        searching_ = true;
                    }
                });
                if (searching_)
                    break; // this row again: it may hold more
                if (tired())
                    return false;
            }
            if (searching_)
                break;
        }
        if (!searching_)
            return true;
    }
}

} // namespace palpate
