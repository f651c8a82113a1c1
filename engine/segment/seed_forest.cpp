#include "engine/segment/seed_forest.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

#include "engine/base/assert.h"
#include "engine/segment/seed_forest_tile.h"
#include "engine/volume/grid.h"

namespace palpate {

namespace {

constexpr double kUnitsASpacing = 16.0;
constexpr uint32_t kWindows = 64; // of costs up to the highest edge, one after the other

} // namespace

SeedForest::SeedForest(const Grid& grid, std::vector<uint16_t> heights, double highest_mm)
    : grid_(grid),
      size_(grid.size),
      tiles_a_side_((grid.size + (kBrickSide - 1)) / kBrickSide),
      heights_(std::move(heights)) {
    PALPATE_ASSERT(heights_.size() == sample_count(grid));
    const glm::dvec3 spacing = spacing_mm(grid);
    unit_mm_ = std::min({spacing.x, spacing.y, spacing.z}) / kUnitsASpacing;
    const auto units = [&](double mm) { // costs stay below 2^32
        return std::clamp(std::round(mm / unit_mm_), 1.0, 0x1p31);
    };
    for (int k = 0; k < 3; ++k)
        distance_[size_t(k)] = uint32_t(units(spacing[k]));
    highest_ = uint64_t(units(highest_mm));
    clear();
}

SeedForest::SeedForest(SeedForest&&) noexcept = default;
SeedForest& SeedForest::operator=(SeedForest&&) noexcept = default;
SeedForest::~SeedForest() = default;

glm::uvec3 SeedForest::index_of(size_t sample) const {
    return {sample % size_.x, sample / size_.x % size_.y, sample / (size_t{size_.x} * size_.y)};
}

glm::uvec3 SeedForest::position_of(size_t tile) const {
    return {tile % tiles_a_side_.x, tile / tiles_a_side_.x % tiles_a_side_.y,
            tile / (size_t{tiles_a_side_.x} * tiles_a_side_.y)};
}

GrowTile& SeedForest::tile_at(glm::uvec3 index) {
    const glm::uvec3 position = index / kBrickSide;
    return tiles_[position.x +
                  tiles_a_side_.x * (position.y + size_t{tiles_a_side_.y} * position.z)];
}

SeedForest::Reached SeedForest::from_neighbors(size_t sample, glm::uvec3 index) const {
    Reached least{kNever, 0};
    for_each_neighbor(index, [&](int axis, size_t from) {
        const uint32_t cost = step(costs_[from], heights_[sample], axis);
        if (cost < least.cost || (cost == least.cost && cost != kNever &&
                                  numbers_[labels_[from]] < numbers_[least.label]))
            least = {cost, labels_[from]};
    });
    return least;
}

void SeedForest::clear() {
    costs_.assign(heights_.size(), kNever);
    labels_.assign(heights_.size(), 0);
    numbers_.assign(1, 0);
    tiles_.clear();
    tiles_.resize(size_t{tiles_a_side_.x} * tiles_a_side_.y * tiles_a_side_.z);
    seeds_.reset();
}

Result<uint8_t> SeedForest::rank_of(uint16_t label) {
    const auto known = std::ranges::find(numbers_, label);
    if (known == numbers_.end() && numbers_.size() > 255)
        return fail("expected seeds of at most 255 labels, found more");
    const auto rank = uint8_t(known - numbers_.begin());
    if (known == numbers_.end())
        numbers_.push_back(label);
    return rank;
}

// Samples that became seeds get cost 0 and wait; those that are none any more are `removed`.
Result<void> SeedForest::take_seeds(const Volume& seeds, std::vector<size_t>& removed) {
    for (uint32_t number = 0; number < tiles_.size(); ++number) {
        const glm::uvec3 position = position_of(number);
        const Brick& now = seeds.brick(position);
        const Brick* before = seeds_ ? &seeds_->brick(position) : nullptr;
        if (before == &now ||
            (!(now.range().max > 0.0f) && !(before && before->range().max > 0.0f)))
            continue;
        const Brick::Pinned pin = now.pin();
        const Brick::Pinned pin_before = before ? before->pin() : Brick::Pinned{};
        const glm::uvec3 valid = seeds.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const uint32_t offset = offset_in_brick({x, y, z});
                    const auto label = uint16_t(now.value(pin, offset));
                    const auto was =
                        before ? uint16_t(before->value(pin_before, offset)) : uint16_t{0};
                    const size_t sample = at(position * kBrickSide + glm::uvec3(x, y, z));
                    if (label == was || heights_[sample] == kGrowWall)
                        continue;
                    if (label == 0) {
                        removed.push_back(sample);
                        continue;
                    }
                    PALPATE_TRY(labels_[sample], rank_of(label));
                    costs_[sample] = 0;
                    tiles_[number].waiting.push_back(uint16_t(offset));
                    tiles_[number].earliest = 0;
                }
    }
    return {};
}

