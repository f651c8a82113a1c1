#pragma once

#include <array>
#include <optional>
#include <span>

#include "haptics/proxy/coupler.h"
#include "haptics/proxy/planes.h"
#include "haptics/proxy/proxy_account.h"
#include "haptics/proxy/slide_gain.h"
#include "haptics/proxy/tool_contacts.h"

// The swept tool (swept_tool.h) in two files: swept_tool.cpp follows the hand through a tick,
// swept_tool_settle.cpp steps to the place where the tool rests.
namespace palpate::haptics::swept_tool {

using glm::dvec3;

struct State : Felt {
    // An exchange has moved the tool, and it may not yet be where that ends.
    double catching_up_s = 0.0;
    bool is_sunk = false;   // since then, wherever it was looked at
    bool is_behind = false; // work ended before it was where the hand draws it
    uint64_t stamps = 0;    // of what it felt
    // In matter without a way out: nothing holds it until none of it is in any.
    bool is_submerged = false;
    dvec3 hand{0.0};
    double trust_mm = 1e3; // of the last step
    SlideGain gain;
    dvec3 last_way{0.0};     // that a tick led it
    double ease = 1.0;       // as a share of such a way
    double confidence = 1.0; // of the normal, in the tick before
    ProxyAccount account;
    uint32_t held_count = 0; // places that held the tool in the tick before
    std::array<Touch, ToolContacts::kMost> held{};
};

// The steps of one tick.
struct Course {
    dvec3 goal;
    double moved_mm; // of the hand, since the tick before
    double half_sample_mm;
    double trust_mm;  // how far planes are believed to hold: no step is longer
    bool look = true; // at every sample, next
    uint32_t looks = 0, most_looks = 0, steps = 0;
    std::optional<dvec3> good;  // the last place where all were looked at and none was deep
    bool is_out = false;        // somewhere where all were looked at, none was sunk
    double since_look_mm = 0.0; // gone since then
    dvec3 last_step{0.0};
    // The way along the surface that the planes gave, before that step.
    std::optional<dvec3> last_along;
    // The end of the whole last step, before it was tempered and cut; none where it led out.
    std::optional<dvec3> rest;
    bool has_learnt = false; // from a step of this tick how far to go
    bool touching = false, has_settled = false;
    bool is_spent = false; // the work of a tick, before it was where it belongs
};

enum class Next { go_on, stop };

class SweptTool final : public Algorithm {
 public:
    void reset(const TickInput& input) noexcept override {
        state_ = State{};
        if (is_place(input.tool.position_mm))
            state_.proxy = input.tool.position_mm;
        coupler_.reset(state_.proxy);
        lever_mm_ = torque_nm_ = dvec3(0.0);
        torque_watch_s_ = 0.0;
        lacked_data_ = false;
        torque_bleed_.forget();
        tool_mm_ = state_.proxy;
    }
    TickOutput tick(const TickInput& input) noexcept override;
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    std::span<const Touch> held() const { return {state_.held.data(), state_.held_count}; }
    double voxel_mm() const { return contacts_.field().voxel_mm(); }

    bool is_exchanged(const TickInput& input, const Volume& volume);
    void come_out(dvec3 place, dvec3 hand);
    void follow(dvec3 hand, double dt_s, Geometry& geometry);
    void settle(Course& c, Geometry& geometry);
    void submerge(dvec3 hand, Geometry& geometry);
    void ease(dvec3 start, double moved_mm);
    void hold_back(dvec3 start, dvec3 hand, double dt_s, Course& c);
    void keep_confidence(dvec3 start, dvec3 settled, bool was_held, Geometry& geometry);
    Course course_to(dvec3 goal, double moved_mm, const Geometry& geometry) const;
    bool try_leap(Course& c);
    Next look_and_step(Course& c, bool is_first, Geometry& geometry);
    dvec3 wanted_step(dvec3 goal) const;
    dvec3 tempered(dvec3 step, Course& c);
    double unseen_mm(const Course& c) const;
    void remember_holds(Course& c, dvec3 step, Geometry& geometry);
    void fall_behind(Course& c);
    dvec3 lever_of(dvec3 force_n) const;
    dvec3 torque_of(const TickInput& input, double moved_mm, bool is_exchanged, dvec3 force_n);

    State state_;
    Coupler coupler_;
    ToolContacts contacts_;
    dvec3 lever_mm_{0.0};         // of the contacts' force, when they were last asked
    dvec3 torque_nm_{0.0};        // of the last tick
    bool lacked_data_ = false;    // in the last tick
    double torque_watch_s_ = 0.0; // since what is felt was exchanged
    Bleed torque_bleed_;          // of torque, Nm
    dvec3 tool_mm_{0.0};          // of the last tick
};

} // namespace palpate::haptics::swept_tool
