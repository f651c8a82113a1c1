#pragma once

#include "engine/base/error.h"
#include "engine/io/volume_io.h"
#include "engine/scene/scene_file.h"

namespace palpate {

// The voxels that a scene file names, with messages for people.
struct LoadedScene {
    SceneData data;
    std::string modality; // of the volume; empty where unknown
    std::vector<std::string> notes, warnings;
    std::vector<Volume> coarser;            // of a volume from a brick file: levels 1, 2, ..
    std::vector<LabelName> label_names;     // of the labels, or of a volume that names its values
    bool inverted = false;                  // small values of the volume are meant to be bright
    std::vector<SeriesInfo> series{};       // of the volume's DICOM folder
    std::vector<SeriesInfo> other_series{}; // of the folders of labels and of other volumes
};
// A line for each series, and the notes.
std::vector<std::string> all_notes(const LoadedScene& loaded);

// Loads, or makes (synthetic:NAME), the volumes and labels of a scene. `options` says how files
// are read; the scene's own frame and series take precedence. An error names the file.
Result<LoadedScene> load_scene_data(const SceneFile& file, const ReadOptions& options = {});

// Gives labels the colours that their file states, where the scene has no styles of its own: in the
// label layer, and on the surfaces of labels. Labels without a stated colour keep the generated
// one.
void color_labels(const std::vector<LabelName>& names, SceneFile& file);

} // namespace palpate
