#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

// Messages for people, on standard error, one line each, with control characters escaped
// (engine/base/printable.h). Data goes to standard output and never through here.
namespace palpate::log {

enum class Level { debug, info, warning, error }; // of a message, rising

// Messages below `level` are dropped. The default is Level::info.
void set_level(Level level);

void write(Level level, const std::string& message); // one sentence, without a line break

template <class... Args> // The levels by name, formatted as fmt::format() does.
void debug(fmt::format_string<Args...> format, Args&&... args) {
    write(Level::debug, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void info(fmt::format_string<Args...> format, Args&&... args) {
    write(Level::info, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void warning(fmt::format_string<Args...> format, Args&&... args) {
    write(Level::warning, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void error(fmt::format_string<Args...> format, Args&&... args) {
    write(Level::error, fmt::format(format, std::forward<Args>(args)...));
}

} // namespace palpate::log
