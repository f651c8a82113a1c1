#include "tests/unit/haptics_proxy/statuses.h"

#include <gtest/gtest.h>

namespace palpate::haptics {
namespace {

constexpr double kRounding = 1e-9; // N, Nm
// A tool's contacts may rearrange by so much under a hand at rest (docs/haptics.md, asked).
constexpr double kAtRest_n = 0.02;

std::vector<StatusCase> cases() {
    std::vector<StatusCase> cases;
    const auto labels = TouchSource::labels;
    for (const char* algorithm : {"swept-point", "swept-local", "swept-mesh", "swept-tool"}) {
        const bool is_tool = std::string_view(algorithm) == "swept-tool";
        const double radius = is_tool ? 1.5 : 0.0;
        cases.push_back({.algorithm = algorithm, .radius_mm = radius});
        cases.push_back({.algorithm = algorithm, .radius_mm = radius, .yield_n = 0.8});
        cases.push_back({.algorithm = algorithm, .radius_mm = radius, .hertz = 100.0});
        cases.push_back(
            {.algorithm = algorithm, .radius_mm = radius, .hertz = 10000.0, .friction = 0.3});
        if (std::string_view(algorithm) != "swept-mesh")
            cases.push_back({.algorithm = algorithm, .source = labels, .radius_mm = radius});
    }
    for (const double yield_n : {0.0, 0.8})
        cases.push_back({.algorithm = "swept-tool",
                         .radius_mm = 1.5,
                         .is_capsule = true,
                         .yield_n = yield_n,
                         .friction = 0.4});
    for (size_t i = 0; i < cases.size(); ++i)
        cases[i].seed = i;
    return cases;
}

TEST(Statuses, FollowOneAnotherUnderAHandAtRestWithoutAJump) {
    StatusScenes scenes;
    std::set<std::pair<Contact, Contact>> changes;
    for (const StatusCase& c : cases()) {
        const int edits = c.hertz > 1000.0 ? 8 : 40;
        const StatusRun run = change_statuses(c, scenes, edits);
        EXPECT_TRUE(run.is_finite) << name_of(c);
        EXPECT_GT(run.most_n, 0.2) << name_of(c);
        const bool is_tool = std::string_view(c.algorithm) == "swept-tool";
        const double rests_n = is_tool ? kAtRest_n : kRounding;
        EXPECT_LE(run.most_change_n, rests_n)
            << name_of(c) << ": from status " << int(run.from) << " to " << int(run.to);
        EXPECT_LE(run.most_torque_change_nm, 1e-3 * run.reach_mm * rests_n) << name_of(c);
        if (c.is_capsule) {
            EXPECT_GT(run.most_nm, 1e-4) << name_of(c);
        }
        changes.insert(run.changes.begin(), run.changes.end());
    }
    // A hand at rest is never behind. Matter yields from `touching` on, once force has come.
    constexpr Contact kMet[] = {Contact::free, Contact::touching, Contact::submerged,
                                Contact::unknown};
    for (const Contact from : kMet)
        for (const Contact to : kMet)
            if (from != to) {
                EXPECT_TRUE(changes.contains({from, to})) << int(from) << " to " << int(to);
            }
    EXPECT_TRUE(changes.contains({Contact::touching, Contact::yielding}));
    EXPECT_TRUE(changes.contains({Contact::yielding, Contact::touching}));
    EXPECT_TRUE(changes.contains({Contact::yielding, Contact::unknown}));
}

} // namespace
} // namespace palpate::haptics
