#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/edit/edit_mask.h"
#include "engine/volume/volume.h"

namespace palpate {

// The effect of a stroke on the samples it passes over.
//
// Below, S' is the snapshot at tool-down, T the set of samples that the tool passed over from then
// on (sweep.h), and every operation is a function of those two alone: S = op(S', T). So it does not
// matter in which portions poses arrive, and staying longer in a place changes nothing (mill
// apart). Samples outside T are those of S'.
//
// L is `label`. N(p) is p's 6, 18 or 26 neighbours within the volume: what would lie outside does
// not count, neither for nor against. "Free" samples are those that may be overwritten: `over`
// lists their labels; without it, all are. Samples with a label in `spared` are never free.
//
// On labels (u8, u16; a map of u8 becomes u16 with the first sample of an L above 255):
//   draw     free samples become L
//   erase    samples with a label in `over` (without it: any) become 0
//   erode    samples of L with a sample not of L in N(p) become 0: one layer, however long the tool
//            stays (Vidholm & Agmund 2004, 5.3)
//   dilate   free samples not of L with a sample of L in N(p) become L
//   smooth   B(p) is the samples within radius_mm of p. Free samples become L where more than half
//            of B(p) is L; samples of L become 0 where less than half of it is
//   fill     cavities: a component (by N) of samples of T that are not L, with no sample outside T
//            among the neighbours of any that is not L either, and none on the volume's faces;
//            its free samples become L
//   islands  a component (by N) of samples of T that are L, with no sample of L outside T among
//            its neighbours, becomes 0 where its volume is less than smallest_mm3
// On grey values (any type; samples without data stay so):
//   cut      samples become to_value
//   mill     values move towards to_value, and never beyond, by rate(S'(p)) * D(p). D is the time
//            in seconds that the tool spent on p, weighted with depth: 0 at its surface, rising
//            linearly to 1 at falloff_mm inside (falloff_mm = 0: 1 everywhere inside). Between two
//            poses it is the midpoint sum over n equal parts, n the least for which no point of
//            the tool moves by more than half the smallest spacing in one (Eriksson et al. 2006,
//            1.2). rate is piecewise linear in the value: a transfer function of hardness.
//            Removing has to_value below, adding above the values met
//
// Both cut and mill leave smooth walls (Walls::smooth): T reaches beyond the tool, and near its
// surface a sample takes only a share of the way from S'(p) to to_value, by its distance from the
// swept tool in samples (share_taken()). So the iso-surface of a hole is the tool's own surface and
// not a staircase of samples. A cut's sample moves by that share; a mill's to there and never
// beyond, with the time weighted from 0 at the longest spacing outside to 1 at falloff_mm inside.
// With `only_values` samples count as part of T only where a grey volume lies in this range, ends
// included (threshold paint): a guide of the same size for labels, S' itself for grey values. With
// `area` they count only where S', of grey values the guide, has a label of the area.
//
// With `alike` (on labels) the tool keeps to edges: it is looked at where it goes down and then at
// every move of at most the smallest spacing (dabs_between()), and of each look T has only the
// samples that are connected to the one at the tool's origin and alike the values of the guide
// around the place where it went down, within so many robust deviations (alike.h).
//
// `spared` are locked labels. No sample of one changes and no sample gets one; an operation on grey
// values leaves out of T the samples where its guide, a label map of the same size, has one of
// them. All other samples change as they would without it.
//
// Gradients are never stored: shading, meshing and touch compute them from the snapshot they read,
// so gradients near a change are always current.
enum class OperationKind { draw, erase, erode, dilate, smooth, fill, islands, cut, mill };

enum class Walls {
    smooth,
    samples, // whole samples: those whose centre the tool holds
};

struct RatePoint {
    double value, per_s; // at this value, value units per second
    friend bool operator==(const RatePoint&, const RatePoint&) = default;
};

struct Operation {
    OperationKind kind = OperationKind::draw;
    uint16_t label = 1;                        // L; 1 .. 65535
    std::optional<std::vector<uint16_t>> over; // free labels; absent: all
    int neighbours = 6;                        // 6, 18 or 26
    double radius_mm = 1.0;                    // of smooth
    double smallest_mm3 = 1.0;                 // of islands
    std::optional<std::pair<double, double>> only_values;
    EditArea area;
    std::optional<double> alike;    // 0 .. 100
    std::vector<uint16_t> spared;   // rising, from 1 on
    std::optional<double> to_value; // of cut and mill; within the range of the volume's type
    Walls walls = Walls::smooth;    // of cut and mill
    // Smooth walls: the iso-value whose surface is to be the tool's own. Without it, and where
    // it does not lie between to_value and the value that was there, that is the mean of the two.
    std::optional<double> surface_value;
    double falloff_mm = 0.0;      // of mill; >= 0
    std::vector<RatePoint> rates; // of mill: rising values, at least one; constant beyond the ends

