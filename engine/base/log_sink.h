#pragma once

#include <string>

#include "engine/base/log.h"

namespace palpate::log {

// Takes the messages in the place of standard error: for a host, such as Python, that shows them in
// its own way. Called from any thread, several at once; must not throw. Null: standard error again.
using Sink = void (*)(Level level, const std::string& message);
void set_sink(Sink sink);

} // namespace palpate::log
