#include <cctype>
#include <exception>
#include <fstream>

#include "engine/io/decoder.h"
#include "engine/io/formats.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr size_t kHeadBytes = 1024;

bool is_dicom(const FileHead& head) {
    if (head.bytes.size() >= 132 && head.bytes.compare(128, 4, "DICM") == 0)
        return true;
    if (head.extension == ".dcm" || head.extension == ".ima" || head.extension == ".dicom")
        return true;
    // Without the preamble a data set begins with a small element of group 0008, little-endian.
    const std::string_view bytes = head.bytes;
    return bytes.size() >= 8 && bytes.starts_with(std::string_view("\x08\0", 2)) && bytes[3] == 0;
}

std::string lower_extension(const fs::path& path) {
    std::string name = path.filename().string();
    for (char& c : name)
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (name.ends_with(".nii.gz"))
        return ".nii.gz";
    return fs::path(name).extension().string();
}

FileHead head_of(const fs::path& path) {
    FileHead head{path, lower_extension(path), {}};
    if (fs::is_regular_file(path)) {
        head.bytes.resize(kHeadBytes);
        std::ifstream in(path, std::ios::binary);
        in.read(head.bytes.data(), kHeadBytes);
        head.bytes.resize(static_cast<size_t>(in.gcount()));
    }
    return head;
}

Result<Decoded> decode_folder(const DecodeRequest& request, VoxelSink& sink) {
    return decode_dicom(request, sink);
}

// The first that recognises a file decodes it. What is told by content comes before what is told
// by name alone.
constexpr Format kFormats[] = {
    {"a folder", [](const FileHead& head) { return fs::is_directory(head.path); }, decode_folder},
    {"DICOM", is_dicom, decode_dicom},
};

} // namespace

Result<Decoded> decode_any(const DecodeRequest& request, VoxelSink& sink) {
    const FileHead head = head_of(request.path);
    for (const Format& format : kFormats) {
        if (!format.recognises(head))
            continue;
        try {
            return format.decode(request, sink);
        } catch (const std::exception& error) {
            return fail("{}: cannot be read as {}: {}", request.path.string(), format.name,
                        error.what());
        }
    }
    return fail("{}: is in no format that can be read", request.path.string());
}

} // namespace palpate::io
