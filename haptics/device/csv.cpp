#include "haptics/device/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

namespace palpate::haptics {

namespace {

constexpr size_t kMostLines = 50'000'000;
constexpr size_t kAbsent = ~size_t{0};

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t'))
        text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r'))
        text.remove_suffix(1);
    return text;
}

void split(std::string_view line, std::vector<std::string_view>& cells) {
    cells.clear();
    for (;;) {
        const size_t comma = line.find(',');
        cells.push_back(trimmed(line.substr(0, comma)));
        if (comma == std::string_view::npos)
            return;
        line.remove_prefix(comma + 1);
    }
}

// Finds the place of each wanted column among the cells of a line.
Result<std::vector<size_t>> read_names(const std::vector<std::string_view>& cells,
                                       std::span<const CsvColumn> columns,
                                       const std::string& where) {
    std::vector<size_t> at;
    for (const CsvColumn& column : columns) {
        const auto found = std::find(cells.begin(), cells.end(), column.name);
        if (found == cells.end() && column.required)
            return fail("{}: expected a column {}, found none", where, column.name);
        if (found != cells.end() && std::find(found + 1, cells.end(), column.name) != cells.end())
            return fail("{}: expected the column {} once, found it twice", where, column.name);
        at.push_back(found == cells.end() ? kAbsent : static_cast<size_t>(found - cells.begin()));
    }
    return at;
}

} // namespace

Result<void> read_csv(std::string_view text, const std::string& name,
                      std::span<const CsvColumn> columns,
                      const std::function<Result<void>(std::span<const double>, size_t)>& row) {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF"; // of spreadsheet programs
    if (text.starts_with(kByteOrderMark))
        text.remove_prefix(kByteOrderMark.size());
    std::vector<std::string_view> cells;
    std::vector<size_t> at;
    std::vector<double> values(columns.size());
    size_t width = 0, number = 0;
    while (!text.empty()) {
        const size_t end = text.find('\n');
        const std::string_view line = trimmed(text.substr(0, end));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        if (++number > kMostLines)
            return fail("{}: expected at most {} lines", name, kMostLines);
        if (line.empty() || line.front() == '#')
            continue;
        split(line, cells);
        if (width == 0) {
            PALPATE_TRY(at, read_names(cells, columns, fmt::format("{}:{}", name, number)));
            width = cells.size();
            continue;
        }
        if (cells.size() != width)
            return fail("{}:{}: expected {} values, found {}", name, number, width, cells.size());
        for (size_t c = 0; c < columns.size(); ++c) {
            values[c] = columns[c].otherwise;
            if (at[c] == kAbsent)
                continue;
            const std::string_view cell = cells[at[c]];
            const char* const last = cell.data() + cell.size();
            const auto [stop, error] = std::from_chars(cell.data(), last, values[c]);
            if (error != std::errc() || stop != last || !std::isfinite(values[c]))
                return fail("{}:{}: {}: expected a number, found '{}'", name, number,
                            columns[c].name, cell);
        }
        PALPATE_TRY(row(values, number));
    }
    if (width == 0)
        return fail("{}: expected a line of column names, found none", name);
    return {};
}

} // namespace palpate::haptics
