#pragma once

#include "engine/program/touch_run.h"
#include "engine/volume/grid.h"

namespace palpate {

// `palpate touch --live`: a person moves the device.
//
// The path of `setup` says where the middle of the device's workspace lies; all of the volume is in
// reach. The device gives no force until a line comes on standard input, and again after each
// fault. A device that is unplugged is opened anew when it is back. Ends after `duration_s`, by
// `stop`, or where the servo ends.
Result<TouchRun> run_touch_live(TouchRunSetup setup, const Grid& grid, double duration_s,
                                std::stop_token stop,
                                const std::function<void(double share)>& progress);

} // namespace palpate
