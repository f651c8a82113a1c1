#include <CLI/CLI.hpp>
#include <filesystem>

#include "apps/palpate/command.h"
#include "apps/palpate/interrupt.h"
#include "apps/palpate/progress.h"
#include "apps/palpate/read_options.h"
#include "engine/base/log.h"
#include "engine/io/brick_file.h"
#include "engine/io/volume_io.h"
#include "engine/scene/scene_file.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic_name.h"

namespace palpate {

namespace {

struct ConvertOptions {
    ReadFlags read;
    std::string out;
    bool labels = false;
};

void warn_of_lost_names(const ConvertOptions& options, const LoadedVolume& loaded) {
    if (!loaded.labels.empty())
        log::warning("{}: does not hold the names and colours of the {} segment{} of {}",
                     options.out, loaded.labels.size(), loaded.labels.size() == 1 ? "" : "s",
                     options.read.path);
}

// Brick by brick: of a synthetic volume or another brick file no more is in memory than what is
// being written.
Result<void> convert_to_bricks(const ConvertOptions& options, const Interrupt& interrupt) {
    BrickStream stream;
    if (is_synthetic(options.read.path)) {
        PALPATE_TRY(const SyntheticVolume found, find_synthetic(options.read.path));
        stream = {found.grid, found.type, options.labels, {}, [made = found](glm::uvec3 at) {
                      return make_brick(made.grid, made.type, made.value, at);
                  }};
    } else {
        PALPATE_TRY(const LoadedVolume loaded, load(options.read, options.labels, interrupt));
        warn_of_lost_names(options, loaded);
        stream = stream_of(loaded.volume);
        stream.modality = loaded.modality;
        stream.labels = options.labels;
    }
    Progress progress("writing " + options.out);
    return save_brick_file(options.out, stream, {interrupt.token(), [&progress](double share) {
                                                     progress.show(share);
                                                 }});
}

Result<void> run_convert(const ConvertOptions& options) {
    PALPATE_TRY(expect_volume_name(options.out));
    const Interrupt interrupt;
    if (std::filesystem::path(options.out).extension() == ".pbv")
        return convert_to_bricks(options, interrupt);
    PALPATE_TRY(const LoadedVolume loaded, load(options.read, options.labels, interrupt));
    warn_of_lost_names(options, loaded);
    return save_volume(options.out, loaded.volume, interrupt.token());
}

} // namespace

Command add_convert(CLI::App& app) {
    auto options = std::make_shared<ConvertOptions>();
    add_read_flags(app, options->read);
    app.add_option("OUT", options->out,
                   "File to write: .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk or .pbv (packed bricks, "
                   "for volumes larger than memory); voxels keep their order and values, lengths "
                   "are in mm")
        ->required();
    app.add_flag("--labels", options->labels,
                 "Read as a label map: whole numbers, 0 is background (default: grey values)");
    return {[options] { return run_convert(*options); },
            [options] {
                std::vector<NamedFile> files;
                append_volume(files, "V", options->read.path);
                append_volume(files, "OUT", options->out, FileUse::write);
                return files;
            }};
}

} // namespace palpate
