// A hand in the window, on the mouse and on a path, in fixed time.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/hand_marks.h"
#include "apps/view/tools/palette.h"
#include "engine/volume/content_hash.h"
#include "haptics/device/device_log.h"
#include "tests/view/hand_fixture.h"

namespace palpate::view {
namespace {

TEST_F(HandTest, AButtonWithoutAToolIsTold) {
    Work work(Source{open_synthetic("synthetic:ball?size=32")}, {800, 600}, 1.0, false);
    ViewState state = work.subject().home;
    work.obey(order::StartHand{}, state);
    work.hand().follow(state, 1.0);
    (void)work.take_message();
    const auto press = [&](uint32_t buttons, double time_s) {
        state.stylus.buttons = buttons;
        work.hand().follow(state, time_s);
        return work.take_message().shown(false);
    };
    EXPECT_NE(press(1, 1.1).find("this button does nothing yet"), std::string::npos);
    EXPECT_EQ(press(1, 1.2), "") << "once a press";
    press(0, 1.3);
    state.stylus.first = Carve::cut;
    EXPECT_EQ(press(1, 1.4), "");
}

// PointerHand takes the way that is seen.
TEST_F(HandTest, APointerIn3dSaysWhereItIsSeenFrom) {
    for (const bool flat : {false, true}) {
        SCOPED_TRACE(flat);
        open("synthetic:ball?size=24", {800, 600});
        if (flat)
            click_widget("volume/orthographic");
        start_mouse();
        move(middle(Panel::volume) + glm::dvec2(20.0, 0.0));
        const glm::dvec3 nearer = state().stylus.eye_mm - state().stylus.meant.position_mm;
        if (flat)
            EXPECT_NEAR(glm::dot(glm::normalize(nearer), towards_eye()), 1.0, 1e-9);
        else
            EXPECT_EQ(state().stylus.eye_mm, state().camera.eye_mm);
        EXPECT_EQ(state().stylus.clear_mm, 2.0 * state().radius_mm);
        move(middle(Panel::axial));
        EXPECT_EQ(state().stylus.clear_mm, 0.0);
    }
}

// The first move out of a widget is that widget's, and the view's a frame later.
TEST_F(HandTest, OneMoveOutOfAWidgetIsFollowed) {
    open("synthetic:ball?size=24");
    start_mouse();
    const Box tools = places_of(state()).tools;
    for (int i = 0; i < 2; ++i)
        move(glm::dvec2(tools.low_px) + glm::dvec2(40.0, 60.0));
    const glm::dvec2 there = middle(Panel::volume) + glm::dvec2(30.0, -20.0);
    move(there);
    wait(0.2);
    const auto meant =
        pixel_of(state(), grid(), Panel::volume, state().stylus.meant.position_mm).value();
    EXPECT_LT(glm::distance(meant, there), 0.5);
}

TEST_F(HandTest, APressIsWhereThePointerIsAlsoOnTheWayFromAWidget) {
    open("synthetic:ball?size=24");
    start_mouse();
    const Box tools = places_of(state()).tools;
    for (int i = 0; i < 2; ++i)
        move(glm::dvec2(tools.low_px) + glm::dvec2(40.0, 60.0));
    const glm::dvec2 there = middle(Panel::volume) + glm::dvec2(30.0, -20.0);
    move(there);
    button(true);
    const auto meant =
        pixel_of(state(), grid(), Panel::volume, state().stylus.meant.position_mm).value();
    EXPECT_LT(glm::distance(meant, there), 0.5);
    button(false);
}

// A document that does not do what the hand does: the time since the first input that it lacks.
TEST_F(HandTest, ThatTheEditorDoesNotFollowIsTold) {
    Work work(Source{open_synthetic("synthetic:ball?size=32")}, {800, 600}, 1.0, false);
    ViewState state = work.subject().home;
    state.tool = &kCutTool;
    const auto at = [&](double time_s) {
        work.hand().follow(state, time_s);
        return work.hand().backlog();
    };
    EXPECT_EQ(at(1.0).inputs, 0u);
    work.obey(order::StrokeDown{{30, 0, 0}, 1.5}, state);
    EXPECT_EQ(at(2.0).inputs, 1u);
    work.obey(order::StrokeMove{{31, 0, 0}, 2.1}, state);
    EXPECT_EQ(at(2.5).inputs, 2u);
    EXPECT_EQ(at(2.5).seconds, 0.5); // of the older one
    work.session().settle();
    EXPECT_EQ(at(4.0).inputs, 0u);
    EXPECT_EQ(at(4.0).seconds, 0.0);
    work.obey(order::StrokeUp{{31, 0, 0}, 4.5}, state);
    EXPECT_EQ(at(5.0).seconds, 0.0); // since it was first seen
    EXPECT_EQ(at(7.0).seconds, 2.0);
    EXPECT_GT(at(7.0).seconds, HandLink::kFarBehind_s);
    work.session().settle();
    EXPECT_EQ(at(7.1).seconds, 0.0);
}

// Moves of a stroke that was refused are no backlog.
TEST_F(HandTest, OfARefusedStrokeNothingWaits) {
    Work work(Source{open_synthetic("synthetic:ball?size=32")}, {800, 600}, 1.0, false);
    Session& session = work.session();
    ASSERT_TRUE(session.stroke(EditInput::Kind::down, {})); // without a tool
    ASSERT_TRUE(session.stroke(EditInput::Kind::move, {0.1, {}}));
    session.settle();
    work.hand().follow(*std::make_unique<ViewState>(work.subject().home), 1.0);
    EXPECT_EQ(work.hand().backlog().inputs, 0u);
}

TEST_F(HandTest, StartsWithoutForceAndOnlyAPersonArms) {
    open("synthetic:ball?size=32");
    EXPECT_FALSE(touch().running());
    start_mouse();
    EXPECT_TRUE(touch().running());
    EXPECT_FALSE(touch().armed());
    for (int i = 0; i < 3; ++i)
        wheel(2.0);
    wait(4.0);
    EXPECT_GT(glm::distance(now().probe.position_mm, now().proxy.position_mm), 1.0); // it presses
    EXPECT_EQ(now().force_n, glm::dvec3(0.0));
    key("space");
    EXPECT_TRUE(touch().armed());
    wait(3.0);
    EXPECT_EQ(now().force_n, glm::dvec3(0.0)); // it waits until the hand is free
    for (int i = 0; i < 8; ++i)
        wheel(-2.0);
    wait(3.0);
    for (int i = 0; i < 8; ++i)
        wheel(2.0);
    wait(2.0);
    EXPECT_GT(glm::length(now().force_n), 0.3);
    key("o");
    EXPECT_FALSE(touch().running());
    EXPECT_EQ(now().force_n, glm::dvec3(0.0));
    key("o");
    EXPECT_TRUE(touch().running());
    EXPECT_FALSE(touch().armed()); // not from the time before
}

// The hand presses straight into a ball: the tool stays at its radius, the probe is deeper, and the
// spring between the two and the hand's own balance.
TEST_F(HandTest, ThePushedToolStaysOutAndTheForceDrawsTheHandBack) {
    open("synthetic:ball?size=64");
    start_mouse();
    wheel(-4.0);
    key("space");
    wait(3.0);
    const double felt_mm = viewer().work().session().parameters().tool_radius_mm;
    for (int i = 0; i < 5; ++i)
        wheel(2.0);
    wait(3.0);
    const glm::dvec3 meant = state().stylus.meant.position_mm;
    const double k = viewer().work().session().parameters().stiffness_n_per_m;
    const double hand = haptics::pointer_hand_model().stiffness_n_per_m;
    // Samples lie 100 / 63 mm apart; the surface is found within a hundredth of one, and the last
    // places of the hand on its way to rest differ by as much.
    EXPECT_NEAR(glm::length(now().proxy.position_mm), kRadius_mm + felt_mm, 0.05);
    const double depth_mm = glm::distance(now().probe.position_mm, now().proxy.position_mm);
    EXPECT_GT(depth_mm, 1.0);
    EXPECT_NEAR(glm::length(now().force_n), 1e-3 * k * depth_mm, 0.02);
    EXPECT_NEAR(glm::distance(now().probe.position_mm, meant),
                1e3 * glm::length(now().force_n) / hand, 0.05);
    // Without friction the force is along the ball's normal, and the tool glides away from under
    // a hand that is not held: normals err by less than half a degree.
    EXPECT_GT(glm::dot(glm::normalize(now().force_n), glm::normalize(now().proxy.position_mm)),
              std::cos(glm::radians(0.5)));
    EXPECT_GT(glm::dot(glm::normalize(now().force_n), towards_eye()), 0.9);
    // Esc: with the next tick. All ticks of the frame come after it.
    const auto before = touch().now();
    key("escape");
    EXPECT_FALSE(touch().armed());
    EXPECT_EQ(now().force_n, glm::dvec3(0.0));
    EXPECT_GT(glm::length(before->force_n), 0.3);
}

// The expected place is by the camera's geometry: a perspective picture written out.
TEST_F(HandTest, TheForceArrowBeginsAtTheProxysPixelAndIsAsLongAsTheForce) {
    open("synthetic:ball?size=24");
    start_mouse();
    TouchSample sample = now();
    sample.proxy.position_mm = {31.0, -17.0, 44.0};
    sample.force_n = {0.4, -0.9, 1.3};
    const Box box = box_of(state(), Panel::volume).value();
    const Camera& camera = state().camera;
    const glm::dvec3 forward = glm::normalize(camera.target_mm - camera.eye_mm);
    const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up));
    const glm::dvec3 up = glm::cross(right, forward);
    const auto pixel = [&](glm::dvec3 p) {
        const glm::dvec3 d = p - camera.eye_mm;
        const double half = 0.5 * box.size_px.y;
        const double scale =
            half / std::tan(glm::radians(0.5 * camera.view_angle_deg)) / glm::dot(d, forward);
        return glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px) - 0.5 +
               scale * glm::dvec2(glm::dot(d, right), -glm::dot(d, up));
    };
    const HandMarks marks = hand_marks(state(), grid(), Panel::volume, sample).value();
    const glm::dvec3 tip = sample.proxy.position_mm + 10.0 * sample.force_n;
    EXPECT_NEAR(glm::distance(marks.proxy_px, pixel(sample.proxy.position_mm)), 0.0, 1e-6);
    EXPECT_NEAR(glm::distance(marks.arrow_to_px.value(), pixel(tip)), 0.0, 1e-6);
    // In an axial slice: right is the patient's left, down is back; a plane 2 mm off the tool's
    // middle cuts a circle of sqrt(3^2 - 2^2) mm.
    const SliceView& slice = state().slices[0];
    sample.proxy.position_mm =
        state().crosshair_mm + 12.0 * slice.right - 5.0 * slice.up + 2.0 * slice.towards;
    const HandMarks cut = hand_marks(state(), grid(), Panel::axial, sample).value();
    const Box axial = box_of(state(), Panel::axial).value();
    const double mm = mm_per_px(slice, grid(), axial.size_px);
    const glm::dvec2 crosshair =
        pixel_of(state(), grid(), Panel::axial, state().crosshair_mm).value();
    EXPECT_NEAR(glm::distance(cut.proxy_px, crosshair + glm::dvec2(12.0, 5.0) / mm), 0.0, 1e-6);
    EXPECT_NEAR(cut.radius_px, std::sqrt(5.0) / mm, 1e-6);
    EXPECT_TRUE(cut.is_cut);
}

