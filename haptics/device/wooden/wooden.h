#pragma once

#include <memory>

#include "haptics/core/device.h"
#include "haptics/device/transport/transport.h"
#include "haptics/device/velocity.h"
#include "haptics/device/wooden/codec.h"
#include "haptics/device/wooden/kinematics.h"

namespace palpate::haptics {

DeviceCapabilities wooden_capabilities(const wooden::Geometry& geometry);

// WoodenHaptics, or a Polhem of the first kind. A report goes out each tick and is answered by one.
// Its encoders count from where they woke up: it is switched on, or calibrated, while both links
// hang at their stops. Currents beyond kMost_ma are scaled down on all motors alike. The device
// ends its force where it hears nothing for 0.5 s. Silent for kSilent_ns though asked: gone.
class WoodenDevice final : public HapticDevice {
 public:
    static constexpr int64_t kSilent_ns = 100'000'000;
    static constexpr int kMost_ma = 2000; // the makers' default

    // `report_bytes` of an outgoing report without its number: 14, or 64 where the board fills up.
    static Result<std::unique_ptr<WoodenDevice>> open(std::unique_ptr<Transport> transport,
                                                      const wooden::Geometry& geometry,
                                                      size_t report_bytes = wooden::kReport);
    ~WoodenDevice() override; // without force

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    Result<void> calibrate() override;
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override;
    void halt(int64_t) noexcept override { transport_->halt(); }

    // The currents of the motors, in mA.
    static std::array<int16_t, 3> motor_currents(const wooden::Geometry& geometry,
                                                 const wooden::Angles& angles,
                                                 glm::dvec3 force_n) noexcept;

 private:
    WoodenDevice(std::unique_ptr<Transport> transport, const wooden::Geometry& geometry,
                 size_t report_bytes);
    void put(const wooden::Command& command, Transfer& transfer) const noexcept;

    DeviceCapabilities capabilities_;
    const wooden::Geometry& geometry_;
    std::unique_ptr<Transport> transport_;
    Transfer &in_, &out_;
    size_t report_bytes_;
    wooden::Angles angles_{};
    bool has_place_ = false;
    int64_t asked_ns_ = 0; // the first report without an answer; 0: none
    int64_t sampled_ns_ = 0;
    VelocityEstimator estimator_;
};

} // namespace palpate::haptics
