#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

struct AlgorithmEntry {
    const char* name;    // as --algorithm takes it: lower case, words joined by '-'
    const char* purpose; // one line, with the paper it is printed in
    bool as_printed;     // with the faults of the print; else repaired
    std::unique_ptr<Algorithm> (*make)();
    uint32_t bits = 0;     // Takes; 0: it feels nothing
    bool is_guide = false; // draws the hand by TouchScene::field[0] and holds it out of nothing

    bool takes(uint32_t what) const { return (bits & what) != 0; }
    bool feels() const { return bits != 0; }
};

// Every algorithm there is, in the order they are listed to people.
std::span<const AlgorithmEntry> algorithms();

// The names of those that take it, as people read them: "eriksson-2006* and swept-*". A star stands
// for the rest of two or more names, where all that begin so take it.
std::string takers_text(uint32_t what);

// Null where there is no such name.
const AlgorithmEntry* find_algorithm(std::string_view name);

} // namespace palpate::haptics