// A button of the hand is a stroke of its tool at the proxy, in 3D and in slices alike.
TEST_F(HandTest, TheButtonsOfTheHandCarveWithTheirTools) {
    open("synthetic:ball?size=32");
    const auto hash = [&](const char* name) { return content_hash(*volume(name)); };
    const uint64_t begin = hash(Work::kGrey);
    key("x");
    start_mouse();
    EXPECT_EQ(state().stylus.first, Carve::cut);
    button(true);
    wait(0.3);
    button(false);
    wait(0.2);
    EXPECT_EQ(viewer().work().edited().undo_steps, 1u);
    const uint64_t cut = hash(Work::kGrey);
    EXPECT_NE(cut, begin);
    // The tool is where it was: on the surface under the pointer.
    const glm::dvec3 at = now().proxy.position_mm;
    EXPECT_NEAR(glm::length(at), kRadius_mm, 6.0); // cut by 3 mm, and alpha sees into the edge
    key("b");                                      // labels, in a slice
    const glm::dvec2 in_slice = middle(Panel::sagittal) + glm::dvec2(30, 10);
    move(in_slice);
    wait(1.0);
    EXPECT_NE(volume(Work::kLabels), nullptr);
    button(true);
    wait(0.2);
    button(false);
    wait(0.2);
    EXPECT_EQ(volume(Work::kLabels)->range().max, 1.0f);
    EXPECT_EQ(hash(Work::kGrey), cut);
    // Within the ball nothing is free: the tool is where the hand is, or on the way to it.
    EXPECT_EQ(viewer().work().edited().undo_steps, 2u); // the cut, the drawing
    key("z", {.ctrl = true});
    EXPECT_EQ(volume(Work::kLabels)->range().max, 0.0f);
}

