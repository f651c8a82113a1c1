// Clip planes and their handles.

#include "apps/view/tools/clip_tool.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

constexpr Panel kSlices[] = {Panel::axial, Panel::coronal, Panel::sagittal};

double offset_of(const ClipPlane& plane) {
    return glm::dot(plane.normal, plane.point_mm);
}

// A crop box of a tenth keeps 0.8^3 of the sampled box: its outlines lie on the faces of that box.
TEST(ClipTool, ACropBoxLiesATenthWithinTheVolume) {
    std::mt19937 random(1);
    for (int i = 0; i < 20; ++i) {
        const Subject subject = subject_of(random_grid(random));
        ViewState state = subject.home;
        set_crop_box(state, subject.grid);
        ASSERT_EQ(state.notes.clip_planes.size(), 6u);
        const glm::dvec3 last = glm::dvec3(subject.grid.size) - 1.0;
        for (size_t k = 0; k < 6; ++k) {
            EXPECT_NEAR(glm::length(state.notes.clip_planes[k].normal), 1.0, 1e-12);
            const auto outline = clip_outline(subject.grid, state.notes.clip_planes, k);
            ASSERT_EQ(outline.size(), 4u);
            for (const glm::dvec3 p : outline) {
                const glm::dvec3 share = index_point(subject.grid, p) / last;
                for (int axis = 0; axis < 3; ++axis)
                    EXPECT_NEAR(std::abs(share[axis] - 0.5), 0.4, 1e-4); // a corner
            }
        }
    }
}

TEST(ClipTool, APlaneGoesThroughThePointUnderThePointer) {
    std::mt19937 random(2);
    int dragged = 0;
    for (int i = 0; i < 100; ++i) {
        const Subject subject = subject_of(random_grid(random));
        TestHand hand{subject};
        hand.state.sections.set(Section::clips, true);
        set_crop_box(hand.state, subject.grid);
        const Panel panel = kSlices[random() % 3];
        const auto handles = clip_handles(hand.state, subject.grid, panel);
        ASSERT_EQ(handles.size(), 8u); // two of each of four lines
        const ClipHandle handle = handles[2 * (random() % 4)];
        ASSERT_FALSE(handle.turns);
        // Towards the volume's middle, so that it stays in the box.
        const glm::dvec2 middle =
            pixel_of(hand.state, subject.grid, panel, center_mm(subject.grid)).value();
        const glm::dvec2 to = handle.at_px + 0.4 * (middle - handle.at_px);
        const auto before = hand.state.notes.clip_planes;
        hand.drag(handle.at_px, to, Button::left);
        const ClipPlane& plane = hand.state.notes.clip_planes[handle.plane];
        EXPECT_NEAR(offset_of(plane),
                    glm::dot(plane.normal, point_under(hand.state, subject.grid, panel, to)), 1e-9);
        EXPECT_LT(glm::distance(plane.normal, before[handle.plane].normal), 1e-12);
        for (size_t k = 0; k < 6; ++k)
            if (k != handle.plane) {
                EXPECT_EQ(hand.state.notes.clip_planes[k], before[k]);
            }
        EXPECT_FALSE(hand.state.clipping.held);
        ++dragged;
    }
    EXPECT_EQ(dragged, 100);
}

TEST(ClipTool, ARingTurnsAPlaneSoThatItsLineRunsThroughThePointer) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1, 1, 2)));
    TestHand hand{subject};
    hand.state.sections.set(Section::clips, true);
    hand.state.notes.clip_planes = {{center_mm(subject.grid), {0, 1, 0}}};
    ClipHandle ring{};
    for (const ClipHandle& handle : clip_handles(hand.state, subject.grid, Panel::axial))
        if (handle.turns)
            ring = handle;
    ASSERT_TRUE(ring.turns);
    const glm::dvec2 to = ring.at_px + glm::dvec2(-5, 40);
    hand.drag(ring.at_px, to, Button::left);
    const ClipPlane& plane = hand.state.notes.clip_planes[0];
    EXPECT_NEAR(glm::length(plane.normal), 1.0, 1e-12);
    EXPECT_NEAR(glm::dot(plane.normal, hand.state.slices[0].towards), 0.0, 1e-9);
    EXPECT_NEAR(offset_of(plane),
                glm::dot(plane.normal, point_under(hand.state, subject.grid, Panel::axial, to)),
                1e-9);
    EXPECT_GT(plane.normal.y, 0.0); // the same side is kept
}

// In 3D the handle follows the pointer along the plane's normal.
TEST(ClipTool, AHandleInTheVolumeStaysUnderThePointer) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    hand.state.sections.set(Section::clips, true);
    set_crop_box(hand.state, subject.grid);
    for (const ClipHandle& handle : clip_handles(hand.state, subject.grid, Panel::volume)) {
        const ClipPlane before = hand.state.notes.clip_planes[handle.plane];
        // The goal is the place of the handle 5 mm further in.
        const glm::dvec3 goal = handle.at_mm + 5.0 * before.normal;
        const glm::dvec2 to = pixel_of(hand.state, subject.grid, Panel::volume, goal).value();
        hand.drag(handle.at_px, to, Button::left);
        EXPECT_NEAR(offset_of(hand.state.notes.clip_planes[handle.plane]), offset_of(before) + 5.0,
                    1e-6);
        hand.state.notes.clip_planes[handle.plane] = before;
    }
}

TEST(ClipTool, WithoutItsTabNothingIsTakenHoldOf) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    set_crop_box(hand.state, subject.grid);
    EXPECT_TRUE(clip_handles(hand.state, subject.grid, Panel::axial).empty());
}

TEST(ClipTool, APlaneStaysWithinTheVolumesBox) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    hand.state.sections.set(Section::clips, true);
    set_crop_box(hand.state, subject.grid);
    const ClipHandle handle = clip_handles(hand.state, subject.grid, Panel::axial).front();
    for (const glm::dvec2 to : {glm::dvec2(-9999), glm::dvec2(9999)}) {
        hand.move(handle.at_px);
        hand.press(Button::left);
        hand.move(to);
        hand.release(Button::left);
        EXPECT_FALSE(
            clip_outline(subject.grid, hand.state.notes.clip_planes, handle.plane).empty() &&
            clip_outline(subject.grid, {hand.state.notes.clip_planes[handle.plane]}, 0).empty());
        set_crop_box(hand.state, subject.grid);
        hand.time_s += 1.0;
    }
}

} // namespace
} // namespace palpate::view
