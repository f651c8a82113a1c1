#include <array>
#include <map>
#include <optional>
#include <span>
#include <string_view>

#include "apps/palpate/command.h"
#include "apps/palpate/seed_options.h"
#include "apps/palpate/segment_net.h"
#include "engine/base/log.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"
#include "engine/program/read_options.h"
#include "engine/segment/map_values.h"
#include "engine/segment/methods.h"

namespace palpate {

namespace {

constexpr const char* kNet = "net"; // beside those of the table: it asks a server

struct SegmentOptions {
    ReadFlags read;
    std::string method, seeds, start, out, cost, strength, distance, curves;
    uint32_t background = 0;
    bool list = false;
    NetOptions net;
    std::map<std::string, double> values; // one for each parameter of any method
};

std::vector<NamedFile> files_of(const SegmentOptions& o) {
    std::vector<NamedFile> files;
    append_volume(files, "V", o.read.path);
    files.push_back({"--seeds", o.seeds});
    append_volume(files, "--start", o.start);
    append_volume(files, "-o", o.out, FileUse::write);
    append_volume(files, "--cost", o.cost, FileUse::write);
    append_volume(files, "--arrival", o.strength, FileUse::write);
    append_volume(files, "--distance", o.distance, FileUse::write);
    files.push_back({"--curves", o.curves, FileUse::write});
    files.push_back({"--key-file", o.net.key_file});
    return files;
}

std::string list_text() {
    std::string text;
    for (const SegmentMethod& method : segment_methods()) {
        text += fmt::format("{}  {}{}\n", method.name, method.purpose,
                            method.takes_curves  ? " (curves)"
                            : method.takes_seeds ? ""
                                                 : " (no seeds)");
        for (const MethodParameter& p : method.parameters) {
            std::string range;
            if (p.least > -1e300)
                range = p.most < 1e300 ? fmt::format(", {:g} .. {:g}", p.least, p.most)
                                       : fmt::format(", at least {:g}", p.least);
            const std::string fallback =
                p.fallback_text ? p.fallback_text : fmt::format("{:g}", p.fallback);
            text += fmt::format("  --{}{}{}  {}{} (default: {})\n", p.name, *p.unit ? " " : "",
                                p.unit, p.purpose, range, fallback);
        }
    }
    return text + net_list_text();
}

// The parameters that were given; a warning names those that a method has not.
ParameterValues values_of(const SegmentOptions& o, const CLI::App& app, std::string_view method,
                          std::span<const MethodParameter> parameters) {
    ParameterValues given;
    std::string idle;
    for (const auto& [name, value] : o.values) {
        if (app.count("--" + name) == 0)
            continue;
        bool is_known = false;
        for (const MethodParameter& parameter : parameters)
            is_known |= name == parameter.name;
        if (is_known)
            given[name] = value;
        else
            idle += (idle.empty() ? "--" : ", --") + name;
    }
    if (!idle.empty())
        log::warning("{} changes nothing: {} has no such parameter", idle, method);
    return given;
}

// Seeds where there are some, and the labels of another result elsewhere.
Result<Volume> with_start(const Volume& seeds, const Volume& start) {
    return map_values<uint16_t>(std::array{&seeds, &start}, {},
                                [](auto v) { return uint16_t(v[0] > 0.0f ? v[0] : v[1]); });
}

Result<SegmentInput> input_of(const SegmentOptions& o, const Volume& volume,
                              const Interrupt& interrupt) {
    SegmentInput input{volume, {}, {}, static_cast<uint16_t>(o.background)};
    if (!o.seeds.empty()) {
        PALPATE_TRY(ReadSeeds read, read_seeds(o.seeds, volume, o.read.max_memory_mib, interrupt));
        input.seeds = std::move(read.map);
        input.balls = std::move(read.balls);
        input.curves = std::move(read.curves);
        if (input.background == 0)
            input.background = read.background;
    }
    if (!o.start.empty()) {
        PALPATE_TRY(ReadSeeds start, read_seeds(o.start, volume, o.read.max_memory_mib, interrupt));
        input.balls.clear(); // fronts start at the samples of both
        if (!input.seeds) {
            input.seeds = std::move(start.map);
        } else {
            PALPATE_TRY(input.seeds, with_start(*input.seeds, start.map));
        }
    }
    return input;
}

Result<void> run_segment(const SegmentOptions& o, const CLI::App& app) {
    if (o.list)
        return print_text(list_text());
    if (o.method == kNet) {
        for (const auto& [option, path] : {std::pair{"--cost", &o.cost},
                                           {"--arrival", &o.strength},
                                           {"--distance", &o.distance},
                                           {"--curves", &o.curves}})
            if (!path->empty())
                return fail("{}: a net has none", option);
        (void)values_of(o, app, kNet, {}); // it has none, and warns
        return run_net(o.net, o.read, o.seeds, o.start, o.background, o.out);
    }
    const SegmentMethod& method = *find_segment_method(o.method);
    warn_of_idle(app, std::array{IdleOptions{
                          true,
                          {"--send-to", "--consent", "--key-file", "--model", "--net-timeout"},
                          fmt::format("{} asks no server", method.name)}});
    for (const std::string& path : {o.out, o.cost, o.strength, o.distance})
        if (!path.empty())
            PALPATE_TRY(expect_volume_name(path));
    if (!method.strength && !o.strength.empty())
        return fail("--arrival: {} has no arrival times or strengths", method.name);
    if (!method.has_distance && !o.distance.empty())
        return fail("--distance: {} moves no surface whose distance it knows", method.name);
    if (!method.takes_curves && !o.curves.empty())
        return fail("--curves: {} takes no curves", method.name);
    const ParameterValues values = values_of(o, app, method.name, method.parameters);
    const Interrupt interrupt;
    PALPATE_TRY(const LoadedVolume loaded, load(o.read, false, interrupt));
    if (!method.takes_seeds && !method.takes_curves && !(o.seeds.empty() && o.start.empty()))
        log::warning("--seeds and --start change nothing: {} takes no seeds", method.name);
    if (method.takes_curves && !o.start.empty())
        log::warning("--start changes nothing: {} takes curves alone", method.name);
    PALPATE_TRY(const SegmentInput input, input_of(o, loaded.volume, interrupt));
    if (!method.takes_curves && !input.curves.empty())
        log::warning("curves of {} change nothing: {} takes seeds", o.seeds, method.name);
    if (method.takes_curves && input.curves.empty())
        return fail("{}: expected closed curves: --seeds FILE with \"curves\"", method.name);
    if (method.takes_seeds && !input.seeds)
        return fail("{}: expected seeds: --seeds FILE, or --start LABELS", method.name);
    std::optional<Progress> progress(o.method);
    const Task task{interrupt.token(), [&](double share) { progress->show(share); }};
    PALPATE_TRY(const Segmented made, segment(method, input, values, task));
    progress.reset();
    for (const std::string& note : made.notes)
        log::info("{}", note);
    if (!(made.labels.range().max > 0.0f))
        log::warning("no sample belongs to an object");
    if (!o.cost.empty() && !made.cost)
        return fail("--cost: {} has no cost", method.name);
    PALPATE_TRY(save_volume(o.out, made.labels, interrupt.token()));
    tell_made(o.out, made.labels);
    if (!o.cost.empty())
        PALPATE_TRY(save_volume(o.cost, *made.cost, interrupt.token()));
    if (!o.distance.empty())
        PALPATE_TRY(save_volume(o.distance, *made.distance, interrupt.token()));
    if (!o.curves.empty()) {
        SeedFile file;
        file.curves = made.curves;
        PALPATE_TRY(write_text(o.curves, seeds_text(file)));
    }
    return o.strength.empty() ? Result<void>()
                              : save_volume(o.strength, *made.strength, interrupt.token());
}

void add_parameters(CLI::App& app, SegmentOptions& o) {
    for (const SegmentMethod& method : segment_methods())
        for (const MethodParameter& parameter : method.parameters) {
            if (o.values.contains(parameter.name))
                continue; // another method has it, too
            std::string of;
            for (const SegmentMethod& other : segment_methods())
                for (const MethodParameter& p : other.parameters)
                    if (std::string_view(p.name) == parameter.name)
                        of += (of.empty() ? "" : ", ") + std::string(other.name);
            app.add_option("--" + std::string(parameter.name), o.values[parameter.name],
                           fmt::format("{} ({}; default: see --list)", parameter.purpose, of))
                ->type_name(*parameter.unit ? parameter.unit : "NUMBER");
        }
}

} // namespace

Command add_segment(CLI::App& app) {
    auto o = std::make_shared<SegmentOptions>();
    app.add_option("V", o->read.path, "Volume to segment");
    add_read_limits(app, o->read);
    std::vector<std::string> names;
    for (const SegmentMethod& method : segment_methods())
        names.emplace_back(method.name);
    names.emplace_back(kNet);
    app.add_option("--method", o->method, "Method; --list tells what each one does")
        ->check(one_of(names))
        ->type_name("NAME");
    app.add_option(
           "--seeds", o->seeds,
           "Seeds: balls, points and curves in mm (.json), recorded strokes that draw labels "
           "(.jsonl), or a label map on the grid of V")
        ->type_name("FILE");
    app.add_option("--start", o->start,
                   "Result of another method, whose labels are seeds, too, where --seeds has none")
        ->type_name("LABELS");
    app.add_option(
           "--background", o->background,
           "Label of the seeds that stands for outside all objects, and becomes 0 (default: "
           "none, or that of a .json file)")
        ->check(CLI::Range(1u, 65535u));
    app.add_option("-o,--output", o->out,
                   "Label map to write: .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk, .pbv")
        ->type_name("FILE");
    app.add_option("--cost", o->cost, "Write the cost of fast marching, of the first object")
        ->type_name("FILE");
    app.add_option("--arrival", o->strength,
                   "Write the arrival times or the connectedness of all samples: any threshold of "
                   "it is a segmentation")
        ->type_name("FILE");
    app.add_option("--distance", o->distance,
                   "Write the signed distance in mm from the surface of a level set, negative "
                   "inside, near the surface")
        ->type_name("FILE");
    app.add_option("--curves", o->curves,
                   "Write the curves of live-wire-surface as they follow edges (.json), to go on "
                   "with or to draw")
        ->type_name("FILE");
    app.add_flag("--list", o->list, "List methods with their parameters, and exit");
    add_parameters(app, *o);
    add_net_options(app, o->net);
    refuse_where_wrong(app, [o]() -> Result<void> {
        if (o->list)
            return {};
        if (o->read.path.empty() || o->method.empty() || o->out.empty())
            return fail("expected V, --method and -o, or --list");
        return {};
    });
    return {[o, &app] { return run_segment(*o, app); }, [o] { return files_of(*o); }};
}

} // namespace palpate
