// Tests of what the mouse and the keys do.

#include <gtest/gtest.h>

#include <cmath>

#include "apps/view/drawing/pick.h"
#include "apps/view/window/key_actions.h"
#include "engine/session/default_scene.h"
#include "engine/volume/synthetic.h"
#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

constexpr Panel kSlices[] = {Panel::axial, Panel::coronal, Panel::sagittal};

glm::dvec3 sample_point(const Grid& grid, glm::dvec3 point_mm) {
    return world_point(grid, glm::round(index_point(grid, point_mm)));
}

TEST(Interaction, AClickSelectsTheSampleThatTheCameraSays) {
    std::mt19937 random(11);
    int clicks = 0;
    while (clicks < 300) {
        const Grid grid = random_grid(random);
        const Subject subject = subject_of(grid);
        TestHand hand{subject};
        const Panel panel = kSlices[random() % 3];
        const Box box = box_of(hand.state, panel).value();
        const glm::dvec2 at =
            glm::dvec2(box.low_px) + glm::dvec2(random() % static_cast<unsigned>(box.size_px.x),
                                                random() % static_cast<unsigned>(box.size_px.y));
        // By the picture's own camera.
        const Camera camera = camera_of(subject.home.slices[static_cast<size_t>(panel)],
                                        subject.home.crosshair_mm, grid, box.size_px);
        const glm::uvec2 size(box.size_px);
        const View view = make_view(camera, size);
        const Ray ray = ray_through(view, at - glm::dvec2(box.low_px), size);
        const double distance = glm::dot(subject.home.crosshair_mm - ray.origin_mm, view.forward);
        const glm::dvec3 index = index_point(grid, ray.origin_mm + distance * ray.direction);
        const glm::dvec3 middle = glm::abs(glm::fract(index) - 0.5);
        if (std::min({middle.x, middle.y, middle.z}) < 1e-6)
            continue; // between two samples
        bool on_handle = false;
        for (const Handle& handle : handles_of(hand.state, grid, panel))
            on_handle = on_handle || glm::distance(handle.at_px, at) <= kHandle_px;
        if (on_handle)
            continue;
        ++clicks;
        hand.move(at);
        hand.press(Button::left);
        const glm::dvec3 expected =
            glm::clamp(glm::round(index), glm::dvec3(0.0), glm::dvec3(grid.size) - 1.0);
        EXPECT_LT(glm::distance(index_point(grid, hand.state.crosshair_mm), expected), 1e-6);
    }
}

TEST(Interaction, TheWheelGoesToTheNextSampleAndStopsAtTheLast) {
    std::mt19937 random(12);
    for (int i = 0; i < 50; ++i) {
        const Subject subject = subject_of(random_grid(random));
        const Panel panel = kSlices[random() % 3];
        TestHand hand{subject};
        hand.move(hand.middle(panel));
        const glm::dvec3 before = index_point(subject.grid, hand.state.crosshair_mm);
        hand.wheel(1.0);
        const glm::dvec3 step = index_point(subject.grid, hand.state.crosshair_mm) - before;
        EXPECT_NEAR(glm::length(step), 1.0, 1e-9);
        EXPECT_GT(glm::dot(glm::dmat3(subject.grid.world_from_index) * step,
                           -subject.home.slices[static_cast<size_t>(panel)].towards),
                  0.0);
        hand.wheel(1000.0);
        const glm::dvec3 end = hand.state.crosshair_mm;
        hand.wheel(1.0);
        EXPECT_LT(glm::distance(hand.state.crosshair_mm, end), 1e-9);
        EXPECT_EQ(hand.state.slices, subject.home.slices);
    }
}

