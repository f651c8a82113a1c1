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

TEST(ProxyAccount, LetsAProxyThatYieldsToTheHandGo) {
    ProxyAccount account;
    dvec3 proxy(0.0, 0.0, 0.0);
    for (int i = 1; i <= 1000; ++i) { // held by a plane and led along it
        const dvec3 hand(0.05 * i, 0.0, -3.0), next(0.05 * i, 0.0, 0.0);
        ASSERT_EQ(account.share_of(proxy, next, hand, 0.0, kT), 1.0) << i;
        proxy = next;
    }
}

TEST(ProxyAccount, LetsWhatSankInComeOutAgain) {
    ProxyAccount account;
    const dvec3 hand(0.0, 0.0, -3.0), on(0.0), in(0.0, 0.0, -0.5);
    EXPECT_EQ(account.share_of(on, in, hand, 0.0, kT), 1.0);
    // Of what was taken a hundredth is forgotten in a tick.
    const double share = account.share_of(in, on, hand, 0.0, kT);
    const dvec3 reached = in + share * (on - in);
    const double taken = squared(on - hand) - squared(in - hand);
    EXPECT_NEAR(squared(reached - hand) - squared(in - hand), 0.99 * taken, 1e-12);
    EXPECT_EQ(account.share_of(reached, on, hand, 0.0, kT), 0.0);
}

TEST(ProxyAccount, ForgetsWhatWasTakenLongAgo) {
    ProxyAccount account;
    const dvec3 hand(0.0, 0.0, -3.0), near(0.0, 0.0, -2.0);
    account.share_of(dvec3(0.0), near, hand, 0.0, kT);
    for (int i = 0; i < 500; ++i) // 5 time constants, at rest
        account.share_of(near, near, hand, 0.0, kT);
    const double share = account.share_of(near, dvec3(0.0), hand, 0.0, kT);
    const double gone = squared(near + share * -near - hand) - squared(near - hand);
    EXPECT_LE(gone, 8.0 * std::exp(-4.9));
    EXPECT_GT(gone, 0.0);
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
            const double share = account.share_of(proxy, wanted, hand, slack_mm, kT);
            ASSERT_GE(share, 0.0);
            ASSERT_LE(share, 1.0);
            const dvec3 next = proxy + share * (wanted - proxy);
            given += squared(next - hand) - squared(proxy - hand);
            proxy = next;
            ASSERT_LE(given, 2.0 * slack_mm * deepest + 1e-9) << i;
        }
    }
}

TEST(ProxyAccount, ResetForgetsWhatWasTaken) {
    ProxyAccount account;
    const dvec3 hand(0.0, 0.0, -3.0), near(0.0, 0.0, -2.0);
    account.share_of(dvec3(0.0), near, hand, 0.0, kT);
    account.reset();
    EXPECT_EQ(account.share_of(near, dvec3(0.0), hand, 0.0, kT), 0.0);
}

} // namespace
} // namespace palpate
