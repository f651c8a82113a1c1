#include <cctype>
#include <exception>
#include <fstream>

#include "engine/io/decoder.h"
#include "engine/io/formats.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr size_t kHeadBytes = 1024;

constexpr std::array<Format, 0> kFormats{};

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
