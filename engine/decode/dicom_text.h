#pragma once

#include <string>
#include <vector>

namespace palpate::io {

// Text of a data set as UTF-8. `sets` are the values of Specific Character Set (0008,0005; PS3.3
// C.12.1.1.2); the escape sequences of ISO 2022 are heeded as far as one set beside ASCII goes.
// Bytes that are no text in that set become question marks.
std::string utf8_of(const std::string& bytes, const std::vector<std::string>& sets);

} // namespace palpate::io
