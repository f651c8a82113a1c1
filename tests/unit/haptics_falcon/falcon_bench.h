#pragma once

#include <memory>

#include "haptics/device/falcon/fake_falcon.h"
#include "haptics/device/falcon/falcon.h"

// A Falcon driver on a model of the device, on a virtual clock, for tests.
namespace palpate::haptics::falcon {

constexpr int64_t kMs = 1'000'000;

inline std::vector<std::byte> test_firmware() {
    std::vector<std::byte> image(8492);
    for (size_t i = 0; i < image.size(); ++i)
        image[i] = static_cast<std::byte>(i * 197 + i / 251);
    return image;
}

struct FalconBench {
    VirtualClock clock;
    FakeFalcon model;
    FakeTransport* transport = nullptr; // of the device that was opened last

    explicit FalconBench(FakeFalconSetup setup = {}) : model(std::move(setup)) {}
    Result<std::unique_ptr<FalconDevice>> open(std::span<const std::byte> firmware = {},
                                               FakeTransport::Fault fault = nullptr) {
        auto made = std::make_unique<FakeTransport>(model, clock);
        transport = made.get();
        transport->set_fault(std::move(fault));
        return FalconDevice::open(std::move(made), firmware);
    }
    // Time on the cable, without the driver.
    void pass(int64_t ns) {
        for (const int64_t end_ns = clock.now_ns() + ns; clock.now_ns() < end_ns;)
            transport->reap(end_ns);
    }
};

} // namespace palpate::haptics::falcon
