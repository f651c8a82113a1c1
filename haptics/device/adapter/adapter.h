#pragma once

#include <memory>
#include <string>

#include "haptics/core/device.h"
#include "haptics/device/adapter/palpate_device.h"
#include "haptics/device/velocity.h"

namespace palpate::haptics {

// A device behind the C interface of palpate_device.h, in a shared library that is loaded when it
// is opened and stays loaded. What the library says is checked: values that are not finite or out
// of range read as stale.
class AdapterDevice final : public HapticDevice {
 public:
    // Refused: a file that is no such library, or of another version of the interface; and what the
    // library itself refuses.
    static Result<std::unique_ptr<AdapterDevice>> open(const std::string& file);
    ~AdapterDevice() override;

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override;
    void halt(int64_t) noexcept override { entry_->halt(device_); }

 private:
    AdapterDevice(const palpate_device* entry, void* device, DeviceCapabilities capabilities);

    const palpate_device* entry_;
    void* device_;
    DeviceCapabilities capabilities_;
    VelocityEstimator estimator_;
    int64_t sampled_ns_ = 0;
    bool has_place_ = false;
};

} // namespace palpate::haptics
