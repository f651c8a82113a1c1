#include "engine/volume/edit.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <vector>

#include "engine/base/assert.h"
#include "engine/volume/builder.h"
#include "engine/volume/nearest_stored.h"

namespace palpate {

struct VolumeEdit::Staged {
    glm::uvec3 position;
    std::vector<std::byte> samples;
};

namespace {

uint64_t brick_key(const Volume& volume, glm::uvec3 p) {
    const glm::uvec3 count = volume.brick_count();
    return p.x + count.x * (p.y + uint64_t{count.y} * p.z);
}

} // namespace

VolumeEdit::VolumeEdit(Volume base) : base_(std::move(base)) {}
VolumeEdit::~VolumeEdit() = default;

VolumeEdit::Staged& VolumeEdit::staged(glm::uvec3 position) {
    std::unique_ptr<Staged>& entry = bricks_[brick_key(base_, position)];
    if (!entry) {
        entry = std::make_unique<Staged>();
        entry->position = position;
        entry->samples.resize(kBrickSamples * bytes_per_sample(base_.type()));
        visit_scalar(base_.type(), [&](auto t) {
            using T = decltype(t);
            base_.brick(position).read(
                std::span<T>(reinterpret_cast<T*>(entry->samples.data()), kBrickSamples));
        });
    }
    return *entry;
}

float VolumeEdit::value(glm::uvec3 index) const {
    const auto found = bricks_.find(brick_key(base_, index / kBrickSide));
    if (found == bricks_.end())
        return base_.value(index);
    return visit_scalar(base_.type(), [&](auto t) {
        const auto* samples = reinterpret_cast<const decltype(t)*>(found->second->samples.data());
        const auto value = static_cast<float>(samples[offset_in_brick(index % kBrickSide)]);
        return std::isfinite(value) ? value : std::numeric_limits<float>::quiet_NaN();
    });
}

void VolumeEdit::set(glm::uvec3 index, double value) {
    visit_scalar(base_.type(), [&](auto t) {
        using T = decltype(t);
        write_brick<T>(index / kBrickSide)[offset_in_brick(index % kBrickSide)] =
            nearest_stored<T>(value);
    });
}

template <class T>
std::span<T> VolumeEdit::write_brick(glm::uvec3 position) {
    PALPATE_ASSERT(base_.type() == scalar_type_of<T>);
    return {reinterpret_cast<T*>(staged(position).samples.data()), kBrickSamples};
}

template std::span<uint8_t> VolumeEdit::write_brick(glm::uvec3);
template std::span<int8_t> VolumeEdit::write_brick(glm::uvec3);
template std::span<uint16_t> VolumeEdit::write_brick(glm::uvec3);
template std::span<int16_t> VolumeEdit::write_brick(glm::uvec3);
template std::span<float> VolumeEdit::write_brick(glm::uvec3);

Volume VolumeEdit::commit() {
    std::vector<const Staged*> touched;
    for (const auto& entry : bricks_)
        touched.push_back(entry.second.get());
    std::vector<PlacedBrick> made(touched.size());
    tbb::parallel_for(size_t{0}, touched.size(), [&](size_t i) {
        const glm::uvec3 position = touched[i]->position;
        BrickPtr brick = visit_scalar(base_.type(), [&](auto t) {
            using T = decltype(t);
            const auto* samples = reinterpret_cast<const T*>(touched[i]->samples.data());
            return Brick::make_after(base_.brick(position),
                                     std::span<const T>(samples, kBrickSamples),
                                     base_.valid_in_brick(position));
        });
        if (brick)
            made[i] = {position, std::move(brick)};
    });
    std::erase_if(made, [](const PlacedBrick& placed) { return placed.brick == nullptr; });
    Volume next = with_bricks(base_, made);
    bricks_.clear();
    return next;
}

Volume with_bricks(const Volume& base, std::span<const PlacedBrick> bricks) {
    if (bricks.empty())
        return base;
    const auto root = std::make_shared<Volume::Root>(base.root());
    std::unordered_map<size_t, std::shared_ptr<Page>> pages;
    for (const auto& [position, brick] : bricks) {
        PALPATE_ASSERT(brick->type() == base.type());
        const glm::uvec3 page = position / kPageSide;
        const glm::uvec3 slot = position % kPageSide;
        const size_t at =
            page.x + root->page_count.x * (page.y + size_t{root->page_count.y} * page.z);
        std::shared_ptr<Page>& copy = pages[at];
        if (!copy) {
            copy = std::make_shared<Page>(*root->pages[at]);
            root->pages[at] = copy;
        }
        copy->bricks[slot.x + kPageSide * (slot.y + kPageSide * slot.z)] = brick;
    }
    for (const auto& entry : pages)
        summarise(*entry.second);
    summarise(*root);
    root->version = next_version();
    return Volume(root);
}

} // namespace palpate
