#include "engine/base/failure.h"

#include <new>
#include <stdexcept>

namespace palpate {

std::string failure_text(const std::exception& error) {
    // Their own words are "std::bad_alloc" and "vector::reserve".
    if (dynamic_cast<const std::length_error*>(&error) ||
        dynamic_cast<const std::bad_array_new_length*>(&error))
        return "it asks for more memory than a program can have";
    return is_lack_of_memory(error) ? "there is not enough memory" : error.what();
}

bool is_lack_of_memory(const std::exception& error) {
    return dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
}

} // namespace palpate