TEST_F(HandTest, TheSameInputGivesTheSameDocumentAndForces) {
    std::vector<std::string> states;
    std::vector<std::vector<float>> forces, pictures;
    for (int run = 0; run < 2; ++run) {
        open("synthetic:ball?size=32");
        start_mouse();
        wheel(-4.0);
        key("space");
        wait(3.0);
        key("x");
        for (int i = 0; i < 4; ++i)
            wheel(2.0);
        button(true);
        move(middle(Panel::volume) + glm::dvec2(20, 9));
        wait(0.3);
        button(false);
        key("j");
        states.push_back(json_line(viewer().dump()));
        forces.push_back(touch().forces_n());
        pictures.push_back(viewer().shot().value().samples);
    }
    EXPECT_EQ(states[0], states[1]);
    EXPECT_EQ(forces[0], forces[1]);
    EXPECT_EQ(pictures[0], pictures[1]);
    EXPECT_GT(*std::max_element(forces[0].begin(), forces[0].end()), 0.05f);
}

// A path of the command line, on a device that follows it whatever the force: a stroke under way
// ends with the recording, and so does the device.
TEST_F(HandTest, APathDrillsAndItsEndStopsTheDevice) {
    HandOptions hand{.device = "exact", .algorithm = "swept-point"};
    std::vector<haptics::HandPose> poses;
    for (int i = 0; i < 100; ++i)
        poses.push_back({.time_s = 0.01 * i,
                         .tool = {.position_mm = {0.0, 0.0, 45.0 - 0.2 * i}},
                         .buttons = i > 20 ? 1u : 0u});
    hand.path = haptics::HandPath(poses);
    open("synthetic:ball?size=32", {800, 600}, hand);
    EXPECT_TRUE(touch().running());
    EXPECT_FALSE(touch().armed());
    EXPECT_TRUE(state().touch_open);
    const uint64_t begin = content_hash(*volume(Work::kGrey));
    key("x");
    wait(2.0);
    EXPECT_FALSE(touch().running());
    EXPECT_FALSE(state().stylus.on);
    EXPECT_EQ(viewer().work().edited().undo_steps, 1u);
    EXPECT_NE(content_hash(*volume(Work::kGrey)), begin);
}
// Over a widget in 3D the left button presses its plate down, and what it says is done once.
TEST_F(HandTest, WidgetsIn3dArePressedByTheHand) {
    const auto is_away = [&](const Widget3d& widget) { // from the eye
        return glm::dot(widget.plate.top.rotation * glm::dvec3(0.0, 0.0, 1.0),
                        state().camera.eye_mm - widget.plate.top.position_mm) < 0.0;
    };
    open("synthetic:ball?size=24");
    start_mouse();
    key("i");
    wheel(-4.0);
    key("space");
    wait(3.0);
    const auto press = [&](const char* id, double along, double up = 0.0) {
        for (const Widget3d& widget : palette_of(state()))
            if (widget.id == id && !(widget.kind == Widget3d::Kind::plane && is_away(widget))) {
                const haptics::TouchPlate& plate = widget.plate;
                const glm::dvec3 at = plate.top.position_mm +
                                      plate.top.rotation * glm::dvec3(along * plate.half_mm.x,
                                                                      up * plate.half_mm.y, 0.0);
                move(pixel_of(state(), grid(), Panel::volume, at).value());
                wait(1.5);
                EXPECT_EQ(now().plate.plate, -1);
                button(true);
                wait(0.5);
                // A plane goes on until it is pressed no deeper.
                const double least = widget.kind == Widget3d::Kind::plane ? 0.5 : 1.0;
                EXPECT_GT(now().plate.depth_mm, least * kPressed * plate.travel_mm);
                EXPECT_GT(glm::length(now().force_n), 0.3); // it pushes back
                EXPECT_EQ(state().stylus.buttons, 0u);      // and cuts nothing
                button(false);
                wait(0.5);
                EXPECT_EQ(now().plate.plate, -1);
            }
    };
    press("cut", 0.0);
    EXPECT_EQ(state().stylus.first, Carve::cut);
    press("drill", 0.0);
    EXPECT_EQ(state().stylus.first, Carve::drill);
    EXPECT_EQ(viewer().work().edited().undo_steps, 0u);
    press("radius", 0.5); // three quarters of the way from 0.5 to 20 mm, logarithmically
    EXPECT_NEAR(state().radius_mm, 0.5 * std::pow(40.0, 0.75), 0.7);
    key("x");
    move(middle(Panel::volume));
    wait(1.5);
    button(true);
    button(false);
    wait(0.1);
    ASSERT_EQ(viewer().work().edited().undo_steps, 1u);
    press("undo", 0.0);
    EXPECT_EQ(viewer().work().edited().undo_steps, 0u);
    EXPECT_EQ(viewer().work().edited().redo_steps, 1u);
    press("shape", 0.0, -0.25); // the third of four rows
    EXPECT_EQ(state().stylus.shape, TipShape::cylinder);
    // A clip plane through the crosshair looks at the eye; its handle is pushed away from it.
    show("clips");
    click_widget("clip/add");
    const ClipPlane before = state().notes.clip_planes.at(0);
    const Widget3d handle = palette_of(state()).back();
    ASSERT_EQ(handle.kind, Widget3d::Kind::plane);
    for (const double x : {-90.0, 90.0}) { // over the ball, which would hold the tool
        move(middle(Panel::volume) + glm::dvec2(x, -125.0));
        wait(1.0);
    }
    press("plane 1", 0.0);
    const ClipPlane after = state().notes.clip_planes.at(0);
    const glm::dvec3 moved = after.point_mm - before.point_mm;
    EXPECT_EQ(after.normal, before.normal);
    const glm::dvec3 view = glm::normalize(state().camera.target_mm - state().camera.eye_mm);
    EXPECT_NEAR(glm::length(glm::cross(moved, before.normal)), 0.0, 1e-6);
    // The pointer presses two travels deep, and the plane goes on until it is pressed no more.
    EXPECT_GT(glm::dot(moved, view), 0.7 * handle.plate.travel_mm);
    EXPECT_LT(glm::dot(moved, view), 3.0 * handle.plate.travel_mm);
}