TEST(Interaction, WAndADragChangeTheWindowAndNothingElse) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    const glm::dvec2 at = hand.middle(Panel::coronal);
    hand.take({.kind = Event::Kind::key, .down = true, .key = "w"});
    hand.drag(at, at + glm::dvec2(50, -30), Button::left);
    // Width 400 grows by a 250th a pixel, the level by as much of it.
    const double width = 400.0 * std::exp(50.0 / 250.0), level = 40.0 + 30.0 / 250.0 * 400.0;
    EXPECT_NEAR(hand.state.window.low, level - 0.5 * width, 1e-9);
    EXPECT_NEAR(hand.state.window.high, level + 0.5 * width, 1e-9);
    EXPECT_EQ(hand.state.crosshair_mm, subject.home.crosshair_mm);
    hand.take({.kind = Event::Kind::key, .down = false, .key = "w"});
    hand.drag(at, at + glm::dvec2(20, 0), Button::left);
    EXPECT_NEAR(hand.state.window.high, level + 0.5 * width, 1e-9);
    EXPECT_NE(hand.state.crosshair_mm, subject.home.crosshair_mm);
}

TEST(Interaction, WhatIsUnderThePointerStaysThereWhilePanningAndZooming) {
    std::mt19937 random(13);
    for (int i = 0; i < 60; ++i) {
        const Subject subject = subject_of(random_grid(random));
        const Panel panel = kSlices[random() % 3];
        TestHand hand{subject};
        const glm::dvec2 from = hand.middle(panel) - glm::dvec2(30, 20),
                         to = from + glm::dvec2(random() % 60, random() % 40);
        const glm::dvec3 held = point_under(hand.state, subject.grid, panel, from);
        hand.drag(from, to, Button::middle);
        EXPECT_LT(glm::distance(point_under(hand.state, subject.grid, panel, to), held), 1e-9);
        hand.wheel(static_cast<double>(random() % 7) - 3.0, {.ctrl = true});
        EXPECT_LT(glm::distance(point_under(hand.state, subject.grid, panel, to), held), 1e-9);
        const glm::dvec3 middle = hand.state.slices[static_cast<size_t>(panel)].center_mm;
        hand.drag(to, to + glm::dvec2(0, -40), Button::right);
        EXPECT_LT(glm::distance(hand.state.slices[static_cast<size_t>(panel)].center_mm, middle),
                  1e-9);
        EXPECT_EQ(hand.state.crosshair_mm, subject.home.crosshair_mm);
    }
}

TEST(Interaction, TheCameraTurnsAboutItsTargetAndAFullTurnBringsItBack) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    const Box box = box_of(hand.state, Panel::volume).value();
    const double side = std::min(box.size_px.x, box.size_px.y);
    const glm::dvec2 at = hand.middle(Panel::volume);
    const Camera begin = hand.state.camera;
    // Half a turn for the shorter side of the view: four quarters go round.
    for (int i = 0; i < 4; ++i) {
        hand.drag(at, at + glm::dvec2(0.5 * side, 0), Button::left);
        EXPECT_NEAR(glm::distance(hand.state.camera.eye_mm, begin.target_mm),
                    glm::distance(begin.eye_mm, begin.target_mm), 1e-9);
        EXPECT_EQ(hand.state.camera.target_mm, begin.target_mm);
    }
    EXPECT_LT(glm::distance(hand.state.camera.eye_mm, begin.eye_mm), 1e-9);
    // A drag to the right shows more of what lay on the left: the eye goes to the left.
    const glm::dvec3 right = make_view(begin, glm::uvec2(1)).right;
    hand.drag(at, at + glm::dvec2(20, 0), Button::left);
    EXPECT_LT(glm::dot(hand.state.camera.eye_mm - begin.eye_mm, right), 0.0);
}

