#pragma once

#include <span>

namespace palpate::view {

// The font file that the build has put into the program (apps/view/CMakeLists.txt); empty: none.
std::span<const unsigned char> letters_file();

} // namespace palpate::view
