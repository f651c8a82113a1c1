#pragma once

#include <cstdint>
#include <variant>
#include <vector>

#include "engine/segment/task.h"

// A click on one place of a volume takes a region: small enough to be found anew as the pointer
// moves.
namespace palpate {

// Samples of a volume: a box of them, and which of these, x fastest, 1 or 0.
struct ClickRegion {
    glm::uvec3 low{0}, size{0};
    std::vector<uint8_t> taken{};
    uint64_t count = 0; // of samples that are taken
    // The values that these have, both ends included; of a level trace only the lower end: of what
    // lies about the contour, on the side where values are higher.
    double least = 0.0, most = 0.0;

    bool has(glm::uvec3 sample) const;
    friend bool operator==(const ClickRegion&, const ClickRegion&) = default;
};

// The samples that are joined to one across faces and have values like those near it.
//
// "Near" are the samples with data within near_mm of it, and those of its block of 3 x 3 x 3. Of
// these count the quarter whose values are nearest to its own, so that a vessel counts that fills
// no more of them. With m their median, and s the largest difference of one of them from its own
// value by 0.3186 (the standard deviation, of values that are normally distributed about it), or a
// thousandth of the volume's range where that is more, the values are those of m - times * s to
// m + times * s, and as far as its own. No sample lies farther from it than reach_mm.
struct LocalThreshold {
    glm::uvec3 at{0};
    double reach_mm = 30.0; // 0 .. 500
    double near_mm = 3.0;   // 0 .. 50
    double times = 3.0;     // 0 .. 1000

    friend bool operator==(const LocalThreshold&, const LocalThreshold&) = default;
};
// The samples of the box that holds all within so many mm of one.
uint64_t samples_in_reach(const Grid& grid, glm::uvec3 at, double reach_mm);
// Refused: a sample outside the volume or without data. Memory: 10 bytes a sample of the box.
Result<ClickRegion> local_region(const Volume& volume, const LocalThreshold& click,
                                 const Task& task);

// The inside of the contour, in a layer of samples, along which the value is that at a place.
//
// The value is interpolated linearly between the four samples about the place. Samples at or above
// it are joined across edges of the layer's squares, those below it across corners too; beyond the
// layer and without data values are lower. Between the nearest of the four on either side runs one
// closed contour. Its inside are the samples of the two's pieces that the other one surrounds, with
// the holes in it.
struct LevelTrace {
    glm::dvec3 at{0.0}; // in samples; along the axis the nearest layer is taken
    int axis = 2;       // across which the layer lies

    friend bool operator==(const LevelTrace&, const LevelTrace&) = default;
};
// Refused: a place outside the volume, a layer of one row, and a place about which all values are
// equal or that is without data.
Result<ClickRegion> level_region(const Volume& volume, const LevelTrace& click, const Task& task);

// One of the two.
using RegionClick = std::variant<LocalThreshold, LevelTrace>;
Result<ClickRegion> region_of(const Volume& volume, const RegionClick& click, const Task& task);

// The region as a label map: u8, or u16 above 255.
Result<Volume> volume_of(const ClickRegion& region, const Grid& grid, uint16_t label,
                         const Task& task);

} // namespace palpate
