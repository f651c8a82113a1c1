// Stereo in the window: where the 3D cursor and the crosshair are drawn, against geometry that
// knows nothing of cameras' bounds: eyes, a screen, and the lines between.

#include <random>

#include "apps/view/window/stereo_view.h"
#include "tests/view/subjects.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

constexpr StereoLayout kLayouts[] = {StereoLayout::side_by_side,       StereoLayout::top_bottom,
                                     StereoLayout::row_interleaved,    StereoLayout::left,
                                     StereoLayout::column_interleaved, StereoLayout::right,
                                     StereoLayout::checkerboard,       StereoLayout::anaglyph};

// A screen in the world, and an eye before it.
struct Seen {
    glm::dvec3 middle, right, up, eye; // of the screen: its axes of unit length
    glm::dvec2 size_mm;

    // The place where the line from the eye to a point goes through the screen: shares of width and
    // height from its upper left corner.
    glm::dvec2 at(glm::dvec3 point) const {
        const glm::dvec3 normal = glm::cross(right, up);
        const double t = glm::dot(middle - eye, normal) / glm::dot(point - eye, normal);
        const glm::dvec3 on = eye + t * (point - eye) - middle;
        return {0.5 + glm::dot(on, right) / size_mm.x, 0.5 - glm::dot(on, up) / size_mm.y};
    }
};

// The window through which an eye (-1 or 1) of a camera sees, at the distance of convergence.
Seen window_of(const Camera& camera, const StereoView& stereo, glm::dvec2 view_px, double side) {
    const glm::dvec3 forward = glm::normalize(camera.target_mm - camera.eye_mm);
    const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up));
    const double distance = glm::distance(camera.target_mm, camera.eye_mm);
    const double ahead = stereo.convergence * distance;
    const double height = 2.0 * ahead * std::tan(glm::radians(0.5 * camera.view_angle_deg));
    return {camera.eye_mm + ahead * forward,
            right,
            glm::cross(right, forward),
            camera.eye_mm + 0.5 * side * stereo.separation * distance * right,
            {height * view_px.x / view_px.y, height}};
}

// The same before a profile's screen, which is at the target and faces the camera.
Seen screen_of(const Camera& camera, const DisplayProfile& profile, double side) {
    const glm::dvec3 forward = glm::normalize(camera.target_mm - camera.eye_mm);
    const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up));
    const glm::dvec3 up = glm::cross(right, forward);
    const double scale = glm::distance(camera.target_mm, camera.eye_mm) / profile.eyes_mm.z;
    const glm::dvec3 eye =
        profile.eyes_mm + glm::dvec3(0.5 * side * profile.eye_separation_mm, 0.0, 0.0);
    return {camera.target_mm, right, up,
            camera.target_mm + scale * (eye.x * right + eye.y * up - eye.z * forward),
            scale * profile.screen_mm};
}

// The eye that a pixel of the view shows, and which of the eye's pixels: by the layout's name.
struct Part {
    int eye;
    glm::dvec2 at; // shares of the eye's picture
};
Part part_at(StereoLayout layout, glm::ivec2 pixel, glm::ivec2 on_screen, glm::dvec2 view_px) {
    const glm::dvec2 share = (glm::dvec2(pixel) + 0.5) / view_px;
    switch (layout) {
        case StereoLayout::side_by_side:
            return {share.x >= 0.5, {std::fmod(2.0 * share.x, 1.0), share.y}};
        case StereoLayout::top_bottom:
            return {share.y >= 0.5, {share.x, std::fmod(2.0 * share.y, 1.0)}};
        case StereoLayout::row_interleaved:
            return {on_screen.y % 2, share};
        case StereoLayout::column_interleaved:
            return {on_screen.x % 2, share};
        case StereoLayout::checkerboard:
            return {(on_screen.x + on_screen.y) % 2, share};
        case StereoLayout::right:
            return {1, share};
        default:
            return {0, share};
    }
}

DisplayProfile workbench() { // screen and eyes of a 17 inch mirror workbench, from aside
    DisplayProfile profile;
    profile.name = "workbench";
    profile.screen_mm = {338.0, 246.0};
    profile.eyes_mm = {25.0, 40.0, 450.0};
    profile.eye_separation_mm = 62.0;
    profile.mirror = true;
    const glm::dmat4 tilt =
        glm::rotate(glm::dmat4(1.0), glm::radians(52.0), glm::dvec3(1.0, 0.0, 0.0));
    profile.screen_from_device = glm::translate(glm::dmat4(1.0), {5.0, -60.0, 30.0}) * tilt;
    return profile;
}