    bool on_labels() const { return kind != OperationKind::cut && kind != OperationKind::mill; }
    bool smooth_walls() const { return !on_labels() && walls == Walls::smooth; }
    bool by_region() const { // needs all of T, and so happens at tool-up
        return kind == OperationKind::fill || kind == OperationKind::islands;
    }
    bool is_free(uint32_t value) const { return is_over(value) && !spares(value); }
    bool is_over(uint32_t value) const; // in `over`
    bool spares(uint32_t label) const;
    bool names_label() const { return on_labels() && kind != OperationKind::erase; }
    bool overwrites() const; // other labels become L, so that `over` confines it
    // Whether it reads another volume: grey values for only_values and alike on labels, labels for
    // spared ones and an area on grey values.
    bool needs_guide() const {
        return on_labels() ? only_values || alike : !spared.empty() || !area.is_everywhere();
    }
    friend bool operator==(const Operation&, const Operation&) = default;
};

const char* name_of(OperationKind kind);

// The operation with a to_value: where it has none, the lowest value of the volume that it begins
// on, as a tool that takes matter away leaves behind (0 where no sample has data). What keeps a
// stroke keeps it settled, so that doing it again gives the same bytes.
Operation settled(Operation operation, const Volume& volume);

// Why an operation cannot be done on a volume: a member out of the ranges above, the volume's type,
// a label L that is spared, or a guide that it needs and that is missing or does not serve
// (check_guide()).
Result<void> check(const Operation& operation, const Volume& volume, const Volume* guide);

// Why a guide does not serve a volume: another size, or samples that lie elsewhere in the patient
// by more than Sweep::tolerance_for(volume's grid), to which tools are swept. That is far more than
// the rounding of formats: 32-bit floats hold positions of 10 m to 0.001 mm.
Result<void> check_guide(const Volume& guide, const Volume& volume);

double rate_at(const std::vector<RatePoint>& rates, double value);

// 0 at the surface and outside, 1 from falloff_mm inside on. depth_mm > 0 inside. Smooth walls
// begin at beyond_mm outside.
double depth_weight(double depth_mm, double falloff_mm, double beyond_mm = 0.0);

// Smooth walls: the share, 0 to 1, of the way from a sample's value to `to` that brings it to
// the surface value. A sample through which the tool's surface passes takes this share.
double share_at_surface(double value, double to, std::optional<double> surface_value);

// The share that a sample takes at a signed distance from the tool's surface, in samples (negative
// inside; Sweep::near()): linear within a sample of the surface, so that linear interpolation
// between two samples finds a plane where it is; from there to 0 outside and 1 inside within
// another sample (kWallReach).
double share_taken(double samples, double at_surface);

// The value after dose seconds; towards `to`, never beyond.
double milled(double value, double rate_per_s, double dose_s, double to);

// The offsets of N(p), in index space.
std::vector<glm::ivec3> neighbour_offsets(int neighbours);

} // namespace palpate
