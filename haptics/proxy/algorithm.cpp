#include "haptics/proxy/algorithm.h"

namespace palpate::haptics {

namespace {

struct NoState {};

TickOutput untouched(NoState&, const TickInput& input) noexcept {
    return {.proxy = input.tool};
}

constexpr AlgorithmEntry kAlgorithms[] = {
    {"none", "nothing is felt: the proxy is the tool", false,
     make_algorithm_of<NoState, untouched>},
};

} // namespace

std::span<const AlgorithmEntry> algorithms() {
    return kAlgorithms;
}

const AlgorithmEntry* find_algorithm(std::string_view name) {
    for (const AlgorithmEntry& entry : kAlgorithms)
        if (name == entry.name)
            return &entry;
    return nullptr;
}

} // namespace palpate::haptics
