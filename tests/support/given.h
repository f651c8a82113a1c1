#pragma once

#include <cstdlib>

namespace palpate {

// A number of a test's work from the environment, or the quick tests' number where it is not set.
// The tests labelled long are the same programs with larger numbers (LONG of palpate_test).
inline double given(const char* name, double quick) {
    const char* text = std::getenv(name);
    return text ? std::atof(text) : quick;
}

} // namespace palpate
