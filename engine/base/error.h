#pragma once

#include <fmt/format.h>

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace palpate {

// An error of the outside world: a file, a header, an argument.
//
// `message` is one sentence without a final line break. It names the file or key, what was
// expected and what was found, so that a person can act on it without reading code.
struct Error {
    std::string message;
};

// A value, or the reason why there is none. Faults of this code are PALPATE_ASSERT instead;
// failures of the graphics device are exceptions (engine/gpu/error.h).
template <class T>
using Result = tl::expected<T, Error>;

// return fail("{}: expected {} bytes, found {}", path, expected, found);
template <class... Args>
[[nodiscard]] tl::unexpected<Error> fail(fmt::format_string<Args...> format, Args&&... args) {
    return tl::unexpected<Error>(Error{fmt::format(format, std::forward<Args>(args)...)});
}

// Passes the error of another Result on: return pass_on(result);
template <class T>
[[nodiscard]] tl::unexpected<Error> pass_on(Result<T>& result) {
    return tl::unexpected<Error>(std::move(result.error()));
}

} // namespace palpate
