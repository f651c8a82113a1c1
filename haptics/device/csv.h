#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace palpate::haptics {

struct CsvColumn {
    std::string_view name;
    bool required = true;
    double otherwise = 0.0; // its value where there is no such column
};

// Comma-separated numbers. The first line names the columns, in any order; others than those
// wanted, empty lines and lines that begin with # are passed over, as is a byte order mark. `row`
// gets the wanted values of each line, in the order of `columns`, all finite; the first error ends
// it. `name` is the file's, for messages. No line at all is an error. Refused: more than 50 million
// lines.
Result<void> read_csv(
    std::string_view text, const std::string& name, std::span<const CsvColumn> columns,
    const std::function<Result<void>(std::span<const double> values, size_t line)>& row);

} // namespace palpate::haptics
