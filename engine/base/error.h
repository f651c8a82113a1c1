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

// For functions that return a Result themselves: goes on with a value, or passes its error on.
//
//     PALPATE_TRY(save(path));                           // a Result whose value is not needed
//     PALPATE_TRY(const Scene scene, read_scene(path));  // declares `scene`
//     PALPATE_TRY(file.scene, read_scene(path));         // assigns; left as it was on an error
//
// The forms with a value are two statements: as the whole body of an `if` they need braces to
// compile. A comma outside parentheses ends an argument, so a type with one is written `auto`.
// All of it is one line for a debugger: a lambda of several lines is named before.
#define PALPATE_TRY(...) \
    PALPATE_TRY_PICK(__VA_ARGS__, PALPATE_TRY_VALUE, PALPATE_TRY_VOID, )(__VA_ARGS__)
#define PALPATE_TRY_PICK(first, second, form, ...) form
#define PALPATE_TRY_VOID(result)                           \
    do {                                                   \
        if (auto palpate_tried = (result); !palpate_tried) \
            return ::palpate::pass_on(palpate_tried);      \
    } while (false)
#define PALPATE_TRY_VALUE(target, result) \
    PALPATE_TRY_NAMED(PALPATE_TRY_JOIN(palpate_tried_, __LINE__), target, result)
#define PALPATE_TRY_NAMED(tried, target, result) \
    auto tried = result;                         \
    if (!tried)                                  \
        return ::palpate::pass_on(tried);        \
    target = std::move(*tried)
#define PALPATE_TRY_JOIN(a, b) PALPATE_TRY_JOINED(a, b)
#define PALPATE_TRY_JOINED(a, b) a##b
