#pragma once

#include <string>

#include "engine/base/json.h"
#include "engine/edit/stroke.h"
#include "haptics/field/touch_parameters.h"

// Texts of options of `palpate touch` and the values that they stand for.
namespace palpate {

// VALUE:FORCE pairs of rising value, or A or A,CENTER,WIDTH of a sigmoid. Empty: none.
Result<haptics::HapticTransfer> read_force(const std::string& text);
// VALUE:OPACITY pairs of rising value. Empty: none.
Result<haptics::HapticTransfer> read_opacity(const std::string& text);

// LABEL,STIFFNESS[,FRICTION[,T0]]
Result<haptics::LabelTouch> read_label(const std::string& text);

bool is_json(const std::string& text); // and not the name of a file that holds it

// JSON itself, or the file that holds it, and what it says.
template <class T>
struct Said {
    Json json;
    T value;
};
Result<Said<Tool>> read_touch_tool(const std::string& text);
Result<Said<Operation>> read_touch_operation(const std::string& text);

} // namespace palpate
