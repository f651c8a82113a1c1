#include "bench/cases/hard_case.h"

#include <exception>

#include "bench/cases/scenes.h"

namespace palpate::cases {

namespace {

constexpr HardCase kCases[] = {
    {"R1", "ray component exactly 0",
     "0 times infinity is NaN where an origin lies on a face; such rays draw holes or lines",
     ray_components},
    {"R2", "camera inside, near-plane cut",
     "flat planes and inside-out pictures where the eye is in the volume or on its face",
     camera_inside},
    {"R3", "grazing and corner rays", "stretches of zero length draw black lines along edges",
     grazing},
    {"R4", "structures thinner than the step", "they are missed, or flicker with the view",
     thin_structures},
    {"R5", "sharp transfer function",
     "a peak narrower than a step's change of value is hit by chance", sharp_transfer},
    {"R6", "opacity correction",
     "lengths measured in samples make opacity depend on spacing and direction",
     opacity_correction},
    {"R7", "cancellation in 1 - (1 - a)^k", "fp32 opacities of 1e-4 keep three digits",
     cancellation},
    {"R8", "accumulation of faint samples", "increments below 2^-11 vanish in half floats",
     accumulation},
    {"R9", "early termination", "what is behind a nearly opaque veil is cut off",
     early_termination},
    {"R10", "first and last partial step", "thin slabs gain or lose a step", partial_steps},
    {"R11", "interpolation weights", "samplers with 8-bit weights make 257 values of a ramp",
     filter_weights},
    {"R12", "storage format", "half floats lose CT values above 2048", storage_format},
    {"R13", "scaling by 2^b against 2^b - 1", "values drift by one code over the range",
     range_scaling},
    {"R14", "gradient operator", "normals that ignore spacing or step in stairs",
     gradient_operator},
    {"R15", "cuts through surfaces", "clip planes leave hollow or black holes", clipped_surface},
    {"R16", "missing data", "one NaN blackens what is beside it, or all", missing_data},
    {"R17", "huge offset, tiny spacing", "fp32 world coordinates lose millimetres", far_or_tiny},
    {"R18", "jitter", "noise that hides rings may bring a bias, or a residue at the start", jitter},
    {"R19", "space skipping", "matter on the border of a skipped cell, or behind a corner, is lost",
     space_skipping},
    {"R20", "borders of bricks", "seams where bricks meet", brick_seams},
    {"R21", "interpolated labels", "between labels 1 and 3 a label 2 that nobody drew", labels},
    {"R22", "maximum between samples", "peaks are missed by half a step; maxima of colours",
     maximum_peak},
    {"R23", "surface between samples", "two crossings within a step cancel, depths step",
     iso_crossings},
};

} // namespace

std::span<const HardCase> hard_cases() {
    return kCases;
}

std::vector<Line> run(const HardCase& hard_case, Painter& painter) {
    Findings findings;
    try {
        hard_case.run(painter, findings);
    } catch (const std::exception& error) {
        findings.part("whether it can be drawn");
        findings.expect(false, error.what());
    }
    return findings.lines();
}

} // namespace palpate::cases
