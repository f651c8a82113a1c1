#include <algorithm>
#include <cctype>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base/file.h"
#include "engine/io/brick_file.h"
#include "engine/io/labels_write.h"
#include "engine/io/output_file.h"
#include "engine/io/volume_headers.h"
#include "engine/io/volume_io.h"
#include "engine/scene/scene.h"

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

// Text between tags, or in quotes, of XML; what XML 1.0 has no place for is left out.
std::string xml_text(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '&')
            out += "&amp;";
        else if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else if (c == '"')
            out += "&quot;";
        else if (static_cast<unsigned char>(c) >= 0x20)
            out += c;
    }
    return out;
}

std::string one_line(std::string text) {
    std::erase_if(text, [](char c) { return static_cast<unsigned char>(c) < 0x20; });
    return text;
}

glm::dvec3 color_of(const LabelName& label) {
    return label.color.value_or(style_of(LabelLayer(), label.label).color);
}

// The extension of code 30 behind a header of NIfTI, whose voxels begin that much later.
void add_label_table(VolumeHeader& header, std::span<const LabelName> names) {
    constexpr int32_t kCaret = 30;
    std::string xml =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<CaretExtension><VolumeInformation "
        "Index=\"0\"><LabelTable><Label Key=\"0\" Red=\"0\" Green=\"0\" Blue=\"0\" "
        "Alpha=\"0\">background</Label>\n";
    for (const LabelName& label : names) {
        const glm::dvec3 c = color_of(label);
        xml += fmt::format(
            "<Label Key=\"{}\" Red=\"{:.6g}\" Green=\"{:.6g}\" Blue=\"{:.6g}\" "
            "Alpha=\"1\">{}</Label>\n",
            label.label, c.x, c.y, c.z, xml_text(label.name));
    }
    xml +=
        "</LabelTable><StudyMetaDataLinkSet></StudyMetaDataLinkSet><VolumeType>Label"
        "</VolumeType></VolumeInformation></CaretExtension>";
    const size_t size = (xml.size() + 8 + 15) / 16 * 16;
    xml.resize(size - 8, '\0');
    const auto put = [&](size_t at, auto value) {
        std::memcpy(&header.bytes[at], &value, sizeof value); // little-endian, as the header is
    };
    const bool second = header.bytes.size() > 540; // NIfTI-2: 540 bytes, and four flags
    const size_t flags = header.bytes.size() - 4;
    if (second)
        put(168, static_cast<int64_t>(header.bytes.size() + size));
    else
        put(108, static_cast<float>(header.bytes.size() + size));
    header.bytes[flags] = 1;
    const size_t begin = header.bytes.size();
    header.bytes.resize(begin + 8);
    put(begin, static_cast<int32_t>(size));
    put(begin + 4, kCaret);
    header.bytes += xml;
}

// Before the empty line that ends a header of NRRD.
void add_segments(VolumeHeader& header, std::span<const LabelName> names) {
    std::string keys;
    for (size_t i = 0; i < names.size(); ++i) {
        const glm::dvec3 c = color_of(names[i]);
        keys += fmt::format(
            "Segment{0}_ID:=Segment_{1}\nSegment{0}_Name:={2}\nSegment{0}_NameAutoGenerated:=0\n"
            "Segment{0}_Color:={3:.6g} {4:.6g} {5:.6g}\nSegment{0}_ColorAutoGenerated:=0\n"
            "Segment{0}_LabelValue:={1}\nSegment{0}_Layer:=0\n",
            i, names[i].label, one_line(names[i].name), c.x, c.y, c.z);
    }
    header.bytes.insert(header.bytes.size() - 1, keys);
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

bool holds_label_names(const fs::path& path) {
    const std::string name = lower_name(path);
    return name.ends_with(".nii") || name.ends_with(".nii.gz") || name.ends_with(".nrrd");
}

Result<void> save_labels(const fs::path& path, const Volume& labels,
                         std::span<const LabelName> names, const std::stop_token& stop) {
    const std::string name = lower_name(path);
    if (names.empty() || !holds_label_names(path))
        return save_volume(path, labels, stop);
    if (name.ends_with(".nrrd")) {
        VolumeHeader header = io::nrrd_volume_header(labels.grid(), labels.type(), "");
        add_segments(header, names);
        return save_single(path, labels, header, stop);
    }
    VolumeHeader header = io::nifti_volume_header(labels.grid(), labels.type());
    add_label_table(header, names);
    if (name.ends_with(".gz"))
        header.packed = VolumeHeader::Packed::all;
    return save_single(path, labels, header, stop);
}

} // namespace palpate
