#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/decoder.h"

// The files of a slice sequence, and the sidecar that describes them.
namespace palpate::io {

constexpr const char* kSidecarName = "slices.json";

// The file of that name beside slices. Every key may be absent, except that slices without a header
// of their own (no PNG, TIFF, JPEG, BMP) need `pattern`, `size` and `type`:
//     pattern        names of the slices: "ct_%03d.png" (printf, one number) or "ct_*.png"
//     spacing_mm     [x, y, z] between sample centres; default 1 with a warning
//     origin_mm      [x, y, z] of the centre of the first sample, LPS; default 0
//     directions     [[x axis], [y axis], [z axis]], unit vectors in LPS; default the LPS axes
//     size           [columns, rows]
//     type           "u8" .. "f64"
//     endianness     "little" (default) or "big"
//     header_bytes   bytes to pass over at the beginning of each file, below 4 GiB; default 0
//     modality       as DICOM names it
// Other keys are errors, so that a misspelt one is not passed over.
struct SliceSidecar {
    std::optional<std::string> pattern;
    std::optional<glm::dvec3> spacing_mm;
    glm::dvec3 origin_mm{};
    glm::dmat3 directions{1};
    std::optional<glm::uvec2> size;
    std::optional<ComponentType> type;
    bool big_endian = false;
    uint64_t header_bytes = 0;
    std::string modality;
};

// An error names the file, the line and the key.
Result<SliceSidecar> load_sidecar(const std::filesystem::path& path);

// Whether a file name is a pattern: holds "*", "?" or a printf number such as "%03d".
bool is_pattern(const std::string& name);

// The files of `folder` that match, ordered by the numbers in their names ("s2" before "s10").
// Warns of numbers that are skipped. An error when none matches.
Result<std::vector<std::filesystem::path>> files_matching(const std::filesystem::path& folder,
                                                          const std::string& pattern,
                                                          std::vector<std::string>& warnings);

// The pictures of a folder, in the same order. An error when there are none, or of several kinds.
Result<std::vector<std::filesystem::path>> pictures_of(const std::filesystem::path& folder,
                                                       std::vector<std::string>& warnings);

// Runs of digits compare as numbers, the rest as characters.
bool natural_less(const std::string& a, const std::string& b);

} // namespace palpate::io
