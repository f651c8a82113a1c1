#pragma once

#include <memory>
#include <vector>

#include "engine/base/ring.h"
#include "haptics/core/workspace.h"
#include "haptics/device/device_log.h"
#include "haptics/device/hand_path.h"

namespace palpate::haptics {

// Plays a recording, with its recorded status. Forces have no effect: the hand of a recording
// feels nothing. Between two records the earlier one holds, and after the last the device has
// ended.
class RecordedDevice final : public HapticDevice {
 public:
    // Records in order of time, at least one. The first plays at start_ns. `capabilities` are those
    // of the device it was recorded with, or of none.
    RecordedDevice(DeviceCapabilities capabilities, std::vector<DeviceRecord> records,
                   int64_t start_ns = 0);

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t, const Wrench&) noexcept override { return DeviceStatus::ok; }
    void halt(int64_t) noexcept override {}

 private:
    DeviceCapabilities capabilities_;
    std::vector<DeviceRecord> records_;
    int64_t start_ns_;
    size_t next_ = 0;
};

// A path as the samples of a device that follows it exactly, one a period, velocities included.
std::vector<DeviceRecord> records_of_path(const HandPath& path, const Workspace& workspace,
                                          int64_t period_ns);

// Passes everything on to another device and notes it in a ring, from which another thread takes
// it. A full ring drops records and counts them; it never holds the servo up.
class RecordingDevice final : public HapticDevice {
 public:
    // `device` must outlive it.
    RecordingDevice(HapticDevice& device, size_t capacity) : device_(device), ring_(capacity) {}

    const DeviceCapabilities& capabilities() const noexcept override {
        return device_.capabilities();
    }
    Result<void> home() override { return device_.home(); }
    Result<void> calibrate() override { return device_.calibrate(); }
    bool wait(int64_t until_ns) noexcept override { return device_.wait(until_ns); }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override;
    void halt(int64_t now_ns) noexcept override { device_.halt(now_ns); }

    // Any one other thread: appends what has come since.
    void drain(std::vector<DeviceRecord>& records);
    uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
    HapticDevice& device_;
    Ring<DeviceRecord> ring_;
    DeviceRecord now_;
    std::atomic<uint64_t> dropped_{0};
};

} // namespace palpate::haptics
