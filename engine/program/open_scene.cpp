#include "engine/program/open_scene.h"

#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "engine/io/label_names.h"
#include "engine/program/project_input.h"
#include "engine/scene/scene_check.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

// A volume beside the first: its option, its name in the scene file, and its place in the scene.
struct Other {
    const std::string* option;
    std::string SceneFile::*name;
    std::optional<Volume> SceneData::*data;
};

// The voxels that a scene names: from memory where they are there, else read.
Result<LoadedScene> load_inputs(const SceneOptions& options, SceneFile& file, const ReadFlags& read,
                                const std::stop_token& stop, const InMemory& memory) {
    const auto known = [&](const std::string& name) {
        const auto found = memory.volumes.find(name);
        return found == memory.volumes.end() ? nullptr : &found->second;
    };
    std::vector<Other> others{{&options.labels, &SceneFile::labels, &SceneData::labels},
                              {&options.fused, &SceneFile::fused, &SceneData::fused},
                              {&options.overlay, &SceneFile::overlay, &SceneData::overlay}};
    std::erase_if(others, [&](const Other& other) { return !known(*other.option); });
    SceneFile to_read = file;
    for (const Other& other : others)
        (to_read.*other.name).clear();
    const LoadedVolume* volume = known(options.input);
    Result<LoadedScene> loaded =
        volume ? LoadedScene{{volume->volume, std::nullopt, {}},
                             volume->modality,
                             {},
                             {},
                             volume->coarser,
                             volume->labels,
                             volume->inverted,
                             volume->series}
               : load_scene_input(options.input, to_read, read_options(read, stop));
    if (!loaded)
        return loaded;
    for (const Other& other : others) {
        file.*other.name = *other.option;
        loaded->data.*other.data = known(*other.option)->volume;
    }
    if (const LoadedVolume* labels = known(options.labels))
        loaded->label_names = labels->labels;
    return loaded;
}

// Volumes that lie beside the scene's volume are seen nowhere in it.
void warn_of_apart(const SceneFile& file, LoadedScene& loaded) {
    const auto check = [&](const std::string& what, const std::optional<Volume>& volume) {
        if (!volume)
            return;
        std::string apart = apart_text(what, volume->grid(), loaded.data.volume.grid());
        if (!apart.empty())
            loaded.warnings.push_back(std::move(apart));
    };
    check("the label map", loaded.data.labels);
    check("the fused volume " + file.fused, loaded.data.fused);
    check("the overlay " + file.overlay, loaded.data.overlay);
}

// Layers of volumes that a scene does not name are not drawn. Those of a project are the window's:
// it shows seeds as an overlay.
void drop_idle_layers(const std::string& input, SceneFile& file, LoadedScene& loaded) {
    const auto drop = [&](auto& layer, const char* key, const char* volume, bool is_there) {
        if (!layer || is_there)
            return;
        layer.reset();
        if (!Project::is_one(input))
            loaded.warnings.push_back(fmt::format(
                "{}: {} has no effect, because the scene has no {}", input, key, volume));
    };
    const SceneData& data = loaded.data;
    drop(file.scene.labels, "label_layer", "labels", data.labels.has_value());
    drop(file.scene.fusion, "fusion_layer", "fused", data.fused.has_value());
    drop(file.scene.overlay, "overlay_layer", "overlay", data.overlay.has_value());
}

} // namespace

Result<OpenedScene> open_scene(const SceneOptions& options, const ReadFlags& read,
                               const std::stop_token& stop, const InMemory& memory) {
    for (const std::string& volume : {options.input, options.labels})
        PALPATE_TRY(expect_no_mesh(volume));
    PALPATE_TRY(SceneFile file, base_scene(options));
    const bool sized = options.size_px.size() == 2;
    const glm::uvec2 size_px =
        sized ? glm::uvec2(options.size_px[0], options.size_px[1]) : file.scene.size_px;
    PALPATE_TRY(expect_picture_memory(size_px, stereo_layout(options, file.scene) ? 2 : 1,
                                      read.max_memory_bytes()));
    if (read.frame >= 0)
        file.frame = static_cast<uint32_t>(read.frame);
    if (!read.series.empty())
        file.series = read.series;
    file.resample_slices |= read.resample_slices;
    PALPATE_TRY(LoadedScene loaded, load_inputs(options, file, read, stop, memory));
    show_labels_by_default(options, file, loaded);
    if (!options.label_names.empty()) {
        if (!loaded.data.labels)
            log::warning("{}: without effect, because there is no label map ({})",
                         Option{"label-names"}, Option{"labels"});
        PALPATE_TRY(loaded.label_names, load_label_table(options.label_names));
    }
    drop_idle_layers(options.input, file, loaded);
    color_labels(loaded.label_names, file);
    PALPATE_TRY(hide_other_labels(options, file, loaded));
    PALPATE_TRY(make_scene_meshes(file, loaded, memory.meshes));
    warn_of_apart(file, loaded);
    for (const std::string& note : all_notes(loaded))
        log::info("{}", note);
    for (const std::string& warning : loaded.warnings)
        log::warning("{}", warning);
    PALPATE_TRY(Scene scene, final_scene(options, file, loaded));
    return OpenedScene{std::move(file), std::move(loaded), std::move(scene)};
}

} // namespace palpate
