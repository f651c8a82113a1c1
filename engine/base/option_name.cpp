#include "engine/base/option_name.h"

#include <algorithm>
#include <atomic>

namespace palpate {

namespace {
std::atomic<OptionStyle> now{OptionStyle::command_line};
} // namespace

void set_option_style(OptionStyle style) {
    now = style;
}

std::string text_of(Option option) {
    if (now == OptionStyle::command_line)
        return fmt::format("--{}", option.name);
    std::string keyword(option.name);
    std::replace(keyword.begin(), keyword.end(), '-', '_');
    return keyword;
}

} // namespace palpate
