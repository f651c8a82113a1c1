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

} // namespace palpate::view