// Every algorithm that is offered runs with every device that needs no argument.
TEST_F(HandTest, EveryOfferedAlgorithmAndDeviceRuns) {
    open("synthetic:ball?size=16");
    for (const std::string& device : touch().devices())
        for (const haptics::AlgorithmEntry& algorithm : haptics::algorithms()) {
            touch().set_up({device, {}, algorithm.name});
            const Result<void> started = touch().start(state().stylus);
            EXPECT_EQ(started.has_value(), follows_edits(algorithm)) << device << algorithm.name;
            if (!started)
                continue;
            frame({}, 0.02);
            frame({}, 0.02);
            ASSERT_TRUE(touch().now()) << device << algorithm.name;
            EXPECT_EQ(now().faults & ~uint32_t{haptics::kFaultSoftened}, 0u);
        }
}

// A recording of one hand does to another document of the kind what the hand did.
TEST_F(HandTest, ARecordingDrillsAndItsEndStopsTheDevice) {
    std::vector<haptics::DeviceRecord> records;
    for (int i = 0; i < 100; ++i) {
        haptics::DeviceRecord record;
        record.sample.time_ns = int64_t{10'000'000} * i;
        record.sample.position_m = {0.0, 0.0, 0.045 - 0.0002 * i};
        record.sample.buttons = i > 20 ? 1u : 0u;
        records.push_back(record);
    }
    for (const char* name : {"hand.csv", "hand.log"}) {
        SCOPED_TRACE(name);
        const std::string file = testing::TempDir() + name;
        ASSERT_TRUE(haptics::save_device_log(file, records));
        open("synthetic:ball?size=32", {800, 600},
             {.device = "recorded:" + file, .algorithm = "swept-point"});
        EXPECT_TRUE(touch().running());
        EXPECT_FALSE(touch().armed());
        const uint64_t begin = content_hash(*volume(Work::kGrey));
        key("x");
        wait(2.0);
        EXPECT_FALSE(touch().running()) << "a recording ends";
        EXPECT_EQ(viewer().work().edited().undo_steps, 1u);
        EXPECT_NE(content_hash(*volume(Work::kGrey)), begin);
    }
}

