// The threads of a session sleep while there is nothing to do. PALPATE_SECONDS is how long one
// looks: the property is one of time, so that this test has to let it pass.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <thread>

#include "haptics/device/recorded.h"
#include "tests/support/given.h"
#include "tests/support/idle.h"
#include "tests/unit/session/session_work.h"

namespace palpate {
namespace {

SessionSetup threaded_setup() {
    return {.document = head_and_organs(),
            .grey = "head",
            .labels = "organs",
            .touch = {},
            .parameters = {.iso = 300.0},
            .mesh_iso = 300.0f};
}

// Switches a second of all threads but the one that measures; others: less the busiest one's.
struct Rates {
    double cpu_share, per_s, others_per_s;
};

Rates measured() {
    const double seconds = given("PALPATE_SECONDS", 1.0);
    const auto before = switches_now();
    const double cpu_s = cpu_s_now();
    const auto began = std::chrono::steady_clock::now();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - began;
    const double used_s = cpu_s_now() - cpu_s;
    uint64_t all = 0, busiest = 0;
    for (const auto& [thread, now] : switches_now()) {
        if (thread == std::to_string(gettid()))
            continue;
        const auto then = before.find(thread);
        const uint64_t more = now.all() - (then == before.end() ? 0 : then->second.all());
        all += more;
        busiest = std::max(busiest, more);
    }
    const auto rate = [&](uint64_t count) { return static_cast<double>(count) / passed.count(); };
    const Rates rates{used_s / passed.count(), rate(all), rate(all - busiest)};
    std::printf("    %.2f %% of a core, %.0f switches a second, %.0f not of the busiest thread\n",
                100.0 * rates.cpu_share, rates.per_s, rates.others_per_s);
    return rates;
}

constexpr double kMostShare = 0.01, kMostPerSecond = 100.0;

// Workers of TBB look for more work for a moment before they sleep, a long one on a busy machine:
// the rates of the first of a few looks that is as quiet as asked, or of the last.
template <class IsQuiet>
Rates at_rest(IsQuiet is_quiet) {
    constexpr int kMostLooks = 10;
    Rates rates = measured();
    for (int look = 1; look < kMostLooks && !is_quiet(rates); ++look)
        rates = measured();
    return rates;
}

void expect_sleep() {
    const Rates rates = at_rest(
        [](const Rates& r) { return r.cpu_share <= kMostShare && r.per_s <= kMostPerSecond; });
    EXPECT_LE(rates.cpu_share, kMostShare);
    EXPECT_LE(rates.per_s, kMostPerSecond);
}

void draw_a_stroke(Session& session) {
    ASSERT_TRUE(session.use({Json{{"kind", "ball"}, {"radius_mm", 3.0}},
                             {make_ball(3.0)},
                             {.kind = OperationKind::cut, .to_value = 0.0},
                             "head",
                             ""}));
    for (int i = 0; i < 20; ++i)
        ASSERT_TRUE(session.stroke(i == 0    ? EditInput::Kind::down
                                   : i == 19 ? EditInput::Kind::up
                                             : EditInput::Kind::move,
                                   {0.01 * i, {{0.2 * i - 2.0, 0, 0}, {1, 0, 0, 0}}}));
    session.settle();
    ASSERT_EQ(session.state().strokes_done, 1u);
}

TEST(SessionIdle, SleepsBeforeAndAfterAStrokeAndWithAToolThatRests) {
    Session session(threaded_setup());
    session.settle();
    expect_sleep();
    draw_a_stroke(session);
    while (session.milling().rate_mm3_per_s > 0.0) // it is measured for 50 ms
        std::this_thread::yield();
    expect_sleep();
    ASSERT_TRUE(session.stroke(EditInput::Kind::down, {1.0, {{0, 0, 0}, {1, 0, 0, 0}}}));
    while (session.state().inputs_done < session.inputs_given() ||
           session.milling().rate_mm3_per_s > 0.0)
        std::this_thread::yield();
    expect_sleep();
}

// An armed device in a hand that rests: the servo ticks, its watchdog looks every 11 ms and bricks
// are locked every 20 ms, 141 switches a second together.
TEST(SessionIdle, OnlyTheServoWorksForAnArmedDeviceAtRest) {
    Session session(threaded_setup());
    session.settle();
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    haptics::RecordedDevice device({.workspace_m = glm::dvec3(1), .max_force_n = 8},
                                   records_of_path(haptics::HandPath(std::vector<haptics::HandPose>(
                                                       1, {.tool = {.position_mm = {0, 0, 400}}})),
                                                   workspace, 1'000'000));
    ASSERT_TRUE(
        session.start({device, *haptics::find_algorithm("swept-point"), workspace, {}, {}, {}}));
    const uint64_t ticks = session.servo()->telemetry().ticks;
    constexpr double kMostOthers = 200.0;
    const Rates with = at_rest([](const Rates& r) { return r.others_per_s <= kMostOthers; });
    EXPECT_LE(with.others_per_s, kMostOthers);
    EXPECT_GT(session.servo()->telemetry().ticks, ticks);
    session.stop();
    expect_sleep();
}

} // namespace
} // namespace palpate
