#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>

#include "haptics/field/algorithm.h"
#include "haptics/field/field_filters.h"
#include "haptics/field/sample_tiles.h"

// The field a proxy is held out of: value and gradient at points of the world, from samples kept in
// a small cache inside the algorithm's state.
namespace palpate::haptics {

struct SplinePlace; // spline_place.h

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
// Where spacing is uneven, the finer axes take a Gaussian of up to 1.3 samples times a parabola
// (seven taps) instead of that sharpening, which is as exact and has less noise. Where `blur` is 0,
// five taps that are exact up to the fifth moment keep bodies of few samples from sinking.
//
// smooth(): the cubic B-spline on samples blurred by a Gaussian of `blur` (0.6 .. 1; less is as
// 0.6) of the coarsest spacing, though of at most 1.9 samples on any axis. Normals come from here:
// noise of 10 % of the contrast turns them by 4 degrees (p99), those of the sharp view by 23, and
// where an edge is narrow, those waver with the lattice without any noise. Thin walls fade in it,
// so it decides nothing.
//
// Where labels are felt, samples are 1 in a label and 0 outside, and both views are blurred, by 0.5
// and 1 sample: their values rise across the border like a smoothed signed distance. Walls of one
// sample are still solid at 0.5.
//
// Samples beyond the volume, without data, or in bricks not in memory count as the lowest value
// there is: free. What is felt near the last two is not known: lacks_data(). Cost: about 0.04 us an
// evaluation, and a few us for each block of 4x4x4 samples that is read for the first time. Nothing
// is allocated. Blocks lie in a table that any box of 32 samples fits into. They outlive a
// snapshot: a block is made again only where samples that it was made of have changed.
//
// All is stored in floats, less the iso-value that was first asked for: near the surface, where it
// matters, rounding is 2^-24 of the contrast for each of a few sums, 1e-6 samples in all.
class Field {
 public:
    // To be called at the start of a tick; `volume` must live until its end. Cheap where nothing
    // changed.
    void follow(const Volume& volume, TouchSource source, double iso, double blur_samples,
                double edge_samples = 0.0);
    void follow(const Volume& volume, const TouchParameters& p) {
        follow(volume, p.source, p.iso, p.normal_blur_samples, p.edge_samples);
    }
    // No volume is followed: everything is free.
    bool is_empty() const { return volume_ == nullptr; }
    // Whether one of the samples that the views of a place are made of has no data, or is not in
    // memory and was missed since follow(). About 1 us where there is no-data in the same brick.
    bool lacks_data(glm::dvec3 world_mm) const;
    bool may_lack_data() const { return volume_->no_data_count() > 0 || lacked_brick_; }

    double value(glm::dvec3 world_mm);       // of sharp()
    FieldSample sharp(glm::dvec3 world_mm);  // the gradient is the derivative of the value
    FieldSample smooth(glm::dvec3 world_mm); // likewise
    // sharp() and smooth() for less than the price of two.
    struct Both {
        FieldSample sharp, smooth;
    };
    Both both(glm::dvec3 world_mm) { return both(world_mm, true, true); }
    // Interpolates the unsharpened samples; for labels, sharp().
    double trilinear(glm::dvec3 world_mm);

    // Finds the points at_mm + offset that may be solid, now or after all have moved by up to one
    // sample on each axis. Returns their number; their order is that of `offsets`.
    // Offsets are given in index space (offset_of), none longer than reach_samples on any axis.
    // About 3 ns a point.
    uint32_t near_points(glm::dvec3 at_mm, std::span<const glm::vec3> offsets, double reach_samples,
                         uint16_t* found);
    // Finds those of the named points whose trilinear() is at least the iso-value less `below`
    // (value units, 0 or more). About 8 ns a point.
    struct Inside {
        float value; // above the iso-value
        uint32_t point;
    };
    uint32_t solid_points(glm::dvec3 at_mm, std::span<const glm::vec3> offsets,
                          double reach_samples, std::span<const uint16_t> named, float below,
                          Inside* found);
    // A number that changes whenever the answer of near_points() to a tool at a place may have
    // become another one.
    uint64_t samples_about(glm::dvec3 at_mm, double reach_samples);
    // A number that changes whenever anything within reach_samples of a place may feel different;
    // it may change without that, too, if reach_samples is large. Never 0.
    uint64_t stamps_about(glm::dvec3 at_mm, double reach_samples) const;
    // Changes where the answer of offset_of() may.
    uint64_t settings() const { return settings_; }
    // Samples that parts of blocks were made of since follow(): about 25 ns for ten of them.
    uint32_t filtered_samples() const { return filtered_samples_; }
    glm::vec3 offset_of(glm::dvec3 mm) const {
        return glm::vec3(glm::dmat3(index_from_world_) * mm);
    }

