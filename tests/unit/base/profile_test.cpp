#include "engine/base/profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

class Profile : public TemporaryFolder {
 protected:
    nlohmann::json saved() const {
        const Result<void> result = profile::save(file("trace.json"));
        EXPECT_TRUE(result) << result.error().message;
        return nlohmann::json::parse(bytes_of("trace.json"));
    }
    static std::vector<nlohmann::json> spans(const nlohmann::json& trace) {
        std::vector<nlohmann::json> found;
        for (const auto& event : trace["traceEvents"])
            if (event["ph"] == "X")
                found.push_back(event);
        return found;
    }
};

TEST_F(Profile, RecordsNothingUntilStarted) {
    EXPECT_FALSE(profile::on());
    {
        const profile::Scope scope("unseen");
        EXPECT_FALSE(scope.recorded());
        profile::add(profile::Track::passes, "unseen", 1, 2);
    }
    EXPECT_TRUE(spans(saved()).empty());
}

TEST_F(Profile, ScopesNestAndCarryWhatTheyAreTold) {
    profile::start();
    profile::name_thread("the test");
    const int64_t before = profile::now_ns();
    {
        profile::Scope outer("outer");
        ASSERT_TRUE(outer.recorded());
        outer.tell("answer", 42.0);
        outer.tell("text", "a \"quoted\" word\n");
        const profile::Scope inner("inner");
    }
    const int64_t after = profile::now_ns();
    const nlohmann::json trace = saved();
    const auto found = spans(trace);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0]["name"], "outer"); // outer ones first, though they end last
    EXPECT_EQ(found[1]["name"], "inner");
    EXPECT_EQ(found[0]["args"]["answer"], 42.0);
    EXPECT_EQ(found[0]["args"]["text"], "a \"quoted\" word\n");
    const auto start = [](const auto& e) { return e["ts"].template get<double>(); };
    const auto end = [&](const auto& e) { return start(e) + e["dur"].template get<double>(); };
    EXPECT_GE(start(found[0]), 0.0);
    EXPECT_LE(start(found[0]), start(found[1]));
    EXPECT_GE(end(found[0]), end(found[1]) - 1e-3); // a nanosecond: sums of doubles
    EXPECT_LE(end(found[0]) - start(found[0]), static_cast<double>(after - before) * 1e-3);
    EXPECT_TRUE(std::any_of(
        trace["traceEvents"].begin(), trace["traceEvents"].end(),
        [](const auto& e) { return e["ph"] == "M" && e["args"]["name"] == "the test"; }));
    EXPECT_FALSE(profile::on());
}

TEST_F(Profile, ThreadsAndTracksAreLinesOfTheirOwn) {
    profile::start();
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([] {
            for (int k = 0; k < 100; ++k)
                const profile::Scope scope("work");
        });
    for (auto& thread : threads)
        thread.join();
    const int64_t now = profile::now_ns();
    profile::add(profile::Track::passes, "ray cast", now, now + 1500, {{"gpu_ms", 0.0015}});
    const auto found = spans(saved());
    EXPECT_EQ(found.size(), 401u);
    std::set<int> lines;
    for (const auto& span : found) {
        if (span["pid"] == 1)
            lines.insert(span["tid"].get<int>());
        else
            EXPECT_EQ(span["dur"], 1.5); // microseconds, to the nanosecond
    }
    EXPECT_EQ(lines.size(), 4u);
}

TEST_F(Profile, ASecondRecordingForgetsTheFirst) {
    profile::start();
    { const profile::Scope scope("first"); }
    const profile::Scope across("begun in the first, ended in the second");
    profile::start();
    { const profile::Scope scope("second"); }
    const auto found = spans(saved());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0]["name"], "second");
}

TEST_F(Profile, SaysHowManySpansItDropped) {
    profile::start();
    constexpr int kMore = 5;
    for (int i = 0; i < (1 << 20) + kMore; ++i)
        profile::add(profile::Track::copies, "", 0, 0);
    // Not parsed whole: a million events. The header says it.
    ASSERT_TRUE(profile::save(file("trace.json")));
    EXPECT_NE(bytes_of("trace.json").substr(0, 200).find("\"dropped_spans\":5"), std::string::npos);
}

TEST_F(Profile, CostsNothingWhileOff) {
    // A load and two branches: about a nanosecond. Twenty allow for slow machines and sanitizers;
    // recording, with two clocks and a lock, could not pass.
    ASSERT_FALSE(profile::on());
    double best_ns = 1e9;
    for (int repeat = 0; repeat < 20; ++repeat) {
        const int64_t start = profile::now_ns();
        for (int i = 0; i < 10000; ++i)
            const profile::Scope scope("off");
        best_ns = std::min(best_ns, static_cast<double>(profile::now_ns() - start) / 10000.0);
    }
    EXPECT_LT(best_ns, 20.0);
}

TEST_F(Profile, ATraceThatCannotBeWrittenIsOneSentence) {
    profile::start();
    const Result<void> result = profile::save(file("no/such/folder/trace.json"));
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().message.find("trace.json: cannot be written"), std::string::npos);
}

} // namespace
} // namespace palpate
