#include "bench/suite/panel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate::bench {
namespace {

using ::testing::HasSubstr;

Bench::Drawn drawn(double step, double ms, double rmse) {
    Bench::Drawn one;
    one.setting.step_samples = step;
    one.frames.wall_ms = std::vector<double>(9, ms);
    one.frames.gpu_ms = one.frames.cpu_ms = one.frames.wall_ms;
    one.errors = {.rmse = rmse, .unit = "colour"};
    return one;
}

PeerPoint peer(const char* mapper, double ms, double rmse) {
    return {.subject = "ball/alpha",
            .mapper = mapper,
            .wall_ms = std::vector<double>(9, ms),
            .cpu_ms = std::vector<double>(9, ms),
            .errors = Errors{.rmse = rmse}};
}

class Panel : public testing::Test {
 protected:
    Sample sample_ = ball(16);
    Subject subject_ = alpha_subject(sample_, window_function(0, 1000, 0.5), "");
    std::vector<std::string> failures_;
};

TEST_F(Panel, SaysWhereWeAreBelowEveryPeer) {
    const std::vector ours{drawn(1.0, 10, 0.02), drawn(0.5, 20, 0.005)};
    const Json panel = panel_json(subject_, ours, {peer("gpu", 40, 0.01), peer("fixed", 15, 0.03)},
                                  {64, 1}, failures_);
    EXPECT_EQ(panel["below_all_peers"], true);
    EXPECT_EQ(panel["default_on_front"], true);
    EXPECT_TRUE(failures_.empty());
    EXPECT_EQ(panel["points"].items.size(), 4u);
    EXPECT_EQ(panel["points"].items[2]["our_point"],
              "fast, step 0.5"); // of the faster, the most exact
    EXPECT_EQ(panel["points"].items[2]["times_faster"], 2.0);
    EXPECT_EQ(panel["points"].items[2]["times_less_error"], 2.0);
    EXPECT_EQ(panel["points"].items[3]["our_point"], "fast, step 1");
}

TEST_F(Panel, OnePeerNotBeatenIsSaid) {
    const std::vector ours{drawn(1.0, 10, 0.02), drawn(0.5, 20, 0.005)};
    // Faster than ours of that error, and equal: neither is strictly below.
    for (const PeerPoint& hard : {peer("fixed", 15, 0.01), peer("fixed", 10, 0.02)}) {
        const Json panel =
            panel_json(subject_, ours, {peer("gpu", 40, 0.01), hard}, {64, 1}, failures_);
        EXPECT_EQ(panel["below_all_peers"], false);
        EXPECT_EQ(panel["points"].items[2]["we_are_below"], true);
        EXPECT_EQ(panel["points"].items[3]["we_are_below"], false);
    }
    EXPECT_TRUE(failures_.empty()); // that is no failure of a default
    EXPECT_FALSE(panel_json(subject_, ours, {}, {64, 1}, failures_).contains("below_all_peers"));
}

TEST_F(Panel, ADefaultBehindItsFrontFailsWithASentence) {
    const std::vector ours{drawn(1.0, 10, 0.02), drawn(0.5, 8, 0.005)};
    Json panel = panel_json(subject_, ours, {}, {64, 1}, failures_);
    EXPECT_EQ(panel["default_on_front"], false);
    ASSERT_EQ(failures_.size(), 1u);
    EXPECT_THAT(failures_[0],
                HasSubstr("ball/alpha: the default (fast, step 1: 10.0 ms, 0.02 colour) is not on "
                          "its front: fast, step 0.5 takes 8.0 ms and errs by 0.005"));
    subject_.judged = false;
    failures_.clear();
    panel = panel_json(subject_, ours, {}, {64, 1}, failures_);
    EXPECT_EQ(panel["default_on_front"], false);
    EXPECT_TRUE(failures_.empty());
}

TEST(Convergence, FitsAboveTheFloorOnly) {
    // Order 2 down to a floor of 1e-5 that rounding sets.
    std::vector<double> steps, errors;
    for (double step = 1.0; step > 0.005; step *= 0.5) {
        steps.push_back(step);
        errors.push_back(std::hypot(0.1 * step * step, 1e-5));
    }
    const Json v = convergence_json("title", "fast", steps, errors);
    // Four times above the floor it adds at most 1/32 to one point: 0.045 in its logarithm, and so
    // to the order less than 0.045 / ln 2 / 2.
    EXPECT_NEAR(v["order"].number, 2.0, 0.033);
    EXPECT_LT(v["fitted_points"].number, double(steps.size()));
    EXPECT_EQ(v["fitted_to"], 1.0);
    // Nothing but floor: no order.
    EXPECT_FALSE(convergence_json("", "fast", {1, 0.5}, {1e-5, 1e-5}).contains("order"));
}

} // namespace
} // namespace palpate::bench