    // The threshold for value(): the iso-value, and 0.5 where labels are felt.
    double iso() const { return base_ + double{threshold_}; }
    double contrast() const { return contrast_; }    // highest less lowest value
    double voxel_mm() const { return smallest_mm_; } // smallest spacing
    double coarsest_mm() const { return coarsest_mm_; }

    // Whether nothing solid can lie within `margin_samples` of the segment; never true where
    // something does.
    bool is_clear(glm::dvec3 from_mm, glm::dvec3 to_mm, double margin_samples) const;

    glm::dvec3 index_of(glm::dvec3 world_mm) const {
        return glm::dvec3(index_from_world_ * glm::dvec4(world_mm, 1.0));
    }
    const Volume* volume() const { return volume_; }

 private:
    static constexpr int kBlock = 4;           // samples
    static constexpr int kTable = 8;           // blocks on each axis
    static constexpr int kSpline = kBlock + 3; // a spline reads three samples beyond
    // Points this far outside are as free as any; indices stay within int.
    static constexpr double kFarthest = 1e6;

    enum Part : uint32_t { kSharpPart, kSmoothPart, kParts };
    struct Made {                // of one part of a block
        uint64_t generation = 0; // in which it was last known to be right
        uint64_t stamps = 0;     // of what it was made of; 0: not made
        bool lacks = false;      // some of it was not in memory
    };
    struct Block {
        glm::ivec3 position{};
        uint64_t settings = 0;
        std::array<Made, kParts> made{};
        // Coefficients of the spline less base_, from 4 position - 1 on, so that the 4x4x4 of a
        // cell lie in one block.
        std::array<float, kSpline * kSpline * kSpline> sharp{}, smooth{};
    };
    struct Box { // of samples
        glm::ivec3 start{};
        int side = 0;
    };

    const Filter& filter_of(Part part) const {
        return part == kSmoothPart ? filters_.smooth : filters_.sharp;
    }
    bool is_far(glm::dvec3 index) const;
    Box box_of(glm::ivec3 position, Part part) const;
    uint64_t stamps_of(Box box) const;
    Block& block(glm::ivec3 position, Part part);
    void renew(Block& block, glm::ivec3 position, Part part);
    void fill(Block& block, Box box, Part part);
    FieldSample evaluate(const SplinePlace& place, Part part);
    Both both(glm::dvec3 world_mm, bool sharp, bool smooth);
    float trilinear_at(glm::dvec3 index);
    void hold(glm::ivec3 low, glm::ivec3 high, SampleTiles::Read what);
    struct Reads {
        int before, after; // of a cell, on each axis
        glm::ivec3 low, high;
    };
    Reads reads_about(glm::dvec3 at, double reach_samples) const;

    const Volume* volume_ = nullptr;
    uint64_t version_ = 0;
    TouchSource source_ = TouchSource::grey;
    double iso_ = 0.5, base_ = 0.5, contrast_ = 1.0, smallest_mm_ = 1.0, coarsest_mm_ = 1.0,
           blur_ = -1.0, edge_ = 0.0;
    StoredSamples stored_;
    FieldFilters filters_;
    float threshold_ = 0.0f; // the iso-value as samples are stored
    float lowest_ = 0.0f;
    Grid grid_;
    glm::dmat4 index_from_world_{1.0};
    glm::dmat3 gradient_to_world_{1.0};
    bool lacked_brick_ = false;
    uint32_t filtered_samples_ = 0;
    uint64_t generation_ = 0; // rises with every snapshot; 0 is "never"
    uint64_t settings_ = 0;   // rises with everything else that blocks depend on
    std::array<Block, kTable * kTable * kTable> blocks_{};
    SampleTiles tiles_;
};

// Settings derived from a volume's own samples (tuning.cpp). Not for the servo thread.
struct Tuning {
    // From its noise on the noisier side of the surface, as a share of the contrast about the
    // iso-value.
    double normal_blur_samples = 1.0;
    double edge_samples = 0.0; // as TouchParameters::edge_samples
    // Of the places where lines along the axes cross the surface, the share that cross back within
    // three samples: 0 on bodies that are thicker, a half on a plate that is not, 0.9 where the
    // iso-value lies amid noise, which is no surface.
    double grains = 0.0;
};
Tuning tuning_for(const Volume& volume, double iso);
// Sets in `parameters` what a volume that is felt at parameters.iso tells, and returns it.
Tuning tune(TouchParameters& parameters, const Volume& volume);

} // namespace palpate::haptics
