#include "engine/edit/edit_lag.h"

#include <gtest/gtest.h>

#include "engine/edit/editor.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

EditState snapshot(uint64_t number, int64_t input_ns) {
    static const Volume volume = make_volume(make_grid(glm::uvec3(4), glm::dvec3(1)),
                                             ScalarType::u8, [](glm::uvec3) { return 0.0; });
    return {.document = volume, .newest_input_ns = input_ns, .snapshot = number};
}

TEST(EditLag, CountsASnapshotOnceForEachReader) {
    EditLag lag;
    constexpr int64_t kMs = 1'000'000;
    lag.reached(EditLag::Reader::picture, snapshot(0, 0), 5 * kMs); // no edit yet
    for (int again = 0; again < 3; ++again) {
        lag.reached(EditLag::Reader::texture, snapshot(1, 10 * kMs), (12 + again) * kMs);
        lag.reached(EditLag::Reader::picture, snapshot(1, 10 * kMs), (40 + again) * kMs);
    }
    lag.reached(EditLag::Reader::picture, snapshot(5, 50 * kMs), 70 * kMs);
    lag.reached(EditLag::Reader::picture, snapshot(4, 45 * kMs), 90 * kMs); // older: not news
    const EditLag::Figures texture = lag.latency_ms(EditLag::Reader::texture);
    EXPECT_EQ(texture.count, 1u);
    EXPECT_EQ(texture.median, 2.0);
    const EditLag::Figures picture = lag.latency_ms(EditLag::Reader::picture);
    EXPECT_EQ(picture.count, 2u);
    EXPECT_EQ(picture.median, 20.0); // of 20 and 30
    EXPECT_EQ(picture.p99, 30.0);
    EXPECT_EQ(picture.most, 30.0);
    EXPECT_EQ(lag.latency_ms(EditLag::Reader::mesh).count, 0u);
}

TEST(EditLag, KeepsTheNewestReportsInBoundedMemory) {
    EditLag lag;
    constexpr uint64_t kReports = 50'000;
    for (uint64_t i = 1; i <= kReports; ++i) { // number i came after i ns
        const auto input_ns = static_cast<int64_t>(1'000'000 * i);
        lag.reached(EditLag::Reader::texture, snapshot(i, input_ns),
                    input_ns + static_cast<int64_t>(i));
    }
    const EditLag::Figures found = lag.latency_ms(EditLag::Reader::texture);
    EXPECT_GE(found.count, 10'000u);
    EXPECT_LE(found.count, 20'000u);
    EXPECT_EQ(found.most, 1e-6 * kReports);
    // Those that are kept are the last of all: their middle one is half of them before the end.
    EXPECT_NEAR(found.median, 1e-6 * static_cast<double>(kReports - found.count / 2), 2e-6);
}

TEST(EditLag, SaysHowManySnapshotsTheHandIsAheadOfTheEye) {
    EditLag lag;
    lag.feels(3);
    lag.reached(EditLag::Reader::picture, snapshot(3, 0), 1);
    lag.feels(9);
    lag.reached(EditLag::Reader::mesh, snapshot(4, 0), 1); // of pictures alone
    lag.reached(EditLag::Reader::picture, snapshot(4, 0), 1);
    lag.reached(EditLag::Reader::picture, snapshot(12, 0), 1); // the eye may be ahead, by no lag
    const EditLag::Figures ahead = lag.hand_eye_snapshots();
    EXPECT_EQ(ahead.count, 3u);
    EXPECT_EQ(ahead.median, 0.0);
    EXPECT_EQ(ahead.most, 5.0);
    const Json json = lag.json();
    EXPECT_EQ(json.find("hand_eye_lag_snapshots")->find("most")->number, 5.0);
    EXPECT_EQ(json.find("edit_to_texture_ms"), nullptr);
}

} // namespace
} // namespace palpate
