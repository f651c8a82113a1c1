#include "bench/suite/edit_live.h"

#include <chrono>
#include <thread>

#include "engine/base/log.h"
#include "engine/base/profile.h"
#include "engine/edit/edit_lag.h"
#include "engine/edit/editor.h"
#include "engine/edit/stroke.h"
#include "engine/surface/block_surface.h"

namespace palpate::bench {

namespace {

constexpr std::chrono::microseconds kTick(1000);
constexpr double kAir = -1000.0 + 1024.0;

glm::dvec3 along(const std::vector<glm::dvec3>& path, double share) {
    const double at = share * static_cast<double>(path.size() - 1);
    const size_t i = std::min(static_cast<size_t>(at), path.size() - 2);
    return glm::mix(path[i], path[i + 1], at - static_cast<double>(i));
}

// What the device did after the last byte of an edit had arrived.
double ms_after_uploads(const std::vector<PassTime>& passes) {
    double ms = 0.0;
    for (const PassTime& pass : passes)
        ms = pass.name == "upload" || pass.name == "cell patch" ? 0.0 : ms + pass.gpu_ms;
    return ms;
}

} // namespace

Result<Value> edit_live(Bench& bench, const Volume& volume, const Scene& scene,
                        const std::vector<glm::dvec3>& path_mm, double seconds) {
    using Clock = std::chrono::steady_clock;
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.to_value = kAir;
    const double radius_mm = 10.0 * sample_mm(volume);
    const Json ball =
        Json::object({{"kind", Json::of("ball")}, {"radius_mm", Json::of(radius_mm)}});
    const Stroke stroke = make_stroke(ball, cut, {{}});
    const float iso = static_cast<float>(scene.ray_cast->isos.front().value);
    Renderer renderer(bench.device());
    if (const auto first = renderer.draw_coarse(scene, {volume, std::nullopt}, {}); !first)
        return fail("{}", first.error().message);
    BlockSurface surface(volume, iso);

    Editor editor(volume);
    auto hand_reader = editor.add_reader(), mesh_reader = editor.add_reader(),
         frame_reader = editor.add_reader();
    EditLag lag;
    editor.use(stroke.shape, stroke.tool, stroke.operation);
    const Clock::time_point begin = Clock::now();
    const Clock::time_point end =
        begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    std::jthread hand([&](const std::stop_token& stop) {
        uint64_t number = 0, refused = 0;
        for (Clock::time_point due = begin; due < end && !stop.stop_requested(); due += kTick) {
            std::this_thread::sleep_until(due);
            lag.feels(hand_reader.pin()->snapshot);
            const double t = std::chrono::duration<double>(due - begin).count();
            const auto kind = number == 0 ? EditInput::Kind::down : EditInput::Kind::move;
            const StrokePose pose{t, {along(path_mm, t / seconds), {1, 0, 0, 0}}};
            const bool taken = editor.push({kind, pose, number + 1, profile::now_ns()});
            number += taken;
            refused += !taken;
        }
        if (refused > 0)
            log::warning("the editor's ring was full for {} of {} poses", refused, number);
    });
    std::jthread mesher([&](const std::stop_token& stop) {
        for (uint64_t done = 0; !stop.stop_requested();) {
            const auto pin = mesh_reader.pin();
            if (pin->snapshot == done) {
                std::this_thread::sleep_for(kTick / 4);
                continue;
            }
            done = pin->snapshot;
            surface.update(pin->volume());
            lag.reached(EditLag::Reader::mesh, *pin, profile::now_ns());
        }
    });
    size_t frames = 0;
    for (; Clock::now() < end && !bench.options().stop.stop_requested(); ++frames) {
        const auto pin = frame_reader.pin();
        const auto drawn = renderer.draw_coarse(scene, {pin->volume(), std::nullopt}, {});
        const int64_t now = profile::now_ns();
        if (!drawn)
            return fail("{}", drawn.error().message);
        lag.reached(EditLag::Reader::texture, *pin,
                    now - static_cast<int64_t>(1e6 * ms_after_uploads(drawn->frame.passes)));
        lag.reached(EditLag::Reader::picture, *pin, now);
    }
    hand.join();
    mesher.request_stop();
    mesher.join();
    Value out = Value::parse(json_line(lag.json()));
    out["seconds"] = seconds;
    out["frames"] = frames;
    out["snapshots"] = frame_reader.pin()->snapshot;
    return out;
}

} // namespace palpate::bench
