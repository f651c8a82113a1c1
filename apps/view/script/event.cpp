#include "apps/view/script/event.h"

namespace palpate::view {

const std::vector<std::string>& key_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all{
            "escape", "enter", "tab",     "backspace", "insert", "delete", "right", "left",
            "down",   "up",    "page_up", "page_down", "home",   "end",    "space", "'",
            ",",      "-",     ".",       "/",         ";",      "=",      "[",     "\\",
            "]",      "`",     "+",       "shift",     "ctrl",   "alt"};
        for (char letter = 'a'; letter <= 'z'; ++letter)
            all.emplace_back(1, letter);
        for (char digit = '0'; digit <= '9'; ++digit)
            all.emplace_back(1, digit);
        return all;
    }();
    return names;
}

} // namespace palpate::view