class StereoTest : public ViewerTest {
 protected:
    // A volume of which nothing is seen in 3D, so that marks lie on black.
    void open_black(const StereoView& stereo) {
        OpenedScene opened = open_synthetic("synthetic:ball?size=24");
        opened.scene.ray_cast->mode = RayMode::iso;
        opened.scene.ray_cast->isos = {{1e9}};
        opened.scene.mirror = stereo.mirror;
        const double distance =
            glm::distance(opened.scene.camera.target_mm, opened.scene.camera.eye_mm);
        opened.scene.stereo =
            StereoSettings{{stereo.separation * distance, stereo.convergence * distance},
                           stereo.layout,
                           stereo.swap_eyes};
        open_scene(Source{std::move(opened)}, {802, 602}, stereo.profile);
        key("n");                                          // no letters
        click(middle(Panel::axial) + glm::dvec2(31, -22)); // the crosshair, off the middle
        key("l");                                          // 3D alone
        key("t");
    }
    // The centroid of what a picture of the window shows about an expected place of an eye's
    // picture: in pixels of the view. `channel` of colours.
    std::optional<glm::dvec2> centroid(const Image& shot, StereoLayout layout, int shown_eye,
                                       glm::dvec2 share, bool mirror) {
        const Box box = box_of(state(), Panel::volume).value();
        const glm::dvec2 size(box.size_px);
        double weight = 0.0;
        glm::dvec2 sum(0.0);
        for (int y = 0; y < box.size_px.y; ++y)
            for (int x = 0; x < box.size_px.x; ++x) {
                const glm::ivec2 pixel(x, y);
                Part part = part_at(layout, pixel, pixel + box.low_px, size);
                if (layout == StereoLayout::anaglyph)
                    part.eye = shown_eye;
                if (mirror)
                    part.at.y = 1.0 - part.at.y;
                if (part.eye != shown_eye || glm::length((part.at - share) * size) > 25.0)
                    continue;
                // An anaglyph shows the left eye in red, the right one in green and blue.
                const size_t channel = layout == StereoLayout::anaglyph && shown_eye == 1 ? 1 : 0;
                const double w = shot.at(static_cast<uint32_t>(box.low_px.x + x),
                                         static_cast<uint32_t>(box.low_px.y + y), channel);
                weight += w;
                sum += w * part.at * size;
            }
        return weight > 0.5 ? std::optional(sum / weight) : std::nullopt;
    }
    // Marks of crosshair and cursor in a picture lie where `seen` says, within 0.1 pixel.
    template <class SeenBy>
    void expect_marks(const StereoView& stereo, const SeenBy& seen) {
        const Box box = box_of(state(), Panel::volume).value();
        const glm::dvec2 size(box.size_px);
        move(glm::dvec2(box.low_px) + glm::floor(glm::dvec2(0.16, 0.22) * size));
        ASSERT_TRUE(state().cursor_mm);
        EXPECT_TRUE(viewer().hides_pointer());
        const Image shot = viewer().shot().value();
        const glm::dvec3 points[] = {state().crosshair_mm, *state().cursor_mm};
        for (const glm::dvec3 point : points) {
            std::optional<glm::dvec2> found[2];
            glm::dvec2 expected[2];
            for (int eye = 0; eye < 2; ++eye) {
                expected[eye] = seen(eye == 0 ? -1.0 : 1.0).at(point) * size;
                const int shown = stereo.swap_eyes ? 1 - eye : eye;
                found[eye] =
                    centroid(shot, stereo.layout, shown, expected[eye] / size, stereo.mirror);
                const bool hidden = (stereo.layout == StereoLayout::left && shown == 1) ||
                                    (stereo.layout == StereoLayout::right && shown == 0);
                ASSERT_EQ(found[eye].has_value(), !hidden) << int(stereo.layout);
                if (hidden)
                    continue;
                EXPECT_NEAR(found[eye]->x, expected[eye].x, 0.1)
                    << int(stereo.layout) << ", eye " << eye;
                EXPECT_NEAR(found[eye]->y, expected[eye].y, 0.1)
                    << int(stereo.layout) << ", eye " << eye;
            }
            if (found[0] && found[1]) {
                EXPECT_NEAR(found[0]->x - found[1]->x, expected[0].x - expected[1].x, 0.1);
                EXPECT_GT(std::abs(expected[0].x - expected[1].x), 2.0);
            }
        }
    }
};

