#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "haptics/safety/chain.h"
#include "tests/unit/haptics_safety/fuzz.h"

// Every fault a device can show, while idle, in contact and in the soft start. Whatever happens,
// what goes out is finite, within limits, changes no faster than it may unless it goes to nothing,
// and is nothing within two ticks of the fault being latched.
namespace palpate::haptics {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int64_t kMs = 1'000'000;
const DeviceCapabilities kDevice{.workspace_m = glm::dvec3(0.05),
                                 .resolution_m = 50e-6,
                                 .max_force_n = 8.0,
                                 .max_damping_n_s_per_m = 20.0};

// The input that the loop gives the chain in one tick; a fault changes it.
struct Feed {
    int64_t now_ns, due_ns;
    DeviceStatus status = DeviceStatus::ok;
    DeviceSample sample;
    glm::dvec3 force_n{0.0};
    bool halted = false; // by a watchdog, since the tick before
    DeviceStatus write = DeviceStatus::ok;
};
// `tick` counts from the fault's start.
using Damage = std::function<void(Feed&, int tick)>;

struct Row {
    const char* name;
    Damage damage;
    uint32_t latches;        // 0: force comes back by itself
    int lasts;               // ticks
    bool moves_time = false; // the clock goes on from where the fault left it
};

const Row kRows[] = {
    {"NaN position", [](Feed& f, int) { f.sample.position_m.y = kNaN; }, kFaultInput, 20},
    {"NaN position for 3 ticks", [](Feed& f, int) { f.sample.position_m.y = kNaN; }, 0, 3},
    {"infinite velocity",
     [](Feed& f, int) { f.sample.velocity_m_per_s.x = std::numeric_limits<double>::infinity(); },
     kFaultInput, 20},
    {"encoder jump of 40 mm that stays", [](Feed& f, int) { f.sample.position_m.x -= 0.04; },
     kFaultInput, 1000},
    {"one sample astray", [](Feed& f, int) { f.sample.position_m.z += 0.02; }, 0, 1},
    {"encoder wrap", [](Feed& f, int) { f.sample.position_m.x += 65536 * 50e-6; }, kFaultInput, 50},
    {"every other sample astray",
     [](Feed& f, int tick) { f.sample.position_m.x += tick % 2 ? 0.03 : 0.0; }, 0, 500},
    {"sample of 10 s ago", [](Feed& f, int) { f.sample.time_ns -= 10'000 * kMs; }, kFaultInput, 20},
    {"sample of a minute ahead", [](Feed& f, int) { f.sample.time_ns += 60'000 * kMs; },
     kFaultInput, 20},
    {"time of samples never set", [](Feed& f, int) { f.sample.time_ns = -1; }, kFaultInput, 20},
    {"sample repeated with its time", [](Feed& f, int tick) { f.sample.time_ns -= tick * kMs; },
     kFaultInput, 20},
    {"samples 2 ms old", [](Feed& f, int) { f.sample.time_ns -= 2 * kMs; }, 0, 500},
    {"write says gone", [](Feed& f, int) { f.write = DeviceStatus::gone; }, kFaultGone, 1},
    {"forces left aside for 3 ticks", [](Feed& f, int) { f.write = DeviceStatus::stale; }, 0, 3},
    {"stuck encoder",
     [](Feed& f, int) {
         f.sample.position_m = {0.001, 0.0, 0.0};
     },
     0, 500},
    {"no samples", [](Feed& f, int) { f.status = DeviceStatus::stale; }, kFaultInput, 50},
    {"no samples for 4 ticks", [](Feed& f, int) { f.status = DeviceStatus::stale; }, 0, 4},
    {"every third sample missing",
     [](Feed& f, int tick) { f.status = tick % 3 ? DeviceStatus::ok : DeviceStatus::stale; }, 0,
     500},
    {"device gone", [](Feed& f, int) { f.status = DeviceStatus::gone; }, kFaultGone, 1},
    {"homing lost and found", [](Feed& f, int) { f.status = DeviceStatus::not_homed; }, 0, 30},
    {"stall of 5 ms", [](Feed& f, int) { f.now_ns += 5 * kMs; }, 0, 1, true},
    {"stall of 50 ms", [](Feed& f, int) { f.now_ns += 50 * kMs; }, 0, 1, true},
    {"hang of 5 ms within a tick", [](Feed& f, int) { f.now_ns = f.due_ns += 5 * kMs; }, 0, 1,
     true},
    {"hang of 50 ms within a tick", [](Feed& f, int) { f.now_ns = f.due_ns += 50 * kMs; }, 0, 1,
     true},
    {"halted by the watchdog", [](Feed& f, int) { f.halted = true; }, 0, 1},
    {"clock 1 s ahead", [](Feed& f, int) { f.now_ns += 1000 * kMs; }, 0, 1, true},
    {"clock 1 s back", [](Feed& f, int) { f.now_ns -= 1000 * kMs; }, kFaultInput, 1},
    {"rotation of no length",
     [](Feed& f, int) {
         f.sample.rotation = {0, 0, 0, 0};
     },
     kFaultInput, 20},
    {"rendered NaN", [](Feed& f, int) { f.force_n.x = kNaN; }, kFaultNotFinite, 1},
    {"rendered 1e300 N",
     [](Feed& f, int) {
         f.force_n = {1e300, -1e300, 1e300};
     },
     0, 100},
    {"force that changes sign every tick",
     [](Feed& f, int tick) {
         f.force_n = {tick % 2 ? 8.0 : -8.0, 0, 0};
     },
     0, 500},
};

enum class State { idle, contact, ramp };

void run_row(const Row& row, State state) {
    SCOPED_TRACE(std::string(row.name) + (state == State::idle      ? ", idle"
                                          : state == State::contact ? ", contact"
                                                                    : ", ramp"));
    const SafetyLimits limits;
    SafetyChain chain(limits, kDevice);
    chain.arm();
    const int begins = state == State::ramp ? 500 : 2200;
    Wrench before;
    int64_t shift_ns = 0, last_ns = 0;
    int since_latch = 0;
    bool force_after = false;
    for (int tick = 0; tick < begins + row.lasts + 6000; ++tick) {
        const int64_t on_time_ns = (tick + 1) * kMs + shift_ns;
        Feed feed{.now_ns = on_time_ns, .due_ns = on_time_ns};
        feed.sample.time_ns = on_time_ns;
        feed.sample.position_m = {0.001, 0, 0};
        feed.force_n.x = state != State::idle && tick > 10 ? -1.0 : 0.0;
        const bool damaged = tick >= begins && tick < begins + row.lasts;
        // After faults that make it start anew, the hand leaves contact for a moment.
        if (tick > begins + row.lasts && tick < begins + row.lasts + 300)
            feed.force_n = glm::dvec3(0.0);
        if (damaged)
            row.damage(feed, tick - begins);
        if (feed.now_ns != on_time_ns && feed.sample.time_ns == on_time_ns)
            feed.sample.time_ns = feed.now_ns; // read in that tick, whenever it was
        if (row.moves_time)
            shift_ns += feed.now_ns - on_time_ns;
        if (feed.halted)
            chain.halted();
        const SafetyChain::Begun begun =
            chain.begin(feed.now_ns, feed.due_ns, feed.status, feed.sample);
        const Wrench out =
            chain.finish({begun.usable ? feed.force_n : glm::dvec3(0.0), {}}, 1000.0);
        chain.written(feed.write);

        const double size = glm::length(out.force_n), last = glm::length(before.force_n);
        ASSERT_TRUE(std::isfinite(size)) << tick;
        ASSERT_LE(size, 0.8 * 8.0) << tick;
        // The time of a tick, as the chain bounds it: 10 us to 0.1 s.
        const double dt_s =
            std::clamp(1e-9 * static_cast<double>(feed.now_ns - last_ns), 1e-5, 0.1);
        last_ns = feed.now_ns;
        if (size > last) {
            ASSERT_LE(glm::length(out.force_n - before.force_n), 2000.0 * dt_s * (1 + 1e-9))
                << tick;
        }
        since_latch = chain.latched() ? since_latch + 1 : 0;
        if (since_latch >= 2) {
            ASSERT_EQ(out, Wrench{}) << tick;
        }
        if (tick > begins + row.lasts + 5000)
            force_after = force_after || size > 0.5;
        before = out;
    }
    EXPECT_EQ(chain.faults() & kFaultLatched, row.latches) << fault_text(chain.faults());
    if (state != State::idle) {
        EXPECT_EQ(force_after, row.latches == 0);
    }
    if (row.latches != 0) { // somebody looks, and says yes
        EXPECT_EQ(chain.history().back().faults & kFaultLatched, row.latches);
        chain.arm();
        EXPECT_FALSE(chain.latched());
    }
}

TEST(FaultMatrix, EveryFaultInEveryStateEndsSafely) {
    for (const Row& row : kRows)
        for (const State state : {State::idle, State::contact, State::ramp})
            run_row(row, state);
}

TEST(FaultMatrix, NothingThatCanBePassedInGivesAnUnsafeForce) {
    fuzz_chain(11, 300'000);
}

} // namespace
} // namespace palpate::haptics
