// Tests of what a person sees and hears of milling in the window.

#include <gtest/gtest.h>

#include "engine/volume/builder.h"
#include "haptics/sound/milling.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

// A hand that goes down the axis of synthetic:ball, with its first button pressed from 1.2 s on.
HandOptions drilling_hand() {
    HandOptions hand{.device = "exact", .algorithm = "swept-point"};
    std::vector<haptics::HandPose> poses;
    for (int i = 0; i < 300; ++i)
        poses.push_back({.time_s = 0.02 * i,
                         .tool = {.position_mm = {0.0, 0.0, 45.0 - 0.1 * i}},
                         .buttons = i > 60 ? 1u : 0u});
    hand.path = haptics::HandPath(poses);
    return hand;
}

class MillingTest : public ViewerTest {
 protected:
    void wait(double seconds) {
        for (; seconds > 1e-9; seconds -= 0.1)
            frame({}, 0.1);
    }
    haptics::Milling milling() { return viewer().work().session().milling(); }
    const DustCloud& dust() { return viewer().work().hand().dust(); }
    // Pixels of the view in 3D that differ between two pictures of the window.
    size_t changed(const Image& a, const Image& b) {
        const Box box = box_of(state(), Panel::volume).value();
        size_t count = 0;
        const glm::uvec2 low(box.low_px), size(box.size_px);
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const size_t i = 3 * (size_t{low.y + y} * state().size_px.x + low.x + x);
                count += a.samples[i] != b.samples[i];
            }
        return count;
    }
};

TEST_F(MillingTest, ADrillMakesDustForWhatItRemovesAndItsEndEndsBoth) {
    open("synthetic:ball?size=64", {800, 600}, drilling_hand());
    EXPECT_EQ(dust().made(), 0u);
    EXPECT_EQ(haptics::milling_level(milling()), 0.0);
    const Volume before = *volume(Work::kGrey);
    key("x");
    wait(1.5);
    ASSERT_TRUE(viewer().work().hand().touch().running());
    const double removed_mm3 = milling().removed_mm3;
    EXPECT_GT(removed_mm3, 1.0);
    EXPECT_EQ(dust().made(), static_cast<uint64_t>(removed_mm3 / haptics::Dust::kGrain_mm3));
    EXPECT_GT(haptics::milling_level(milling()), 0.0);
    EXPECT_FALSE(dust().grains().empty());
    EXPECT_EQ(viewer().dump()["hand"]["grains"], dust().made());
    const double iso = viewer().work().session().parameters().iso;
    wait(5.0);
    EXPECT_FALSE(viewer().work().hand().touch().running()) << "the path is over";
    EXPECT_TRUE(dust().grains().empty()) << "dust settles";
    EXPECT_EQ(haptics::milling_level(milling()), 0.0);
    // The document itself tells the same by another way: all that is not solid any more.
    const Volume after = *volume(Work::kGrey);
    size_t gone = 0;
    for (uint32_t z = 0; z < grid().size.z; ++z)
        for (uint32_t y = 0; y < grid().size.y; ++y)
            for (uint32_t x = 0; x < grid().size.x; ++x)
                gone += before.value({x, y, z}) >= iso && after.value({x, y, z}) < iso;
    const glm::dvec3 spacing = spacing_mm(grid());
    const double gone_mm3 = static_cast<double>(gone) * spacing.x * spacing.y * spacing.z;
    EXPECT_NEAR(milling().removed_mm3, gone_mm3, 1e-9 * gone_mm3);
}

// Label 5 lies below a height.
constexpr double kTop_mm = 25.0;
Volume lower_label(const Grid& grid) {
    return make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return world_point(grid, glm::dvec3(i)).z <= kTop_mm ? 5.0 : 0.0;
    });
}

// The hand goes through matter under a label, and stops at it where the label is locked.
TEST_F(MillingTest, ALockedLabelIsFeltAndStays) {
    for (const bool locked : {false, true}) {
        open("synthetic:ball?size=64", {800, 600}, drilling_hand());
        Session& session = viewer().work().session();
        session.put({Work::kLabels, VolumeKind::labels, lower_label(grid())}, "labels");
        const NotePages pages = session.state().document.notes;
        Notes notes = notes_of(pages).value();
        if (locked)
            notes.locked_labels = {5};
        session.note(changes_between(pages, pages_of(notes)), "label locks");
        frame({});
        frame({});
        const Volume before = *volume(Work::kGrey);
        key("x");
        double lowest_mm = 1e9;
        bool is_told = false;
        for (int i = 0; i < 70; ++i) {
            wait(0.1);
            if (const auto& now = viewer().work().hand().touch().now())
                lowest_mm = std::min(lowest_mm, now->proxy.position_mm.z);
            is_told = is_told ||
                      viewer().interface().message().find("label 5 is locked") != std::string::npos;
        }
        const Volume after = *volume(Work::kGrey);
        size_t above = 0, below = 0; // samples that have changed
        for (uint32_t z = 0; z < grid().size.z; ++z)
            for (uint32_t y = 0; y < grid().size.y; ++y)
                for (uint32_t x = 0; x < grid().size.x; ++x) {
                    const double z_mm = world_point(grid(), glm::dvec3(x, y, z)).z;
                    const bool is_other = before.value({x, y, z}) != after.value({x, y, z});
                    (z_mm <= kTop_mm ? below : above) += is_other;
                }
        EXPECT_GT(above, 0u);
        EXPECT_EQ(below > 0, !locked);
        EXPECT_EQ(is_told, locked);
        // The surface lies between the last sample that goes and the first that stays.
        const double spacing_z_mm = spacing_mm(grid()).z;
        if (locked) {
            EXPECT_GT(lowest_mm, kTop_mm - spacing_z_mm);
        } else {
            EXPECT_LT(lowest_mm, kTop_mm - 4.0 * spacing_z_mm);
        }
    }
}

