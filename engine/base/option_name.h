#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>

// Names of options in messages. A program says --frame-ms where Python says frame_ms; so messages
// have the name marked and know neither.
namespace palpate {

// fail("{}: expected a scene with ray casting", Option{"frame-ms"});
struct Option {
    std::string_view name; // lower case and hyphens, without leading ones
};

// The option of a word of the command line, "--frame-ms".
constexpr Option option_of(std::string_view flag) {
    return {flag.substr(2)};
}

enum class OptionStyle { command_line, keywords };
void set_option_style(OptionStyle style); // of the process; before other threads are started
std::string text_of(Option option);

} // namespace palpate

template <>
struct fmt::formatter<palpate::Option> : fmt::formatter<std::string_view> {
    auto format(palpate::Option option, fmt::format_context& context) const {
        return fmt::formatter<std::string_view>::format(palpate::text_of(option), context);
    }
};
