#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

namespace palpate {

// For SessionDevice::hung: one sentence, and the end of the program. A driver that does not return
// keeps what it uses for ever, so nothing can be put away; strokes are in the journal.
inline std::function<void()> end_where_device_hangs(std::string name) {
    return [name = std::move(name)] {
        fmt::print(stderr,
                   "error: {}: its driver does not return; force was halted, and the program ends. "
                   "Unplug the device before it is used again.\n",
                   name);
        std::_Exit(1);
    };
}

} // namespace palpate
