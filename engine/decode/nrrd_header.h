#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/io/decoder.h"

namespace palpate::io {

// The fields of a NRRD header that say what the voxels are and where they lie.
// Source: teem.sourceforge.net/nrrd/format.html.
struct NrrdHeader {
    enum class Encoding { raw, gzip, ascii };

    // One axis of the array, fastest first.
    struct Axis {
        int64_t size = 0;
        std::optional<glm::dvec3> direction; // step in the file's space and unit; absent: no space
        double spacing = 1;                  // where no direction is given
        double mm_per_unit = 1;              // of "units"
        bool is_spatial = true;              // false for components, time and lists
        bool is_list = false;                // its kind is "list" or "time"
    };

    // One segment of a segmentation of 3D Slicer (.seg.nrrd), whose keys are Segment0_Name,
    // Segment0_Color, Segment0_LabelValue and Segment0_Layer.
    struct Segment {
        uint32_t number = 0; // in the key
        LabelName label;     // its value is 0 where the header states none
        std::optional<int64_t> layer;
    };

    ComponentType type{};
    std::vector<Axis> axes;
    Encoding encoding{};
    bool big_endian = false;
    std::string space; // lower case, long form; empty where the header names none
    std::optional<glm::dvec3> origin;
    std::optional<glm::dvec3> mm_per_unit; // of "space units", along each axis of the space
    int64_t line_skip = 0;
    int64_t byte_skip = 0;                 // -1: the voxels are the last bytes
    std::string data_file;                 // empty: the voxels follow the header
    std::vector<std::string> listed_files; // after "data file: LIST"
    size_t bytes = 0;                      // of the header with the empty line that ends it
    std::vector<Segment> segments;
    std::string modality; // the key "modality", as DICOM names it
};

// From the beginning of a file. An error begins with `name` and names the field; warnings are
// added for what is assumed.
Result<NrrdHeader> parse_nrrd_header(const std::string& name, std::string_view text,
                                     std::vector<std::string>& warnings);

// The files that a detached header names; empty where the voxels follow the header. An error names
// the header and a file that lies outside its folder, or does not exist.
Result<std::vector<std::filesystem::path>> nrrd_data_files(const std::filesystem::path& path,
                                                           const NrrdHeader& header);

} // namespace palpate::io
