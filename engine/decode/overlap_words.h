#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

namespace palpate::io {

// How many samples two segments share, by a number of each.
using Overlaps = std::map<std::pair<uint32_t, uint32_t>, uint64_t>;

// "1 'Liver' and 2 in 5 samples, ..": the first eight pairs by the words of their numbers, and how
// many more there are.
std::string overlap_words(const Overlaps& overlaps,
                          const std::function<std::string(uint32_t)>& words);

} // namespace palpate::io
