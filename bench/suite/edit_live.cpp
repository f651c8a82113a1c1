#include "bench/suite/edit_live.h"

#include <chrono>

#include "engine/base/profile.h"
#include "engine/edit/stroke.h"
#include "engine/session/session.h"
#include "engine/volume/extent.h"
#include "haptics/core/clock.h"
#include "haptics/device/recorded.h"

namespace palpate::bench {

namespace {

constexpr int64_t kTick_ns = 1'000'000;
constexpr double kAirValue = -1000.0 + 1024.0;

// A hand that follows the path in so many seconds, with the button pressed.
haptics::HandPath pressed_path(const std::vector<glm::dvec3>& path_mm, double seconds) {
    std::vector<haptics::HandPose> poses;
    for (size_t i = 0; i < path_mm.size(); ++i)
        poses.push_back(
            {.time_s = seconds * static_cast<double>(i) / static_cast<double>(path_mm.size() - 1),
             .tool = {.position_mm = path_mm[i]},
             .buttons = 1});
    return haptics::HandPath(std::move(poses));
}

// The device's time for all that it did after the last byte of an edit had arrived.
double ms_after_uploads(const std::vector<PassTime>& passes) {
    double ms = 0.0;
    for (const PassTime& pass : passes)
        ms = pass.name == "upload" || pass.name == "cell patch" ? 0.0 : ms + pass.gpu_ms;
    return ms;
}

} // namespace

Result<Json> edit_live(Bench& bench, const Volume& volume, const Scene& scene,
                       const std::vector<glm::dvec3>& path_mm, double seconds) {
    using Clock = std::chrono::steady_clock;
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.to_value = kAirValue;
    const double radius_mm = 10.0 * smallest_spacing_mm(volume.grid());
    const Json ball = Json{{"kind", "ball"}, {"radius_mm", radius_mm}};
    const Stroke stroke = *make_stroke(ball, cut, {{}});
    const float iso = static_cast<float>(scene.ray_cast->isos.front().value);
    Renderer renderer(bench.device());
    PALPATE_TRY(renderer.draw(scene, {volume, std::nullopt}, CoarseSettings{}));
    Session session({.document = volume,
                     .grey = "volume",
                     .labels = {},
                     .scene = scene,
                     .touch = {},
                     .parameters = {},
                     .mesh_iso = iso,
                     .edit = {}});
    auto eye = session.add_eye();
    session.use({stroke.shape, stroke.tool, stroke.operation, {}, {}});
    session.settle();
    const haptics::Workspace workspace(path_mm.front(), 1.0);
    haptics::RecordedDevice hand(
        {.workspace_m = glm::dvec3(10.0)}, // no reach and no limits: the path is what is carved
        records_of_path(pressed_path(path_mm, seconds), workspace, kTick_ns),
        haptics::monotonic_ns());
    const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                     std::chrono::duration<double>(seconds));
    PALPATE_TRY(session.start({hand, *haptics::find_algorithm("none"), workspace, {}, {}, {}}));
    size_t frames = 0;
    for (; Clock::now() < end && !bench.options().stop.stop_requested(); ++frames) {
        const Session::Eye::Sight sight = eye.look();
        const auto drawn = renderer.draw(sight.scene, sight.data, CoarseSettings{});
        const int64_t now = profile::now_ns();
        if (!drawn)
            return fail("{}", drawn.error().message);
        eye.reached(EditLag::Reader::texture, sight,
                    now - static_cast<int64_t>(1e6 * ms_after_uploads(drawn->passes)));
        eye.reached(EditLag::Reader::picture, sight, now);
    }
    session.stop();
    if (const std::string refusal = session.take_refusal(); !refusal.empty())
        return fail("{}", refusal);
    Json out = session.lag().json();
    out["seconds"] = seconds;
    out["frames"] = frames;
    out["snapshots"] = session.state().snapshot;
    return out;
}

} // namespace palpate::bench
