#pragma once

#include <array>
#include <glm/glm.hpp>

#include "haptics/proxy/algorithm.h"

// The field a proxy is held out of: value and gradient at points of the world, from samples kept in
// a small cache inside the algorithm's state.
namespace palpate::haptics {

struct FieldSample {
    double value = 0.0;       // value units; at or above the iso-value is solid
    glm::dvec3 gradient{0.0}; // value units per mm of the world
};

// Two views of one snapshot:
//
// sharp(): the tricubic quasi-interpolant of the samples: the uniform cubic B-spline on samples
// sharpened by (-1/6, 4/3, -1/6) on each axis, exact for cubic polynomials. What is solid is
// decided here: on an edge blurred by 0.7 samples its surface is within 0.01 samples of the true
// plane where trilinear interpolation errs by 0.02, and within 0.03 on a ball of 6 samples where
// trilinear errs by 0.07 (measured).
//
// Where spacing is uneven and the blur is not 0, the finer axes take a Gaussian of up to 1.3
// samples times a parabola instead of that sharpening, which is as exact and has less noise.
//
// smooth(): the cubic B-spline on samples blurred by a Gaussian of `blur` (0 .. 1) of the coarsest
// spacing, though of at most 1.9 samples on any axis. Normals
// come from here: noise of 10 % of the contrast turns them by 4 degrees (p99), those of the sharp
// view by 23. Thin walls fade in it, so it decides nothing. A blur of 0 sharpens by half instead,
// by (-1/12, 7/6, -1/12): on clean data the sharp view's normals waver with the lattice, and those
// of the plain spline round corners off.
//
// Where labels are felt, samples are 1 in a label and 0 outside, and both views are blurred, by 0.6
// and 1 sample: their values rise across the border like a smoothed signed distance. Walls of 1.5
// samples are still solid at 0.6.
//
// Samples beyond the volume, without data, or in bricks not in memory count as the lowest value
// there is: free. Cost: about 0.1 us an evaluation, and about 3 us for each block of 4x4x4 samples
// that is read for the first time. Nothing is allocated. Blocks lie in a table that any box of 32
// samples fits into; the table is forgotten when the snapshot changes.
class Field {
 public:
    // To be called at the start of a tick; `volume` must live until its end. Cheap where nothing
    // changed.
    void follow(const Volume& volume, TouchSource source, double iso, double blur_samples);
    // No volume is followed: everything is free.
    bool is_empty() const { return volume_ == nullptr; }
    // Whether something read since follow() was not in memory.
    bool lacked_brick() const { return lacked_brick_; }

    double value(glm::dvec3 world_mm);       // of sharp()
    FieldSample sharp(glm::dvec3 world_mm);  // the gradient is the derivative of the value
    FieldSample smooth(glm::dvec3 world_mm); // likewise
    double trilinear(glm::dvec3 world_mm);   // of the unsharpened samples; cheapest

    double iso() const { return iso_; }
    double contrast() const { return contrast_; }    // highest less lowest value
    double voxel_mm() const { return smallest_mm_; } // smallest spacing

    // Whether nothing solid can lie within `margin_samples` of the segment; never true where
    // something does.
    bool is_clear(glm::dvec3 from_mm, glm::dvec3 to_mm, double margin_samples) const;

    glm::dvec3 index_of(glm::dvec3 world_mm) const {
        return glm::dvec3(index_from_world_ * glm::dvec4(world_mm, 1.0));
    }
    const Volume* volume() const { return volume_; }

 private:
    static constexpr int kBlock = 4;                // samples
    static constexpr int kTable = 8;                // blocks on each axis
    static constexpr int kRaw = kBlock + 1;         // cells read one sample beyond
    static constexpr int kReach = 3, kFarReach = 5; // of the blur; where spacing is uneven

    enum Part : uint8_t { kRawPart = 1, kSharpPart = 2, kSmoothPart = 4 };
    struct Block {
        glm::ivec3 position{};
        uint32_t epoch = 0;
        uint32_t parts = 0;
        std::array<float, kRaw * kRaw * kRaw> raw;
        std::array<float, kBlock * kBlock * kBlock> sharp, smooth;
    };

    const Block& block(glm::ivec3 position, Part part);
    void fill_raw(Block& block);
    void fill(Block& block, Part part);
    template <bool kGradient>
    FieldSample evaluate(glm::dvec3 world_mm, Part part);

    const Volume* volume_ = nullptr;
    uint64_t version_ = 0;
    TouchSource source_ = TouchSource::grey;
    double iso_ = 0.5, contrast_ = 1.0, smallest_mm_ = 1.0, blur_ = -1.0;
    float lowest_ = 0.0f;
    bool is_even_ = true;                                        // spacing: the near reach does
    std::array<std::array<float, 2 * kFarReach + 1>, 3> taps_{}; // of the blur, each axis
    // Where spacing is uneven and data noisy, the sharp view's filter on each axis; see follow().
    bool is_sharp_wide_ = false;
    std::array<std::array<float, 2 * kReach + 1>, 3> sharp_taps_{};
    double overshoot_ = 0.0; // of the sharp view beyond its samples' range, as a share of it
    glm::dmat4 index_from_world_{1.0};
    glm::dmat3 gradient_to_world_{1.0};
    bool lacked_brick_ = false;
    uint32_t epoch_ = 0; // 0 is "never filled"
    std::array<Block, kTable * kTable * kTable> blocks_;
};

// How much to blur normals for a volume: from its noise, estimated as the median absolute
// difference of neighbouring samples about the medians of blocks, as a share of the contrast about
// `iso`. Not for the servo thread.
double normal_blur_for(const Volume& volume, double iso);

} // namespace palpate::haptics
