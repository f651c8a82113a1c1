#include "engine/scene/display_profile.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

#include "engine/base/file.h"
#include "engine/base/json_value.h"
#include "engine/scene/scene_names.h"

namespace palpate {

namespace {

constexpr double kFarthest_mm = 1e5;

// World millimetres for one of the person's.
double scale_of(const DisplayProfile& profile, const Camera& camera) {
    return glm::distance(camera.target_mm, camera.eye_mm) / profile.eyes_mm.z;
}

glm::dmat4 read_matrix(const JsonValue& in) {
    glm::dmat4 matrix(1.0);
    const std::vector<JsonValue> items = in.items(16, 16);
    if (items.size() != 16)
        return matrix;
    for (int i = 0; i < 16; ++i) // row by row
        matrix[i % 4][i / 4] = items[static_cast<size_t>(i)].number(-1e6, 1e6);
    if (glm::transpose(matrix)[3] != glm::dvec4(0, 0, 0, 1))
        in.complain("expected a last row of 0, 0, 0, 1");
    else if (!(std::abs(glm::determinant(matrix)) > 1e-12))
        in.complain("expected a matrix that can be inverted");
    return matrix;
}

} // namespace

Result<DisplayProfile> parse_display_profile(std::string_view text, const std::string& name) {
    Result<Json> json = parse_json(text, name);
    if (!json)
        return pass_on(json);
    JsonErrors errors{name, {}};
    const JsonValue in(*json, "", errors);
    DisplayProfile profile;
    in.only_keys({"palpate_display", "name", "screen_mm", "eyes_mm", "eye_separation_mm", "layout",
                  "swap_eyes", "mirror", "screen_from_device"});
    const auto version = in.find("palpate_display");
    if (!version || version->number(0, 1e6) != 1)
        in.complain("expected \"palpate_display\": 1");
    in.take("name", profile.name);
    if (const auto size = in.find("screen_mm"))
        if (const auto sides = size->items(2, 2); sides.size() == 2)
            profile.screen_mm = {sides[0].number_above(0.0, kFarthest_mm),
                                 sides[1].number_above(0.0, kFarthest_mm)};
    if (const auto eyes = in.find("eyes_mm")) {
        profile.eyes_mm = eyes->vector(-kFarthest_mm, kFarthest_mm);
        if (!(profile.eyes_mm.z > 0.0))
            eyes->complain("expected eyes in front of the screen, z above 0");
    }
    if (const auto apart = in.find("eye_separation_mm"))
        profile.eye_separation_mm = apart->number_above(0.0, kFarthest_mm);
    if (const auto layout = in.find("layout")) {
        profile.layout = layout->choice(Names<StereoLayout>::list);
        if (profile.layout == StereoLayout::separate)
            layout->complain("expected a layout of one picture");
    }
    in.take("swap_eyes", profile.swap_eyes);
    in.take("mirror", profile.mirror);
    if (const auto matrix = in.find("screen_from_device"))
        profile.screen_from_device = read_matrix(*matrix);
    if (errors.first)
        return tl::unexpected<Error>(*errors.first);
    return profile;
}

Result<DisplayProfile> load_display_profile(const std::filesystem::path& path) {
    Result<std::string> text = load_text(path, 1 << 20);
    if (!text)
        return pass_on(text);
    return parse_display_profile(*text, path.string());
}

glm::dmat4 world_from_screen(const DisplayProfile& profile, const Camera& camera) {
    const View view = make_view(camera, glm::uvec2(1));
    const double scale = scale_of(profile, camera);
    return {glm::dvec4(scale * view.right, 0.0), glm::dvec4(scale * view.up, 0.0),
            glm::dvec4(-scale * view.forward, 0.0), glm::dvec4(camera.target_mm, 1.0)};
}

Camera camera_before(const DisplayProfile& profile, const Camera& camera, glm::uvec2 eye_px) {
    const glm::dmat4 world = world_from_screen(profile, camera);
    const glm::dvec3 eyes = profile.eyes_mm;
    const glm::dvec2 pixel_mm = profile.screen_mm / glm::dvec2(eye_px);
    Camera before = camera;
    before.projection = Projection::perspective;
    before.eye_mm = glm::dvec3(world * glm::dvec4(eyes, 1.0));
    before.target_mm = glm::dvec3(world * glm::dvec4(eyes.x, eyes.y, 0.0, 1.0));
    before.view_angle_deg =
        2.0 * std::atan(0.5 * profile.screen_mm.y / eyes.z) * 180.0 / glm::pi<double>();
    before.pixel_aspect = pixel_mm.x / pixel_mm.y;
    before.shift = -glm::dvec2(eyes) / (0.5 * profile.screen_mm.y);
    return before;
}

StereoRig rig_before(const DisplayProfile& profile, const Camera& camera) {
    const double scale = scale_of(profile, camera);
    return {scale * profile.eye_separation_mm, scale * profile.eyes_mm.z};
}

} // namespace palpate
