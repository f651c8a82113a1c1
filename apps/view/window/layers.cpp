#include "apps/view/window/layers.h"

#include "engine/scene/value_survey.h"

namespace palpate::view {

namespace {

Result<bool> holds_labels(const std::string& file, const ReadOptions& how) {
    PALPATE_TRY(const LoadedVolume read, load_volume(file, how));
    return !read.labels.empty() ||
           (read.modality.empty() && looks_like_labels(read.volume, survey_values(read.volume)));
}

} // namespace

Result<void> take_layers(const std::vector<std::string>& files, const ReadOptions& how,
                         SceneOptions& scene) {
    for (const std::string& file : files) {
        PALPATE_TRY(const bool labels, holds_labels(file, how));
        std::string& place = !labels                ? scene.fused
                             : scene.labels.empty() ? scene.labels
                                                    : scene.overlay;
        if (!place.empty())
            return fail("{}: expected at most {} over a volume, found one more beside {}", file,
                        labels ? "two label maps" : "one other volume", place);
        place = file;
    }
    return {};
}

} // namespace palpate::view
