// The scissors of the window.

#include "apps/view/tools/scissors_tool.h"

#include "engine/volume/extent.h"
#include "tests/view/recorded_session.h"
#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

TestHand hand_with_scissors(const Subject& subject) {
    TestHand hand{subject};
    hand.key(",");
    EXPECT_EQ(hand.state.tool, &kScissorsTool);
    return hand;
}

// Draws a square about the middle of a view.
void draw_square(TestHand& hand, Panel panel, double half_px) {
    const glm::dvec2 middle = hand.middle(panel);
    hand.move(middle - half_px);
    hand.press(Button::left);
    for (const glm::dvec2 by : {glm::dvec2(1, -1), {1, 1}, {-1, 1}})
        hand.move(middle + half_px * by);
    hand.release(Button::left);
}

// The cuts that were asked for; the last one alone is known.
std::vector<Scissors> cuts_of(const TestHand& hand) {
    std::vector<Scissors> cuts;
    for (const Order& order : hand.orders)
        if (const auto* document = std::get_if<DocumentOrder>(&order))
            if (const auto* one = std::get_if<order::ChangeLabel>(document)) {
                cuts.push_back(hand.state.own.of<Cutting>().cut);
                EXPECT_EQ(one->change, cuts.back().action == ScissorsAction::fill_inside
                                           ? &kFillByScissors
                                           : &kEraseByScissors);
            }
    return cuts;
}

TEST(ScissorsTool, InASliceTheOutlineLiesInItsPlane) {
    std::mt19937 random(3);
    for (int round = 0; round < 5; ++round) {
        const Subject subject = subject_of(random_grid(random));
        for (const Panel panel : {Panel::axial, Panel::coronal, Panel::sagittal}) {
            TestHand hand = hand_with_scissors(subject);
            hand.state.label = 4;
            draw_square(hand, panel, 20.0);
            const std::vector<Scissors> cuts = cuts_of(hand);
            ASSERT_EQ(cuts.size(), 1u);
            const SliceView& slice = hand.state.slices[static_cast<size_t>(panel)];
            EXPECT_EQ(cuts[0].towards, slice.towards);
            EXPECT_FALSE(cuts[0].eye_mm);
            EXPECT_EQ(cuts[0].label, 4);
            ASSERT_EQ(cuts[0].outline_mm.size(), 4u);
            const double px = mm_per_px(slice, subject.grid, box_of(hand.state, panel)->size_px);
            const glm::dvec3 across = cuts[0].outline_mm[1] - cuts[0].outline_mm[0];
            EXPECT_NEAR(glm::distance(across, 40.0 * px * slice.right), 0.0, 1e-9);
            for (const glm::dvec3 corner : cuts[0].outline_mm)
                EXPECT_NEAR(glm::dot(corner - hand.state.crosshair_mm, slice.towards), 0.0, 1e-9);
        }
    }
}

// The corners lie under the pixels that were drawn, as far away as the
// crosshair, with both projections.
TEST(ScissorsTool, In3dItIsSeenFromTheCamera) {
    std::mt19937 random(4);
    const Subject subject = subject_of(random_grid(random));
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        TestHand hand = hand_with_scissors(subject);
        hand.state.camera.projection = projection;
        draw_square(hand, Panel::volume, 30.0);
        const std::vector<Scissors> cuts = cuts_of(hand);
        ASSERT_EQ(cuts.size(), 1u);
        EXPECT_EQ(cuts[0].eye_mm.has_value(), projection == Projection::perspective);
        const glm::dvec2 middle = hand.middle(Panel::volume);
        const glm::dvec2 drawn[] = {middle - 30.0, middle + glm::dvec2(30, -30), middle + 30.0,
                                    middle + glm::dvec2(-30, 30)};
        for (size_t i = 0; i < 4; ++i) {
            const auto at =
                pixel_of(hand.state, subject.grid, Panel::volume, cuts[0].outline_mm[i]);
            ASSERT_TRUE(at);
            EXPECT_NEAR(glm::distance(*at, drawn[i]), 0.0, 1e-6);
            EXPECT_NEAR(glm::dot(cuts[0].outline_mm[i] - hand.state.crosshair_mm, cuts[0].towards),
                        0.0, 1e-6);
        }
    }
}

TEST(ScissorsTool, TheKeyTakesTheNextActionAndDepthsAreTheStates) {
    std::mt19937 random(5);
    const Subject subject = subject_of(random_grid(random));
    TestHand hand = hand_with_scissors(subject);
    for (const ScissorsAction action : {ScissorsAction::erase_outside, ScissorsAction::fill_inside,
                                        ScissorsAction::erase_inside}) {
        hand.key(",");
        hand.orders.clear();
        draw_square(hand, Panel::axial, 20.0);
        ASSERT_EQ(cuts_of(hand).size(), 1u);
        EXPECT_EQ(cuts_of(hand)[0].action, action);
    }
    Cutting& cutting = hand.state.own.of<Cutting>();
    cutting.depth = CutDepth::slab;
    cutting.slab_mm = 6.0;
    cutting.all_labels = true;
    hand.orders.clear();
    draw_square(hand, Panel::axial, 20.0);
    EXPECT_EQ(cuts_of(hand)[0].depths_mm, std::pair(-3.0, 3.0));
    EXPECT_TRUE(cuts_of(hand)[0].all_labels);
    cutting.depth = CutDepth::seen_first;
    hand.orders.clear();
    draw_square(hand, Panel::axial, 20.0);
    EXPECT_TRUE(cuts_of(hand).empty()) << "in a slice nothing is seen first";
    hand.state.notes.clip_planes = {{hand.state.crosshair_mm, {1.0, 0.0, 0.0}}};
    draw_square(hand, Panel::volume, 20.0);
    EXPECT_TRUE(cuts_of(hand).empty()) << "clip planes show what would be hidden";
    hand.state.notes.clip_planes.clear();
    hand.time_s += 1.0; // no double click
    draw_square(hand, Panel::volume, 20.0);
    ASSERT_EQ(cuts_of(hand).size(), 1u);
    EXPECT_TRUE(cuts_of(hand)[0].seen_first);
}