TEST(Interaction, ControlRollsAndShiftPansTheVolume) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    const Box box = box_of(hand.state, Panel::volume).value();
    const glm::dvec2 middle = glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px);
    const View before = make_view(hand.state.camera, glm::uvec2(1));
    // From the right of the middle to below it: a quarter, clockwise.
    hand.drag(middle + glm::dvec2(40, 0), middle + glm::dvec2(0, 40), Button::left, {.ctrl = true});
    const View after_roll = make_view(hand.state.camera, glm::uvec2(1));
    // The right side of before is now below.
    EXPECT_LT(glm::distance(after_roll.up, -before.right), 1e-9);
    hand.state.camera = subject.home.camera;
    const glm::dvec3 target = subject.home.camera.target_mm;
    const glm::dvec2 at = pixel_of(hand.state, subject.grid, Panel::volume, target).value();
    hand.drag(middle, middle + glm::dvec2(30, 10), Button::left, {.shift = true});
    const glm::dvec2 moved = pixel_of(hand.state, subject.grid, Panel::volume, target).value();
    EXPECT_LT(glm::distance(moved - at, glm::dvec2(30, 10)), 1e-6);
}

TEST(Interaction, AHandleTurnsTheOtherPlanesByTheAngleOfTheHand) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1, 1, 2)));
    for (const double degrees : {30.0, -75.0, 10.0})
        for (const Panel panel : kSlices) {
            TestHand hand{subject};
            const Handle handle = handles_of(hand.state, subject.grid, panel).front();
            const glm::dvec2 middle =
                pixel_of(hand.state, subject.grid, panel, hand.state.crosshair_mm).value();
            const glm::dvec2 arm = handle.at_px - middle;
            const double angle = glm::radians(degrees), c = std::cos(angle), s = std::sin(angle);
            // Counter-clockwise for an eye, where rows count downwards.
            const glm::dvec2 turned(c * arm.x + s * arm.y, -s * arm.x + c * arm.y);
            hand.drag(handle.at_px, middle + turned, Button::left);
            const auto own = static_cast<size_t>(panel);
            for (size_t i = 0; i < kSlicePanels; ++i) {
                const glm::dvec3 was = subject.home.slices[i].towards,
                                 is = hand.state.slices[i].towards;
                const glm::dvec3 axis = subject.home.slices[own].towards;
                if (i == own) {
                    EXPECT_EQ(was, is);
                    continue;
                }
                EXPECT_NEAR(glm::dot(was, is), c, 1e-9);
                EXPECT_NEAR(glm::dot(glm::cross(was, is), axis), s, 1e-9);
            }
            EXPECT_EQ(hand.state.crosshair_mm, subject.home.crosshair_mm);
            hand.key("r");
            EXPECT_EQ(hand.state.slices, subject.home.slices);
        }
}

TEST(Interaction, ADoubleClickMaximisesAViewAndBack) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    const auto click = [&] {
        hand.press(Button::left);
        hand.release(Button::left);
    };
    hand.move(hand.middle(Panel::sagittal));
    click();
    click();
    EXPECT_EQ(hand.state.alone, Panel::sagittal);
    EXPECT_EQ(places_of(hand.state).views.size(), 1u);
    click(); // a third click begins anew
    EXPECT_EQ(hand.state.alone, Panel::sagittal);
    click();
    EXPECT_EQ(hand.state.alone, std::nullopt);
    click();
    hand.time_s += 1.0;
    click(); // too late
    EXPECT_EQ(hand.state.alone, std::nullopt);
    hand.key("b"); // a brush draws two dots
    hand.time_s += 1.0;
    click();
    click();
    EXPECT_EQ(hand.state.alone, std::nullopt);
    EXPECT_EQ(hand.orders.size(), 4u);
}

