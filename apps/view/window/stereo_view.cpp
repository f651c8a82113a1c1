#include "apps/view/window/stereo_view.h"

#include "apps/view/window/state.h"

namespace palpate::view {

namespace {

constexpr glm::vec3 kCursorColor{1.0f, 0.9f, 0.3f}, kCrosshairColor{0.35f, 0.86f, 1.0f};
constexpr double kCursor_px = 5.0, kCrosshair_px = 4.0; // radius on the screen

// Pixels of the view for one of an eye's.
glm::uvec2 view_px_per_eye_px(const StereoView& stereo) {
    return stereo.on ? display_size_px({1, 1}, stereo.layout) : glm::uvec2(1);
}

glm::uvec2 view_size_px(const ViewState& state) {
    return glm::uvec2(glm::max(box_of(state, Panel::volume).value().size_px, 1));
}

// Its camera, size and eyes.
Scene eyes_of(const ViewState& state) {
    Scene scene;
    scene.size_px = view_size_px(state);
    scene.camera = state.camera;
    show_to_both_eyes(scene, state.stereo);
    return scene;
}

} // namespace

StereoView stereo_view_of(const Scene& scene, const Camera& camera) {
    StereoView stereo;
    stereo.mirror = scene.mirror;
    stereo.on = scene.stereo.has_value() || scene.mirror;
    if (!scene.stereo) {
        stereo.layout = scene.mirror ? StereoLayout::left : stereo.layout;
        return stereo;
    }
    const double distance = glm::distance(camera.target_mm, camera.eye_mm);
    if (scene.stereo->layout != StereoLayout::separate)
        stereo.layout = scene.stereo->layout;
    stereo.swap_eyes = scene.stereo->swap_eyes;
    stereo.separation = scene.stereo->rig.eye_separation_mm / distance;
    stereo.convergence = scene.stereo->rig.convergence_mm / distance;
    return stereo;
}

void use_profile(StereoView& stereo, const DisplayProfile& profile) {
    stereo.on = true;
    stereo.layout = profile.layout.value_or(stereo.layout);
    stereo.swap_eyes = profile.swap_eyes;
    stereo.mirror = profile.mirror;
    stereo.profile = profile;
}

glm::uvec2 eye_size_px(const StereoView& stereo, glm::uvec2 view_px) {
    return glm::max(view_px / view_px_per_eye_px(stereo), 1u);
}

void show_to_both_eyes(Scene& scene, const StereoView& stereo) {
    scene.stereo.reset();
    scene.mirror = stereo.on && stereo.mirror;
    if (!stereo.on)
        return;
    scene.size_px = eye_size_px(stereo, scene.size_px);
    const double distance = glm::distance(scene.camera.target_mm, scene.camera.eye_mm);
    StereoRig rig{stereo.separation * distance, stereo.convergence * distance};
    if (stereo.profile) {
        rig = rig_before(*stereo.profile, scene.camera);
        scene.camera = camera_before(*stereo.profile, scene.camera, scene.size_px);
    } else {
        const glm::dvec2 pixel(view_px_per_eye_px(stereo));
        scene.camera.pixel_aspect = pixel.x / pixel.y;
    }
    scene.stereo = StereoSettings{rig, stereo.layout, stereo.swap_eyes};
}

DisplayLayout display_of(const ViewState& state, Panel panel, glm::ivec2 screen_px) {
    const StereoView& stereo = state.stereo;
    if (panel != Panel::volume || !stereo.on)
        return {};
    const Scene scene = eyes_of(state);
    DisplayLayout display{stereo.layout, stereo.swap_eyes, stereo.mirror,
                          screen_px + box_of(state, panel).value().low_px};
    const auto eyes = make_stereo_views(scene.camera, scene.stereo->rig, scene.size_px);
    const glm::dvec2 pixel(view_px_per_eye_px(stereo));
    const auto mark = [&](glm::dvec3 point_mm, double radius_px, glm::vec3 color) {
        for (uint32_t eye = 0; eye < 2; ++eye)
            if (const auto at = pixel_of(eyes[eye], glm::ivec2(scene.size_px), point_mm))
                display.marks.push_back(
                    {eye, glm::vec2(*at), glm::vec2(radius_px / pixel), color, 1.0f});
    };
    if (state.crosshair_shown)
        mark(state.crosshair_mm, kCrosshair_px, kCrosshairColor);
    if (state.cursor_mm)
        mark(*state.cursor_mm, kCursor_px, kCursorColor);
    return display;
}

Ray ray_under(const ViewState& state, glm::dvec2 at_px) {
    const Scene scene = eyes_of(state);
    const glm::uvec2 pixel = view_px_per_eye_px(state.stereo);
    const glm::dvec2 size(scene.size_px);
    const glm::dvec2 inside =
        at_px + 0.5 - glm::dvec2(box_of(state, Panel::volume).value().low_px); // of the view
    // Halves lie beside each other unscaled; other layouts show each eye all over the view.
    glm::dvec2 at = inside;
    for (int axis = 0; axis < 2; ++axis)
        if (pixel[axis] > 1 && at[axis] >= size[axis])
            at[axis] -= size[axis];
    if (state.stereo.on && state.stereo.mirror)
        at.y = size.y - at.y;
    return ray_through(make_view(scene.camera, scene.size_px), at - 0.5, scene.size_px);
}

void move_cursor(ViewState& state, const Subject& subject) {
    if (!state.stereo.on || state.under != Panel::volume) {
        state.cursor_mm.reset();
        return;
    }
    const Ray ray = ray_under(state, state.pointer_px);
    const auto met = subject.pick ? subject.pick(ray) : std::nullopt;
    const glm::dvec3 forward = glm::normalize(state.camera.target_mm - state.camera.eye_mm);
    const double ahead = glm::dot(state.camera.target_mm - ray.origin_mm, forward);
    state.cursor_mm =
        met.value_or(ray.origin_mm + ahead / glm::dot(ray.direction, forward) * ray.direction);
}

} // namespace palpate::view
