#include "engine/decode/overlap_words.h"

#include <fmt/format.h>

namespace palpate::io {

std::string overlap_words(const Overlaps& overlaps,
                          const std::function<std::string(uint32_t)>& words) {
    constexpr size_t kMostPairs = 8;
    std::string pairs;
    size_t listed = 0;
    for (const auto& [pair, samples] : overlaps)
        if (listed++ < kMostPairs)
            pairs += fmt::format("{}{} and {} in {} samples", pairs.empty() ? "" : ", ",
                                 words(pair.first), words(pair.second), samples);
    if (listed > kMostPairs)
        pairs += fmt::format(", and {} more pairs", listed - kMostPairs);
    return pairs;
}

} // namespace palpate::io
