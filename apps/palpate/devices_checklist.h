#pragma once

#include <string>

#include "engine/base/error.h"
#include "engine/base/json.h"
#include "haptics/device/checklist.h"
#include "haptics/device/registry.h"

namespace palpate {

// `palpate devices test`.
struct ChecklistCommand {
    std::string name, firmware, report, page;
    bool is_armed = false; // else the person is asked
    double move_s = 15.0;
};

// Runs the checklist on the device and writes the report. `device` is the entry as JSON, which the
// report begins with. Nothing is written where a step fails.
Result<void> run_devices_test(const ChecklistCommand& command, const haptics::DeviceEntry& entry,
                              Json device);

// One page that needs nothing else.
std::string checklist_page(const haptics::Checklist& list, const std::string& title,
                           const Json& device);

} // namespace palpate
