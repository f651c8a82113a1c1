#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

// The data files that headers of NRRD and MetaImage name: one, a list, or a pattern.
namespace palpate::io {

// A printf pattern with one number, and the whole numbers that follow it: "slice %03d.raw 1 93 1"
// is "slice %03d.raw" and 1, 93, 1. The pattern holds exactly one "%d" or "%0Nd".
struct FilePattern {
    std::string pattern;
    std::vector<int64_t> numbers; // at most `most_numbers`
};

// Absent where a text has no such form; names may hold spaces.
std::optional<FilePattern> file_pattern(std::string_view text, size_t most_numbers);

// The names of a pattern for the numbers from `first` to `last` by `step`, in either direction. An
// error begins with the header's name.
Result<std::vector<std::string>> names_of(const std::filesystem::path& header,
                                          const std::string& pattern, int64_t first, int64_t last,
                                          int64_t step);

// The files of names; all lie beside the header or below it. An error where there is none, or one
// that cannot be used.
Result<std::vector<std::filesystem::path>> files_of(const std::filesystem::path& header,
                                                    const std::vector<std::string>& names);

// How many files a list must have, each of which holds the first `dimensions` axes: the product of
// the other sizes, 2^31 at the most.
uint64_t files_for(const std::vector<int64_t>& sizes, size_t dimensions);

// Whether a field names a list: "LIST" alone or with a number of dimensions ("LIST 2", "LIST 2D").
bool is_list_mark(std::string_view field);

// The lines of `text` up to an empty one, without white space at their ends.
std::vector<std::string> names_in(std::string_view text);

} // namespace palpate::io
