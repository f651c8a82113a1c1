#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "engine/segment/task.h"
#include "engine/volume/brick.h"

namespace palpate {

// A field that an algorithm writes as it goes, one T for each sample of a grid, in the bricks of a
// volume: 32x32x32, x fastest (offset_in_brick). A brick holds the fill value and takes no memory
// until it is first written; then 32768 T. Different bricks may be written from different threads;
// a brick may be read by many threads while none writes it.
//
// Values of a written brick that lie beyond the grid may be anything.
template <class T>
class BrickArray {
 public:
    // Each component of size >= 1.
    explicit BrickArray(glm::uvec3 size, T fill = T{})
        : size_(size),
          brick_count_((size + (kBrickSide - 1)) / kBrickSide),
          fill_(fill),
          bricks_(size_t{brick_count_.x} * brick_count_.y * brick_count_.z) {}

    glm::uvec3 size() const { return size_; }
    glm::uvec3 brick_count() const { return brick_count_; }
    const T& fill() const { return fill_; }

    // The samples of a brick, kBrickSamples of them; null where it was never written, and holds
    // fill(). position < brick_count() on every axis.
    const T* find(glm::uvec3 position) const { return bricks_[number(position)].get(); }
    T* find(glm::uvec3 position) { return bricks_[number(position)].get(); }

    // The same, made where it was never written.
    T* write(glm::uvec3 position) {
        std::unique_ptr<T[]>& brick = bricks_[number(position)];
        if (!brick) {
            brick = std::make_unique_for_overwrite<T[]>(kBrickSamples);
            std::fill_n(brick.get(), kBrickSamples, fill_);
        }
        return brick.get();
    }

    // Makes a brick hold fill() again, and frees it.
    void clear(glm::uvec3 position) { bricks_[number(position)].reset(); }

    // For single samples; inner loops take whole bricks. index < size() on every axis.
    T value(glm::uvec3 index) const {
        const T* brick = find(index / kBrickSide);
        return brick ? brick[offset_in_brick(index % kBrickSide)] : fill_;
    }
    void set(glm::uvec3 index, T value) {
        write(index / kBrickSide)[offset_in_brick(index % kBrickSide)] = value;
    }

    size_t bytes() const { // of the bricks that were written
        return sizeof(T) * kBrickSamples *
               size_t(std::count_if(bricks_.begin(), bricks_.end(),
                                    [](const auto& brick) { return brick != nullptr; }));
    }

 private:
    size_t number(glm::uvec3 position) const {
        return position.x + brick_count_.x * (position.y + size_t{brick_count_.y} * position.z);
    }

    glm::uvec3 size_, brick_count_;
    T fill_;
    std::vector<std::unique_ptr<T[]>> bricks_;
};

// The array as a volume. Each brick is freed once it is copied, so that no second whole field is
// held. grid.size must be array.size(); T: uint8_t, int8_t, uint16_t, int16_t, float (NaN and
// infinities become "no data").
template <class T>
Result<Volume> take_volume(BrickArray<T> array, const Grid& grid, const Task& task) {
    const BrickPtr filled = Brick::make(std::span<const T>(&array.fill(), 1));
    return make_bricks(grid, scalar_type_of<T>, task, [&](glm::uvec3 position) {
        const T* samples = array.find(position);
        if (!samples)
            return filled;
        const glm::uvec3 valid =
            glm::min(glm::uvec3(kBrickSide), grid.size - position * kBrickSide);
        BrickPtr brick = Brick::make(std::span<const T>(samples, kBrickSamples), valid);
        array.clear(position);
        return brick;
    });
}

} // namespace palpate