TEST_F(MillingTest, TheRemovedVolumeIsToldOfEachLabelAndFollowsUndo) {
    open("synthetic:ball?size=64", {1280, 1000}, drilling_hand());
    Session& session = viewer().work().session();
    const Volume labels = lower_label(grid());
    session.put({Work::kLabels, VolumeKind::labels, labels}, "labels");
    const Volume before = *volume(Work::kGrey);
    key("x");
    wait(8.0);
    ASSERT_FALSE(viewer().work().hand().touch().running()) << "the path is over";
    const double iso = session.parameters().iso;
    const glm::dvec3 spacing = spacing_mm(grid());
    const double sample_ml = 1e-3 * spacing.x * spacing.y * spacing.z;
    const auto expect_removed = [&](const Volume& from) { // by all samples of the two volumes
        const Volume now = *volume(Work::kGrey);
        double none_ml = 0.0, five_ml = 0.0;
        for (uint32_t z = 0; z < grid().size.z; ++z)
            for (uint32_t y = 0; y < grid().size.y; ++y)
                for (uint32_t x = 0; x < grid().size.x; ++x)
                    if (from.value({x, y, z}) >= iso && now.value({x, y, z}) < iso)
                        (labels.value({x, y, z}) == 5.0f ? five_ml : none_ml) += sample_ml;
        const Json removed = viewer().dump()["removed_ml"];
        const auto ml = [&](const char* key) {
            const Json* const found = removed.find(key);
            return found ? found->number : 0.0;
        };
        EXPECT_NEAR(ml("0"), none_ml, 1e-9);
        EXPECT_NEAR(ml("5"), five_ml, 1e-9);
        EXPECT_NEAR(ml("all"), none_ml + five_ml, 1e-9);
        return none_ml + five_ml;
    };
    EXPECT_GT(expect_removed(before), 0.0);
    const Volume drilled = *volume(Work::kGrey);
    session.undo();
    session.settle();
    frame({}); // counts what has changed
    EXPECT_EQ(expect_removed(before), 0.0);
    session.redo();
    session.settle();
    frame({}); // counts what has changed
    EXPECT_GT(expect_removed(before), 0.0);
    click_widget("removed/reset");
    EXPECT_EQ(expect_removed(drilled), 0.0);
    session.undo(); // beyond the reset: matter that comes back is not removed
    session.settle();
    frame({}); // counts what has changed
    EXPECT_EQ(expect_removed(drilled), 0.0);
}

TEST_F(MillingTest, DustIsSeenWhereItIsWanted) {
    open("synthetic:ball?size=64", {800, 1000}, drilling_hand());
    key("x");
    wait(1.5);
    ASSERT_FALSE(dust().grains().empty());
    // No time passes: what differs is the dust alone, and not the tool or older grains.
    const Box box = viewer().interface().widgets().at("touch/dust");
    const glm::dvec2 at = glm::dvec2(box.low_px) + glm::dvec2(8.0, 0.5 * box.size_px.y);
    const auto press = [&] {
        for (const bool down : {true, false})
            frame({{.kind = Event::Kind::button, .button = Button::left, .down = down}}, 0.0);
        frame({}, 0.0);
    };
    frame({{.kind = Event::Kind::move, .at_px = at}}, 0.0);
    frame({}, 0.0);
    ASSERT_TRUE(viewer().draw_pictures());
    frame({}, 0.0);
    ASSERT_FALSE(dust().grains().empty());
    const Image with = viewer().capture();
    EXPECT_EQ(changed(with, viewer().capture()), 0u);
    press();
    EXPECT_FALSE(state().stylus.dust_shown);
    EXPECT_GT(changed(with, viewer().capture()), 0u);
    press();
    EXPECT_TRUE(state().stylus.dust_shown);
    EXPECT_EQ(changed(with, viewer().capture()), 0u);
}

TEST_F(MillingTest, SoundIsSwitchedInThePanel) {
    open("synthetic:ball?size=32", {800, 600}, drilling_hand());
    EXPECT_TRUE(state().stylus.sound_on);
    click_widget("touch/sound");
    EXPECT_FALSE(state().stylus.sound_on);
}

// A machine without a sound output, or with one: the window says why, or is not silent.
TEST(MillingSoundOutput, OpensWhenWantedAndSaysWhyItIsSilent) {
    MillingSoundOutput output;
    output.frame({}, false);
    EXPECT_TRUE(output.why_silent().empty());
    output.frame({}, true);
    output.wait_for_opening();
    output.frame({}, true);
    EXPECT_NE(output.is_open(), !output.why_silent().empty());
    output.frame({}, false);
    EXPECT_FALSE(output.is_open());
    EXPECT_TRUE(output.why_silent().empty());
}

} // namespace
} // namespace palpate::view
