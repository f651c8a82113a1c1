#include "apps/palpate/command.h"
#include "apps/palpate/interrupt.h"
#include "apps/palpate/read_options.h"
#include "engine/io/volume_io.h"

namespace palpate {

namespace {

struct ConvertOptions {
    ReadFlags read;
    std::string out;
    bool labels = false;
};

Result<void> run_convert(const ConvertOptions& options) {
    const Interrupt interrupt;
    const Result<LoadedVolume> loaded = load(options.read, options.labels, interrupt);
    if (!loaded)
        return fail("{}", loaded.error().message);
    return save_volume(options.out, loaded->volume, interrupt.token());
}

} // namespace

Command add_convert(CLI::App& app) {
    auto options = std::make_shared<ConvertOptions>();
    add_read_flags(app, options->read);
    app.add_option("OUT", options->out,
                   "File to write: .nii, .nii.gz, .nrrd, .mha, .mhd or .vtk; voxels keep their "
                   "order and values, lengths are in mm")
        ->required();
    app.add_flag("--labels", options->labels,
                 "Read as a label map: whole numbers, 0 is background (default: grey values)");
    return [options] { return run_convert(*options); };
}

} // namespace palpate
