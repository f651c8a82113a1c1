#pragma once

#include <exception>
#include <string>
#include <string_view>
#include <type_traits>

#include "engine/base/error.h"

namespace palpate {

// An exception in words for a person: memory that ran out is called so.
std::string failure_text(const std::exception& error);
bool is_lack_of_memory(const std::exception& error);

// Does what gives a Result; an exception becomes its error, which names what was done.
template <class Do>
auto attempt(std::string_view what, Do&& act) -> std::invoke_result_t<Do> {
    try {
        return act();
    } catch (const std::exception& error) {
        return fail("{}: {}", what, failure_text(error));
    }
}

} // namespace palpate
