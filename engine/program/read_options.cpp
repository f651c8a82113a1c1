#include "engine/program/read_options.h"

#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "engine/io/mesh_io.h"
#include "engine/program/option_checks.h"
#include "engine/program/project_input.h"
#include "engine/scene/scene_file.h"
#include "engine/volume/synthetic_name.h"

namespace palpate {

void add_read_flags(CLI::App& app, ReadFlags& flags) {
    app.add_option("V", flags.path,
                   "Volume: a file, a DICOM folder, a folder of slices, a pattern such as "
                   "ct_%03d.png or 'ct_*.png', a project folder, or synthetic:NAME")
        ->required();
    add_read_limits(app, flags);
}

void add_read_limits(CLI::App& app, ReadFlags& flags) {
    app.add_option(
           "--frame", flags.frame,
           "Frame of a 4-D file, or channel of a TIFF, counted from 0 (default: 0, with a warning)")
        ->check(CLI::Range(int64_t{0}, int64_t{0xffffffff}))
        ->type_name("N");
    app.add_option("--series", flags.series,
                   "DICOM series: its number in the list, its UID or a part of its description "
                   "(default: the largest)")
        ->type_name("NAME");
    app.add_flag("--resample-slices", flags.resample_slices,
                 "DICOM: interpolate unevenly spaced or tilted slices linearly to even spacing "
                 "along their normal (default: uneven spacing is refused, tilt is kept)");
    app.add_option("--max-memory", flags.max_memory_mib,
                   "Memory limit for what is read, and for a size that another option asks for, in "
                   "MiB (default: 75 % of this machine's memory)")
        ->check(positive())
        ->type_name("MIB");
}

uint64_t ReadFlags::max_memory_bytes() const {
    return static_cast<uint64_t>(std::min(max_memory_mib, 1e12) * 1024 * 1024);
}

Result<void> expect_no_mesh(const std::string& path) {
    if (is_synthetic(path) || !has_mesh_extension(path))
        return {};
    return fail(
        "{0}: expected a volume, found the name of a mesh; to draw it: palpate render VOLUME "
        "--surface {0}; to feel it: palpate touch VOLUME --algorithm swept-mesh --mesh {0}; to "
        "measure it: palpate compare",
        path);
}

ReadOptions read_options(const ReadFlags& flags, const std::stop_token& stop) {
    ReadOptions options;
    if (flags.frame >= 0)
        options.frame = static_cast<uint32_t>(flags.frame);
    if (!flags.series.empty())
        options.series = flags.series;
    options.resample_slices = flags.resample_slices;
    if (const uint64_t most = flags.max_memory_bytes(); most > 0)
        options.max_memory_bytes = most;
    options.stop = stop;
    options.progress = flags.progress;
    return options;
}

Result<LoadedVolume> load(const ReadFlags& flags, bool labels, const std::stop_token& stop) {
    PALPATE_TRY(expect_no_mesh(flags.path));
    const ReadOptions options = read_options(flags, stop);
    if (Project::is_one(flags.path))
        return load_project_volume(flags.path, labels, options);
    if (is_synthetic(flags.path)) {
        PALPATE_TRY(Volume made, make_synthetic(flags.path, options.max_memory_bytes));
        if (labels && made.type() != ScalarType::u8)
            return fail("{}: expected labels (checkerboard), found grey values", flags.path);
        if (flags.resample_slices)
            log::warning("{}: {} has no effect on a synthetic volume", flags.path,
                         Option{"resample-slices"});
        return LoadedVolume{std::move(made), {}, {}, {}, {}, {}};
    }
    Result<LoadedVolume> loaded =
        labels ? load_labels(flags.path, options) : load_volume(flags.path, options);
    if (loaded) {
        for (const std::string& note : all_notes(*loaded))
            log::info("{}", note);
        for (const std::string& warning : loaded->warnings)
            log::warning("{}", warning);
    }
    return loaded;
}

} // namespace palpate
