#pragma once

#include <string>
#include <vector>

#include "engine/image/image.h"
#include "engine/program/scene_options.h"

namespace CLI {
class App;
}

// Warnings of `palpate render`: an empty picture, or an option without effect.
namespace palpate {

// A scene that is about to be drawn, and where it comes from.
struct SceneToDraw {
    const SceneOptions& options;
    const SceneFile& file; // of base_scene()
    const Scene& scene;    // of final_scene()
    const LoadedScene& loaded;
};

// A sentence for each part of the scene that draws nothing or changes nothing, with the reason.
std::vector<std::string> empty_parts(const SceneToDraw& drawn);

// One warning with every option that was given and has no effect. `frames` of --frames.
void warn_of_idle_options(const CLI::App& app, const SceneToDraw& drawn, const std::string& output,
                          uint32_t frames);

// Whether every pixel has the colour of the first.
bool is_one_color(const std::vector<Image>& eyes);

} // namespace palpate