// Takes cost and label from seeds that are gone, and from every sample whose cost may come from
// one: a neighbour of the same label whose cost is a step from theirs.
void SeedForest::cut(const std::vector<size_t>& removed) {
    struct Cut {
        size_t at;
        uint32_t cost;
        uint8_t label;
    };
    std::vector<Cut> front, next;
    const auto take = [&](std::vector<Cut>& to, size_t sample) {
        to.push_back({sample, costs_[sample], labels_[sample]});
        costs_[sample] = kNever;
        labels_[sample] = 0;
        tile_at(index_of(sample)).has_cut = true;
    };
    for (const size_t sample : removed)
        take(front, sample);
    for (; !front.empty(); front.swap(next)) {
        next.clear();
        for (const Cut& cut : front)
            for_each_neighbor(index_of(cut.at), [&](int axis, size_t to) {
                if (costs_[to] != kNever && labels_[to] == cut.label &&
                    costs_[to] == step(cut.cost, heights_[to], axis))
                    take(next, to);
            });
    }
}

bool SeedForest::spread(const Task& task) {
    const auto steps = uint32_t(highest_ / kWindows + distance_[0] * 2 * kBrickSide);
    std::vector<size_t> active;
    for (;;) {
        uint32_t begin = kNever;
        for (const GrowTile& tile : tiles_)
            begin = std::min(begin, tile.next());
        if (begin == kNever)
            return true;
        const uint32_t end = kNever - begin > steps ? begin + steps : kNever;
        if (task.progress)
            task.progress(std::min(1.0, double(begin) / double(highest_)));
        for (bool is_done = false; !is_done;) {
            is_done = true;
            // Tiles with a common face are never in one turn: a turn writes what it alone reads.
            for (uint32_t turn = 0; turn < 2; ++turn) {
                active.clear();
                for (size_t i = 0; i < tiles_.size(); ++i) {
                    const glm::uvec3 at = position_of(i);
                    if ((at.x + at.y + at.z) % 2 == turn && tiles_[i].next() < end)
                        active.push_back(i);
                }
                is_done = is_done && active.empty();
                if (task.stop.stop_requested())
                    return false;
                tbb::parallel_for(size_t{0}, active.size(), [&](size_t i) { run(active[i], end); });
            }
        }
    }
}

Result<void> SeedForest::update(const Volume& seeds, const Task& task) {
    if (seeds.size() != size_)
        return fail("the seeds have another size than the volume");
    for (GrowTile& tile : tiles_)
        tile.passed_on = 0, tile.served = 0;
    std::vector<size_t> removed;
    Result<void> taken = take_seeds(seeds, removed);
    if (!taken && seeds_) { // ranks of labels that have gone count, too: from the start they do not
        clear();
        removed.clear();
        taken = take_seeds(seeds, removed);
    }
    if (!taken) {
        clear();
        return taken;
    }
    cut(removed);
    if (!spread(task)) {
        clear();
        return stopped();
    }
    served_ = 0;
    for (const GrowTile& tile : tiles_)
        served_ += tile.served;
    seeds_ = seeds;
    return {};
}

Result<Volume> SeedForest::labels(ScalarType type, uint16_t background, const Task& task) const {
    PALPATE_ASSERT(type == ScalarType::u8 || type == ScalarType::u16);
    return make_bricks(grid_, type, task, [&](glm::uvec3 position) {
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), size_ - position * kBrickSide);
        const auto make = [&]<class T>(T) {
            std::vector<T> samples(kBrickSamples);
            for (uint32_t z = 0; z < valid.z; ++z)
                for (uint32_t y = 0; y < valid.y; ++y)
                    for (uint32_t x = 0; x < valid.x; ++x) {
                        const uint16_t label =
                            numbers_[labels_[at(position * kBrickSide + glm::uvec3(x, y, z))]];
                        samples[offset_in_brick({x, y, z})] = T(label == background ? 0 : label);
                    }
            return Brick::make(std::span<const T>(samples), valid);
        };
        return type == ScalarType::u8 ? make(uint8_t{}) : make(uint16_t{});
    });
}

Result<Volume> SeedForest::costs(const Task& task) const {
    return make_bricks(grid_, ScalarType::f32, task, [&](glm::uvec3 position) {
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), size_ - position * kBrickSide);
        std::vector<float> samples(kBrickSamples);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const uint32_t cost = costs_[at(position * kBrickSide + glm::uvec3(x, y, z))];
                    samples[offset_in_brick({x, y, z})] =
                        cost == kNever ? std::numeric_limits<float>::quiet_NaN()
                                       : float(cost * unit_mm_);
                }
        return Brick::make(std::span<const float>(samples), valid);
    });
}

size_t SeedForest::bytes() const {
    return heights_.size() * sizeof(heights_[0]) + costs_.size() * sizeof(costs_[0]) +
           labels_.size() * sizeof(labels_[0]) + tiles_.size() * sizeof(GrowTile);
}

} // namespace palpate
