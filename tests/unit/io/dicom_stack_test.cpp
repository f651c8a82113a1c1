#include "engine/decode/dicom_stack.h"

#include <gmock/gmock.h>

#include <cmath>

namespace palpate::io {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// `count` axial images of 4 x 3 at 0.5 x 0.75 mm, 3 mm apart from z = 10 mm upwards, stored from
// the top down.
std::vector<DicomFrame> axial(int count) {
    std::vector<DicomFrame> frames;
    for (int i = count - 1; i >= 0; --i) {
        DicomFrame& frame = frames.emplace_back();
        frame.file = fmt::format("{:03}.dcm", i);
        frame.instance_uid = fmt::format("1.2.{}", i);
        frame.instance_number = i;
        frame.size = {4, 3};
        frame.position = glm::dvec3(-7, 8, 10 + 3 * i);
        frame.axes = glm::dmat2x3{{1, 0, 0}, {0, 1, 0}};
        frame.spacing_mm = glm::dvec2(0.5, 0.75);
    }
    return frames;
}

Result<DicomStack> stack_of(std::vector<DicomFrame> frames, std::optional<uint32_t> frame = {}) {
    return make_stack({.path = "folder", .frame = frame}, {"", "", "", std::move(frames)});
}

Result<DicomStack> resampled_stack(std::vector<DicomFrame> frames) {
    return make_stack({.path = "folder", .resample_slices = true}, {"", "", "", std::move(frames)});
}

// Images at z_mm, otherwise as those of axial().
std::vector<DicomFrame> axial_at(const std::vector<double>& z_mm) {
    std::vector<DicomFrame> frames = axial(static_cast<int>(z_mm.size()));
    for (size_t i = 0; i < z_mm.size(); ++i)
        frames[z_mm.size() - 1 - i].position->z = z_mm[i];
    return frames;
}

// Five slices 4.22 mm apart, a gap of 1.14 mm, four slices 7.38 mm apart.
std::vector<double> two_blocks() {
    std::vector<double> z_mm;
    for (int i = 0; i < 5; ++i)
        z_mm.push_back(-10 + 4.22 * i);
    for (int i = 0; i < 4; ++i)
        z_mm.push_back(-10 + 4 * 4.22 + 1.14 + 7.38 * i);
    return z_mm;
}

TEST(DicomStack, SortsAlongTheNormal) {
    const auto stack = stack_of(axial(5));
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_EQ(stack->grid.size, glm::uvec3(4, 3, 5));
    EXPECT_EQ(stack->frames[0].file, "000.dcm");
    EXPECT_EQ(stack->grid.world_from_index[3], glm::dvec4(-7, 8, 10, 1));
    EXPECT_EQ(stack->grid.world_from_index[2], glm::dvec4(0, 0, 3, 0));
    EXPECT_EQ(stack->grid.world_from_index[0], glm::dvec4(0.5, 0, 0, 0));
    EXPECT_EQ(stack->grid.world_from_index[1], glm::dvec4(0, 0.75, 0, 0));
    EXPECT_THAT(stack->warnings, IsEmpty());
}

TEST(DicomStack, KeepsTheShearOfATiltedGantry) {
    auto frames = axial(10);
    const double tilt = 15.0 * std::acos(-1.0) / 180.0;
    for (DicomFrame& frame : frames)
        frame.position->y += std::tan(tilt) * frame.position->z;
    const auto stack = stack_of(frames);
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_NEAR(stack->grid.world_from_index[2].y, 3 * std::tan(tilt), 1e-12);
    EXPECT_NEAR(stack->grid.world_from_index[2].z, 3.0, 1e-12);
    EXPECT_THAT(stack->warnings, ElementsAre(AllOf(HasSubstr("tilt"), HasSubstr("15.00 degrees"))));
}

TEST(DicomStack, NamesAMissingSlice) {
    auto frames = axial(10);
    frames.erase(frames.begin() + 4); // 005.dcm
    EXPECT_THAT(stack_of(frames).error().message,
                AllOf(HasSubstr("5 slices 3 mm apart"), HasSubstr("a gap of 6 mm"),
                      HasSubstr("004.dcm and 006.dcm"), HasSubstr("1 slice seems to be missing"),
                      HasSubstr("--resample-slices")));
}

TEST(DicomStack, WarnsOfSlightlyUnevenGapsAndRefusesOthers) {
    auto frames = axial(9);
    frames[4].position->z += 0.2; // of 3 mm: 7 %
    const auto slight = stack_of(frames);
    ASSERT_TRUE(slight) << slight.error().message;
    EXPECT_THAT(slight->warnings,
                ElementsAre(AllOf(HasSubstr("a gap of 3.2 mm"), HasSubstr("a gap of 2.8 mm"),
                                  HasSubstr("0.2 mm from their place"))));
    frames[4].position->z += 0.8;
    EXPECT_THAT(stack_of(frames).error().message, HasSubstr("wrong by up to 1 mm"));
}

TEST(DicomStack, SaysWhichBlocksASeriesHas) {
    const auto refused = stack_of(axial_at(two_blocks()));
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message,
                AllOf(HasSubstr("5 slices 4.22 mm apart (at -10 .. 6.88 mm)"),
                      HasSubstr("a gap of 1.14 mm"),
                      HasSubstr("4 slices 7.38 mm apart (at 8.02 .. 30.16 mm)"),
                      HasSubstr("not evenly spaced"), Not(HasSubstr("missing"))));
}

