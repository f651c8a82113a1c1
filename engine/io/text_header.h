#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

// Text headers, for the readers of NRRD and MetaImage.
namespace palpate::io {

// No header of these formats is longer.
constexpr size_t kMostHeaderBytes = 1 << 20;

// The first kMostHeaderBytes of a file, or fewer.
Result<std::string> load_beginning(const std::string& path);

// Takes the next line off `text`, without its line end (\n or \r\n); absent when none is complete.
std::optional<std::string_view> take_line(std::string_view& text);

std::string_view trimmed(std::string_view text);
std::string lower_case(std::string_view text);

// Words apart by white space.
std::vector<std::string_view> words_of(std::string_view text);

// The whole text as one number; absent otherwise.
std::optional<double> parse_double(std::string_view text);
std::optional<int64_t> parse_integer(std::string_view text);

// As many numbers as there are words; absent when one is none.
std::optional<std::vector<double>> parse_doubles(std::string_view text);
std::optional<std::vector<int64_t>> parse_integers(std::string_view text);

} // namespace palpate::io
