#include "apps/view/document/free_name.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>

namespace palpate::view {

namespace fs = std::filesystem;

namespace {

std::string lower(std::string text) {
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

// ".nii.gz" of "labels.nii.gz"
std::string ending_of(const fs::path& name) {
    const std::string last = name.extension().string();
    return lower(last) == ".gz" ? name.stem().extension().string() + last : last;
}

bool is_free(const fs::path& path, const std::string& ending) {
    std::error_code error; // of a name that cannot be looked up: writing tells the reason
    if (fs::exists(fs::symlink_status(path, error)))
        return false;
    return lower(ending) != ".mhd" || !fs::exists(fs::path(path).replace_extension(".raw"), error);
}

} // namespace

fs::path free_name(const fs::path& name, uint32_t number) {
    if (!name.has_filename())
        return name;
    const std::string ending = ending_of(name), whole = name.filename().string();
    const std::string stem = whole.substr(0, whole.size() - ending.size());
    fs::path path = name;
    do {
        if (number > 0)
            path.replace_filename(fmt::format("{}-{}{}", stem, number, ending));
        ++number;
    } while (!is_free(path, ending));
    return path;
}

std::string file_word(std::string name) {
    for (char& letter : name) // what folders and shells have a use for
        if (static_cast<unsigned char>(letter) < 0x80 && letter != '-' &&
            !std::isalnum(static_cast<unsigned char>(letter)))
            letter = '_';
    return name;
}

std::string followed_name(const std::string& typed, const std::string& proposed,
                          const std::string& name) {
    const fs::path now = typed;
    if (now.empty())
        return name;
    return now.filename() == proposed ? (now.parent_path() / name).string() : typed;
}

} // namespace palpate::view