TEST(DicomStack, HasHolesWhereDamagedFilesExplainThem) {
    auto frames = axial(10);
    frames.erase(frames.begin() + 3, frames.begin() + 5); // 006.dcm and 005.dcm
    const auto make = [&](size_t damaged) {
        return make_stack({.path = "folder"}, {"", "", "", frames}, damaged);
    };
    EXPECT_THAT(make(1).error().message, HasSubstr("2 slices seem to be missing"));
    const auto stack = make(2);
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_EQ(stack->grid.size.z, 10u);
    EXPECT_EQ(stack->frames[5].file, "");
    EXPECT_EQ(stack->frames[6].file, "");
    EXPECT_EQ(stack->frames[7].file, "007.dcm");
    EXPECT_EQ(stack->grid.world_from_index[2], glm::dvec4(0, 0, 3, 0));
    EXPECT_THAT(stack->warnings, ElementsAre(HasSubstr("2 of 10 slices are missing")));
}

TEST(DicomStack, ResamplesToTheFinestBlock) {
    const auto stack = resampled_stack(axial_at(two_blocks()));
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_TRUE(stack->resampled);
    EXPECT_EQ(stack->frames.size(), 9u);
    // 40.16 mm in steps of at most 4.22 mm are ten.
    EXPECT_EQ(stack->grid.size, glm::uvec3(4, 3, 11));
    EXPECT_NEAR(stack->grid.world_from_index[2].z, 4.016, 1e-12);
    EXPECT_THAT(stack->warnings, ElementsAre(AllOf(HasSubstr("1.14 mm"), HasSubstr("11 slices"),
                                                   HasSubstr("4.016 mm apart"))));
}

TEST(DicomStack, ResamplingMakesATiltedStackUpright) {
    auto frames = axial(10);
    for (DicomFrame& frame : frames)
        frame.position->y += 0.5 * frame.position->z; // 1.5 mm a slice, 2 rows
    const auto stack = resampled_stack(frames);
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_EQ(stack->grid.size, glm::uvec3(4, 3 + 18, 10));
    EXPECT_NEAR(glm::distance(stack->grid.world_from_index[2], glm::dvec4(0, 0, 3, 0)), 0, 1e-12);
    EXPECT_THAT(stack->warnings, ElementsAre(AllOf(HasSubstr("26.57 degrees"), // atan 0.5
                                                   HasSubstr("4 x 3"), HasSubstr("4 x 21"))));
}

TEST(DicomStack, ResamplingARegularStackIsSaidToDoNothing) {
    const auto stack = resampled_stack(axial(4));
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_FALSE(stack->resampled);
    EXPECT_THAT(stack->warnings, ElementsAre(HasSubstr("has no effect")));
}

TEST(DicomStack, DropsCopies) {
    auto frames = axial(5);
    frames.push_back(frames[2]);
    frames.back().file = "copy.dcm";
    const auto stack = stack_of(frames);
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_EQ(stack->grid.size.z, 5u);
    EXPECT_THAT(stack->warnings, ElementsAre(HasSubstr("copy.dcm repeats 002.dcm")));
}

