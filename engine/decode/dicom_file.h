#pragma once

#include <map>
#include <span>
#include <string_view>

#include "engine/decode/dicom_stack.h"

// One DICOM file, read through GDCM.
namespace palpate::io {

// How a segmentation (SEG) stores its segments, PS3.3 C.8.20.2.
enum class SegmentationKind {
    binary,     // one bit a sample; each frame belongs to one segment
    fractional, // a share of the largest value; each frame belongs to one segment
    label_map,  // the numbers of segments
};

struct Segmentation {
    SegmentationKind kind{};
    uint32_t largest_fraction = 1;
    std::vector<LabelName> segments;
    // The labels of segments by their numbers, where Palpate wrote them; empty: they are the same.
    std::map<uint32_t, uint32_t> label_of;
};

// The header of a file, without its pixels.
struct DicomFile {
    std::filesystem::path path;
    std::vector<DicomFrame> frames;   // in the order in which the file stores them; one or more
    ComponentType type{};             // of the stored samples; u8 where they are bits
    uint32_t bits_allocated = 0;      // for a sample: 1, 8, 16 or 32; 64 of doubles
    uint32_t bits_stored = 0;         // the sample's low bits that count, once shifted down
    uint32_t high_bit = 0;            // the highest of them
    double most_expansion = 1.0;      // of the pixel data's encoding, see VoxelClaim
    uint64_t bytes = 0;               // of the file
    uint16_t pixel_element = 0x0010;  // (7fe0,xxxx): Pixel Data, or floating-point ones
    uint64_t pixels_at = 0;           // the byte at which the pixel data begins
    std::string syntax;               // UID of the transfer syntax
    uint64_t deflated_at = 0;         // the byte at which a deflated data set begins; 0: none does
    bool encapsulated = false;        // the pixels are encoded, in items
    std::optional<glm::uvec2> mosaic; // size of the whole image where frames are tiles of one
    std::optional<Segmentation> segmentation;
    std::string refusal; // "is a ..": why the object is not read; frames then hold one without size
    std::vector<std::string> warnings;
};

// Whether a file begins as DICOM files do, or has an extension of theirs (lower case, with the
// dot).
bool looks_like_dicom(std::string_view bytes, const std::string& extension);

// An error where the file is no DICOM file, or a damaged one. Objects that hold no image that can
// be read are no error: `refusal` says what they are.
Result<DicomFile> read_dicom_header(const std::filesystem::path& path);

// The samples of every frame, in native byte order; exactly as many bytes as the header claims.
// Signed samples are extended from the bits that are stored.
Result<std::vector<char>> read_dicom_pixels(const DicomFile& file);

// The pixel data as stored, of a file that is not encapsulated.
Result<std::vector<char>> read_dicom_bytes(const DicomFile& file);

} // namespace palpate::io
