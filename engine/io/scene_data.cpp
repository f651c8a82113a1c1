#include "engine/io/scene_data.h"

#include <algorithm>

#include "engine/base/profile.h"
#include "engine/volume/synthetic_name.h"

namespace palpate {

namespace {

Result<LoadedVolume> load_named(const SceneFile& file, const std::string& name, bool labels,
                                const ReadOptions& options) {
    if (is_synthetic(name)) {
        PALPATE_TRY(Volume made, make_synthetic(name, options.max_memory_bytes));
        if (labels && made.type() != ScalarType::u8 && made.type() != ScalarType::u16)
            return fail("{}: expected labels (checkerboard), found grey values", name);
        return LoadedVolume{std::move(made), {}, {}, {}, {}, {}};
    }
    const std::filesystem::path path = volume_path(file, name);
    return labels ? load_labels(path, options) : load_volume(path, options);
}

void keep_messages(LoadedScene& scene, const LoadedVolume& from) {
    scene.notes.insert(scene.notes.end(), from.notes.begin(), from.notes.end());
    scene.warnings.insert(scene.warnings.end(), from.warnings.begin(), from.warnings.end());
}

} // namespace

Result<LoadedScene> load_scene_data(const SceneFile& file, const ReadOptions& options) {
    const profile::Scope scope("load");
    ReadOptions volume_options = options;
    if (file.frame > 0)
        volume_options.frame = file.frame;
    if (!file.series.empty())
        volume_options.series = file.series;
    volume_options.resample_slices |= file.resample_slices;
    PALPATE_TRY(const LoadedVolume volume, load_named(file, file.volume, false, volume_options));
    LoadedScene scene{{volume.volume, std::nullopt},
                      volume.modality,
                      {},
                      {},
                      volume.coarser,
                      volume.labels,
                      volume.inverted,
                      volume.series};
    keep_messages(scene, volume);
    ReadOptions other_options = options;
    other_options.frame.reset();
    other_options.series.reset();
    other_options.resample_slices = false;
    const auto load_other = [&](const std::string& name, bool labels,
                                std::optional<Volume>& into) -> Result<std::vector<LabelName>> {
        if (name.empty())
            return std::vector<LabelName>{};
        PALPATE_TRY(LoadedVolume other, load_named(file, name, labels, other_options));
        keep_messages(scene, other);
        scene.other_series.insert(scene.other_series.end(), other.series.begin(),
                                  other.series.end());
        into = std::move(other.volume);
        return std::move(other.labels);
    };
    PALPATE_TRY(std::vector<LabelName> names, load_other(file.labels, true, scene.data.labels));
    if (!file.labels.empty())
        scene.label_names = std::move(names);
    PALPATE_TRY(load_other(file.fused, false, scene.data.fused));
    PALPATE_TRY(load_other(file.overlay, true, scene.data.overlay));
    return scene;
}

std::vector<std::string> all_notes(const LoadedScene& loaded) {
    std::vector<std::string> all;
    for (const auto* list : {&loaded.series, &loaded.other_series})
        for (const SeriesInfo& series : *list)
            all.push_back(series_line(series));
    all.insert(all.end(), loaded.notes.begin(), loaded.notes.end());
    return all;
}

void color_labels(const std::vector<LabelName>& names, SceneFile& file) {
    std::vector<LabelStyle> styles; // by label, up to the last that has a colour
    for (const LabelName& name : names) {
        if (!name.color || name.label == 0 || name.label > 65535)
            continue;
        while (styles.size() <= name.label)
            styles.push_back(style_of(LabelLayer{}, static_cast<uint32_t>(styles.size())));
        styles[name.label].color = *name.color;
    }
    if (styles.empty())
        return;
    if (file.scene.labels && file.scene.labels->styles.empty())
        file.scene.labels->styles = styles;
    for (size_t i = 0; i < std::min(file.surfaces.size(), file.scene.surfaces.size()); ++i) {
        SurfaceLayer& layer = file.scene.surfaces[i];
        if (file.surfaces[i].labels && layer.label_styles.empty())
            for (const LabelStyle& style : styles)
                layer.label_styles.push_back({style.color, layer.style.opacity});
    }
}

} // namespace palpate