TEST(Interaction, ABrushFollowsThePointerAndEscapeTakesItsStrokeBack) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    hand.key("b");
    const glm::dvec2 from = hand.middle(Panel::axial), to = from + glm::dvec2(31, -17);
    hand.drag(from, to, Button::left);
    ASSERT_EQ(hand.orders.size(), 3u);
    const glm::dvec3 begin = point_under(hand.state, subject.grid, Panel::axial, from),
                     end = point_under(hand.state, subject.grid, Panel::axial, to);
    const auto down = hand.given<order::StrokeDown>(0);
    const auto move = hand.given<order::StrokeMove>(1);
    const auto up = hand.given<order::StrokeUp>(2);
    EXPECT_EQ(down.at_mm, begin);
    EXPECT_EQ(move.at_mm, end);
    EXPECT_EQ(up.at_mm, end);
    EXPECT_LT(down.time_s, up.time_s);
    EXPECT_EQ(hand.state.crosshair_mm, subject.home.crosshair_mm);
    hand.press(Button::left);
    hand.key("r"); // nothing else happens while a stroke is drawn
    EXPECT_EQ(hand.state.drag->kind, Drag::Kind::tool);
    hand.key("escape");
    hand.given<order::StrokeCancel>(hand.orders.size() - 1);
    hand.move(from);
    hand.release(Button::left);
    EXPECT_EQ(hand.orders.size(), 5u);
}

TEST(Interaction, ShiftAndAMoveSetTheCrosshairOnWhatIsSeenInTheVolume) {
    const Grid grid = make_grid(glm::uvec3(64), glm::dvec3(1), glm::dvec3(-31.5));
    const Volume ball =
        synthetic::sample(synthetic::sphere({0, 0, 0}, 20.0, 1.0), grid, ScalarType::f32);
    Subject subject = subject_of(grid);
    Scene scene;
    scene.ray_cast = RayCastLayer{.mode = RayMode::iso, .isos = iso_surfaces({500.0})};
    subject.pick = [&](const Ray& ray) { return first_seen(ray, ball, scene); };
    TestHand hand{subject};
    hand.move(hand.middle(Panel::volume), {.shift = true});
    const Box box = box_of(hand.state, Panel::volume).value();
    const glm::uvec2 size(box.size_px);
    const Ray ray = ray_through(make_view(subject.home.camera, size),
                                hand.middle(Panel::volume) - glm::dvec2(box.low_px), size);
    const double b = glm::dot(ray.origin_mm, ray.direction),
                 d = std::sqrt(b * b - glm::dot(ray.origin_mm, ray.origin_mm) + 400.0);
    const glm::dvec3 met = ray.origin_mm + (-b - d) * ray.direction;
    const std::optional<glm::dvec3> found = first_seen(ray, ball, scene);
    ASSERT_TRUE(found);
    // The trilinear field of a ball of 20 samples is off by its curvature, 1/8 of 1/20 of a sample
    // on each axis, and the root by 1/2000.
    EXPECT_LT(glm::distance(*found, met), 0.03);
    EXPECT_LT(glm::distance(hand.state.crosshair_mm, sample_point(grid, *found)), 1e-9);
    // Beside the ball nothing is met, and the crosshair stays.
    const glm::dvec3 before = hand.state.crosshair_mm;
    hand.move(glm::dvec2(box.low_px) + 3.0, {.shift = true});
    EXPECT_EQ(hand.state.crosshair_mm, before);
    // In a slice it goes to the sample under the pointer.
    const glm::dvec2 at = hand.middle(Panel::coronal) + glm::dvec2(40, 10);
    const glm::dvec3 there = point_under(hand.state, grid, Panel::coronal, at);
    hand.move(at, {.shift = true});
    EXPECT_LT(glm::distance(hand.state.crosshair_mm, sample_point(grid, there)), 1e-9);
}

