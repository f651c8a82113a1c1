#pragma once

#include <memory>
#include <span>
#include <unordered_map>

#include "engine/volume/volume.h"

namespace palpate {

// A batch of writes that becomes one new snapshot.
//
// A brick is copied when it is first written; commit() shares every brick that was not touched, or
// that holds the same bits as before. One thread writes an edit.
class VolumeEdit {
 public:
    explicit VolumeEdit(Volume base);
    ~VolumeEdit();

    const Volume& base() const { return base_; }

    // The sample as this edit sees it. index < size on every axis.
    float value(glm::uvec3 index) const;

    // Rounds to the nearest value of the type and clamps to its range; for f32, a value that is not
    // finite means "no data".
    void set(glm::uvec3 index, double value);

    // Whole-brick access for operations that write many samples: the brick's kBrickSamples samples,
    // x fastest. T is the stored type. Samples outside the volume may hold anything.
    template <class T>
    std::span<T> write_brick(glm::uvec3 position);

    // The new snapshot; the base itself where nothing changed. The edit is spent.
    Volume commit();

 private:
    struct Staged;
    Staged& staged(glm::uvec3 position);

    Volume base_;
    std::unordered_map<uint64_t, std::unique_ptr<Staged>> bricks_;
};

struct PlacedBrick {
    glm::uvec3 position; // in bricks
    BrickPtr brick;      // of the volume's type
};

// A later snapshot with these bricks in place of those of `base` and all others shared; `base`
// itself for an empty list. Each position at most once.
Volume with_bricks(const Volume& base, std::span<const PlacedBrick> bricks);

} // namespace palpate
