#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <utility>

#include "engine/gpu/device.h"

namespace palpate {

// A device, or what is made on one, that all tests of a program share. It is made at its first use
// and destroyed after the last test, before main returns, in the reverse order of `make`: Debian
// 13's validation layer (1.4.309) crashes where a device is destroyed among the static objects of a
// program that made a second instance, and SwiftShader where a device goes before its pipelines.
template <typename Thing>
class KeptForTests : public testing::Environment {
 public:
    using Maker = std::function<std::unique_ptr<Thing>()>;

    // GoogleTest owns the result.
    static KeptForTests& make(Maker maker) {
        auto* kept = new KeptForTests(std::move(maker));
        testing::AddGlobalTestEnvironment(kept);
        return *kept;
    }
    Thing& get() {
        if (!thing_)
            thing_ = maker_();
        return *thing_;
    }
    void TearDown() override { thing_.reset(); }

 private:
    explicit KeptForTests(Maker maker) : maker_(std::move(maker)) {}
    Maker maker_;
    std::unique_ptr<Thing> thing_;
};

inline KeptForTests<GpuDevice>& keep_device(const DeviceOptions& options) {
    return KeptForTests<GpuDevice>::make(
        [options] { return std::make_unique<GpuDevice>(options); });
}

} // namespace palpate
