// palpate filter: filters of engine/segment/filters.h, one after the other.

#include <algorithm>
#include <filesystem>

#include "apps/palpate/command.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/io/brick_file.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"
#include "engine/program/read_options.h"
#include "engine/segment/convert_type.h"
#include "engine/segment/filters.h"

namespace palpate {

namespace {

struct Step {
    const Filter* filter;
    FilterValues values;
};

struct FilterOptions {
    ReadFlags read;
    std::string out, type, locked;
    std::vector<std::string> with; // NAME=FILE
    bool labels = false, list = false;
    // Texts of the filters' options, by the filters' places in the table.
    std::vector<std::vector<std::string>> texts =
        std::vector<std::vector<std::string>>(filters().size());
    const CLI::App* app = nullptr;
};

std::string list_text() {
    std::string text;
    for (const Filter& filter : filters()) {
        text +=
            fmt::format("--{} {}\n    {}\n", filter.name, filter_arguments(filter), filter.purpose);
        if (const std::string ranges = filter_ranges(filter); !ranges.empty())
            text += fmt::format("    {}\n", ranges);
        text += fmt::format("    {}result: {}; memory beside input and result: {}{}\n",
                            filter.takes_labels ? "takes labels; " : "", filter.type, filter.memory,
                            filter.bricks ? "; also volumes larger than memory" : "");
    }
    return text;
}

// The filters in the order in which they were typed.
Result<std::vector<Step>> steps_of(const FilterOptions& o) {
    std::vector<Step> steps;
    std::vector<uint16_t> locked;
    if (!o.locked.empty()) {
        Result<std::vector<uint16_t>> read = read_locked_labels(o.locked);
        if (!read)
            return fail("--locked: {}", read.error().message);
        locked = std::move(*read);
    }
    std::map<const CLI::Option*, size_t> seen;
    for (const CLI::Option* option : o.app->parse_order())
        for (size_t i = 0; i < filters().size(); ++i) {
            const Filter& filter = filters()[i];
            if (option->get_name() != fmt::format("--{}", filter.name))
                continue;
            const std::vector<std::string>& texts = o.texts[i];
            const size_t use = seen[option]++;
            const bool plain = filter.parameters.empty() && filter.text[0] == '\0';
            Result<FilterValues> values =
                read_filter_values(filter, plain ? "" : texts[std::min(use, texts.size() - 1)]);
            if (!values)
                return fail("--{}: {}", filter.name, values.error().message);
            values->locked = locked;
            if (const Result<void> can = check_locked(filter, *values); !can)
                return fail("--{}: {}", filter.name, can.error().message);
            steps.push_back({&filter, std::move(*values)});
        }
    return steps;
}

// The volumes that --with names.
Result<std::map<std::string, Volume>> others_of(const FilterOptions& o,
                                                const Interrupt& interrupt) {
    std::map<std::string, Volume> others;
    for (const std::string& text : o.with) {
        const size_t equals = text.find('=');
        ReadFlags flags;
        flags.path = text.substr(equals + 1);
        flags.max_memory_mib = o.read.max_memory_mib;
        PALPATE_TRY(LoadedVolume loaded, load(flags, false, interrupt));
        if (!others.emplace(text.substr(0, equals), std::move(loaded.volume)).second)
            return fail("--with: expected each name once, found '{}' twice",
                        text.substr(0, equals));
    }
    return others;
}

// Whether all steps leave values in the unit they had, so that those of a CT are Hounsfield units
// still and its modality is kept.
bool keep_unit(const std::vector<Step>& steps) {
    constexpr std::string_view kKeeping[] = {
        "gaussian", "median", "median-samples", "bilateral", "clamp",    "mask",
        "crop",     "pad",    "flip",           "reorient",  "resample", "resample-like"};
    return std::all_of(steps.begin(), steps.end(), [&](const Step& step) {
        return std::find(std::begin(kKeeping), std::end(kKeeping), step.filter->name) !=
               std::end(kKeeping);
    });
}

// A file that is gone when this is.
struct TemporaryFile {
    std::filesystem::path path;
    ~TemporaryFile() {
        std::error_code ignored;
        std::filesystem::remove(path, ignored);
    }
};

Result<void> run_filters(const FilterOptions& o) {
    if (o.list)
        return print_text(list_text());
    PALPATE_TRY(expect_volume_name(o.out));
    PALPATE_TRY(std::vector<Step> steps, steps_of(o));
    const Interrupt interrupt;
    bool is_labels = o.labels || (!steps.empty() && steps.front().filter->takes_labels);
    PALPATE_TRY(LoadedVolume loaded, load(o.read, is_labels, interrupt));
    PALPATE_TRY(const auto others, others_of(o, interrupt));
    Volume volume = std::move(loaded.volume);
    const std::string modality = !is_labels && keep_unit(steps) ? loaded.modality : "";
    if (loaded.inverted && !is_labels && keep_unit(steps))
        warn_of_lost_inversion(o.out, o.read.path);
    const ScalarType given_type = volume.type();
    const auto task_of = [&](Progress& progress) {
        return Task{interrupt.token(), [&progress](double share) { progress.show(share); }};
    };
    // From a brick file to a brick file, no result is held in memory where the filters allow it.
    bool in_files = o.read.path.ends_with(".pbv") && o.out.ends_with(".pbv");
    std::vector<std::unique_ptr<TemporaryFile>> temporary;
    for (size_t i = 0; i < steps.size(); ++i) {
        Step& step = steps[i];
        step.values.others = &others;
        step.values.memory_bytes = o.read.max_memory_bytes();
        is_labels |= step.filter->takes_labels;
        Progress progress(steps.size() == 1 ? fmt::format("{}", step.filter->name)
                                            : fmt::format("{} ({} of {})", step.filter->name, i + 1,
                                                          steps.size()));
        const auto failed = [&](const Error& error) {
            return fail("--{}: {}", step.filter->name, error.message);
        };
        if (!in_files || !step.filter->bricks) {
            Result<Volume> made = run_filter(*step.filter, volume, step.values, task_of(progress));
            if (!made)
                return failed(made.error());
            volume = std::move(*made);
            is_labels &= volume.type() != ScalarType::f32;
            continue;
        }
        Result<BrickMaker> maker =
            step.filter->bricks(volume, step.values, {interrupt.token(), {}});
        if (!maker)
            return failed(maker.error());
        is_labels &= maker->type != ScalarType::f32;
        temporary.push_back(std::make_unique<TemporaryFile>(
            TemporaryFile{fmt::format("{}.step{}.pbv", o.out, i + 1)}));
        FilesTogether of_the_step; // which the next one reads
        PALPATE_TRY(save_brick_file(
            temporary.back()->path, {maker->grid, maker->type, false, {}, maker->brick},
            {interrupt.token(), [&](double share) { progress.show(share); }}));
        PALPATE_TRY(of_the_step.commit());
        PALPATE_TRY(BrickFile opened, open_brick_file(temporary.back()->path));
        volume = std::move(opened.volume);
    }
    if (!o.type.empty()) {
        const ScalarType type = o.type == "keep" ? given_type : *scalar_type_named(o.type);
        if (const std::string lost = what_type_loses(volume, type); !lost.empty())
            log::warning("--type {}: {}", o.type, lost);
        const BrickMaker maker = converted_bricks(volume, type);
        if (o.out.ends_with(".pbv")) {
            PALPATE_TRY(save_brick_file(o.out, {maker.grid, type, is_labels, modality, maker.brick},
                                        {interrupt.token(), {}}));
            const glm::uvec3 size = maker.grid.size;
            tell_made(o.out, fmt::format("{} x {} x {} samples of {}", size.x, size.y, size.z,
                                         name_of(type)));
            return {};
        }
        PALPATE_TRY(volume, make_bricks(maker, {interrupt.token(), {}}));
    }
    if (o.out.ends_with(".pbv")) {
        BrickStream stream = stream_of(volume);
        stream.modality = modality;
        stream.labels = is_labels;
        PALPATE_TRY(save_brick_file(o.out, stream, {interrupt.token(), {}}));
    } else {
        PALPATE_TRY(save_volume(o.out, volume, interrupt.token(), modality));
    }
    tell_made(o.out, volume);
    return {};
}

} // namespace

Command add_filter(CLI::App& app) {
    auto o = std::make_shared<FilterOptions>();
    o->app = &app;
    add_read_flags(app, o->read);
    CLI::Option* volume = app.get_option("V")->required(false);
    app.add_flag("--list", o->list, "List the filters with their ranges and memory, and exit");
    CLI::Option* out =
        app.add_option("-o,--output", o->out,
                       "File to write: .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk or .pbv (packed "
                       "bricks: with V a .pbv too, results larger than memory)");
    app.add_flag("--labels", o->labels,
                 "Read V as a label map: whole numbers, 0 is background (default: grey values)");
    app.add_option(
           "--locked", o->locked,
           "Labels that stay as they are: filters of label maps take no sample of theirs and "
           "give them none (default: none)")
        ->type_name("LABEL[,LABEL..]");
    app.add_option("--type", o->type,
                   "Type of the result: rounded to the nearest value it holds (default: integers "
                   "stay as they are where a filter makes no others, else f32)")
        ->check(one_of(std::vector<std::string>{"keep", "u8", "i8", "u16", "i16", "f32"}));
    app.add_option("--with", o->with,
                   "Another volume on V's grid and the name by which filters know it; may be "
                   "repeated")
        ->type_name("NAME=FILE")
        ->check(CLI::Validator(
            [](std::string& text) {
                const size_t equals = text.find('=');
                return equals == std::string::npos || equals == 0
                           ? fmt::format("expected NAME=FILE, found '{}'", text)
                           : std::string();
            },
            ""))
        ->take_all()
        ->expected(1)
        ->allow_extra_args(false);
    for (size_t i = 0; i < filters().size(); ++i) {
        const Filter& filter = filters()[i];
        const std::string ranges = filter_ranges(filter);
        const std::string help =
            ranges.empty() ? filter.purpose : fmt::format("{}; {}", filter.purpose, ranges);
        const std::string name = fmt::format("--{}", filter.name);
        CLI::Option* option = nullptr;
        if (filter.parameters.empty() && filter.text[0] == '\0')
            option = app.add_flag(name, help);
        else
            option = app.add_option(name, o->texts[i], help)
                         ->type_name(filter_arguments(filter))
                         ->take_all()
                         ->expected(1)
                         ->allow_extra_args(false);
        option->group(filter.takes_labels ? "Filters of label maps, likewise"
                                          : "Filters, in the order given; may be repeated");
    }
    refuse_where_wrong(app, [o, volume, out]() -> Result<void> {
        if (o->list)
            return {};
        if (volume->count() == 0)
            return fail("expected a volume V, or --list");
        if (out->count() == 0)
            return fail("expected -o FILE");
        PALPATE_TRY(const std::vector<Step> steps, steps_of(*o));
        if (steps.empty() && o->type.empty())
            return fail("expected a filter, such as --gaussian 1.5; --list names them");
        return {};
    });
    return {[o] { return run_filters(*o); },
            [o] {
                std::vector<NamedFile> files;
                append_volume(files, "V", o->read.path);
                for (const std::string& text : o->with)
                    append_volume(files, "--with", text.substr(text.find('=') + 1));
                append_volume(files, "-o", o->out, FileUse::write);
                return files;
            }};
}

} // namespace palpate
