#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// Facts that a DICOM file states about an image, which may tell it from others at the same place.
namespace palpate::io {

// In the order in which frames are sorted. Times of acquisition are seconds since 2000-01-01.
enum class FrameKey {
    temporal_position,
    trigger_time_ms,
    echo_time_ms,
    b_value,
    acquisition_number,
    acquisition_time_s,
    // These order frames only where none of those above does.
    echo_number,
    inversion_time_ms,
    flip_angle,
    reference_time_ms,
    gradient_x, // of diffusion; 0 where an image states none
    gradient_y,
    gradient_z,
};
constexpr size_t kFrameKeys = 13, kMainFrameKeys = 6;

struct FrameIndex {
    std::string name;
    uint32_t value = 0;
};

struct FrameMarks {
    std::array<std::optional<double>, kFrameKeys> values;
    std::string image_type;
    // The frame's numbers in the dimensions of its file, which all its frames have:
    // DimensionIndexValues, or the vectors of nuclear medicine other than that of slices.
    std::vector<FrameIndex> indices;

    std::optional<double>& operator[](FrameKey key) { return values[static_cast<size_t>(key)]; }
};

} // namespace palpate::io
