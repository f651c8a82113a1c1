#include <CLI/CLI.hpp>
#include <filesystem>
#include <tuple>

#include "apps/palpate/command.h"
#include "apps/palpate/convert_labels.h"
#include "engine/base/log.h"
#include "engine/io/brick_file.h"
#include "engine/io/labels_write.h"
#include "engine/io/volume_io.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"
#include "engine/program/read_options.h"
#include "engine/scene/scene_file.h"
#include "engine/segment/filters.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic_name.h"

namespace palpate {

namespace {

struct ConvertOptions {
    ReadFlags read;
    std::string out;
    bool labels = false;
    LabelOutput label_output;
    std::string crop, spacing, interpolation, reorient; // of filters.h
};

// The filters that the options stand for, in the order in which they are applied: what is left out
// is not resampled.
Result<std::vector<std::pair<const Filter*, FilterValues>>> changes_of(const ConvertOptions& o) {
    std::string spacing = o.spacing;
    if (!spacing.empty()) { // resample X,INTERPOLATION,Y,Z
        const size_t comma = spacing.find(',');
        const std::string interpolation = !o.interpolation.empty() ? o.interpolation
                                          : o.labels               ? "nearest"
                                                                   : "linear";
        spacing = fmt::format("{},{}{}", spacing.substr(0, comma), interpolation,
                              comma == std::string::npos ? "" : spacing.substr(comma));
    }
    std::vector<std::pair<const Filter*, FilterValues>> changes;
    for (const auto& [option, name, text] : {std::tuple("--crop", "crop", o.crop),
                                             {"--spacing", "resample", spacing},
                                             {"--reorient", "reorient", o.reorient}}) {
        if (text.empty())
            continue;
        for (const Filter& filter : filters())
            if (filter.name == std::string_view(name)) {
                Result<FilterValues> values = read_filter_values(filter, text);
                if (!values)
                    return fail("{}: {}", option, values.error().message);
                changes.emplace_back(&filter, std::move(*values));
            }
    }
    return changes;
}

// Loads the volume and changes it as the options say.
Result<LoadedVolume> load_changed(const ConvertOptions& o, const Interrupt& interrupt) {
    PALPATE_TRY(auto changes, changes_of(o));
    PALPATE_TRY(LoadedVolume loaded, load_labelled(o.label_output, o.read, o.labels, interrupt));
    PALPATE_TRY(take_label_names(o.label_output, loaded));
    for (auto& [filter, values] : changes) {
        Progress progress(filter->name);
        values.memory_bytes = o.read.max_memory_bytes();
        Result<Volume> made =
            run_filter(*filter, loaded.volume, values,
                       {interrupt.token(), [&](double share) { progress.show(share); }});
        if (!made)
            return fail("--{}: {}",
                        filter->name == std::string_view("resample") ? "spacing" : filter->name,
                        made.error().message);
        loaded.volume = std::move(*made);
        loaded.coarser.clear();
    }
    return loaded;
}

void warn_of_lost_names(const ConvertOptions& options, const LoadedVolume& loaded) {
    if (!loaded.labels.empty() && !(options.labels && holds_label_names(options.out)))
        log::warning("{}: does not hold the names and colours of the {} segment{} of {}",
                     options.out, loaded.labels.size(), loaded.labels.size() == 1 ? "" : "s",
                     options.read.path);
}

// Brick by brick: of a synthetic volume or another brick file no more is in memory than what is
// being written.
Result<void> convert_to_bricks(const ConvertOptions& options, const Interrupt& interrupt) {
    BrickStream stream;
    const bool changed =
        !options.crop.empty() || !options.spacing.empty() || !options.reorient.empty();
    if (is_synthetic(options.read.path) && !changed) {
        PALPATE_TRY(const SyntheticVolume found, find_synthetic(options.read.path));
        stream = {found.grid, found.type, options.labels, {}, [made = found](glm::uvec3 at) {
                      return make_brick(made.grid, made.type, made.value, at);
                  }};
    } else {
        PALPATE_TRY(const LoadedVolume loaded, load_changed(options, interrupt));
        warn_of_lost_names(options, loaded);
        if (loaded.inverted && !options.labels)
            warn_of_lost_inversion(options.out, options.read.path);
        stream = stream_of(loaded.volume);
        stream.modality = loaded.modality;
        stream.labels = options.labels;
    }
    Progress progress("writing " + options.out);
    PALPATE_TRY(save_brick_file(options.out, stream, {interrupt.token(), [&progress](double share) {
                                                          progress.show(share);
                                                      }}));
    const glm::uvec3 size = stream.grid.size;
    tell_made(options.out, fmt::format("{} x {} x {} samples of {}", size.x, size.y, size.z,
                                       name_of(stream.type)));
    return {};
}

Result<void> run_convert(const ConvertOptions& options) {
    const bool dicom = names_dicom(options.out);
    if (!dicom)
        PALPATE_TRY(expect_volume_name(options.out));
    const Interrupt interrupt;
    if (dicom) {
        PALPATE_TRY(const LoadedVolume labels, load_changed(options, interrupt));
        return convert_to_dicom(options.label_output, options.read, options.out, labels, interrupt);
    }
    if (std::filesystem::path(options.out).extension() == ".pbv")
        return convert_to_bricks(options, interrupt);
    PALPATE_TRY(const LoadedVolume loaded, load_changed(options, interrupt));
    warn_of_lost_names(options, loaded);
    if (loaded.inverted && !options.labels)
        warn_of_lost_inversion(options.out, options.read.path);
    if (options.labels && !loaded.labels.empty())
        PALPATE_TRY(save_labels(options.out, loaded.volume, loaded.labels, interrupt.token()));
    else
        PALPATE_TRY(save_volume(options.out, loaded.volume, interrupt.token(), loaded.modality));
    tell_made(options.out, loaded.volume);
    return {};
}

} // namespace

Command add_convert(CLI::App& app) {
    auto options = std::make_shared<ConvertOptions>();
    add_read_flags(app, options->read);
    app.add_option("OUT", options->out,
                   "File to write: .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk, .pbv (packed bricks, "
                   "for volumes larger than memory) or, of labels, .dcm; voxels keep their order "
                   "and values, lengths are in mm")
        ->required();
    app.add_flag("--labels", options->labels,
                 "Read as a label map: whole numbers, 0 is background (default: grey values; "
                 "with OUT.dcm labels)");
    add_label_output(app, options->label_output);
    app.add_option("--crop", options->crop,
                   "Samples from low to high, both included, by index (default: all)")
        ->type_name("X_LOW,Y_LOW,Z_LOW,X_HIGH,Y_HIGH,Z_HIGH");
    CLI::Option* spacing =
        app.add_option(
               "--spacing", options->spacing,
               "Resample to samples so far apart, in mm, after --crop (default: as they are)")
            ->type_name("MM[,Y,Z]");
    app.add_option(
           "--interpolation", options->interpolation,
           "With --spacing: nearest, linear or cubic (default: linear, with --labels nearest)")
        ->check(one_of({"nearest", "linear", "cubic"}))
        ->needs(spacing);
    app.add_option(
           "--reorient", options->reorient,
           "Exchange and reverse axes, so that they rise towards these sides of the patient, "
           "such as LPS or RAS; the patient does not move (default: as they are stored)")
        ->type_name("LETTERS");
    refuse_where_wrong(app, [options]() -> Result<void> {
        options->labels = options->labels || names_dicom(options->out) ||
                          !options->label_output.reference.empty();
        PALPATE_TRY(const auto changes, changes_of(*options));
        return check_label_output(options->label_output, options->read.path, options->out);
    });
    return {[options] { return run_convert(*options); },
            [options] {
                std::vector<NamedFile> files;
                append_volume(files, "V", options->read.path);
                append_volume(files, "OUT", options->out, FileUse::write);
                append_label_output(options->label_output, files);
                return files;
            }};
}

} // namespace palpate
