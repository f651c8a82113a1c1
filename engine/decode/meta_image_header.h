#pragma once

#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/io/decoder.h"

namespace palpate::io {

// The fields of a MetaImage header that say what the voxels are and where they lie, in LPS.
// Source: the MetaIO documentation of ITK (itk.org/Wiki/MetaIO/Documentation).
struct MetaImageHeader {
    ComponentType type{};
    std::vector<int64_t> sizes; // 1 to 16 axes, fastest first
    uint32_t components = 1;    // interleaved
    glm::dmat3 steps{1};        // columns: the step along each index axis, LPS mm
    glm::dvec3 origin{};        // LPS mm
    bool binary = true;
    bool big_endian = false;
    bool compressed = false; // one zlib stream
    int64_t header_size = 0; // bytes before the voxels in the data file; -1: voxels are the last
    Rescale rescale;
    std::string modality;                  // as DICOM names it
    std::string data_file;                 // "LOCAL": the voxels follow the header
    std::vector<std::string> listed_files; // after ElementDataFile = LIST
    size_t bytes = 0;                      // of the header with the line that names the data file

    bool is_local() const; // whether the voxels follow the header
};

// From the beginning of a file. An error begins with `name` and names the field; warnings are added
// for what is assumed.
Result<MetaImageHeader> parse_meta_image_header(const std::string& name, std::string_view text,
                                                std::vector<std::string>& warnings);

// The files that a header names; empty where the voxels follow it. A list has as many as its last
// axis has samples, or as "LIST 2D" says. An error names the header and what is wrong.
Result<std::vector<std::filesystem::path>> meta_image_data_files(const std::filesystem::path& path,
                                                                 const MetaImageHeader& header);

} // namespace palpate::io
