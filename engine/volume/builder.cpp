#include "engine/volume/builder.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstring>
#include <vector>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/volume/nearest_stored.h"

namespace palpate {

namespace {

size_t page_index(const Volume::Root& root, glm::uvec3 brick) {
    const glm::uvec3 page = brick / kPageSide;
    return page.x + root.page_count.x * (page.y + size_t{root.page_count.y} * page.z);
}

uint32_t slot_index(glm::uvec3 brick) {
    const glm::uvec3 slot = brick % kPageSide;
    return slot.x + kPageSide * (slot.y + kPageSide * slot.z);
}

BrickPtr zero_brick(ScalarType type) {
    return visit_scalar(type,
                        [](auto t) { return Brick::make(std::span<const decltype(t)>(&t, 1)); });
}

// Runs make(position) -> BrickPtr for every brick on all threads.
template <class Make>
Volume build(const Grid& grid, ScalarType type, const Make& make) {
    VolumeBuilder builder(grid, type);
    const glm::uvec3 count = builder.brick_count();
    const size_t total = size_t{count.x} * count.y * count.z;
    std::atomic<size_t> made{0}; // shows the thread sanitizer, too, that tasks are awaited
    tbb::parallel_for(size_t{0}, total, [&](size_t i) {
        const profile::Scope scope("make a brick");
        const glm::uvec3 position(i % count.x, i / count.x % count.y,
                                  i / (size_t{count.x} * count.y));
        builder.set_brick(position, make(position));
        ++made;
    });
    PALPATE_ASSERT_CMP(made.load(), ==, total);
    return builder.finish();
}

} // namespace

uint64_t next_version() {
    static std::atomic<uint64_t> counter{0};
    return ++counter;
}

void summarise(Page& page) {
    page.range = {};
    page.no_data_count = 0;
    for (const BrickPtr& brick : page.bricks)
        if (brick) {
            page.range.include(brick->range());
            page.no_data_count += brick->no_data_count();
        }
}

void summarise(Volume::Root& root) {
    root.range = {};
    root.no_data_count = 0;
    for (const auto& page : root.pages) {
        root.range.include(page->range);
        root.no_data_count += page->no_data_count;
    }
}

VolumeBuilder::VolumeBuilder(const Grid& grid, ScalarType type)
    : root_(std::make_shared<Volume::Root>()) {
    PALPATE_ASSERT(grid.size.x >= 1 && grid.size.y >= 1 && grid.size.z >= 1);
    root_->grid = grid;
    root_->type = type;
    root_->brick_count = (grid.size + (kBrickSide - 1)) / kBrickSide;
    root_->page_count = (root_->brick_count + (kPageSide - 1)) / kPageSide;
    const glm::uvec3 pages = root_->page_count;
    pages_.resize(size_t{pages.x} * pages.y * pages.z);
    const BrickPtr zero = zero_brick(type);
    for (auto& page : pages_)
        page = std::make_shared<Page>();
    for (uint32_t z = 0; z < root_->brick_count.z; ++z)
        for (uint32_t y = 0; y < root_->brick_count.y; ++y)
            for (uint32_t x = 0; x < root_->brick_count.x; ++x)
                set_brick({x, y, z}, zero);
}

void VolumeBuilder::set_brick(glm::uvec3 position, BrickPtr brick) {
    PALPATE_ASSERT(brick && brick->type() == root_->type);
    pages_[page_index(*root_, position)]->bricks[slot_index(position)] = std::move(brick);
}

Volume VolumeBuilder::finish() {
    for (const auto& page : pages_)
        summarise(*page);
    root_->pages.assign(pages_.begin(), pages_.end());
    root_->version = next_version();
    summarise(*root_);
    pages_.clear();
    return Volume(std::move(root_));
}

template <class T>
Volume make_volume(const Grid& grid, std::span<const T> samples) {
    PALPATE_ASSERT_CMP(samples.size(), ==, sample_count(grid));
    return build(grid, scalar_type_of<T>, [&](glm::uvec3 position) {
        const glm::uvec3 start = position * kBrickSide;
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), grid.size - start);
        thread_local std::vector<T> staged;
        staged.assign(kBrickSamples, T{});
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y) {
                const size_t row =
                    start.x + grid.size.x * (start.y + y + size_t{grid.size.y} * (start.z + z));
                std::memcpy(&staged[offset_in_brick({0, y, z})], &samples[row],
                            valid.x * sizeof(T));
            }
        return Brick::make(std::span<const T>(staged), valid);
    });
}

template Volume make_volume(const Grid&, std::span<const uint8_t>);
template Volume make_volume(const Grid&, std::span<const int8_t>);
template Volume make_volume(const Grid&, std::span<const uint16_t>);
template Volume make_volume(const Grid&, std::span<const int16_t>);
template Volume make_volume(const Grid&, std::span<const float>);

BrickPtr make_brick(const Grid& grid, ScalarType type,
                    const std::function<double(glm::uvec3)>& value, glm::uvec3 position) {
    return visit_scalar(type, [&](auto t) {
        using T = decltype(t);
        const glm::uvec3 start = position * kBrickSide;
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), grid.size - start);
        std::vector<T> staged(kBrickSamples);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x)
                    staged[offset_in_brick({x, y, z})] =
                        nearest_stored<T>(value(start + glm::uvec3(x, y, z)));
        return Brick::make(std::span<const T>(staged), valid);
    });
}

Volume make_volume(const Grid& grid, ScalarType type,
                   const std::function<double(glm::uvec3)>& value) {
    return build(grid, type,
                 [&](glm::uvec3 position) { return make_brick(grid, type, value, position); });
}

Volume with_grid(const Volume& volume, const Grid& grid) {
    PALPATE_ASSERT(grid.size == volume.size());
    auto root = std::make_shared<Volume::Root>(volume.root());
    root->grid = grid;
    root->version = next_version();
    return Volume(std::move(root));
}

} // namespace palpate
