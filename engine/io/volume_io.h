#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/memory.h"
#include "engine/io/label_names.h"
#include "engine/io/series_info.h"
#include "engine/volume/volume.h"

namespace palpate {

struct ReadOptions {
    // Upper bound for everything loading needs at once: the file's voxels as they are decoded, and
    // the volume made from them.
    uint64_t max_memory_bytes = physical_memory_bytes() / 4 * 3;

    std::optional<uint32_t> frame; // of a 4-D file; absent: frame 0, with a warning if others
    // DICOM: series instance UID, number in the list of series (from 1), or part of the
    // description; absent: the series with the most images.
    std::optional<std::string> series;

    // DICOM: unevenly spaced or sheared (gantry tilt) slices are interpolated linearly to even
    // spacing along their normal, with a warning that says so. Absent, uneven ones are refused.
    bool resample_slices = false;

    // Seconds of processor time that reading may take without progress, beside 1 s for each 20 MB
    // of the file and, once their number is known, 1 s for each 4 MB of voxels. Ten times as much
    // wall clock is allowed.
    double max_quiet_s = 1.0;

    // Brick files: bytes of samples kept in memory beside those in use; at most half of
    // max_memory_bytes.
    uint64_t brick_cache_bytes = uint64_t{512} << 20;

    // DICOM: the image in the middle of the series alone, as one slice, for a preview. Of a
    // segmentation, and of other formats, all is read.
    bool middle_image = false;

    std::stop_token stop; // asked to stop, loading ends with an error
    // Told while voxels are decoded: their share, 0 .. 1. From the caller's thread. May be empty.
    std::function<void(double share)> progress{};
};

// A volume read from a file, with messages for people.
struct LoadedVolume {
    Volume volume;
    std::vector<std::string> warnings; // sentences: what was assumed, lost or odd
    std::vector<std::string> notes;    // sentences: how frames were ordered, and the like
    std::string modality;              // as DICOM names it: "CT", "MR"; empty where unknown
    std::vector<Volume> coarser;       // of a brick file: levels 1, 2, .., each half as fine
    std::vector<LabelName> labels;     // of a label map that names them, such as a DICOM SEG
    bool inverted = false;             // small values are meant to be bright (DICOM's MONOCHROME1)
    std::vector<SeriesInfo> series{};  // of a DICOM folder
    std::string frame_of_reference{};  // UID, of DICOM images and segmentations that state one
};
// A line for each series, and the notes.
std::vector<std::string> all_notes(const LoadedVolume& loaded);

// Reads a volume: a file, a folder (DICOM series, also in folders below it, or slices) or a slice
// pattern ("ct_%03d.png", "ct_*.png").
//
// Voxels keep the order in which they are stored; world_from_index says where they lie, in LPS
// millimetres. Values are physical (HU for CT): the smallest of u8, i8, u16, i16 and f32 that holds
// every one exactly; where none does, f32, and a warning states the largest rounding. NaN and
// infinities are no-data, counted in a warning; so is the padding of DICOM images, counted in a
// note.
//
// A brick file (engine/io/brick_file.h) is opened, and its samples are fetched as they are read; a
// reader that meets a damaged one gets a SourceError.
//
// Any other file is decoded in a child process with limits on memory and time (docs/decisions), so
// that a damaged file ends in an error, whatever the libraries that read it do. An error names the
// file.
Result<LoadedVolume> load_volume(const std::filesystem::path& path,
                                 const ReadOptions& options = {});

// The same for label maps: every value must be a whole number in 0 .. 65535, of whatever type; the
// volume is u8 where the largest is at most 255, else u16. Refused else, with the offending value.
Result<LoadedVolume> load_labels(const std::filesystem::path& path,
                                 const ReadOptions& options = {});

// Writes a volume in the format its extension names: .nii, .nii.gz, .nrrd, .mha, .mhd (with a .raw
// beside it), .vtk (structured points) or .pbv (brick file). The voxels keep their order and type;
// no-data is NaN. What a format cannot hold is refused: shear by MetaImage, turned axes by VTK.
//
// The file appears whole or not at all, also when `stop` asks to end early. `modality`, as of
// LoadedVolume, is kept by .nrrd (key "modality"), .mha, .mhd and .pbv; the others have no place
// for it. One of other characters than capitals, digits and _ is left out.
Result<void> save_volume(const std::filesystem::path& path, const Volume& volume,
                         const std::stop_token& stop = {}, const std::string& modality = {});
// The same errors before long work: whether there is a format of that name, and whether it holds
// volumes that lie on a grid.
Result<void> expect_volume_name(const std::filesystem::path& path);
Result<void> expect_format_holds(const std::filesystem::path& path, const Grid& grid);

} // namespace palpate
