#pragma once

#include <string>
#include <vector>

#include "apps/view/window/interaction.h"

namespace palpate::view {

// Acts on a key that is pressed or let go, by the tables of keys and of tools.
void use_key(Outcome& next, const Event& event, const Subject& subject);

// All keys and buttons and what they do, for the help and for the guide, in their order.
struct KeyHelp {
    std::string keys, purpose;
};
const std::vector<KeyHelp>& key_help();

// Single keys and what they do, for the search box.
struct KeyCommand {
    const char* title; // "3D from the left"
    std::string keys;  // "Ctrl+S"
    Event press;
};
std::vector<KeyCommand> key_commands();

} // namespace palpate::view
