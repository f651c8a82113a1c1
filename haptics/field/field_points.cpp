// The part of Field that tells of a tool's many points; declared in field.h.

#include "haptics/field/field.h"
#include "haptics/field/samples.h"
#include "haptics/field/spline_place.h"

namespace palpate::haptics {

namespace {

// The places of a tool's points: counted from a tile's corner that is lower than all of them, so
// that places are positive, and small enough for floats where the tool is.
struct Around {
    static constexpr int kSide = SampleTiles::kSide;
    glm::ivec3 corner;
    glm::vec3 from;

    Around(glm::dvec3 at, double reach)
        : corner(kSide * (glm::ivec3(floor_of(at.x - reach), floor_of(at.y - reach),
                                     floor_of(at.z - reach)) >>
                          3) -
                 kSide),
          from(at - glm::dvec3(corner)) {}
};

// The cells that points within `reach` of a place lie in, and some more where floats round.
struct Cells {
    glm::ivec3 low, high;

    Cells(glm::dvec3 at, double reach) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = floor_of(at[axis] - reach - kSlack);
            high[axis] = floor_of(at[axis] + reach + kSlack);
        }
    }

 private:
    static constexpr double kSlack = 1e-3;
};

float trilinear_in(const float* numbers, glm::uvec3 low, glm::uvec3 high, glm::vec3 f) {
    const auto lerp = [](float a, float b, float t) { return a + t * (b - a); };
    const auto face = [&](uint32_t z) {
        const float *a = numbers + low.y + z, *b = numbers + high.y + z;
        return lerp(lerp(a[low.x], a[high.x], f.x), lerp(b[low.x], b[high.x], f.x), f.y);
    };
    return lerp(face(low.z), face(high.z), f.z);
}

} // namespace

void Field::hold(glm::ivec3 low, glm::ivec3 high, SampleTiles::Read what) {
    tiles_.follow(*volume_, stored_, threshold_, lowest_, settings_, generation_);
    tiles_.hold(low, high, what);
    lacked_brick_ |= tiles_.lacks();
}

// A point's value among the tiles.
float Field::trilinear_at(glm::dvec3 index) {
    const glm::ivec3 cell(floor_of(index.x), floor_of(index.y), floor_of(index.z));
    const glm::ivec3 next = cell + 1;
    hold(cell, next, SampleTiles::Read::all);
    const auto at = [](glm::ivec3 s) {
        return glm::uvec3(SampleTiles::at_x(s.x), SampleTiles::at_y(s.y), SampleTiles::at_z(s.z));
    };
    return trilinear_in(tiles_.numbers(), at(cell), at(next), glm::vec3(index - glm::dvec3(cell)));
}

double Field::trilinear(glm::dvec3 world_mm) {
    if (source_ == TouchSource::labels) // binary samples have no surface between them
        return value(world_mm);
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index))
        return base_ + double{stored_.of(lowest_)};
    return base_ + double{trilinear_at(index)};
}

// The samples that near_points() asks about: a cell's corners after a step of one sample either
// way, and what is blurred into them.
Field::Reads Field::reads_about(glm::dvec3 at, double reach) const {
    const bool labels = source_ == TouchSource::labels;
    const int blur = labels ? filters_.sharp.reach + 1 : 0;
    const Cells cells(at, reach);
    return {1 + blur, 2 + blur, cells.low - 1 - blur, cells.high + 2 + blur};
}

uint64_t Field::samples_about(glm::dvec3 at_mm, double reach_samples) {
    const glm::dvec3 at = index_of(at_mm);
    if (!volume_ || !(glm::length(at) < kFarthest))
        return 0;
    const Reads reads = reads_about(at, reach_samples);
    if (!SampleTiles::fits(reads.low, reads.high))
        return generation_ | uint64_t{1} << 63;
    hold(reads.low, reads.high,
         source_ == TouchSource::labels ? SampleTiles::Read::none : SampleTiles::Read::where_solid);
    return tiles_.held();
}

