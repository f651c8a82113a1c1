#include "engine/decode/file_list.h"
#include "engine/decode/nrrd_header.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

// A list of data files, and how many axes each holds; without the latter any even share.
struct Named {
    std::vector<std::string> names;
    std::optional<int64_t> dimensions;
};

Result<Named> named_files(const fs::path& path, const NrrdHeader& header) {
    if (is_list_mark(header.data_file)) {
        Named named{header.listed_files, {}};
        if (const auto words = words_of(header.data_file); words.size() > 1)
            named.dimensions = parse_integer(words[1]).value_or(0);
        return named;
    }
    const std::optional<FilePattern> pattern = file_pattern(header.data_file, 4);
    if (!pattern || pattern->numbers.size() < 3)
        return fail(
            "{}: expected one data file, \"LIST\" or \"name.%d first last step\", found another "
            "list of them (\"{}\")",
            path.string(), header.data_file.substr(0, 80));
    const std::vector<int64_t>& numbers = pattern->numbers;
    Named named;
    PALPATE_TRY(named.names, names_of(path, pattern->pattern, numbers[0], numbers[1], numbers[2]));
    if (numbers.size() > 3)
        named.dimensions = numbers[3];
    return named;
}

} // namespace

Result<std::vector<fs::path>> nrrd_data_files(const fs::path& path, const NrrdHeader& header) {
    std::vector<fs::path> files;
    if (header.data_file.empty())
        return files;
    if (!is_list_mark(header.data_file) && header.data_file.find('%') == std::string::npos) {
        PALPATE_TRY(files.emplace_back(), file_beside(path, header.data_file));
        return files;
    }
    PALPATE_TRY(const Named named, named_files(path, header));
    std::vector<int64_t> sizes;
    for (const NrrdHeader::Axis& axis : header.axes)
        sizes.push_back(axis.size);
    const auto count = static_cast<int64_t>(sizes.size());
    if (named.dimensions && (*named.dimensions < 1 || *named.dimensions > count))
        return fail("{}: expected data files of 1 to {} dimensions, found \"{}\"", path.string(),
                    count, header.data_file.substr(0, 80));
    // Files of as many dimensions as the whole share its last axis.
    if (const auto each = named.dimensions.value_or(count); each < count)
        if (const uint64_t wanted = files_for(sizes, static_cast<size_t>(each));
            wanted != named.names.size())
            return fail("{}: expected {} data files of {} dimensions in the list of them, found {}",
                        path.string(), wanted, each, named.names.size());
    return files_of(path, named.names);
}

} // namespace palpate::io
