#pragma once

#include <cstdint>
#include <string>

namespace palpate {

// A series that the reader of a DICOM folder found, and whether it is the one that was read.
struct SeriesInfo {
    uint32_t number = 0; // from 1, as ReadOptions::series takes it
    uint32_t count = 0;  // of the series in the folder
    std::string modality;
    std::string description; // free text of the file: it may hold a patient's name
    std::string content;     // "93 images of 64 x 64 at 3.2 x 3.2 mm, axial"
    std::string uid;
    bool is_read = false;

    friend bool operator==(const SeriesInfo&, const SeriesInfo&) = default;
};

// "series 1 of 2: CT 'head', 93 images of 64 x 64 at 3.2 x 3.2 mm, axial, 1.2.3 (read)".
std::string series_line(const SeriesInfo& series);

} // namespace palpate
