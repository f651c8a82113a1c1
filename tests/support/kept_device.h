#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "engine/gpu/device.h"

namespace palpate {

// A device that all tests of a program share. It is made at its first use and destroyed after the
// last test, before main returns: Debian 13's validation layer (1.4.309) crashes where a device is
// destroyed among the static objects of a program that made a second instance.
class KeptDevice : public testing::Environment {
 public:
    // GoogleTest owns the result.
    static KeptDevice& make(const DeviceOptions& options) {
        auto* kept = new KeptDevice(options);
        testing::AddGlobalTestEnvironment(kept);
        return *kept;
    }
    GpuDevice& get() {
        if (!device_)
            device_.emplace(options_);
        return *device_;
    }
    void TearDown() override { device_.reset(); }

 private:
    explicit KeptDevice(const DeviceOptions& options) : options_(options) {}
    DeviceOptions options_;
    std::optional<GpuDevice> device_;
};

} // namespace palpate