TEST(Interaction, KeysDoWhatTheHelpSays) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    hand.key("2");
    EXPECT_EQ(hand.state.window, (GreyWindow{-1000.0, 3000.0}));
    hand.key("9"); // there is none, which a person is told
    EXPECT_EQ(hand.orders,
              std::vector<Order>{order::Tell{"window 9: this volume has windows 1 to 2"}});
    hand.orders.clear();
    EXPECT_EQ(hand.state.window, (GreyWindow{-1000.0, 3000.0}));
    hand.key("/", {.shift = true});
    EXPECT_TRUE(hand.state.help_open);
    hand.key("escape");
    EXPECT_FALSE(hand.state.help_open);
    const struct {
        const char* key;
        bool shift;
        glm::dvec3 towards;
    } views[] = {{"home", false, {0, 0, 1}},      {"home", true, {0, 0, -1}},
                 {"end", false, {0, -1, 0}},      {"end", true, {0, 1, 0}},
                 {"page_down", false, {1, 0, 0}}, {"page_down", true, {-1, 0, 0}}};
    for (const auto& view : views) {
        hand.key(view.key, {.shift = view.shift});
        const Camera& camera = hand.state.camera;
        EXPECT_LT(glm::distance(glm::normalize(camera.eye_mm - camera.target_mm), view.towards),
                  1e-12);
    }
    hand.key("s");
    EXPECT_FALSE(hand.state.labels_shown);
    hand.key("d");
    EXPECT_EQ(hand.state.label_opacity, 0.5);
    hand.key("=");
    EXPECT_EQ(hand.state.radius_mm, 3.75);
    hand.key("z", {.ctrl = true});
    hand.key("y", {.ctrl = true});
    hand.key("z", {.shift = true, .ctrl = true});
    EXPECT_EQ(hand.orders, (std::vector<Order>{order::Undo{}, order::Redo{}, order::Redo{}}));
}

TEST(Interaction, WhatWidgetsTakeMovesNoView) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    hand.move(hand.middle(Panel::axial));
    const ViewState before = hand.state;
    for (const Event& event :
         {Event{.kind = Event::Kind::button, .down = true, .for_widget = true},
          Event{.kind = Event::Kind::wheel, .wheel = {0, 3}, .for_widget = true},
          Event{.kind = Event::Kind::key, .down = true, .key = "r", .for_widget = true},
          Event{.kind = Event::Kind::key, .down = true, .key = "w", .for_widget = true}})
        hand.take(event);
    EXPECT_EQ(hand.state, before);
    EXPECT_TRUE(hand.orders.empty());
}

// Whatever a hand does: planes stay orthonormal, the crosshair in the volume, the window open, the
// camera in its place.
TEST(Interaction, AHundredThousandRandomEventsKeepTheStateSound) {
    std::mt19937 random(17);
    const Grid grid = random_grid(random);
    const Subject subject = subject_of(grid);
    TestHand hand{subject};
    const auto& keys = key_names();
    for (int i = 0; i < 100000; ++i) {
        Event event;
        event.kind = static_cast<Event::Kind>(random() % 7);
        event.modifiers = {random() % 4 == 0, random() % 4 == 0, random() % 8 == 0};
        event.at_px = {static_cast<double>(random() % 1500) - 50,
                       static_cast<double>(random() % 1000) - 50};
        event.button = static_cast<Button>(random() % 3);
        event.down = random() % 2;
        event.wheel = {0.0, static_cast<double>(random() % 9) - 4.0};
        event.key = keys[random() % keys.size()];
        event.size_px = {random() % 3000, random() % 2000};
        if (event.kind == Event::Kind::resize && random() % 50)
            continue;
        hand.take(event);
        const ViewState& s = hand.state;
        for (const SliceView& slice : s.slices) {
            ASSERT_NEAR(glm::length(slice.towards), 1.0, 1e-9);
            ASSERT_LT(glm::length(glm::cross(slice.right, slice.up) - slice.towards), 1e-6);
            ASSERT_TRUE(slice.zoom >= 0.05 && slice.zoom <= 200.0);
        }
        const glm::dvec3 index = index_point(grid, s.crosshair_mm);
        for (int axis = 0; axis < 3; ++axis)
            ASSERT_TRUE(index[axis] > -1e-6 && index[axis] < grid.size[axis] - 1 + 1e-6);
        ASSERT_LT(s.window.low, s.window.high);
        const double distance = glm::distance(s.camera.eye_mm, s.camera.target_mm);
        ASSERT_TRUE(distance > 0.0 && std::isfinite(distance));
        const View view = make_view(s.camera, glm::uvec2(1));
        ASSERT_NEAR(glm::length(view.right), 1.0, 1e-6);
    }
}

