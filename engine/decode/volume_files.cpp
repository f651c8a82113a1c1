#include "engine/decode/volume_files.h"

#include <optional>
#include <string>

#include "engine/decode/meta_image_header.h"
#include "engine/decode/nrrd_header.h"
#include "engine/decode/nrrd_list.h"
#include "engine/decode/slice_list.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

// The file or list of files that a header names; empty where the voxels follow it.
std::string named_by(const fs::path& header) {
    const std::string extension = header.extension().string();
    const bool is_nrrd = extension == ".nhdr" || extension == ".nrrd";
    if (!is_nrrd && extension != ".mhd" && extension != ".mha")
        return {};
    const Result<std::string> text = load_beginning(header.string());
    if (!text)
        return {};
    std::vector<std::string> ignored;
    if (is_nrrd) {
        const Result<NrrdHeader> found = parse_nrrd_header(header.string(), *text, ignored);
        return found ? found->data_file : std::string();
    }
    const Result<MetaImageHeader> found = parse_meta_image_header(header.string(), *text, ignored);
    const bool beside = found && lower_case(found->data_file) != "local";
    return beside ? found->data_file : std::string();
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
    const std::string named = named_by(path);
    if (named.empty())
        return files;
    const Result<std::optional<std::vector<fs::path>>> list = nrrd_file_list(path, named);
    if (list && *list)
        files.insert(files.end(), (*list)->begin(), (*list)->end());
    else
        files.push_back(path.parent_path() / named);
    return files;
}

} // namespace palpate::io
