#pragma once

#include <cstdint>

#include "engine/volume/volume.h"

// Abdomens with a liver whose extent is known, for trials of segmentation.
namespace palpate::bench {

// An abdomen as a CT in the venous phase shows it: its grid, grey values and liver are functions of
// the number alone, drawn from ranges that liver_phantom.cpp names one by one.
struct LiverPhantom {
    Volume volume;            // HU, i16, with noise; LPS mm, the patient's right at negative x
    Volume truth;             // u8, on the same grid: 1 where a sample's centre lies in the liver
    double contrast_hu = 0.0; // of the liver to the muscle of the wall that it touches
    double noise_hu = 0.0;    // standard deviation
    double bridge_mm = 0.0; // radius of the place where heart and liver touch with one grey value;
                            // 0: fat lies between
};

// The organs are ellipsoids, tubes and smooth unions of them, bent by six waves of 90 to 220 mm.
// The liver has two lobes and a caudate one, hollows for gall bladder, kidney and vena cava,
// branching vessels, and up to three lesions; vessels and lesions within it belong to it. About it
// lie heart, lungs, stomach, spleen, kidney, gall bladder, spine, aorta, the wall with ribs, and
// fat. Edges are as wide as the slices are thick, for partial volume. Noise is that of a smooth
// kernel: correlated over two samples in a slice and independent between slices.
LiverPhantom liver_phantom(uint64_t number);

} // namespace palpate::bench