// In the picture the tool hides what is behind it, and is hidden by what lies before it.
TEST_F(HandTest, TheToolLiesAtItsDepthAmongTheRays) {
    open("synthetic:ball?size=32");
    Scene scene = viewer().work().session().scene();
    scene.ray_cast = default_ray_cast(RayMode::iso, viewer().work().loaded());
    viewer().work().session().show(scene);
    key("h");
    for (int i = 0; i < 5; ++i)
        key("=");
    start_mouse();
    for (int i = 0; i < 15; ++i)
        wheel(-1.0); // well before the ball
    wait(2.0);
    const auto is_tool = [&] { // at the panel's middle: blue
        const Image shot = viewer().shot().value();
        const glm::uvec2 p(middle(Panel::volume));
        return shot.at(p.x, p.y, 2) > shot.at(p.x, p.y, 0) + 0.2f;
    };
    EXPECT_TRUE(is_tool());
    touch().set_up({kMouse, {}, "none"}); // which nothing holds out
    ASSERT_TRUE(touch().start(state().stylus));
    for (int i = 0; i < 25; ++i)
        wheel(1.0); // 10 samples behind the surface
    wait(2.0);
    EXPECT_LT(glm::length(now().proxy.position_mm), 0.5 * kRadius_mm);
    EXPECT_FALSE(is_tool());
}

