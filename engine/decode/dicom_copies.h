#pragma once

#include "engine/decode/dicom_stack.h"

// Images of a series that are there several times.
namespace palpate::io {

// Leaves one image of each instance, and the image that others were made of by compression that
// loses detail, where it lies among them at the same place. What is left out is a warning.
void drop_copies(const std::string& name, std::vector<DicomFrame>& frames,
                 std::vector<std::string>& warnings);

// Leaves one image at each place, with a warning, where the samples of all images of a place are
// the same; else changes nothing and returns false.
bool drop_equal_images(const std::string& name, std::vector<std::vector<DicomFrame>>& places,
                       const SameSamples& same_samples, std::vector<std::string>& warnings);

} // namespace palpate::io
