#pragma once

#include "engine/base/mailbox.h"
#include "haptics/core/workspace.h"
#include "haptics/device/hand_source.h"
#include "haptics/device/simulated.h"

namespace palpate::haptics {

// Where a pointer is and what it presses, in the world.
struct PointerTarget {
    ToolPose tool;
    uint32_t buttons = 0;
};

// A pointer, such as a mouse in a picture, as the intention of a simulated hand.
//
// A pointer jumps sixty times a second. The hand follows it as a first-order lag of kLag_s, at
// kMost_m_per_s at most: slower than the safety chain takes for a fault.
class PointerHand final : public HandSource {
 public:
    static constexpr double kLag_s = 0.032, kMost_m_per_s = 0.5;

    // The hand rests at `first`. `workspace`, as it is now, maps targets to the device.
    PointerHand(const PointerTarget& first, const Workspace& workspace);

    // One thread other than the servo's. Targets that are not finite are left out.
    void point(const PointerTarget& target);

    Meant meant(double time_s) noexcept override;
    Held held(double time_s) noexcept override;

 private:
    Workspace workspace_;
    Mailbox<PointerTarget> targets_;
    Mailbox<PointerTarget>::Reader reader_; // the servo's
    double time_s_ = 0.0;
    glm::dvec3 position_m_;
};

// A device for a pointer: a light handle without friction or steps, which reaches as far as volumes
// do, in a hand that comes to rest without swinging.
const DevicePreset& pointer_preset();
HandModel pointer_hand_model();

} // namespace palpate::haptics
