#pragma once

#include <string>
#include <string_view>

#include "engine/base/json.h"

namespace palpate {

// One file that needs nothing else: what `script` draws of `results`, with the functions of
// page_template.html.
std::string page_of(std::string_view script, const Json& results);

} // namespace palpate