TEST(ScissorsTool, EscapeDropsTheOutlineAndAClickCutsNothing) {
    std::mt19937 random(6);
    const Subject subject = subject_of(random_grid(random));
    TestHand hand = hand_with_scissors(subject);
    hand.move(hand.middle(Panel::axial));
    hand.press(Button::left);
    hand.move(hand.middle(Panel::axial) + 9.0);
    hand.move(hand.middle(Panel::axial) + glm::dvec2(0.0, 20.0));
    hand.key("escape");
    hand.release(Button::left);
    EXPECT_TRUE(hand.state.own.of<Cutting>().drawn_px.empty());
    hand.time_s += 1.0;
    hand.press(Button::left);
    hand.release(Button::left);
    EXPECT_TRUE(cuts_of(hand).empty());
    const Camera before = hand.state.camera;
    hand.drag(hand.middle(Panel::volume), hand.middle(Panel::volume) + 30.0, Button::left,
              {.shift = true});
    EXPECT_NE(hand.state.camera, before) << "with Shift the drag is the camera's";
    EXPECT_TRUE(cuts_of(hand).empty());
}

class ScissorsWindow : public ViewerTest {
 protected:
    // A ball of label 1 about the crosshair, and the scissors in the hand.
    void draw_ball() {
        open("synthetic:ball?size=40");
        key("b");
        const auto middle = pixel_of(state(), grid(), Panel::axial, state().crosshair_mm);
        for (int i = 0; i < 6; ++i)
            key("=");
        click(glm::round(middle.value()));
        ASSERT_GT(samples().size(), 300u);
        key(",");
    }
    void draw_outline(Panel panel, double half_px) {
        const Box box = box_of(state(), panel).value();
        const glm::dvec2 middle =
            glm::floor(glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px));
        low_px_ = middle - half_px;
        high_px_ = middle + half_px;
        move(low_px_);
        button(true);
        move({high_px_.x, low_px_.y});
        move(high_px_);
        move({low_px_.x, high_px_.y});
        button(false);
        frame({});
    }
    // Whether the drawn square has a sample's centre in it, as the view shows it.
    bool is_inside(Panel panel, glm::uvec3 sample) {
        const auto at = pixel_of(state(), grid(), panel, world_point(grid(), glm::dvec3(sample)));
        return at && glm::all(glm::greaterThan(*at, low_px_)) &&
               glm::all(glm::lessThan(*at, high_px_));
    }
    std::vector<glm::uvec3> samples() { // of label 1
        std::vector<glm::uvec3> all;
        const Volume labels = *volume(Work::kLabels);
        for (uint32_t z = 0; z < 40; ++z)
            for (uint32_t y = 0; y < 40; ++y)
                for (uint32_t x = 0; x < 40; ++x)
                    if (labels.value({x, y, z}) == 1.0f)
                        all.emplace_back(x, y, z);
        return all;
    }

    glm::dvec2 low_px_{}, high_px_{};
};

TEST_F(ScissorsWindow, ErasesWhatIsSeenInsideAsOneStep) {
    for (const Panel panel : {Panel::sagittal, Panel::volume}) {
        draw_ball();
        const std::vector<glm::uvec3> before = samples();
        draw_outline(panel, 8.0);
        std::vector<glm::uvec3> left = before;
        std::erase_if(left, [&](glm::uvec3 at) { return is_inside(panel, at); });
        EXPECT_LT(left.size(), before.size() - 10u);
        EXPECT_GT(left.size(), 10u);
        EXPECT_EQ(samples(), left);
        EXPECT_EQ(viewer().work().edited().undo_steps, 2u);
        key("z", {.ctrl = true});
        frame({});
        EXPECT_EQ(samples(), before);
    }
}

TEST_F(ScissorsWindow, ErasesWhatIsSeenOutside) {
    draw_ball();
    key(",");
    std::vector<glm::uvec3> left = samples();
    draw_outline(Panel::volume, 8.0);
    std::erase_if(left, [&](glm::uvec3 at) { return !is_inside(Panel::volume, at); });
    EXPECT_GT(left.size(), 10u);
    EXPECT_EQ(samples(), left);
}

const RecordedSteps kScissorsSessions[] = {
    {"scissors_key", "key ,", R"({"tool": {"hand": "scissors"}})"},
    {"scissors_in_the_panel",
     "section wire; widget segment/scissors 0.05; widget scissors/depth; "
     "widget "
     "scissors/depth/slab",
     R"({"tool": {"hand": "scissors"}})"},
    {"scissors_cut_nothing_of_no_label",
     "key ,; at axial -40 -40; press left; at axial 40 -40; at axial 0 40; "
     "release left",
     R"({"undo_steps": 0})"},
};

class ScissorsSessions : public RecordedSession {};
TEST_P(ScissorsSessions, End) {
    expect_end();
}
INSTANTIATE_TEST_SUITE_P(View, ScissorsSessions, ::testing::ValuesIn(kScissorsSessions),
                         [](const auto& test) { return std::string(test.param.name); });

} // namespace
} // namespace palpate::view
