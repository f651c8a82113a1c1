#include "apps/palpate/open_scene.h"

#include "apps/palpate/project_input.h"
#include "engine/base/log.h"
#include "engine/loading/scene_meshes.h"

namespace palpate {

Result<OpenedScene> open_scene(const SceneOptions& options, const ReadFlags& read,
                               const std::stop_token& stop) {
    for (const std::string& volume : {options.input, options.labels})
        PALPATE_TRY(expect_no_mesh(volume));
    PALPATE_TRY(SceneFile file, base_scene(options));
    if (read.frame >= 0)
        file.frame = static_cast<uint32_t>(read.frame);
    if (!read.series.empty())
        file.series = read.series;
    file.resample_slices |= read.resample_slices;
    PALPATE_TRY(LoadedScene loaded,
                load_scene_input(options.input, file, read_options(read, stop)));
    show_labels_by_default(options, file, loaded);
    color_labels(loaded.label_names, file);
    PALPATE_TRY(make_scene_meshes(file, loaded));
    for (const std::string& note : loaded.notes)
        log::info("{}", note);
    for (const std::string& warning : loaded.warnings)
        log::warning("{}", warning);
    PALPATE_TRY(Scene scene, final_scene(options, file, loaded));
    return OpenedScene{std::move(file), std::move(loaded), std::move(scene)};
}

} // namespace palpate
