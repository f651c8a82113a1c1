#include "engine/io/dicom_stack.h"

#include <gmock/gmock.h>

#include <cmath>

namespace palpate::io {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

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
                AllOf(HasSubstr("from 3 to 6 mm"), HasSubstr("004.dcm and 006.dcm"),
                      HasSubstr("1 slices seem to be missing")));
}

TEST(DicomStack, WarnsOfSlightlyUnevenGapsAndRefusesOthers) {
    auto frames = axial(9);
    frames[4].position->z += 0.2; // of 3 mm: 7 %
    const auto slight = stack_of(frames);
    ASSERT_TRUE(slight) << slight.error().message;
    EXPECT_THAT(slight->warnings,
                ElementsAre(AllOf(HasSubstr("from 2.8 to 3.2 mm"), HasSubstr("0.2 mm"))));
    frames[4].position->z += 0.8;
    EXPECT_THAT(stack_of(frames).error().message, HasSubstr("wrong by up to 1 mm"));
}

TEST(DicomStack, LeavesAScoutOut) {
    auto frames = axial(6);
    DicomFrame scout = frames[0];
    scout.file = "scout.dcm";
    scout.instance_uid = "1.2.99";
    scout.axes = glm::dmat2x3{{0, 1, 0}, {0, 0, -1}};
    frames.push_back(scout);
    const auto stack = stack_of(frames);
    ASSERT_TRUE(stack) << stack.error().message;
    EXPECT_EQ(stack->grid.size.z, 6u);
    EXPECT_THAT(stack->warnings,
                ElementsAre(AllOf(HasSubstr("scout.dcm"), HasSubstr("1 of 7 images"))));
}

TEST(DicomStack, RefusesAnEvenMix) {
    auto frames = axial(4);
    frames[0].size = frames[1].size = {8, 8};
    EXPECT_THAT(stack_of(frames).error().message,
                AllOf(HasSubstr("mixed sizes or orientations"), HasSubstr("8 x 8"),
                      HasSubstr("4 x 3"), HasSubstr("003.dcm"), HasSubstr("001.dcm")));
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
    for (DicomFrame later : axial(4)) {
        later.file = "later_" + later.file.string();
        later.instance_uid += ".1";
        later.instance_number += 100;
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
    EXPECT_THAT(choose_series({.path = "f", .series = "CT"}, all).error().message,
                HasSubstr("no series match"));
}

} // namespace
} // namespace palpate::io
