#include "haptics/safety/write_gate.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <optional>

#include "tests/support/interleave.h"

namespace palpate::haptics {
namespace {

using interleave::Explorer;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kLimit_ns = 11 * kMs;

TEST(WriteGate, StaysOpenWhileWritesComeInTime) {
    WriteGate gate;
    EXPECT_FALSE(gate.close(1000 * kMs, kLimit_ns)); // nothing was ever written
    for (int64_t now = kMs; now < 500 * kMs; now += 10 * kMs) {
        EXPECT_FALSE(gate.reopen(now));
        ASSERT_TRUE(gate.begin_write());
        ASSERT_TRUE(gate.end_write(now));
        EXPECT_EQ(gate.last_ns(), now);
        EXPECT_FALSE(gate.close(now + kLimit_ns, kLimit_ns));
    }
}

TEST(WriteGate, OnceClosedNothingIsWrittenUntilTheServoHasSeenIt) {
    WriteGate gate;
    gate.begin_write();
    gate.end_write(100 * kMs);
    EXPECT_TRUE(gate.close(112 * kMs, kLimit_ns));
    EXPECT_FALSE(gate.begin_write());              // of the tick that hung
    EXPECT_TRUE(gate.close(113 * kMs, kLimit_ns)); // and is to be halted again
    EXPECT_TRUE(gate.reopen(114 * kMs));
    EXPECT_FALSE(gate.close(115 * kMs, kLimit_ns));
    EXPECT_FALSE(gate.reopen(114 * kMs)); // told once
    EXPECT_TRUE(gate.begin_write());
    EXPECT_TRUE(gate.end_write(115 * kMs));
}

TEST(WriteGate, AWriteThatHangsIsClosedAndMustBeTakenBack) {
    WriteGate gate;
    gate.begin_write();
    gate.end_write(100 * kMs);
    EXPECT_TRUE(gate.begin_write());
    EXPECT_FALSE(gate.close(111 * kMs, kLimit_ns)); // no longer than the limit
    EXPECT_TRUE(gate.close(112 * kMs, kLimit_ns));
    EXPECT_FALSE(gate.end_write(101 * kMs));
    EXPECT_TRUE(gate.reopen(113 * kMs));
}

// The last message to the device.
enum Told : int { kNothing, kOldForce, kNewForce, kHalted };

// A servo that hung in a tick sends what it worked out before and perhaps ticks once more, while a
// watchdog that finds the last write too old looks twice.
Explorer::Report explore(bool takes_back, bool ticks_again) {
    Explorer& explorer = Explorer::current();
    using Gate = BasicWriteGate<interleave::Atomic>;
    std::optional<Gate> gate;
    Told told = kNothing;
    bool was_closed = false;
    const auto tell = [&](Told what) {
        explorer.step({{&told, true}});
        told = what;
    };
    const auto write = [&, takes_back, tell](Told what, int64_t now_ns) {
        if (!gate->begin_write())
            return;
        tell(what);
        if (!gate->end_write(now_ns) && takes_back)
            tell(kHalted);
    };
    const auto make = [&]() -> std::vector<std::function<void()>> {
        gate.emplace();
        gate->begin_write();
        gate->end_write(100 * kMs);
        told = kNothing;
        was_closed = false;
        return {[&, ticks_again] {
                    write(kOldForce, 130 * kMs);
                    if (!ticks_again)
                        return;
                    const bool was_shut = gate->reopen(131 * kMs);
                    write(was_shut ? kHalted : kNewForce, 131 * kMs);
                },
                [&] {
                    for (int look = 0; look < 2; ++look)
                        if (gate->close(131 * kMs, kLimit_ns)) {
                            was_closed = true;
                            tell(kHalted);
                        }
                }};
    };
    const auto finish = [&] {
        explorer.expect(!was_closed || told != kOldForce,
                        "force of before the hang stands after it");
        explorer.expect(gate->close(131 * kMs, kLimit_ns) ? told == kHalted : true,
                        "the gate is closed and force stands");
    };
    return explorer.explore(make, finish);
}

TEST(WriteGateModel, NoForceOfBeforeAHangStandsInAnyOrder) {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the thread sanitizer does not follow fibres";
#endif
    for (const bool ticks_again : {false, true}) {
        const Explorer::Report report = explore(true, ticks_again);
        EXPECT_EQ(report.violation, "") << "after " << report.orders << " orders";
        std::printf("%llu orders\n", static_cast<unsigned long long>(report.orders));
        EXPECT_GT(report.orders, 10u);
    }
}

// Between the look at the gate and the write a thread may stop: the model must see that.
TEST(WriteGateModel, WithoutTakingItBackOldForceStands) {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the thread sanitizer does not follow fibres";
#endif
    EXPECT_NE(explore(false, false).violation, "");
}

} // namespace
} // namespace palpate::haptics
