#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "haptics/field/algorithm.h"
#include "haptics/field/field_filters.h"
#include "haptics/field/stored_samples.h"

namespace palpate::haptics {

// The two views of a Field (field.h) at the points of a lattice that is a whole number of times as
// fine as the samples, box by box: what marching cubes make triangles of that are to be felt. Point
// i of the lattice lies at sample i / finer, on each axis. The same point has the same bits in
// every box. Where the parameters have an opacity table, samples go through it first.
//
// All memory is there from the start, and nothing is fetched: for the servo thread. 10 to 30 us for
// a box.
class FineSamples {
 public:
    static constexpr int kMostSide = 13, kMostFiner = 4;

    explicit FineSamples(int finer = 2); // 1 .. kMostFiner
    int finer() const { return finer_; }

    // Before anything else, and whenever something may have changed; `volume` must live until then.
    void follow(const Volume& volume, const TouchParameters& parameters);

    // side^3 points from `first` on, x fastest, side 8 .. kMostSide; good until the same is asked
    // for again. What is solid is decided by the sharp view, and normals are the smooth one's.
    struct Box {
        const float* values;
        bool lacks_brick;
    };
    Box sharp(glm::ivec3 first, int side);
    Box smooth(glm::ivec3 first, int side);

    uint64_t settings() const { return settings_; } // changes where any point may, but for samples
    // Whether one of the samples that points about a place of index space are made of has no data,
    // or is not in memory.
    bool lacks_data(glm::dvec3 index) const;
    float threshold() const { return threshold_; } // sharp values at or above it are solid
    // The least that a point can be: far from everything solid.
    float free_value() const { return free_value_; }
    // Whether a sample, as it was stored, is free; those that are not there are.
    bool is_free(glm::ivec3 sample) const;
    // Whether block ranges decide all points from `low` to `high`.
    enum class Matter { free, solid, unknown };
    Matter matter(glm::ivec3 low, glm::ivec3 high) const;
    bool is_clear(glm::ivec3 low, glm::ivec3 high) const {
        return matter(low, high) == Matter::free;
    }

 private:
    // The taps of a point of the lattice on an axis, by its place between two samples.
    static constexpr int kMostTaps = 2 * Filter::kMostReach + 4;
    static constexpr int kMostRead = kMostSide + kMostTaps;
    struct View {
        int reach = 0; // of the filter: taps reach from 1 + reach before to 2 + reach after
        std::array<std::array<std::array<float, kMostTaps>, kMostFiner>, 3> taps{};
    };
    View make_view(const Filter& filter) const;
    bool make(const View& view, glm::ivec3 first, int side, std::vector<float>& out);

    int finer_;
    const Volume* volume_ = nullptr;
    bool labels_ = false, has_table_ = false;
    HapticTransfer table_;
    StoredSamples stored_;
    FieldFilters filters_;
    View sharp_view_, smooth_view_;
    float threshold_ = 0.0f, lowest_ = 0.0f, free_value_ = 0.0f;
    uint64_t settings_ = 0;
    Grid grid_;
    double iso_ = 0.0, blur_ = -1.0, edge_ = 0.0;
    std::vector<float> samples_, z_, zy_, turned_, sharp_, smooth_;
};

} // namespace palpate::haptics
