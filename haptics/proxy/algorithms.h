#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

struct AlgorithmEntry {
    const char* name;    // as --algorithm takes it: lower case, words joined by '-'
    const char* purpose; // one line, with the paper it is printed in
    bool as_printed;     // with the faults of the print; else repaired
    std::unique_ptr<Algorithm> (*make)();
    bool is_guide = false; // draws the hand by TouchScene::field[0] and holds it out of nothing
};

// Every algorithm there is, in the order they are listed to people.
std::span<const AlgorithmEntry> algorithms();

// Null where there is no such name.
const AlgorithmEntry* find_algorithm(std::string_view name);

} // namespace palpate::haptics
