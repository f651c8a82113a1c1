#include "apps/palpate/open_scene.h"

#include "apps/palpate/project_input.h"
#include "engine/base/log.h"
#include "engine/loading/scene_meshes.h"

namespace palpate {

Result<OpenedScene> open_scene(const SceneOptions& options, const ReadFlags& read,
                               const Interrupt& interrupt) {
    for (const std::string& volume : {options.input, options.labels})
        if (auto voxels = expect_no_mesh(volume); !voxels)
            return pass_on(voxels);
    Result<SceneFile> file = base_scene(options);
    if (!file)
        return pass_on(file);
    if (read.frame >= 0)
        file->frame = static_cast<uint32_t>(read.frame);
    if (!read.series.empty())
        file->series = read.series;
    file->resample_slices |= read.resample_slices;
    Result<LoadedScene> loaded =
        load_scene_input(options.input, *file, read_options(read, interrupt));
    if (!loaded)
        return pass_on(loaded);
    show_labels_by_default(options, *file, *loaded);
    color_labels(loaded->label_names, *file);
    if (auto made = make_scene_meshes(*file, *loaded); !made)
        return pass_on(made);
    for (const std::string& note : loaded->notes)
        log::info("{}", note);
    for (const std::string& warning : loaded->warnings)
        log::warning("{}", warning);
    Result<Scene> scene = final_scene(options, *file, *loaded);
    if (!scene)
        return pass_on(scene);
    return OpenedScene{std::move(*file), std::move(*loaded), std::move(*scene)};
}

} // namespace palpate
