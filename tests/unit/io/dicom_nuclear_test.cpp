// The places of the frames of nuclear medicine, and how they follow one another.

#include <gmock/gmock.h>

#include "tests/unit/io/frame_truth.h"

namespace palpate {
namespace {

using test::decimal_string;
using test::decoded;
using test::DicomData;
using test::expect_truth;
using test::image_of;
using test::put_spacing;
using test::Random;
using test::random_truth;
using test::Stored;
using test::stored_frames;
using test::Truth;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kNuclearClass = "1.2.840.10008.5.1.4.1.1.20";

class DicomNuclear : public test::FramesInFiles {
 protected:
    std::string nuclear_error(const DicomData& data) { return error_of(data, kNuclearClass); }
};
INSTANTIATE_TEST_SUITE_P(Each, DicomNuclear, test::every_encoding_and_deflated(),
                         test::encoding_name);

// Vectors count from 1 for each frame.
DicomData nuclear(const Truth& truth, const std::vector<Stored>& frames) {
    DicomData data = image_of(truth, frames), detector;
    data.put(8, 8, "CS", "ORIGINAL\\PRIMARY\\RECON TOMO\\EMISSION").put(8, 0x60, "CS", "NM");
    data.put(0x18, 0x88, "DS", decimal_string({truth.step}));
    put_spacing(truth, data);
    detector.put(0x20, 0x32, "DS", decimal_string(truth.place(0)));
    detector.put(0x20, 0x37, "DS", decimal_string(truth.axes()));
    data.put_items(0x54, 0x22, {detector});
    std::vector<uint16_t> slices, times, ones(frames.size(), 1);
    for (const Stored& frame : frames) {
        slices.push_back(static_cast<uint16_t>(frame.slice + 1));
        times.push_back(static_cast<uint16_t>(frame.time + 1));
    }
    data.put_words(0x54, 0x80, slices).put_words(0x54, 0x81, {truth.slices});
    if (truth.times == 1)
        return data.put_words(0x28, 9, {0x54, 0x80}, "AT");
    data.put_words(0x54, 0x60, ones).put_words(0x54, 0x70, times);
    return data.put_words(0x28, 9, {0x54, 0x60, 0x54, 0x70, 0x54, 0x80}, "AT");
}

TEST_P(DicomNuclear, FramesFollowTheSliceVectorAndTheSignOfTheSpacing) {
    for (uint32_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Truth truth = random_truth(random, seed % 3 == 2);
        write(nuclear(truth, stored_frames(random, truth, seed % 2 == 1)), kNuclearClass);
        expect_truth(folder_ / "a.dcm", truth);
        // The first slice is the first of the volume, whichever way the others follow.
        const auto found = decoded(folder_ / "a.dcm");
        ASSERT_TRUE(found) << found.error().message;
        EXPECT_LT(glm::distance(glm::dvec3(found->decoded.grid.world_from_index[3]), truth.origin),
                  1e-5);
        if (truth.times > 1)
            EXPECT_THAT(found->decoded.notes, Contains(HasSubstr("ordered by TimeSlotVector")));
        else
            EXPECT_THAT(found->decoded.warnings, IsEmpty());
    }
}

TEST_P(DicomNuclear, FramesAreSlicesAlsoWithoutAPosition) {
    Random random(3);
    Truth truth = random_truth(random, true);
    truth.origin = {};
    truth.across = {1, 0, 0};
    truth.down = {0, 1, 0};
    DicomData data = nuclear(truth, stored_frames(random, truth, true)), detector;
    write(data.erase(0x54, 0x22), kNuclearClass);
    expect_truth(folder_ / "a.dcm", truth);
    detector.put(0x54, 0x200, "DS", "0"); // the start angle of a detector that states no more
    write(data.put_items(0x54, 0x22, {detector}), kNuclearClass);
    expect_truth(folder_ / "a.dcm", truth);
    EXPECT_THAT(decoded(folder_ / "a.dcm")->decoded.warnings,
                AllOf(Contains(HasSubstr("(0, 0, 0) mm is assumed")),
                      Contains(HasSubstr("orientation (axial)"))));
}

TEST_P(DicomNuclear, FramesAreRefusedByTheVectorThatDoesNotFit) {
    Random random(1);
    const Truth truth = random_truth(random, false);
    const DicomData data = nuclear(truth, stored_frames(random, truth, false));
    EXPECT_THAT(nuclear_error(DicomData(data).put_words(0x54, 0x80, {1, 2, 3, 4, 5, 6, 7, 8, 9})),
                AllOf(HasSubstr("SliceVector has 9 numbers"), HasSubstr("frames")));
    std::vector<uint16_t> slices(truth.slices);
    EXPECT_THAT(nuclear_error(DicomData(data).put_words(0x54, 0x80, slices)), HasSubstr("holds 0"));
    // Slices in order need no vector, those of several times do.
    EXPECT_EQ(nuclear_error(DicomData(data).erase(0x54, 0x80)), "read");
    expect_truth(folder_ / "a.dcm", truth);
    const Truth gated = random_truth(random, true);
    EXPECT_THAT(
        nuclear_error(nuclear(gated, stored_frames(random, gated, false)).erase(0x54, 0x80)),
        HasSubstr("SliceVector has 0 numbers"));
    // Every frame in one place, and no vector that tells them apart.
    std::fill(slices.begin(), slices.end(), 1);
    EXPECT_EQ(nuclear_error(DicomData(data).put_words(0x54, 0x80, slices)), "read");
    const auto cine = decoded(folder_ / "a.dcm");
    EXPECT_EQ(cine->decoded.grid.size.z, 1u);
    EXPECT_THAT(cine->decoded.notes, Contains(HasSubstr("order in the file")));
}

TEST_P(DicomNuclear, ProjectionsAreNoSlices) {
    Random random(1);
    Truth truth = random_truth(random, false);
    const std::vector<Stored> frames = stored_frames(random, truth, false);
    DicomData data = nuclear(truth, frames);
    std::vector<uint16_t> views(frames.size());
    for (size_t i = 0; i < views.size(); ++i)
        views[i] = static_cast<uint16_t>(views.size() - i);
    data.erase(0x54, 0x80).put_words(0x54, 0x90, views).put_words(0x28, 9, {0x54, 0x90}, "AT");
    write(data, kNuclearClass);
    const auto last = decoded(folder_ / "a.dcm", 0);
    ASSERT_TRUE(last) << last.error().message;
    EXPECT_EQ(last->decoded.grid.size.z, 1u);
    EXPECT_EQ(last->values[0], Truth::value(0, 0, truth.slices - 1, 0)); // view 1 is stored last
}

} // namespace
} // namespace palpate
