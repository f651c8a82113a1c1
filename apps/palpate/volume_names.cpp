// The files of volumes. Apart from other named files, because only the program that decodes knows
// them.

#include <filesystem>

#include "engine/decode/volume_files.h"
#include "engine/program/named_files.h"
#include "engine/program/scene_options.h"

namespace palpate {

namespace fs = std::filesystem;

void append_volume(std::vector<NamedFile>& files, const std::string& option,
                   const std::string& path, FileUse use) {
    if (path.empty() || is_synthetic(path))
        return;
    if (use == FileUse::read) {
        const std::vector<fs::path> found = io::volume_files(path);
        const bool is_header = found.size() > 1 && found.front() == path; // else slices
        for (const fs::path& file : found)
            files.push_back({is_header && file != path ? "the voxels of " + option : option,
                             file.string(), use});
        return;
    }
    files.push_back({option, path, use});
    if (fs::path raw = path; raw.extension() == ".mhd")
        files.push_back({"the voxels of " + option, raw.replace_extension(".raw").string(), use});
}

void append_files(const SceneFile& scene, std::vector<NamedFile>& files) {
    for (const auto& [what, name] : {std::pair("the volume of SCENE", &scene.volume),
                                     {"the labels of SCENE", &scene.labels},
                                     {"the fused volume of SCENE", &scene.fused},
                                     {"the overlay of SCENE", &scene.overlay}})
        if (!name->empty() && !is_synthetic(*name))
            append_volume(files, what, volume_path(scene, *name).string());
}

} // namespace palpate
