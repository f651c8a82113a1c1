#pragma once

#include <span>

namespace palpate::view {

// The font files that the build has put into the program (apps/view/CMakeLists.txt); empty: none.
std::span<const unsigned char> letters_file(); // Noto Sans
std::span<const unsigned char> bold_file();    // Noto Sans, bold
std::span<const unsigned char> icons_file();   // Material Design Icons

} // namespace palpate::view
