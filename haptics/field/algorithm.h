#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/base/tool_pose.h"
#include "haptics/field/touch_parameters.h"
#include "haptics/field/touch_scene.h"

// The common interface of all haptic algorithms.
//
// Positions are millimetres of the world, velocities mm/s, forces newtons on the hand, torques
// newton metres about the tool, stiffness N/m: lengths are divided by 1000 where a force is made,
// and nowhere else.
namespace palpate::haptics {

struct TickInput {
    ToolPose tool;                               // where the hand holds the device, in world
    glm::dvec3 velocity_mm_per_s{0.0};           // of the tool
    double dt_s = 1e-3;                          // since the tick before; > 0
    uint32_t buttons = 0;                        // bit b: button b is pressed
    double removal = 0.0;                        // 0 .. 1: how strongly material goes now
    const TouchScene* scene = nullptr;           // never null; lives until the tick returns
    const TouchParameters* parameters = nullptr; // likewise
};

enum class Contact : uint8_t {
    free,      // nothing is touched; force may be left where the proxy is behind the hand
    touching,  // held out by a surface
    yielding,  // pushed into material beyond T0
    submerged, // inside material, and no way out is known
    behind,    // the work of a tick ends before the hand is reached: force fades and does not rise
    unknown,   // samples there are missing or without data: force fades by 90 N/s
};

// When a tool works on the material, and where.
enum class Carving : uint8_t {
    by_button, // while a button is pressed, at the proxy
    rests,     // not now: the algorithm decides, whatever the button
    at_tool,   // now, and where the hand is
};

struct TickOutput {
    ToolPose proxy;          // where the tool would be if it could not enter; finite
    glm::dvec3 force_n{0.0}; // on the hand; the safety chain bounds it afterwards
    glm::dvec3 torque_nm{0.0};
    Contact contact = Contact::free;
    glm::dvec3 normal{0.0};  // unit length, out of the material; 0 where none is known
    double depth_mm = 0.0;   // distance from tool to proxy
    double confidence = 1.0; // of the normal, 0 .. 1
    uint32_t label = 0;      // of the touched material; 0 is none
    uint32_t iterations = 0; // of whatever the algorithm repeats
    uint32_t contacts = 0;   // constraints or samples that held the proxy
    Carving carving = Carving::by_button;
};

// One way of touching, made by name outside the servo thread with all memory it will ever use.
//
// reset() and tick() neither allocate, throw, lock nor print, take bounded time, and are functions
// of the state and the input alone: no clock, no random device, no global. Samples of bricks that
// are not in memory (Brick::is_in_source()) are never fetched: they count as missing. An input that
// is not finite gives force 0 and Contact::unknown, and leaves the state as it was.
class Algorithm {
 public:
    virtual ~Algorithm() = default;
    // Forgets contact: the proxy is at the tool.
    virtual void reset(const TickInput& input) noexcept = 0;
    virtual TickOutput tick(const TickInput& input) noexcept = 0;
    // Its own objects, which ticks read and write: to be locked in memory. Not for the servo.
    virtual std::vector<std::span<const std::byte>> memory() const = 0;
};

// For memory() of an algorithm that is one object.
template <class T>
std::vector<std::span<const std::byte>> memory_of(const T& object) {
    return {std::as_bytes(std::span(&object, 1))};
}

// An Algorithm out of a plain state and a function of it:
//     TickOutput milling_tick(MillingState& state, const TickInput& input) noexcept;
// A state that starts empty is one whose first tick puts the proxy at the tool.
template <class State, TickOutput (*Tick)(State&, const TickInput&) noexcept>
class StatefulAlgorithm final : public Algorithm {
    static_assert(std::is_trivially_copyable_v<State>);

 public:
    void reset(const TickInput&) noexcept override { state_ = State{}; }
    TickOutput tick(const TickInput& input) noexcept override { return Tick(state_, input); }
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    State state_{};
};

template <class State, TickOutput (*Tick)(State&, const TickInput&) noexcept>
std::unique_ptr<Algorithm> make_algorithm_of() {
    return std::make_unique<StatefulAlgorithm<State, Tick>>();
}

} // namespace palpate::haptics
