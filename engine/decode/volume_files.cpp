#include "engine/decode/volume_files.h"

#include <string>

#include "engine/decode/meta_image_header.h"
#include "engine/decode/nrrd_header.h"
#include "engine/decode/slice_list.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

// The files that a header names; none where the voxels follow it, or where they cannot be used.
std::vector<fs::path> named_by(const fs::path& header) {
    const std::string extension = header.extension().string();
    const bool is_nrrd = extension == ".nhdr" || extension == ".nrrd";
    std::vector<std::string> ignored;
    if (!is_nrrd && extension != ".mhd" && extension != ".mha")
        return {};
    const Result<std::string> text = load_beginning(header.string());
    if (!text)
        return {};
    Result<std::vector<fs::path>> files;
    if (is_nrrd) {
        if (const auto found = parse_nrrd_header(header.string(), *text, ignored))
            files = nrrd_data_files(header, *found);
    } else if (const auto found = parse_meta_image_header(header.string(), *text, ignored)) {
        files = meta_image_data_files(header, *found);
    }
    return files.value_or(std::vector<fs::path>());
}

} // namespace

std::vector<fs::path> volume_files(const fs::path& path) {
    std::vector<std::string> ignored;
    if (is_pattern(path.filename().string())) {
        const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
        return files_matching(folder, path.filename().string(), ignored)
            .value_or(std::vector<fs::path>());
    }
    std::vector<fs::path> files{path};
    const std::vector<fs::path> named = named_by(path);
    files.insert(files.end(), named.begin(), named.end());
    return files;
}

} // namespace palpate::io
