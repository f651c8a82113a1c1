#include "engine/program/named_files.h"

#include <algorithm>
#include <filesystem>

#include "engine/base/writable.h"

namespace palpate {

namespace {

namespace fs = std::filesystem;

bool is_written(const NamedFile& file) {
    return file.use != FileUse::read;
}

// Whether two names lead to one place on disk, be it there or not.
bool is_same_file(const std::string& a, const std::string& b) {
    std::error_code ignored;
    return fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored) ||
           fs::equivalent(a, b, ignored);
}

// Whether a file is there and lies in a folder or below it.
bool lies_in(const std::string& file, const std::string& folder) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored) || !fs::exists(file, ignored))
        return false;
    const fs::path inner = fs::weakly_canonical(file, ignored),
                   outer = fs::weakly_canonical(folder, ignored);
    return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first ==
           outer.end();
}

Result<void> expect_apart(const NamedFile& written, const NamedFile& other, const NamedFile& first,
                          const NamedFile& second) {
    if (written.path == "-" && is_written(other) && other.path == "-")
        return fail("{} and {}: expected one of them on standard output, found '-' for both",
                    first.option, second.option);
    if (written.path == "-" || (is_written(other) && other.path == "-"))
        return {};
    if (is_same_file(written.path, other.path))
        return fail("{} and {}: expected a file for each, found '{}' for both", first.option,
                    second.option, first.path);
    if (!is_written(other) && lies_in(written.path, other.path))
        return fail(
            "{} and {}: expected a new file or one outside the folder '{}' that is read, found "
            "'{}' in it",
            first.option, second.option, other.path, written.path);
    return {};
}

} // namespace

Result<void> each_its_own(std::span<const NamedFile> files) {
    for (const NamedFile& file : files)
        if (file.use == FileUse::write && file.path == "-")
            return fail("{}: expected the name of a file, found '-'", file.option);
    for (size_t i = 0; i < files.size(); ++i)
        for (size_t j = i + 1; j < files.size(); ++j) {
            const NamedFile &a = files[i], &b = files[j];
            if (a.path.empty() || b.path.empty() || !(is_written(a) || is_written(b)))
                continue;
            if (is_written(a) && is_written(b) && a.option == b.option)
                continue; // the pictures of one name
            const bool a_is_written = is_written(a);
            PALPATE_TRY(expect_apart(a_is_written ? a : b, a_is_written ? b : a, a, b));
        }
    return {};
}

Result<void> all_can_be_written(std::span<const NamedFile> files) {
    for (const NamedFile& file : files)
        if (is_written(file) && !file.makes_folder && !file.path.empty() && file.path != "-")
            PALPATE_TRY(expect_writable(file.path));
    return {};
}

} // namespace palpate