TEST(Interaction, ATypedEndOfAWindowMovesTheOtherOneWhereItPassesIt) {
    const GreyWindow window{-160.0, 240.0}, limits{-5000.0, 7000.0};
    const auto low = [&](double value) { return with_low(window, value, 1.0, limits); };
    const auto high = [&](double value) { return with_high(window, value, 1.0, limits); };
    EXPECT_EQ(low(-300.0), (GreyWindow{-300.0, 240.0}));
    EXPECT_EQ(low(239.0), (GreyWindow{239.0, 240.0}));
    EXPECT_EQ(low(240.0), (GreyWindow{240.0, 640.0}));
    EXPECT_EQ(low(500.0), (GreyWindow{500.0, 900.0}));
    EXPECT_EQ(low(6900.0), (GreyWindow{6900.0, 7000.0}));
    EXPECT_EQ(low(1e9), (GreyWindow{6999.0, 7000.0}));
    EXPECT_EQ(low(-1e9), (GreyWindow{-5000.0, 240.0}));
    EXPECT_EQ(low(NAN), window);
    EXPECT_EQ(high(300.0), (GreyWindow{-160.0, 300.0}));
    EXPECT_EQ(high(-500.0), (GreyWindow{-900.0, -500.0}));
    EXPECT_EQ(high(-4900.0), (GreyWindow{-5000.0, -4900.0}));
    EXPECT_EQ(high(INFINITY), (GreyWindow{-160.0, 7000.0}));
    // A narrow window is as wide as the least one; ends may also be allowed to be the same.
    EXPECT_EQ(with_low({1.0, 1.5}, 7.0, 1.0, limits), (GreyWindow{7.0, 8.0}));
    EXPECT_EQ(with_low(window, 240.0, 0.0, limits), (GreyWindow{240.0, 240.0}));
}

// However far the mouse goes: a later drag brings the values back into the window.
TEST(Interaction, AWindowStaysNearTheValues) {
    std::mt19937 random(5);
    const Subject subject = subject_of(random_grid(random));
    TestHand hand{subject};
    const glm::dvec2 middle = hand.middle(Panel::axial);
    for (const glm::dvec2 to : {glm::dvec2(1e5, 0), glm::dvec2(0, 1e5), glm::dvec2(-1e5, -1e5)}) {
        hand.state.window = subject.home.window;
        hand.take({.kind = Event::Kind::key, .down = true, .key = "w"});
        for (int i = 0; i < 20; ++i)
            hand.drag(middle, to, Button::left);
        hand.take({.kind = Event::Kind::key, .key = "w"});
        const GreyWindow window = hand.state.window;
        EXPECT_LT(window.low, window.high);
        const double span = double{subject.range.max} - subject.range.min;
        EXPECT_GE(window.low, subject.range.min - 2e3 * span); // half the widest, and the farthest
        EXPECT_LE(window.high, subject.range.max + 2e3 * span);
    }
    const GreyWindow constant = limited({1e30, 1e30}, {1e30f, 1e30f});
    EXPECT_LT(constant.low, constant.high);
}

// As on the way to a letter that is typed into an open chooser.
TEST(Interaction, AModifierAloneIsNotAnswered) {
    const Subject subject = subject_of(make_grid(glm::uvec3(8), glm::dvec3(1)));
    TestHand hand{subject};
    Outcome next;
    for (const bool open : {false, true}) {
        hand.state.browser_open = open;
        for (const char* key : {"shift", "ctrl", "alt"}) {
            const Event event{.kind = Event::Kind::key, .down = true, .key = key};
            EXPECT_EQ(why_idle({next, event, subject, hand.state}, false), "") << key;
        }
        const Event letter{.kind = Event::Kind::key, .down = true, .key = "q"};
        EXPECT_NE(why_idle({next, letter, subject, hand.state}, false), "");
    }
}

} // namespace
} // namespace palpate::view
