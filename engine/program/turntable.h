#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/program/named_files.h"
#include "engine/scene/scene.h"

namespace CLI {
class App;
}

namespace palpate {

// Many pictures of a scene by a camera that moves: once round, or through the cameras of scenes.
struct TurntableOptions {
    uint32_t frames = 0; // 0: one picture, no turntable
    std::vector<std::string> path;
    double frames_per_s = 25.0;
};
void add_turntable_options(CLI::App& app, TurntableOptions& options);

// Fails where `output` is no name for the frames: a picture with a run of #, which becomes the
// number from 0 on, or an .mp4.
Result<void> check_together(const TurntableOptions& options, const std::string& output);

// The files of the frames, for each_its_own(); none of an .mp4.
std::vector<std::string> frame_names(const TurntableOptions& options, const std::string& output);

// Draws all frames: `draw(camera, file)` writes one, whole. Interrupted, it leaves the whole frames
// before that; of an .mp4, and where a frame fails, nothing. `grid` is the volume's.
Result<void> draw_turntable(
    const TurntableOptions& options, const Camera& first, const Grid& grid,
    const std::string& output,
    const std::function<Result<void>(const Camera&, const std::string& file)>& draw,
    const std::stop_token& stop);

} // namespace palpate
