#include "apps/view/drawing/letters.h"

namespace palpate::view {

std::span<const unsigned char> letters_file() {
    return {};
}

} // namespace palpate::view