TEST(DicomStack, RefusesADuplicatePosition) {
    auto frames = axial(5);
    frames.push_back(frames[2]);
    frames.back().file = "other.dcm";
    frames.back().instance_uid = "1.2.77";
    EXPECT_THAT(stack_of(frames).error().message,
                AllOf(HasSubstr("duplicate positions"), HasSubstr("002.dcm"),
                      HasSubstr("other.dcm"), HasSubstr("16.000 mm")));
}

TEST(DicomStack, SplitsATimeSeriesIntoFrames) {
    auto frames = axial(4);
    for (DicomFrame& frame : frames)
        frame.marks[FrameKey::acquisition_number] = 1;
    for (DicomFrame later : axial(4)) {
        later.file = "later_" + later.file.string();
        later.instance_uid += ".1";
        later.marks[FrameKey::acquisition_number] = 2;
        frames.push_back(later);
    }
    const auto first = stack_of(frames);
    ASSERT_TRUE(first) << first.error().message;
    EXPECT_EQ(first->grid.size.z, 4u);
    EXPECT_EQ(first->frames[2].file, "002.dcm");
    EXPECT_THAT(first->warnings, ElementsAre(HasSubstr("2 frames")));
    EXPECT_EQ(stack_of(frames, 1)->frames[2].file, "later_002.dcm");
    EXPECT_THAT(stack_of(frames, 2).error().message, HasSubstr("no frame 2"));
}

TEST(DicomSeries, SeparatesPlanesAndObjects) {
    std::vector<DicomFrame> frames = axial(6);
    for (DicomFrame& frame : frames)
        frame.series_uid = "1.1";
    frames[0].axes = glm::dmat2x3{{0, 1, 0}, {0, 0, -1}};
    frames[1].axes = frames[0].axes;
    frames[2].size = {8, 8};
    frames[3].object = DicomObject::other;
    frames[3].object_words = "is a report";
    const auto all = group_series(frames);
    ASSERT_EQ(all.size(), 4u);
    const std::vector<SeriesInfo> list = list_series(all, 1);
    ASSERT_EQ(list.size(), 4u);
    EXPECT_EQ(list[0].content, "2 images of 4 x 3 at 0.5 x 0.75 mm, sagittal");
    EXPECT_EQ(list[1].content, "2 images of 4 x 3 at 0.5 x 0.75 mm, axial");
    EXPECT_EQ(list[3].content, "1 file (passed over: is a report)");
    for (uint32_t i = 0; i < 4; ++i) {
        EXPECT_EQ(list[i].number, i + 1);
        EXPECT_EQ(list[i].count, 4u);
        EXPECT_EQ(list[i].is_read, i == 1);
    }
    EXPECT_EQ(choose_series({.path = "f", .series = "3"}, all).value(), 2u);
    EXPECT_EQ(choose_series({.path = "f", .series = "1.1"}, all).value(), 0u);
    EXPECT_THAT(choose_series({.path = "f", .series = "4"}, all).error().message,
                HasSubstr("is a report"));
    EXPECT_THAT(choose_series({.path = "f", .series = "5"}, all).error().message,
                AllOf(HasSubstr("no series match '5'"), HasSubstr("series 4 of 4")));
}

TEST(DicomSeries, IsTheLargestOrTheOneNamed) {
    std::vector<DicomFrame> frames = axial(5);
    for (size_t i = 0; i < frames.size(); ++i) {
        frames[i].series_uid = i < 2 ? "1.1" : "1.2";
        frames[i].series_description = i < 2 ? "T1 axial" : "T2 axial";
    }
    const auto all = group_series(frames);
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[choose_series({.path = "f"}, all).value()].uid, "1.2");
    EXPECT_EQ(all[choose_series({.path = "f", .series = "1.1"}, all).value()].uid, "1.1");
    EXPECT_EQ(all[choose_series({.path = "f", .series = "t1"}, all).value()].uid, "1.1");
    EXPECT_THAT(choose_series({.path = "f", .series = "axial"}, all).error().message,
                AllOf(HasSubstr("2 series match"), HasSubstr("1.1"), HasSubstr("T2 axial")));
    EXPECT_EQ(all[choose_series({.path = "f", .series = "t1 AXIAL"}, all).value()].uid, "1.1");
    EXPECT_THAT(choose_series({.path = "f", .series = "CT"}, all).error().message,
                HasSubstr("no series match"));
}

} // namespace
} // namespace palpate::io
