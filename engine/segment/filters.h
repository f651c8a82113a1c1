#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/segment/brick_maker.h"

// The table of filters: what `palpate filter` and its help are made from. A new filter is one line
// in filters.cpp, or in label_filters.cpp where it takes labels.
namespace palpate {

struct FilterParameter {
    const char* name;
    const char* unit; // "mm", "HU", ..; empty for a plain number or a word
    double least = 0, most = 0;
    std::optional<double> preset{}; // absent: must be given
    // Names of the values 0, 1, .., separated by '|'; empty: a number.
    const char* words = "";
    bool whole = false; // a whole number
};

// The values of a filter's parameters, in their order, each in its range.
struct FilterValues {
    std::vector<double> numbers;
    std::string text;                                 // of a filter that takes one
    const std::map<std::string, Volume>* others = {}; // further volumes, by name; may be null
    // Labels of which a filter that changes a map neither takes a sample nor gives one more.
    std::vector<uint16_t> locked{};
    uint64_t memory_bytes = 0; // most of a result of another size (expect_memory()); 0: the default
};

struct Filter {
    const char* name;
    const char* purpose;
    const char* text; // the name of its one parameter, a text; empty where it takes numbers
    std::vector<FilterParameter> parameters;
    const char* type;   // of the result
    const char* memory; // beside the input and the result
    // One of the two. Filters with bricks() work on volumes larger than memory; the task is for
    // those that read the volume once before.
    Result<BrickMaker> (*bricks)(const Volume& volume, const FilterValues& values,
                                 const Task& task);
    Result<Volume> (*whole)(const Volume& volume, const FilterValues& values, const Task& task);
    // Its input is a label map: whole numbers 0 .. 65535, 0 is background. So is its result, unless
    // that is f32.
    bool takes_labels = false;
    // Its result is the map with some labels changed, so that others can be locked.
    bool changes_map = false;
};

std::span<const Filter> filters();
std::vector<Filter> label_filters(); // those of filters() that take labels
std::vector<Filter> click_filters(); // those that take a place

// The values in "1.5", "2,50" or "2,range=50": in the order of the parameters, or by name. Those
// left out have their preset. The error states the expected and the found text.
Result<FilterValues> read_filter_values(const Filter& filter, const std::string& text);
// The one of FilterValues::others that has that name.
Result<Volume> other_volume(const FilterValues& values, const std::string& name);
// Labels in "3" or "3,5", 1 .. 65535 each.
Result<std::vector<uint16_t>> read_locked_labels(const std::string& text);
Result<double> read_filter_value(const FilterParameter& parameter, const std::string& text);

// "SIGMA" or "SIGMA[,SECOND]", and "sigma: 0 .. 1000 mm; ..".
std::string filter_arguments(const Filter& filter);
std::string filter_ranges(const Filter& filter);

Result<Volume> run_filter(const Filter& filter, const Volume& volume, const FilterValues& values,
                          const Task& task); // as the table says; on the whole volume
// Whether a filter can leave labels as they are, where any are locked; else a sentence.
Result<void> check_locked(const Filter& filter, const FilterValues& values);

} // namespace palpate