// Done in every layout: the parallax of points off the plane of no parallax.
TEST_F(StereoTest, CursorAndCrosshairHaveTheParallaxOfTheGeometry) {
    for (const StereoLayout layout : kLayouts)
        for (const bool turned : {false, true}) {
            StereoView stereo;
            stereo.layout = layout;
            stereo.swap_eyes = stereo.mirror = turned;
            stereo.separation = 0.06;
            stereo.convergence = 0.8; // so that the cursor, as far as the target, has parallax
            open_black(stereo);
            EXPECT_TRUE(state().stereo.on);
            const glm::dvec2 size(box_of(state(), Panel::volume)->size_px);
            expect_marks(state().stereo, [&](double side) {
                return window_of(state().camera, state().stereo, size, side);
            });
            if (HasFailure())
                return;
        }
}

TEST_F(StereoTest, AProfilesScreenIsSeenAsItStands) {
    for (const StereoLayout layout :
         {StereoLayout::anaglyph, StereoLayout::side_by_side, StereoLayout::row_interleaved}) {
        StereoView stereo;
        stereo.layout = layout;
        stereo.profile = workbench();
        stereo.profile->layout = layout;
        open_black(stereo);
        // The cursor lies on the screen, and has no parallax: only the crosshair is checked for it.
        const Box box = box_of(state(), Panel::volume).value();
        const glm::dvec2 size(box.size_px);
        const Image shot = viewer().shot().value();
        for (int eye = 0; eye < 2; ++eye) {
            const glm::dvec2 expected =
                screen_of(state().camera, *stereo.profile, eye == 0 ? -1.0 : 1.0)
                    .at(state().crosshair_mm) *
                size;
            const auto found = centroid(shot, layout, eye, expected / size, true);
            ASSERT_TRUE(found) << int(layout);
            EXPECT_NEAR(found->x, expected.x, 0.1) << int(layout) << ", eye " << eye;
            EXPECT_NEAR(found->y, expected.y, 0.1) << int(layout) << ", eye " << eye;
        }
    }
}

// The picture of a plane is a homography of it: that of four points gives all others, and it is the
// one that eyes, screen and calibration give. Mirrored, its rows are counted from below.
TEST(Stereo, MirroredAndCalibratedProfilesAreHomographies) {
    std::mt19937 random(5);
    const Grid grid = random_grid(random);
    TestHand hand{subject_of(grid)};
    ViewState& state = hand.state;
    state.layout = Layout::volume;
    const DisplayProfile profile = workbench();
    use_profile(state.stereo, profile);
    state.stereo.layout = StereoLayout::top_bottom;
    const glm::dvec2 view_px(box_of(state, Panel::volume)->size_px);
    const glm::dmat4 world = world_from_screen(profile, state.camera);
    const auto drawn = [&](glm::dvec2 on_plane, uint32_t eye) { // in pixels of the eye's picture
        state.crosshair_mm =
            glm::dvec3(world * profile.screen_from_device * glm::dvec4(on_plane, 20.0, 1.0));
        const DisplayLayout display = display_of(state, Panel::volume, {0, 0});
        return glm::dvec2(display.marks.at(eye).at_px);
    };
    EXPECT_TRUE(display_of(state, Panel::volume, {0, 0}).mirror);
    const glm::dvec2 eye_px = view_px * glm::dvec2(1.0, 0.5);
    for (uint32_t eye = 0; eye < 2; ++eye) {
        // pixel = H (x, y, 1), from the profile's numbers alone: the central projection from the
        // eye to z = 0, of points (x, y, 20) of the device.
        const glm::dvec3 e =
            profile.eyes_mm +
            glm::dvec3((eye == 0 ? -0.5 : 0.5) * profile.eye_separation_mm, 0.0, 0.0);
        const glm::dmat4& c = profile.screen_from_device;
        const glm::dvec3 x(c[0]), y(c[1]), o(glm::dvec3(20.0 * c[2] + c[3]));
        const auto column = [&](glm::dvec3 p, double w) { // of P e.z - e P.z, and e.z w - P.z
            return glm::dvec3((p.x * e.z - e.x * p.z) / profile.screen_mm.x,
                              -(p.y * e.z - e.y * p.z) / profile.screen_mm.y, e.z * w - p.z);
        };
        const glm::dmat3 h(column(x, 0.0), column(y, 0.0), column(o, 1.0));
        for (double v = -40.0; v <= 40.0; v += 20.0)
            for (double u = -60.0; u <= 60.0; u += 20.0) {
                const glm::dvec3 image = h * glm::dvec3(u, v, 1.0);
                const glm::dvec2 expected =
                    (glm::dvec2(image) / image.z + 0.5) * glm::floor(eye_px) - 0.5;
                const glm::dvec2 found = drawn({u, v}, eye);
                EXPECT_NEAR(found.x, expected.x, 1e-3) << u << ", " << v; // marks are floats
                EXPECT_NEAR(found.y, expected.y, 1e-3) << u << ", " << v;
            }
    }
}

