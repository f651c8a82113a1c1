#include <filesystem>
#include <span>

#include "apps/palpate/command.h"
#include "engine/base/file.h"
#include "engine/base/json.h"
#include "engine/base/log.h"
#include "engine/edit/replay.h"
#include "engine/edit/stroke.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/project_input.h"
#include "engine/program/read_options.h"
#include "engine/program/scene_options.h"
#include "engine/session/default_scene.h"
#include "engine/session/feel.h"

namespace palpate {

namespace {

struct ProjectOptions {
    std::string folder, from, labels, strokes, exported, out;
    uint32_t undo = 0, redo = 0;
    bool save = false, discard = false, json = false;

    bool changes() const { return !strokes.empty() || undo > 0 || redo > 0 || save || discard; }
};

std::vector<NamedFile> files_of(const ProjectOptions& o) {
    std::vector<NamedFile> files;
    if (!o.from.empty())
        append_volume(files, "--new", o.from);
    append_volume(files, "--labels", o.labels);
    files.push_back({"--strokes", o.strokes});
    append_volume(files, "-o", o.out, FileUse::write);
    return files;
}

// A project of a scene or a volume, seen and felt as render and touch do by default.
Result<void> create(const ProjectOptions& o, const Interrupt& interrupt) {
    for (const std::string& volume : {o.from, o.labels})
        PALPATE_TRY(expect_no_mesh(volume));
    SceneOptions options;
    options.input = o.from;
    options.labels = o.labels;
    PALPATE_TRY(SceneFile file, base_scene(options));
    PALPATE_TRY(LoadedScene loaded, load_scene_input(o.from, file, {.stop = interrupt.token()}));
    for (const std::string& note : all_notes(loaded))
        log::info("{}", note);
    for (const std::string& warning : loaded.warnings)
        log::warning("{}", warning);
    const bool is_map = file.labels.empty() && is_label_map(loaded);
    show_labels_by_default(options, file, loaded);
    color_labels(loaded.label_names, file);
    PALPATE_TRY(file.scene, final_scene(options, file, loaded));
    file.framing.reset();
    file.centered_slices.clear();
    file.centered_clips.clear();
    ProjectContents contents{
        Document(loaded.data.volume, is_map ? VolumeKind::labels : VolumeKind::grey),
        "volume",
        is_map ? "volume" : "",
        std::move(file),
        {.iso = default_iso(loaded)},
        loaded.modality};
    if (loaded.data.labels && !is_map) {
        contents.labels = "labels";
        contents.document =
            with_volume(contents.document, {"labels", VolumeKind::labels, *loaded.data.labels});
    }
    PALPATE_TRY(Project::create(o.folder, contents));
    log::info("{}: created", o.folder);
    return {};
}

Result<void> describe(const ProjectOptions& o, const Project::Seen& seen) {
    const ProjectContents& contents = seen.contents;
    Json volumes = Json::array(), steps = Json::array();
    std::string text;
    for (const NamedVolume& v : contents.document.volumes) {
        const glm::uvec3 size = v.volume.size();
        const glm::dvec3 spacing = spacing_mm(v.volume.grid());
        const bool is_seen = v.name == contents.grey || v.name == contents.labels;
        text += fmt::format("volume     {}: {}, {} x {} x {}, {:g} x {:g} x {:g} mm, {}{}\n",
                            v.name, name_of(v.kind), size.x, size.y, size.z, spacing.x, spacing.y,
                            spacing.z, name_of(v.volume.type()), is_seen ? ", seen and felt" : "");
        volumes.push_back({{"name", v.name},
                           {"kind", name_of(v.kind)},
                           {"size", {size.x, size.y, size.z}},
                           {"spacing_mm", spacing},
                           {"type", name_of(v.volume.type())}});
    }
    text += fmt::format("saves      {}\nsteps      {} since the last save", seen.saves,
                        seen.unsaved.size());
    text += seen.in_effect() == seen.unsaved.size()
                ? "\n"
                : fmt::format(", {} in effect\n", seen.in_effect());
    for (size_t i = 0; i < seen.unsaved.size(); ++i) {
        const Project::Step& step = seen.unsaved[i];
        text += fmt::format("  {:<8} {}{}\n", i + 1, title_of(step.entry),
                            step.in_effect ? "" : "; undone, not in effect");
        if (!step.why_idle.empty())
            text += fmt::format("           it changed no sample: {}\n", step.why_idle);
        steps.push_back({{"title", title_of(step.entry)},
                         {"in_effect", step.in_effect},
                         {"why_idle", step.why_idle}});
    }
    if (!o.json)
        return print_text(text);
    return print_report(report_text({{"volumes", volumes},
                                     {"grey", contents.grey},
                                     {"labels", contents.labels},
                                     {"modality", contents.modality},
                                     {"saves", seen.saves},
                                     {"steps", steps}}));
}

// Strokes as steps: those on labels work on the labels that are seen, others on the values.
Result<std::vector<JournalEntry>> steps_of(const ProjectOptions& o, const Document& document,
                                           const std::string& grey, const std::string& labels) {
    std::vector<JournalEntry> entries;
    if (!o.strokes.empty()) {
        PALPATE_TRY(const std::string text, load_text(o.strokes, uint64_t{1} << 30));
        PALPATE_TRY(std::vector<Stroke> strokes, parse_strokes(text, o.strokes));
        for (Stroke& stroke : strokes) {
            Operation& operation = stroke.operation;
            const bool on_labels = operation.on_labels();
            const bool guided = operation.needs_guide();
            const std::string& on = on_labels ? labels : grey;
            const Volume* volume = document.find(on);
            const std::string& guide_name = on_labels ? grey : labels;
            const Volume* guide = guided ? document.find(guide_name) : nullptr;
            if (!volume)
                return fail("{}: '{}' needs {}, and the project has none", o.strokes,
                            name_of(operation.kind), on_labels ? "labels" : "grey values");
            if (Result<void> fits = check(operation, *volume, guide); !fits)
                return fail("{}: {}", o.strokes, fits.error().message);
            operation = settled(std::move(operation), *volume);
            entries.push_back(
                {JournalEntry::Kind::stroke, std::move(stroke), on, guided ? guide_name : "", {}});
        }
    }
    entries.insert(entries.end(), o.undo, {.kind = JournalEntry::Kind::undo});
    entries.insert(entries.end(), o.redo, {.kind = JournalEntry::Kind::redo});
    return entries;
}

// Does all of them in memory: where one cannot be done, nothing is kept of any. They become what a
// journal is to keep, before_journal of the history's steps being none of it.
// Returns what is to be said of strokes that changed no sample.
Result<std::vector<std::string>> take_steps(const ProjectOptions& o,
                                            std::vector<JournalEntry>& entries, Document& document,
                                            History& history, size_t before_journal,
                                            const Interrupt& interrupt) {
    using Kind = JournalEntry::Kind;
    size_t strokes = 0;
    uint32_t back = 0, forth = 0;
    std::vector<std::string> idle;
    JournalReach reach(history.stats(), before_journal);
    for (JournalEntry& entry : entries) {
        const History::Stats steps = history.stats();
        const bool is_undo = entry.kind == Kind::undo, is_redo = entry.kind == Kind::redo;
        if ((is_undo && steps.undo_steps == 0) || (is_redo && steps.redo_steps == 0))
            return fail(
                "{}: nothing is left to {}: expected at most --{} {}, found {}; nothing is changed",
                o.folder, is_undo ? "undo" : "redo", is_undo ? "undo" : "redo",
                is_undo ? back : forth, is_undo ? o.undo : o.redo);
        const Document before = document;
        const Result<Replayed> done = replay(document, history, entry, interrupt.token());
        if (!done)
            return fail("{}; nothing is changed", done.error().message);
        if (is_undo || is_redo) {
            entry = reach.entry(is_undo, before, document);
            if (entry.kind == Kind::change && entry.change.packed.empty())
                return fail("{}: a step needs more memory than there is; nothing is changed",
                            o.folder);
            reach.moved(is_undo, entry);
        } else {
            reach.recorded();
        }
        back += is_undo;
        forth += is_redo;
        strokes += entry.kind == Kind::stroke;
        if (!done->why_idle.empty())
            idle.push_back(fmt::format("{}: stroke {} changed no sample: {}", o.strokes, strokes,
                                       done->why_idle));
    }
    return idle;
}

Result<void> expect_exported(const ProjectOptions& o, const Document& document) {
    const Result<void> there =
        o.exported.empty() ? Result<void>() : expect_volume(document, o.exported);
    if (!there)
        return fail("--export: {}", there.error().message);
    return {};
}

Result<void> write_export(const ProjectOptions& o, const Document& document,
                          const std::string& grey, const std::string& modality,
                          const Interrupt& interrupt) {
    if (o.exported.empty())
        return {};
    PALPATE_TRY(expect_exported(o, document));
    return save_volume(o.out, *document.find(o.exported), interrupt.token(),
                       o.exported == grey ? modality : "");
}

// All that is asked for, or nothing: steps are done in memory, the export is written, and then
// either the journal takes all steps at once or, with --save, the save has them.
Result<void> change(const ProjectOptions& o, const Interrupt& interrupt) {
    if (o.discard) { // which is tried on the last save first
        PALPATE_TRY(Project::Seen saved,
                    Project::look(o.folder, {.unsaved = false, .stop = interrupt.token()}));
        ProjectContents& last = saved.contents;
        PALPATE_TRY(auto entries, steps_of(o, last.document, last.grey, last.labels));
        History history;
        PALPATE_TRY(take_steps(o, entries, last.document, history, 0, interrupt));
        PALPATE_TRY(expect_exported(o, last.document));
    }
    PALPATE_TRY(Project::Opened opened,
                Project::open(o.folder, {.unsaved = !o.discard, .stop = interrupt.token()}));
    for (const std::string& note : opened.notes)
        log::warning("{}", note);
    SessionSetup& setup = opened.setup;
    PALPATE_TRY(auto entries, steps_of(o, setup.document, setup.grey, setup.labels));
    PALPATE_TRY(const auto idle, take_steps(o, entries, setup.document, *setup.edit.begun,
                                            setup.edit.before_journal, interrupt));
    FilesTogether files;
    PALPATE_TRY(write_export(o, setup.document, setup.grey, opened.project.modality(), interrupt));
    files.close(); // those of a save take their names in an order of their own
    if (o.save) {
        setup.edit.threaded = false;
        Session session(std::move(setup));
        PALPATE_TRY(opened.project.save(session));
    } else {
        PALPATE_TRY(setup.edit.journal->append(entries));
    }
    for (const std::string& sentence : idle)
        log::warning("{}", sentence);
    return files.commit();
}

Result<void> change_or_export(const ProjectOptions& o, const Interrupt& interrupt) {
    if (o.changes())
        return change(o, interrupt);
    if (o.exported.empty())
        return {};
    PALPATE_TRY(const Project::Seen seen, Project::look(o.folder, interrupt.token()));
    for (const std::string& note : seen.notes)
        log::warning("{}", note);
    return write_export(o, seen.contents.document, seen.contents.grey, seen.contents.modality,
                        interrupt);
}

Result<void> run_project(const ProjectOptions& o, const CLI::App& app) {
    const Interrupt interrupt;
    const bool describes = o.exported.empty() && !o.changes() && o.from.empty();
    const IdleOptions idle[] = {{!describes, {"--json"}, "of a description"}};
    warn_of_idle(app, idle);
    if (!o.out.empty())
        PALPATE_TRY(expect_volume_name(o.out));
    if (!o.from.empty()) {
        PALPATE_TRY(create(o, interrupt));
        Result<void> done = change_or_export(o, interrupt);
        std::error_code ignored;
        if (!done) // the folder is of this command alone
            std::filesystem::remove_all(o.folder, ignored);
        return done;
    }
    if (!Project::is_one(o.folder))
        return fail("{}: expected the folder of a project; --new SCENE creates one", o.folder);
    if (!describes)
        return change_or_export(o, interrupt);
    PALPATE_TRY(const Project::Seen seen, Project::look(o.folder, interrupt.token()));
    for (const std::string& note : seen.notes)
        log::warning("{}", note);
    return describe(o, seen);
}

} // namespace

Command add_project(CLI::App& app) {
    auto o = std::make_shared<ProjectOptions>();
    app.add_option("PROJECT", o->folder,
                   "Project folder. Without options: its volumes and its steps since the last save")
        ->required();
    auto* created = app.add_option("--new", o->from,
                                   "Create the folder from a scene file, a volume or another "
                                   "project (default: it is there)")
                        ->type_name("SCENE");
    app.add_option("--labels", o->labels, "With --new: label map beside the volume (default: none)")
        ->needs(created)
        ->type_name("FILE");
    app.add_option("--strokes", o->strokes,
                   "Apply strokes, JSON lines (docs/reference/strokes.md), each as a step; those "
                   "on labels change the labels that are seen, others the values (default: none)")
        ->type_name("FILE");
    app.add_option("--undo", o->undo, "Take back the last N steps (default: 0)")->type_name("N");
    app.add_option("--redo", o->redo,
                   "Apply again the last N steps that were taken back "
                   "(default: 0)")
        ->type_name("N");
    auto* save = app.add_flag("--save", o->save, "Save the volumes with all steps");
    app.add_flag("--discard", o->discard,
                 "Go back to the last save; the steps since then are kept in journal-N.set-aside")
        ->excludes(save);
    auto* exported = app.add_option("--export", o->exported,
                                    "Name of a volume of the project to write (default: none)")
                         ->type_name("NAME");
    auto* out = app.add_option("-o,--output", o->out,
                               "File of --export: .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk or .pbv")
                    ->needs(exported)
                    ->type_name("FILE");
    exported->needs(out);
    app.add_flag("--json", o->json, "The description as JSON");
    return {[o, &app] { return run_project(*o, app); }, [o] { return files_of(*o); },
            /*files_together=*/false};
}

} // namespace palpate