// Rays, the surface, and both show one ball; a cut is seen in all of them.
TEST_F(HandTest, TheSurfaceFollowsEditsAndTheIsoValue) {
    open("synthetic:ball?size=32");
    key("h");
    const auto covered = [&] {
        frame({});
        const Image shot = viewer().shot().value();
        const Box box = box_of(state(), Panel::volume).value();
        size_t lit = 0;
        for (int y = 30; y < box.size_px.y - 30; ++y)
            for (int x = 30; x < box.size_px.x - 30; ++x)
                lit += shot.at(static_cast<uint32_t>(box.low_px.x + x),
                               static_cast<uint32_t>(box.low_px.y + y), 0) > 0.1f;
        return lit;
    };
    key("v");
    EXPECT_EQ(state().seen_as, SeenAs::mesh);
    EXPECT_FALSE(viewer().work().session().scene().ray_cast);
    const size_t whole = covered();
    EXPECT_GT(whole, 1000u);
    viewer().work().session().set_iso(950.0); // farther in
    EXPECT_LT(covered(), whole);
    viewer().work().session().set_iso(500.0);
    EXPECT_EQ(covered(), whole);
    key("v");
    EXPECT_EQ(state().seen_as, SeenAs::both);
    EXPECT_TRUE(viewer().work().session().scene().ray_cast);
    key("v");
    EXPECT_EQ(state().seen_as, SeenAs::rays);
    EXPECT_TRUE(viewer().work().session().scene().surfaces.empty());
}

} // namespace
} // namespace palpate::view
