#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "apps/palpate/command.h"
#include "apps/palpate/touch_live.h"
#include "apps/palpate/touch_options.h"
#include "apps/palpate/touch_page.h"
#include "apps/palpate/touch_said.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/io/scene_data.h"
#include "engine/io/volume_io.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"
#include "engine/program/project_input.h"
#include "engine/program/read_options.h"
#include "engine/program/scene_options.h"
#include "engine/program/setting_options.h"
#include "engine/program/touch_guide.h"
#include "engine/program/touch_run.h"
#include "engine/session/project_description.h"
#include "engine/session/starter.h"
#include "engine/session/touch_json.h"
#include "haptics/servo/touch_log.h"
#include "haptics/sound/wav.h"

namespace palpate {

namespace {

using haptics::AlgorithmEntry;
using haptics::TouchParameters;

constexpr double kLive_s = 60.0; // of --live without --duration

template <class Table>
std::vector<std::string> names_of(const Table& table) {
    std::vector<std::string> names;
    for (const auto& entry : table)
        names.emplace_back(entry.name);
    return names;
}

Result<LoadedScene> load_touched(const TouchOptions& o, const Interrupt& interrupt) {
    PALPATE_TRY(SceneFile file, scene_file_of(o.scene));
    if (!o.labels.empty())
        file.labels = o.labels.starts_with("synthetic:")
                          ? o.labels
                          : std::filesystem::absolute(o.labels).string();
    Result<LoadedScene> scene = load_scene_input(o.scene, file, {.stop = interrupt.token()});
    if (scene) {
        for (const std::string& note : all_notes(*scene))
            log::info("{}", note);
        for (const std::string& warning : scene->warnings)
            log::warning("{}", warning);
    }
    return scene;
}

// The key "touch" of a scene file; nothing where it has none.
Result<std::optional<TouchParameters>> touch_of_scene_file(const std::string& path, double iso) {
    PALPATE_TRY(const std::string text, load_text(path));
    PALPATE_TRY(const Json json, parse_json(text, path));
    JsonErrors errors{path, {}};
    const JsonValue scene(json, "", errors);
    const auto touch = scene.find("touch");
    if (!touch)
        return std::optional<TouchParameters>();
    TouchParameters own = read_touch_parameters(*touch);
    if (!touch->find("iso"))
        own.iso = iso;
    if (errors.first)
        return tl::unexpected(*errors.first);
    return std::optional(own);
}

// The parameters of the options; if SCENE has its own, those, except for options that are given.
Result<TouchParameters> parameters_of(const TouchOptions& o, const LoadedScene& scene,
                                      const CLI::App& app) {
    const bool is_project = Project::is_one(o.scene);
    std::optional<TouchParameters> own;
    if (is_project) {
        PALPATE_TRY(const ProjectDescription read,
                    read_project_description(project_folder(o.scene)));
        own = read.touch;
    } else if (is_scene_file(o.scene)) {
        PALPATE_TRY(own, touch_of_scene_file(o.scene, default_iso(scene)));
    }
    TouchParameters p = own.value_or(o.parameters);
    if (own)
        take_given<TouchParameters>(app, o.parameters, p, haptics::kTouchSettings);
    else if (app.count("--iso") == 0)
        p.iso = default_iso(scene);
    if (scene.inverted && !own && app.count("--iso") == 0)
        log::warning(
            "{}: its bright parts are small values (MONOCHROME1), which feel like air: solid are "
            "values from --iso {:g} on; to feel the bright parts, touch the negative (palpate "
            "filter {} --expression '0 - a' -o negative.nrrd)",
            o.scene, p.iso, o.scene);
    return p;
}

std::vector<NamedFile> files_of(const TouchOptions& o) {
    std::vector<NamedFile> files;
    append_volume(files, "SCENE", o.scene);
    append_volume(files, "--labels", o.labels);
    files.insert(files.end(), {{"--path", o.motion.path},
                               {"--write-path", o.motion.write, FileUse::write_text},
                               {"--report", o.report, FileUse::write_text},
                               {"--page", o.page, FileUse::write},
                               {"--record", o.record, FileUse::write},
                               {"--sound", o.sound, FileUse::write}});
    append_volume(files, "-o", o.output, FileUse::write);
    if (const TouchedStrokes strokes = strokes_of(o); strokes.in_journal())
        files.push_back({"the journal of -o", strokes.journal().string(), FileUse::write});
    append_files(o.feel, files);
    if (is_guide_file(o.feel.guide))
        append_volume(files, "--guide", o.feel.guide);
    if (const Result<haptics::DeviceEntry> device = haptics::find_device(o.device))
        files.push_back({"--device", device->argument});
    if (is_scene_file(o.scene))
        if (const Result<SceneFile> scene = load_scene(o.scene)) // else it is told later
            append_files(*scene, files);
    return files;
}

Result<void> say(const haptics::TouchSummary& s, double removed_mm3, const Json& telemetry) {
    Json json{{"path_ticks", s.ticks},
              {"contact_ticks", s.contact_ticks},
              {"most_force_n", s.most_force_n},
              {"largest_step_n", s.largest_step_n},
              {"most_depth_mm", s.most_depth_mm},
              {"energy_mj", s.energy_mj},
              {"removed_mm3", removed_mm3},
              {"all_faults", haptics::fault_text(s.faults)}};
    json.update(telemetry);
    return print_report(json_text(json));
}

// `modality` is that of the volume of -o.
Result<void> write_all(const TouchOptions& o, const TouchRun& run, const std::string& modality,
                       const std::stop_token& stop) {
    const std::string title =
        fmt::format("{} touched with {} on {}", o.scene, o.algorithm, o.device);
    Result<void> done = write_text(o.report, haptics::touch_csv(run.ticks, run.start_ns));
    if (done && !o.page.empty())
        done = write_text(o.page, touch_page(run.ticks, run.start_ns, title));
    if (done && !o.record.empty())
        done = haptics::save_device_log(o.record, run.records);
    if (done && !o.sound.empty() && !run.ticks.empty())
        done = haptics::save_wav(
            o.sound,
            haptics::sound_of(run.milling,
                              1e-9 * static_cast<double>(run.ticks.back().now_ns - run.start_ns)));
    if (done && !o.output.empty())
        done = save_volume(o.output, run.volume, stop, modality);
    return done;
}

// Checks the options whatever the scene.
Result<void> check_together(const TouchOptions& o) {
    if (o.parameters.friction_dynamic > o.parameters.friction_static)
        return fail(
            "--friction: expected a dynamic coefficient of at most the static {:g}, found {:g}",
            o.parameters.friction_static, o.parameters.friction_dynamic);
    PALPATE_TRY(check_together(o.motion));
    if (const Result<haptics::DeviceEntry> device = haptics::find_device(o.device);
        device && !device->node.empty() && !o.motion.live)
        return fail("--device {}: a person moves it, so it needs --live", o.device);
    return check_together(o.feel, o.algorithm);
}

// A path for a first touch of SCENE, instead of a touch.
Result<void> write_starter(const TouchOptions& o, const CLI::App& app) {
    std::string idle;
    for (const CLI::Option* option : app.get_options())
        if (const std::string name = option->get_name(); option->count() > 0 &&
                                                         name.starts_with("-") && name != "--iso" &&
                                                         name != "--write-path")
            idle += fmt::format("{}{}", idle.empty() ? "" : ", ", name);
    if (!idle.empty())
        log::warning("without effect here: {} (with --write-path)", idle);
    const Interrupt interrupt;
    PALPATE_TRY(const LoadedScene scene, load_touched(o, interrupt));
    PALPATE_TRY(const TouchParameters parameters, parameters_of(o, scene, app));
    const Result<Landing> landing = find_landing(scene.data.volume, parameters.iso);
    if (!landing)
        return fail("{}: {}; --iso names another value", o.scene, landing.error().message);
    return write_text(o.motion.write, starter_path(*landing, scene.data.volume));
}

Result<void> run_touch(const TouchOptions& o, const CLI::App& app) {
    if (!o.output.empty())
        PALPATE_TRY(expect_volume_name(o.output));
    const AlgorithmEntry* algorithm = haptics::find_algorithm(o.algorithm);
    const Result<haptics::DeviceEntry> device = haptics::find_device(o.device); // was checked
    const Interrupt interrupt;
    PALPATE_TRY(const LoadedScene scene, load_touched(o, interrupt));
    const Grid& grid = scene.data.volume.grid();
    PALPATE_TRY(const haptics::HandPath path, hand_path(app, o.motion, grid));
    PALPATE_TRY(const TouchParameters parameters, parameters_of(o, scene, app));
    PALPATE_TRY(Feel feel, make_feel(o.feel, scene, parameters, *algorithm, interrupt.token()));
    warn_of_idle_options(app, o, *algorithm, feel.parameters.source, *device);
    const TouchedStrokes strokes = strokes_of(o);
    PALPATE_TRY(std::optional<Project::Opened> project, open_project(strokes, interrupt.token()));
    SessionSetup felt = session_setup(feel);
    SessionSetup session =
        project ? setup_in_project(std::move(project->setup), std::move(felt), *feel.edit)
                : std::move(felt);
    if (feel.second_edit) {
        feel.second_edit->on = feel.edit->on;
        feel.second_edit->guide = feel.edit->guide;
    }
    const Volume before =
        feel.edit ? *session.document.find(feel.edit->on) : session.document.first();
    if (!o.output.empty())
        PALPATE_TRY(expect_format_holds(o.output, before.grid()));
    const bool saves_labels = feel.edit && feel.edit->operation.on_labels();
    const std::string modality = saves_labels ? "" : scene.modality;
    PALPATE_TRY(std::optional<Journal> journal, begin_journal(strokes, session.document));
    const bool journalled = journal.has_value();
    if (journalled)
        session.edit.journal.emplace(std::move(*journal));
    Progress progress("touching");
    const auto show = [&](double share) { progress.show(share); };
    TouchRunSetup setup{.session = std::move(session),
                        .edit = std::move(feel.edit),
                        .second_edit = std::move(feel.second_edit),
                        .algorithm = *algorithm,
                        .path = path,
                        .device = *device,
                        .settings = o.run,
                        .real_time = o.real_time};
    const double live_s = app.count("--duration") > 0 ? o.motion.shape.duration_s : kLive_s;
    Result<TouchRun> run =
        o.motion.live ? run_touch_live(std::move(setup), grid, live_s, interrupt.token(), show)
                      : run_touch_loop(std::move(setup), interrupt.token(), show);
    Result<void> done =
        run ? write_all(o, *run, modality, interrupt.token()) : Result<void>(pass_on(run));
    if (done) // before the journal goes that stands in for them
        done = FilesTogether::commit_newest();
    if (journalled)
        done = end_journal(strokes, std::move(done));
    if (!done && project)
        return fail("{}; the finished strokes are steps of {}", done.error().message, o.scene);
    if (!done)
        return done;
    if (project)
        log::info("{}: {} step{} more; `palpate project {} --undo N` takes steps back", o.scene,
                  run->strokes, run->strokes == 1 ? "" : "s", o.scene);
    const haptics::TouchSummary summary = haptics::summarise(run->ticks, run->start_ns);
    warn_of_what_was_felt(summary, o, path, grid);
    if (edits(o))
        warn_of_idle_edit(before, run->volume, path, o);
    return o.report == "-" ? Result<void>()
                           : say(summary, run->removed_mm3, std::move(run->telemetry));
}

} // namespace

Command add_touch(CLI::App& app) {
    auto o = std::make_shared<TouchOptions>();
    app.add_option("SCENE", o->scene,
                   "Scene file (.json), project folder, or a volume: file, DICOM folder, "
                   "synthetic:NAME")
        ->required();
    app.add_option("--labels", o->labels, "Label map beside the volume (default: none)");
    add_path_options(app, o->motion);
    app.add_option(
           "--algorithm", o->algorithm,
           fmt::format("Haptic algorithm: {}", fmt::join(names_of(haptics::algorithms()), ", ")))
        ->check(one_of(names_of(haptics::algorithms())))
        ->capture_default_str();
    app.add_option("--device", o->device,
                   "Device by its name or number among those of `palpate devices`")
        ->check(device_name())
        ->capture_default_str();
    add_settings<TouchParameters>(app, o->parameters, haptics::kTouchSettings,
                                  haptics::takers_text);
    add_settings<TouchRunSettings>(app, o->run, kRunSettings);
    add_feel_options(app, o->feel);
    app.add_flag("--real-time", o->real_time,
                 "Run on the wall clock, in a real-time thread if permitted");
    app.add_option(
           "--report", o->report,
           "Every tick as CSV; - is standard output, instead of the summary (default: none)")
        ->type_name("FILE.csv");
    app.add_option("--page", o->page, "Plots over time as one HTML page (default: none)")
        ->type_name("FILE.html");
    app.add_option("--record", o->record,
                   "Record of samples and forces of the device: .csv, else a compact format "
                   "(default: none)")
        ->type_name("FILE");
    app.add_option(
           "--sound", o->sound,
           "Sound of the removed material, 16-bit WAV; silent where nothing goes (default: none)")
        ->type_name("FILE.wav");
    app.add_option("-o,--output", o->output,
                   "The volume after the edit, or its labels if --edit changes labels (default: "
                   "none). During the edit, FILE.journal keeps its strokes")
        ->type_name("FILE");
    app.add_flag("--journal", o->keep_journal,
                 "Keep FILE.journal at the end; `palpate edit SCENE --recover --undo N -o FILE` "
                 "then takes strokes back");
    refuse_where_wrong(app, [o, &app] {
        if (!o->feel.guide.empty() && app.count("--algorithm") == 0)
            o->algorithm = algorithm_of_guide(o->feel.guide);
        return check_together(*o);
    });
    return {[o, &app]() -> Result<void> {
                for (const std::string& volume : {o->scene, o->labels})
                    PALPATE_TRY(expect_no_mesh(volume));
                return o->motion.write.empty() ? run_touch(*o, app) : write_starter(*o, app);
            },
            [o] { return files_of(*o); }};
}

} // namespace palpate
