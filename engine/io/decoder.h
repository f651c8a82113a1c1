#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/io/dicom_parts.h"
#include "engine/io/label_names.h"
#include "engine/io/series_info.h"
#include "engine/volume/grid.h"

// Input and output of the decoder of a file format. Decoders run in the child process
// (engine/io/sandbox.h): they may crash, but must check all that they state.
namespace palpate::io {

// How one component of a voxel is stored in a file.
enum class ComponentType : uint8_t { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 };

constexpr size_t bytes_per_component(ComponentType type) {
    constexpr size_t bytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return bytes[static_cast<size_t>(type)];
}

// Calls visitor(T{}) with the C++ type that stores `type`, and returns what it returns.
template <class Visitor>
decltype(auto) visit_component(ComponentType type, Visitor&& visitor) {
    switch (type) {
        case ComponentType::u8:
            return visitor(uint8_t{});
        case ComponentType::i8:
            return visitor(int8_t{});
        case ComponentType::u16:
            return visitor(uint16_t{});
        case ComponentType::i16:
            return visitor(int16_t{});
        case ComponentType::u32:
            return visitor(uint32_t{});
        case ComponentType::i32:
            return visitor(int32_t{});
        case ComponentType::u64:
            return visitor(uint64_t{});
        case ComponentType::i64:
            return visitor(int64_t{});
        case ComponentType::f32:
            return visitor(float{});
        case ComponentType::f64:
            break;
    }
    return visitor(double{});
}

// "u8" .. "f64".
const char* name_of(ComponentType type);

// One entry of a format's table of types: the name or number that stands for one.
template <class Key>
struct TypeKey {
    Key key;
    ComponentType type;
};
template <class Key, size_t N>
std::optional<ComponentType> find_type(const TypeKey<Key> (&table)[N], Key key) {
    for (const TypeKey<Key>& entry : table)
        if (entry.key == key)
            return entry.type;
    return std::nullopt;
}

struct DecodeRequest {
    std::filesystem::path path; // file, folder or pattern
    std::optional<uint32_t> frame;
    std::optional<std::string> series;
    bool resample_slices = false; // DICOM: to even spacing, without shear
    bool middle_image = false;    // DICOM: that one of the series alone
    bool reference = false;       // DICOM: what objects made from the series take over; no voxels
    // DICOM structure sets: the series on whose grid contours become labels; empty: none.
    std::filesystem::path onto{};
    std::optional<std::string> onto_series{};
    // DICOM: files in which a reader has died, to be passed over with a warning. Others do not heed
    // it.
    std::vector<std::filesystem::path> without{};
};

// physical value = slope * stored value + intercept, computed in double by the parent.
struct Rescale {
    double slope = 1;
    double intercept = 0;

    friend bool operator==(const Rescale&, const Rescale&) = default;
};

// Stored values, both ends included, that stand for no data: the padding of DICOM images. Holds
// nothing by default.
struct StoredRange {
    double low = 1;
    double high = 0;

    bool holds(double value) const { return value >= low && value <= high; }
    friend bool operator==(const StoredRange&, const StoredRange&) = default;
};

// The result of a decoder beside the voxels in the sink. `grid` must have the claimed size.
struct Decoded {
    Grid grid;                    // world_from_index in LPS millimetres, for voxels in stored order
    std::vector<Rescale> rescale; // empty: none; one: for all; grid.size.z of them: one per slice
    // Padding of values, not of labels: empty: none; else grid.size.z of them, one per slice.
    std::vector<StoredRange> padding;
    bool inverted = false; // small values are meant to be bright (DICOM's MONOCHROME1)
    std::string modality;
    std::vector<std::string> warnings; // sentences, which name the file where there are several
    std::vector<std::string> notes;
    std::vector<SeriesInfo> series;      // DICOM: all of them, where a list is of use
    std::vector<LabelName> labels;       // names and colours of labels
    std::string frame_of_reference;      // DICOM: UID
    std::optional<DicomParts> reference; // DICOM: where it was asked for; there are no voxels then
    bool heeded_resample_slices = false; // in the child: the request was acted upon or answered
};

// The claim of a header, before any memory is taken for it.
struct VoxelClaim {
    glm::uvec3 size{};
    ComponentType type{};
    uint32_t components = 1;     // interleaved; the parent refuses what it cannot show
    uint64_t source_bytes = 0;   // bytes of the file (or files) that hold these voxels
    double most_expansion = 1.0; // voxel bytes that one source byte can stand for: 1 for raw
    uint64_t working_bytes = 0;  // memory the decoder needs beside the voxels
};

constexpr double kRawExpansion = 1.0;
constexpr double kDeflateExpansion = 1032.0; // the format's bound, zlib "Technical Details"

// The shared memory that takes the voxels. One per decode.
class VoxelSink {
 public:
    // `memory_fd` is resized by allocate(); `report_fd` takes messages for the parent, or is -1.
    VoxelSink(int memory_fd, int report_fd, uint64_t max_bytes);
    ~VoxelSink();
    VoxelSink(const VoxelSink&) = delete;
    VoxelSink& operator=(const VoxelSink&) = delete;

    // Checks the claim against the source and against the limit, raises this process's own memory
    // limit by it, and returns zeroed memory of exactly the claimed bytes: native byte order,
    // x fastest, components interleaved. An error states both numbers and begins with `name`.
    // Called again, it takes the place of what was allocated before.
    Result<std::span<std::byte>> allocate(const std::string& name, const VoxelClaim& claim);

    // Raises this process's own memory limit by what reading a header needs, for formats whose
    // header is as long as the file. An error, as above, beyond the limit for all.
    Result<void> reserve(const std::string& name, uint64_t bytes);

    // Tells the parent that work goes on, so that it waits; once per file of a series, say, which
    // is then named, or passed over, should the reader crash in it.
    void alive(const std::filesystem::path& file = {}) const;

    const std::optional<VoxelClaim>& claim() const { return claim_; }

 private:
    int memory_fd_, report_fd_;
    uint64_t max_bytes_;
    std::optional<VoxelClaim> claim_;
    std::span<std::byte> voxels_;
};

// The bytes a claim stands for; absent when a size is 0 or the product passes 2^62.
std::optional<uint64_t> claimed_bytes(const VoxelClaim& claim);

// The frame to read of a file that has `frames` (>= 1): the one asked for, else 0 with a warning
// when there are others. An error names the file when there is no such frame.
Result<uint32_t> choose_frame(const DecodeRequest& request, uint32_t frames,
                              std::vector<std::string>& warnings);

// The file that a header names, when it lies in the header's folder or below it; links are
// followed. An error names both files else, or when it does not exist.
Result<std::filesystem::path> file_beside(const std::filesystem::path& header,
                                          const std::string& name);

// Refuses what is not a regular file (a pipe would block for ever); returns the size in bytes.
Result<uint64_t> regular_file_bytes(const std::filesystem::path& path);

} // namespace palpate::io
