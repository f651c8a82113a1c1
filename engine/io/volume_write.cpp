#include <algorithm>
#include <cctype>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base/file.h"
#include "engine/io/brick_file.h"
#include "engine/io/output_file.h"
#include "engine/io/volume_headers.h"
#include "engine/io/volume_io.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

using io::OutputFile;
using io::VolumeHeader;

template <class T>
void reverse_words(std::vector<T>& values) {
    for (T& value : values) {
        const auto bytes = std::as_writable_bytes(std::span(&value, 1));
        std::reverse(bytes.begin(), bytes.end());
    }
}

// Row by row through the bricks; one slice at a time is held in memory.
template <class T>
Result<void> write_voxels(OutputFile& file, const std::string& name, const Volume& volume,
                          bool big_endian, const std::stop_token& stop) {
    const glm::uvec3 size = volume.size();
    std::vector<float> row(size.x);
    std::vector<T> slice;
    for (uint32_t z = 0; z < size.z; ++z) {
        if (stop.stop_requested())
            return fail("{}: writing was stopped", name);
        slice.clear();
        for (uint32_t y = 0; y < size.y; ++y) {
            read_row(volume, {0, y, z}, size.x, row.data());
            for (const float value : row)
                slice.push_back(static_cast<T>(value));
        }
        if (big_endian)
            reverse_words(slice);
        PALPATE_TRY(file.write(std::as_bytes(std::span(slice))));
    }
    return {};
}

Result<void> write_voxels(OutputFile& file, const std::string& name, const Volume& volume,
                          bool big_endian, const std::stop_token& stop) {
    return visit_scalar(volume.type(), [&](auto t) {
        return write_voxels<decltype(t)>(file, name, volume, big_endian, stop);
    });
}

// Header and voxels in one file.
Result<void> save_single(const fs::path& path, const Volume& volume, const VolumeHeader& header,
                         const std::stop_token& stop) {
    const std::string name = path.string();
    return write_atomically(path, [&](const fs::path& temporary) -> Result<void> {
        PALPATE_TRY(OutputFile file, OutputFile::create(temporary, name));
        if (header.packed == VolumeHeader::Packed::all)
            PALPATE_TRY(file.begin_packing());
        PALPATE_TRY(file.write(header.bytes));
        if (header.packed == VolumeHeader::Packed::voxels)
            PALPATE_TRY(file.begin_packing());
        PALPATE_TRY(write_voxels(file, name, volume, header.big_endian, stop));
        return file.finish();
    });
}

// A header and a file of voxels beside it. At no moment does a header lie beside voxels that are
// not its own: an old header goes before its voxels do, and the new one comes last.
Result<void> save_pair(const fs::path& path, const Volume& volume, const std::stop_token& stop,
                       const std::string& modality) {
    const fs::path raw = fs::path(path).replace_extension(".raw");
    PALPATE_TRY(const VolumeHeader header,
                io::meta_image_volume_header(path.string(), volume.grid(), volume.type(),
                                             raw.filename().string(), modality));
    return write_atomically(path, [&](const fs::path& temporary) -> Result<void> {
        PALPATE_TRY(OutputFile text, OutputFile::create(temporary, path.string()));
        PALPATE_TRY(text.write(header.bytes));
        PALPATE_TRY(text.finish());
        return write_atomically(raw, [&](const fs::path& temporary_raw) -> Result<void> {
            PALPATE_TRY(OutputFile file, OutputFile::create(temporary_raw, raw.string()));
            PALPATE_TRY(write_voxels(file, raw.string(), volume, false, stop));
            PALPATE_TRY(file.finish());
            std::error_code failed;
            fs::remove(path, failed);
            if (failed)
                return fail("{}: cannot be replaced: {}", path.string(), failed.message());
            return {};
        });
    });
}

// Has only capitals, digits and _, as modalities do: no such text breaks a header's line.
bool is_plain_word(const std::string& text) {
    return text.size() <= 16 && std::all_of(text.begin(), text.end(), [](unsigned char c) {
               return std::isupper(c) || std::isdigit(c) || c == '_';
           });
}

std::string lower_name(const fs::path& path) {
    std::string name = path.filename().string();
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return name;
}

} // namespace

Result<void> expect_volume_name(const fs::path& path) {
    const std::string name = lower_name(path);
    for (const std::string_view ending :
         {".nii", ".nii.gz", ".nrrd", ".mha", ".mhd", ".vtk", ".pbv"})
        if (name.ends_with(ending))
            return {};
    return fail(
        "{}: expected an extension .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk or .pbv, found \"{}\"",
        path.string(), path.extension().string());
}

Result<void> expect_format_holds(const fs::path& path, const Grid& grid) {
    PALPATE_TRY(expect_volume_name(path));
    const std::string name = lower_name(path);
    // The scalar type changes only the size of a header, not whether there is one.
    if (name.ends_with(".mha") || name.ends_with(".mhd"))
        PALPATE_TRY(io::meta_image_volume_header(path.string(), grid, ScalarType::u8, "LOCAL", {}));
    else if (name.ends_with(".vtk"))
        PALPATE_TRY(io::vtk_volume_header(path.string(), grid, ScalarType::u8));
    return {};
}

Result<void> save_volume(const fs::path& path, const Volume& volume, const std::stop_token& stop,
                         const std::string& given_modality) {
    PALPATE_TRY(expect_volume_name(path));
    const std::string name = lower_name(path);
    const Grid& grid = volume.grid();
    const std::string modality = is_plain_word(given_modality) ? given_modality : "";
    if (name.ends_with(".nii") || name.ends_with(".nii.gz")) {
        VolumeHeader header = io::nifti_volume_header(grid, volume.type());
        if (name.ends_with(".gz"))
            header.packed = VolumeHeader::Packed::all;
        return save_single(path, volume, header, stop);
    }
    if (name.ends_with(".nrrd"))
        return save_single(path, volume, io::nrrd_volume_header(grid, volume.type(), modality),
                           stop);
    if (name.ends_with(".mhd"))
        return save_pair(path, volume, stop, modality);
    if (name.ends_with(".pbv")) {
        BrickStream stream = stream_of(volume);
        stream.modality = modality;
        return save_brick_file(path, stream, {stop, {}});
    }
    PALPATE_TRY(const VolumeHeader header,
                name.ends_with(".mha") ? io::meta_image_volume_header(
                                             path.string(), grid, volume.type(), "LOCAL", modality)
                                       : io::vtk_volume_header(path.string(), grid, volume.type()));
    return save_single(path, volume, header, stop);
}

} // namespace palpate
