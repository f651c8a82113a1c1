#pragma once

#include "engine/base/mailbox.h"
#include "haptics/core/workspace.h"
#include "haptics/device/hand_source.h"
#include "haptics/device/simulated.h"

namespace palpate::haptics {

// The place of a pointer in the world, and what it presses.
struct PointerTarget {
    ToolPose tool;
    uint32_t buttons = 0;
    // Over a picture seen from eye_mm, as deep as what is seen there. Where that is much nearer to
    // the eye than the hand, as beyond the edge of an opening, the hand goes back towards the eye,
    // until it is clear_mm before that depth, then aside, then down. 0: the straight way.
    glm::dvec3 eye_mm{0.0};
    double clear_mm = 0.0;
};

// A pointer, such as a mouse in a picture, as the intention of a simulated hand.
//
// A pointer jumps sixty times a second. The hand follows it as a first-order lag of kLag_s, at
// kMost_m_per_s at most: slower than the safety chain takes for a fault. A button that is pressed
// far from the hand waits until the hand is where it was pressed, so that a tool does not work on
// the way there; one that is released is released at once.
class PointerHand final : public HandSource {
 public:
    static constexpr double kLag_s = 0.032, kMost_m_per_s = 0.5;
    // A hand that follows lags by less than kFar_m; within kThere_m it has arrived.
    static constexpr double kFar_m = kLag_s * kMost_m_per_s, kThere_m = 5e-4;

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

    // The servo's own.
    enum class Way { straight, back, aside };
    glm::dvec3 way_to(const PointerTarget& target, const glm::dvec3& goal_m) noexcept;
    void take_buttons(const PointerTarget& target) noexcept;

    double time_s_ = 0.0;
    glm::dvec3 position_m_;
    Way way_ = Way::straight;
    glm::dvec3 over_m_{0.0};           // the end of the way aside
    uint32_t asked_ = 0, buttons_ = 0; // of the target, and those that the hand has pressed
    bool arrives_ = false;             // at pressed_m_, before it presses
    glm::dvec3 pressed_m_{0.0};
};

// A device for a pointer: a light handle without friction or steps, which reaches as far as volumes
// do, in a hand that comes to rest without swinging.
const DevicePreset& pointer_preset();
HandModel pointer_hand_model();

} // namespace palpate::haptics