uint32_t Field::near_points(glm::dvec3 at_mm, std::span<const glm::vec3> offsets,
                            double reach_samples, uint16_t* found) {
    const glm::dvec3 at = index_of(at_mm);
    if (!volume_ || !(glm::length(at) < kFarthest))
        return 0;
    const Around around(at, reach_samples);
    const Reads reads = reads_about(at, reach_samples);
    uint32_t count = 0;
    if (!SampleTiles::fits(reads.low, reads.high)) {
        bool lacks_some = false;
        for (uint32_t i = 0; i < offsets.size(); ++i) {
            const glm::ivec3 cell = around.corner + glm::ivec3(around.from + offsets[i]);
            const ValueRange range =
                range_about(*volume_, cell - reads.before, cell + reads.after, lacks_some);
            found[count] = static_cast<uint16_t>(i);
            count += !range.empty() && stored_.of(range.max) >= threshold_;
        }
        return count;
    }
    samples_about(at_mm, reach_samples);
    if (!tiles_.any_solid())
        return 0;
    // Each tile's answer is looked up once.
    constexpr int kMost = SampleTiles::kMost + 2;
    std::array<const uint64_t*, size_t(kMost * kMost * kMost)> masks{};
    const glm::ivec3 first = around.corner >> 3;
    for (uint32_t i = 0; i < offsets.size(); ++i) {
        const glm::ivec3 cell(around.from + offsets[i]);
        const glm::ivec3 tile = cell >> 3, in = cell & 7;
        const uint64_t*& mask = masks[size_t(tile.x + kMost * (tile.y + kMost * tile.z))];
        if (!mask)
            mask = tiles_.near(first + tile).data();
        found[count] = static_cast<uint16_t>(i);
        count += mask[in.z] >> (in.x + 8 * in.y) & 1;
    }
    return count;
}

uint32_t Field::solid_points(glm::dvec3 at_mm, std::span<const glm::vec3> offsets,
                             double reach_samples, std::span<const uint16_t> named, float below,
                             Inside* found) {
    const glm::dvec3 at = index_of(at_mm);
    if (!volume_ || named.empty() || !(glm::length(at) < kFarthest))
        return 0;
    const Around around(at, reach_samples);
    uint32_t count = 0;
    const auto offer = [&](float value, uint16_t point) {
        found[count] = {value - threshold_, point};
        count += value >= threshold_ - below;
    };
    if (source_ == TouchSource::labels) {
        static_assert(Around::kSide % kBlock == 0);
        for (const uint16_t i : named) {
            SplinePlace place(glm::dvec3(around.from + offsets[i]));
            place.block += around.corner / kBlock;
            offer(place.value(block(place.block, kSharpPart).sharp.data()), i);
        }
        return count;
    }
    const Cells cells(at, reach_samples);
    if (!SampleTiles::fits(cells.low, cells.high + 1)) {
        for (const uint16_t i : named)
            offer(trilinear_at(glm::dvec3(around.corner) + glm::dvec3(around.from + offsets[i])),
                  i);
        return count;
    }
    hold(cells.low, cells.high + 1, SampleTiles::Read::where_solid);
    if (!tiles_.any_solid())
        return 0;
    // The places of samples in the table, for each coordinate that a point may have.
    constexpr size_t kMost = SampleTiles::kSide * (SampleTiles::kMost + 2);
    std::array<uint32_t, kMost> x, y, z;
    const glm::ivec3 last = cells.high + 1 - around.corner;
    for (int i = 0; i <= last.x; ++i)
        x[size_t(i)] = SampleTiles::at_x(around.corner.x + i);
    for (int i = 0; i <= last.y; ++i)
        y[size_t(i)] = SampleTiles::at_y(around.corner.y + i);
    for (int i = 0; i <= last.z; ++i)
        z[size_t(i)] = SampleTiles::at_z(around.corner.z + i);
    const float* numbers = tiles_.numbers();
    for (const uint16_t i : named) {
        const glm::vec3 p = around.from + offsets[i];
        const glm::ivec3 c(p);
        const auto cx = size_t(c.x), cy = size_t(c.y), cz = size_t(c.z);
        offer(trilinear_in(numbers, {x[cx], y[cy], z[cz]}, {x[cx + 1], y[cy + 1], z[cz + 1]},
                           p - glm::vec3(c)),
              i);
    }
    return count;
}

} // namespace palpate::haptics