TEST(Stereo, TheRayUnderAPixelIsTheOneThatIsShownThere) {
    std::mt19937 random(6);
    TestHand hand{subject_of(random_grid(random))};
    ViewState& state = hand.state;
    for (const StereoLayout layout : kLayouts)
        for (const bool mirror : {false, true})
            for (const bool on : {false, true}) {
                state.stereo = {.on = on, .layout = layout, .mirror = mirror};
                const Box box = box_of(state, Panel::volume).value();
                const glm::dvec2 at = glm::dvec2(box.low_px) + glm::dvec2(100.25, 60.5);
                const Ray ray = ray_under(state, at);
                Scene scene;
                scene.size_px = glm::uvec2(box.size_px);
                scene.camera = state.camera;
                show_to_both_eyes(scene, state.stereo);
                const auto pixel =
                    pixel_of(make_view(scene.camera, scene.size_px), glm::ivec2(scene.size_px),
                             ray.origin_mm + 300.0 * ray.direction);
                const glm::dvec2 scale = glm::dvec2(box.size_px) / glm::dvec2(scene.size_px);
                glm::dvec2 expected(100.75, 61.0);
                for (int i = 0; i < 2; ++i)
                    if (scale[i] > 1.0)
                        expected[i] = std::fmod(expected[i], double(scene.size_px[i]));
                if (on && mirror)
                    expected.y = scene.size_px.y - expected.y;
                EXPECT_NEAR(pixel->x + 0.5, expected.x, 1e-6) << int(layout);
                EXPECT_NEAR(pixel->y + 0.5, expected.y, 1e-6) << int(layout);
            }
}

TEST(Stereo, ProfilesAreReadAndFaultsAreNamed) {
    const auto read = [](const char* text) { return parse_display_profile(text, "p.json"); };
    const DisplayProfile profile = read(R"({"palpate_display": 1, "name": "desk",
        "screen_mm": [520, 290], "eyes_mm": [0, 50, 700], "eye_separation_mm": 63,
        "layout": "row_interleaved", "swap_eyes": true, "mirror": true,
        "screen_from_device": [1,0,0,10, 0,0,-1,20, 0,1,0,30, 0,0,0,1]})")
                                       .value();
    EXPECT_EQ(profile.layout, StereoLayout::row_interleaved);
    EXPECT_EQ(profile.screen_from_device * glm::dvec4(1, 2, 3, 1), glm::dvec4(11, 17, 32, 1));
    for (const auto& [text, complaint] :
         {std::pair(R"({"name": "x"})", "palpate_display"),
          {R"({"palpate_display": 1, "eyes_mm": [0, 0, -5]})", "in front of the screen"},
          {R"({"palpate_display": 1, "layout": "separate"})", "one picture"},
          {R"({"palpate_display": 1, "screen_mm": [0, 5]})", "screen_mm"},
          {R"({"palpate_display": 1, "screen_from_device": [0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,1]})",
           "inverted"},
          {R"({"palpate_display": 1, "depth": 3})", "depth"}}) {
        const auto found = read(text);
        ASSERT_FALSE(found) << text;
        EXPECT_NE(found.error().message.find("p.json"), std::string::npos);
        EXPECT_NE(found.error().message.find(complaint), std::string::npos)
            << found.error().message;
    }
}

} // namespace
} // namespace palpate::view
