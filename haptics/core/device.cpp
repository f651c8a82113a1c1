#include "haptics/core/device.h"

namespace palpate::haptics {

Result<void> HapticDevice::home() {
    return fail("{}: expected a device that is homed, found one without homing",
                capabilities().name);
}

Result<void> HapticDevice::calibrate() {
    return fail("{}: expected a device that is calibrated, found one without calibration",
                capabilities().name);
}

bool HapticDevice::wait(int64_t) noexcept {
    return false;
}

} // namespace palpate::haptics
