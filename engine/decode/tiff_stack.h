#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/decoder.h"

// The meaning of the pages of a TIFF, as ImageJ and OME state it in the description of the first
// page. Sources: ij.io.TiffEncoder and TiffDecoder of ImageJ 1; the OME-TIFF specification and the
// OME data model 2016-06 (docs.openmicroscopy.org).
namespace palpate::io {

struct TiffStack {
    uint32_t slices = 1, channels = 1, times = 1;
    // The page of slice z, channel c and time t: pages[z + slices * (c + channels * t)].
    std::vector<uint32_t> pages;
    // The file has one page, behind whose pixels those of all others follow without tags, in the
    // order of `pages`. The byte at which they begin.
    std::optional<uint64_t> raw_from;
    bool big_endian = false;
    std::optional<glm::dvec3> spacing_mm;
    std::optional<Rescale> rescale; // ImageJ's calibration by a straight line

    uint32_t frames() const { return channels * times; }
    // Whether the pages are the slices, one after another.
    bool is_plain(uint32_t found_pages) const;
    // "2 channels and 10 times"
    std::string words() const;
};

// Absent where the file states neither. `found_pages` is how many the file has. Metadata that do
// not fit the pages are a warning and left out; planes that lie in other files are refused by name.
Result<std::optional<TiffStack>> read_tiff_stack(const std::filesystem::path& path,
                                                 uint32_t found_pages,
                                                 std::vector<std::string>& warnings);

// The parts of it: they read what a description says of `found_pages` pages. For pictures of ImageJ
// the number of pixels in a unit along x and y, and the unit that the tags name (empty: none),
// stand in the tags.
struct ImageJResolution {
    std::optional<double> x, y;
    std::string unit;
};
std::optional<TiffStack> imagej_stack(const std::string& name, const std::string& description,
                                      const ImageJResolution& resolution, uint32_t found_pages,
                                      std::vector<std::string>& warnings);
Result<std::optional<TiffStack>> ome_stack(const std::filesystem::path& path,
                                           const std::string& description, uint32_t found_pages,
                                           std::vector<std::string>& warnings);

} // namespace palpate::io
