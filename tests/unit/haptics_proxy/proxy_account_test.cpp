#include "haptics/proxy/proxy_account.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace palpate {
namespace {

using glm::dvec3;
using haptics::ProxyAccount;

constexpr double kT = 1e-3;

double squared(dvec3 v) {
    return glm::dot(v, v);
}

// A tick of somebody who wants to go to `to`; where it went.
dvec3 go(ProxyAccount& account, dvec3 from, dvec3 to, dvec3 hand, double slack_mm,
         double moved_mm = 0.0) {
    account.forget(kT);
    account.allow(moved_mm, glm::distance(from, hand));
    const double share = account.share_of(from, to, hand, slack_mm);
    EXPECT_GE(share, 0.0);
    EXPECT_LE(share, 1.0);
    const dvec3 next = from + share * (to - from);
    account.note(from, next, hand);
    return next;
}

TEST(ProxyAccount, LetsAProxyThatYieldsToTheHandGo) {
    ProxyAccount account;
    dvec3 proxy(0.0, 0.0, 0.0);
    for (int i = 1; i <= 1000; ++i) { // held by a plane and led along it
        const dvec3 hand(0.05 * i, 0.0, -3.0), next(0.05 * i, 0.0, 0.0);
        proxy = go(account, proxy, next, hand, 0.0);
        ASSERT_EQ(proxy, next) << i;
    }
}

TEST(ProxyAccount, LetsWhatSankInComeOutAgain) {
    ProxyAccount account;
    const dvec3 hand(0.0, 0.0, -3.0), on(0.0), in(0.0, 0.0, -0.5);
    EXPECT_EQ(go(account, on, in, hand, 0.0), in);
    // A hundredth of what was taken is forgotten in a tick.
    const dvec3 reached = go(account, in, on, hand, 0.0);
    const double taken = squared(on - hand) - squared(in - hand);
    EXPECT_NEAR(squared(reached - hand) - squared(in - hand), 0.99 * taken, 1e-12);
    EXPECT_NEAR(glm::distance(go(account, reached, on, hand, 0.0), reached), 0.0, 1e-12);
}

TEST(ProxyAccount, ForgetsWhatWasTakenLongAgo) {
    ProxyAccount account;
    const dvec3 hand(0.0, 0.0, -3.0), near(0.0, 0.0, -2.0);
    go(account, dvec3(0.0), near, hand, 0.0);
    for (int i = 0; i < 500; ++i) // 5 time constants, at rest
        go(account, near, near, hand, 0.0);
    const double gone =
        squared(go(account, near, dvec3(0.0), hand, 0.0) - hand) - squared(near - hand);
    EXPECT_LE(gone, 8.0 * std::exp(-4.9));
    EXPECT_GT(gone, 0.0);
}

// A tool that grows against a hand at rest: its surface stays where it is.
TEST(ProxyAccount, AllowsForAToolThatGrows) {
    ProxyAccount account;
    const dvec3 hand(0.0, 0.0, -3.0);
    dvec3 proxy(0.0);
    for (int i = 1; i <= 100; ++i) {
        const dvec3 next(0.0, 0.0, 0.01 * i);
        proxy = go(account, proxy, next, hand, 0.0, 0.01);
        ASSERT_NEAR(proxy.z, next.z, 1e-9) << i;
    }
}

// Whatever a proxy does, its own motion gives no more to the spring than what that holds over the
// slack, at the deepest.
TEST(ProxyAccount, ArbitraryMotionGivesNoMoreThanTheSlack) {
    std::mt19937 random(1);
    std::normal_distribution<double> step;
    for (const double slack_mm : {0.0, 0.02, 0.3}) {
        ProxyAccount account;
        dvec3 hand(0.0), proxy(0.0);
        double given = 0.0, deepest = 0.0;
        for (int i = 0; i < 100000; ++i) {
            hand += 0.05 * dvec3(step(random), step(random), step(random));
            if (squared(hand) > 100.0)
                hand *= 0.9;
            deepest = std::max(deepest, glm::distance(hand, proxy));
            // Now and then far, now and then to the hand, now and then nowhere.
            const double size = i % 100 == 0 ? 5.0 : 0.1;
            dvec3 wanted = proxy + size * dvec3(step(random), step(random), step(random));
            if (i % 37 == 0)
                wanted = hand;
            if (i % 41 == 0)
                wanted = proxy;
            const dvec3 next = go(account, proxy, wanted, hand, slack_mm);
            given += squared(next - hand) - squared(proxy - hand);
            proxy = next;
            ASSERT_LE(given, 2.0 * slack_mm * deepest + 1e-9) << i;
        }
    }
}

TEST(ProxyAccount, ResetForgetsWhatWasTaken) {
    ProxyAccount account;
    const dvec3 hand(0.0, 0.0, -3.0), near(0.0, 0.0, -2.0);
    go(account, dvec3(0.0), near, hand, 0.0);
    account.reset();
    EXPECT_EQ(go(account, near, dvec3(0.0), hand, 0.0), near);
}

} // namespace
} // namespace palpate
