#include <filesystem>

#include "apps/palpate/command.h"
#include "apps/palpate/edit_replay.h"
#include "apps/palpate/mask_options.h"
#include "engine/base/file.h"
#include "engine/base/json.h"
#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "engine/edit/journal.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"
#include "engine/program/read_options.h"
#include "engine/session/feel.h"
#include "engine/session/starter.h"

namespace palpate {

namespace {

namespace fs = std::filesystem;

struct EditOptions {
    ReadFlags read;
    std::string strokes, out, guide, report, history_folder, write_strokes;
    double history_memory_mib = 512;
    uint32_t undo = 0;
    bool recover = false, discard = false;
    std::optional<double> iso;
    MaskOptions mask;
};

// From which value on samples are material: 1 of labels, else as `palpate touch` takes it.
double solid_from(const EditOptions& options, const LoadedVolume& volume, bool labels) {
    if (labels)
        return 1.0;
    return options.iso ? *options.iso
                       : default_iso({{volume.volume, {}, {}}, volume.modality, {}, {}, {}, {}});
}

std::vector<NamedFile> files_of(const EditOptions& o) {
    std::vector<NamedFile> files;
    append_volume(files, "V", o.read.path);
    files.push_back({"STROKES", o.strokes});
    append_volume(files, "--guide", o.guide);
    append_volume(files, "-o", o.out, FileUse::write);
    if (!o.out.empty())
        files.push_back({"the journal of -o", o.out + ".journal", FileUse::write});
    files.push_back({"--write-strokes", o.write_strokes, FileUse::write_text});
    files.push_back({"--report", o.report, FileUse::write_text});
    return files;
}

Result<std::vector<JournalEntry>> strokes_of_file(const EditOptions& options) {
    std::vector<JournalEntry> entries;
    if (!options.strokes.empty()) {
        PALPATE_TRY(const std::string text, load_text(options.strokes, uint64_t{1} << 30));
        PALPATE_TRY(std::vector<Stroke> strokes, parse_strokes(text, options.strokes));
        PALPATE_TRY(const EditMask mask, mask_of(options.mask));
        for (Stroke& stroke : strokes) {
            Result<Operation> masked = within_mask(std::move(stroke.operation), mask);
            if (!masked)
                return fail("{}: {}", options.strokes, masked.error().message);
            stroke.operation = std::move(*masked);
            const bool guided = stroke.operation.needs_guide();
            entries.push_back({JournalEntry::Kind::stroke,
                               std::move(stroke),
                               "volume",
                               guided ? "guide" : "",
                               {}});
        }
    }
    return entries;
}

// The operation of the first stroke; null where there is none. All work on labels or none does.
Result<const Operation*> first_operation(const std::vector<JournalEntry>& entries) {
    const Operation* first = nullptr;
    for (const JournalEntry& entry : entries) {
        if (entry.kind != JournalEntry::Kind::stroke)
            continue;
        const Operation& operation = entry.stroke.operation;
        if (first && first->on_labels() != operation.on_labels())
            return fail(
                "expected strokes on labels or strokes on grey values, found both ('{}' and '{}')",
                name_of(first->kind), name_of(operation.kind));
        first = first ? first : &operation;
    }
    return first;
}

// Each undo needs a stroke, each redo an undo: found out before the work, not at its end.
Result<void> check_undo(const std::vector<JournalEntry>& strokes, uint32_t undo) {
    size_t done = 0;
    for (const JournalEntry& entry : strokes)
        if (entry.kind == JournalEntry::Kind::undo)
            done -= done > 0;
        else
            ++done;
    if (undo > done)
        return fail("--undo: expected at most {} stroke{} to take back, found {}", done,
                    done == 1 ? "" : "s", undo);
    return {};
}

// The contents of an existing journal, if it may be touched; looked at before loading anything.
Result<Journal::Contents> look_at_journal(const EditOptions& options, const fs::path& path) {
    std::error_code error;
    if (!fs::exists(path, error)) {
        if (options.recover && options.strokes.empty())
            return fail("{}: no such file, so there is nothing to recover", path.string());
        return Journal::Contents();
    }
    PALPATE_TRY(Journal::expect_ended(path));
    if (options.discard)
        return Journal::Contents();
    if (!options.recover)
        return fail(
            "{}: holds strokes of an interrupted edit; --recover applies them, --discard drops "
            "them",
            path.string());
    Result<Journal::Contents> found = Journal::peek(path);
    if (found && found->entries.empty() && options.strokes.empty()) {
        if (found->damage)
            return fail(
                "{}: damaged at byte {}, before its first step has ended: {}; it stays as it is, "
                "with {} later ones that could be read",
                path.string(), found->damage->at_byte, found->damage->what, found->damage->later);
        return fail("{}: holds no stroke, so there is nothing to recover", path.string());
    }
    return found;
}

// The journal to go on with, and what it holds already.
Result<Journal::Found> find_journal(const EditOptions& options, const fs::path& path,
                                    const Journal::Base& base) {
    std::error_code error;
    if (fs::exists(path, error) && options.recover)
        return Journal::open(path, base);
    if (fs::exists(path, error) && options.discard)
        PALPATE_TRY(Journal::discard(path));
    PALPATE_TRY(Journal made, Journal::create(path, base));
    return Journal::Found{{}, std::move(made)};
}

// Says what was found in a journal.
void tell(const Journal::Found& found, const fs::path& path) {
    const size_t kept = found.entries.size();
    if (kept > 0)
        log::info("{}: {} step{} recovered{}", path.string(), kept, kept == 1 ? "" : "s",
                  found.cut ? ", and one that had not ended is dropped" : "");
    if (const auto& damage = found.damage)
        log::warning(
            "{}: damaged at byte {}: {}; {} later step{} could be read and {} left out, because "
            "each depends on the steps before it; the whole journal is kept in {}",
            path.string(), damage->at_byte, damage->what, damage->later,
            damage->later == 1 ? "" : "s", damage->later == 1 ? "is" : "are",
            damage->kept_as.string());
}

// The volume, and the guide if there is one that fits.
struct Input {
    LoadedVolume volume;
    std::optional<Volume> guide;
};

Result<Input> load_input(const EditOptions& options, const std::vector<JournalEntry>& strokes,
                         const Interrupt& interrupt) {
    PALPATE_TRY(const Operation* const first, first_operation(strokes));
    const bool labels = first && first->on_labels();
    Result<LoadedVolume> loaded = load(options.read, labels, interrupt);
    if (!loaded && labels)
        return fail("{}; '{}' of the strokes works on labels: expected a label map as V",
                    loaded.error().message, name_of(first->kind));
    if (!loaded)
        return pass_on(loaded);
    Input input{std::move(*loaded), {}};
    if (options.guide.empty())
        return input;
    ReadFlags flags = options.read;
    flags.path = options.guide;
    const bool of_labels =
        !labels && std::any_of(strokes.begin(), strokes.end(), [](const JournalEntry& entry) {
            return entry.stroke.operation.needs_guide();
        });
    PALPATE_TRY(const LoadedVolume guide, load(flags, of_labels, interrupt));
    if (const Result<void> serves = check_guide(guide.volume, input.volume.volume); !serves)
        return fail("{}: {}", options.guide, serves.error().message);
    input.guide = guide.volume;
    return input;
}

// Strokes for a first edit of V, instead of an edit.
Result<void> write_starter(const EditOptions& options, const CLI::App& app) {
    const IdleOptions idle[] = {
        {true,
         {"--guide", "--inside", "--outside", "--only-values", "--over", "--undo",
          "--history-memory", "--history-folder", "--report", "-o", "--recover", "--discard"},
         "with --write-strokes"}};
    warn_of_idle(app, idle);
    const Interrupt interrupt;
    PALPATE_TRY(const LoadedVolume loaded, load(options.read, false, interrupt));
    const double iso = solid_from(options, loaded, false);
    const Result<Landing> landing = find_landing(loaded.volume, iso);
    if (!landing)
        return fail("{}: {}; --iso names another value", options.read.path,
                    landing.error().message);
    return write_text(options.write_strokes, starter_strokes(*landing, loaded.volume, iso));
}

Result<void> run_edit(const EditOptions& options) {
    const fs::path journal_path = options.out + ".journal";
    const Interrupt interrupt;
    PALPATE_TRY(expect_volume_name(options.out));
    PALPATE_TRY(std::vector<JournalEntry> wanted, strokes_of_file(options));
    const bool alone = options.strokes.empty(); // the journal's strokes are all there are
    PALPATE_TRY(const Journal::Contents there, look_at_journal(options, journal_path));
    const std::vector<JournalEntry>& strokes = alone ? there.entries : wanted;
    PALPATE_TRY(check_undo(strokes, options.undo));
    for (uint32_t i = 0; i < options.undo; ++i)
        wanted.push_back({JournalEntry::Kind::undo, {}});
    const Result<const Operation*> first = first_operation(strokes);
    if (!first)
        return fail("{}: {}", alone ? journal_path.string() : options.strokes,
                    first.error().message);
    const bool labels = *first && (*first)->on_labels();
    if (options.iso && (labels || options.report.empty()))
        log::warning("--iso: without effect ({})", labels ? "of grey values" : "without --report");
    PALPATE_TRY(const Input input, load_input(options, strokes, interrupt));
    const Volume& volume = input.volume.volume;
    PALPATE_TRY(expect_format_holds(options.out, volume.grid()));
    const Volume* guide = input.guide ? &*input.guide : nullptr;
    Document document(volume, labels ? VolumeKind::labels : VolumeKind::grey);
    if (guide)
        document = with_volume(document,
                               {"guide", labels ? VolumeKind::grey : VolumeKind::labels, *guide});
    for (JournalEntry& entry : wanted) { // before anything is begun
        if (entry.kind != JournalEntry::Kind::stroke)
            continue;
        if (const Result<void> fits = check(entry.stroke.operation, volume, guide); !fits)
            return fail("{}: {}", options.strokes, fits.error().message);
        entry.stroke.operation = settled(std::move(entry.stroke.operation), volume);
    }

    PALPATE_TRY(Journal::Found found,
                find_journal(options, journal_path, Journal::base_of(document)));
    tell(found, journal_path);
    std::vector<JournalEntry> entries = std::move(found.entries);
    const size_t kept = entries.size();
    if (alone) {
        for (JournalEntry& entry : wanted)
            entries.push_back(std::move(entry));
    } else { // what is kept must be where STROKES began
        for (size_t i = 0; i < kept; ++i)
            if (i >= wanted.size() || entries[i].text() != wanted[i].text())
                return fail(
                    "{}: expected the beginning of {}, found another step {}; --recover without "
                    "STROKES applies the journal",
                    journal_path.string(), options.strokes, i + 1);
        entries = std::move(wanted);
    }
    const auto keep_journal = [&](const Error& why) {
        return fail("{}; the finished strokes are in {}, and --recover applies them", why.message,
                    journal_path.string());
    };
    const Timer timer;
    Replay replay(
        document,
        {static_cast<uint64_t>(std::min(options.history_memory_mib, 1e9) * 1048576.0),
         options.history_folder, [](const std::string& notice) { log::warning("{}", notice); }},
        solid_from(options, input.volume, labels));
    {
        Progress progress("editing");
        for (size_t i = 0; i < entries.size(); ++i) {
            if (const Result<void> done = replay.apply(entries[i], interrupt.token()); !done)
                return keep_journal(done.error());
            if (i >= kept)
                if (const Result<void> written = found.journal.append(entries[i]); !written)
                    return keep_journal(written.error());
            progress.show(static_cast<double>(i + 1) / static_cast<double>(entries.size()));
        }
    }
    const double edit_ms = timer.ms();
    if (const std::string idle = replay.what_was_idle(); !idle.empty())
        log::warning("{}", idle);
    if (const Result<void> saved = save_volume(options.out, replay.volume(), interrupt.token(),
                                               labels ? "" : input.volume.modality);
        !saved)
        return keep_journal(saved.error());
    if (!options.report.empty()) {
        Json report = replay.report();
        report["edit_ms"] = edit_ms;
        report["save_ms"] = timer.ms() - edit_ms;
        if (const Result<void> said = write_text(options.report, report_text(report)); !said)
            return keep_journal(said.error());
    }
    if (const Result<void> named = FilesTogether::commit_newest(); !named)
        return keep_journal(named.error());
    found.journal.remove();
    tell_made(options.out, replay.volume());
    return {};
}

} // namespace

Command add_edit(CLI::App& app) {
    auto options = std::make_shared<EditOptions>();
    add_read_flags(app, options->read);
    auto* strokes = app.add_option(
        "STROKES", options->strokes,
        "Strokes, JSON lines (docs/reference/strokes.md); positions in mm (LPS), times "
        "in s; cut and "
        "mill without to_value leave V's lowest value");
    app.add_option("-o,--output", options->out,
                   "File to write: .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk or .pbv. During the "
                   "edit, FILE.journal keeps its strokes")
        ->type_name("FILE");
    app.add_option("--write-strokes", options->write_strokes,
                   "Write strokes to begin with, a cut and a groove at V's surface at --iso, as a "
                   "STROKES file, and do not edit (default: none)")
        ->type_name("FILE")
        ->excludes(strokes);
    app.add_option("--guide", options->guide,
                   "Grey values for only_values of strokes on labels, or labels for `spared`, "
                   "`inside` and `outside` of strokes on grey values; of V's size (default: none)")
        ->type_name("VOLUME");
    add_mask_options(app, options->mask);
    app.add_option("--undo", options->undo, "Take back the last N strokes at the end (default: 0)")
        ->type_name("N");
    app.add_option("--history-memory", options->history_memory_mib,
                   "Memory limit for the undo history, in MiB (default: 512)")
        ->check(non_negative())
        ->type_name("MIB");
    app.add_option("--history-folder", options->history_folder,
                   "Folder for older undo steps beyond that limit (default: they are dropped)")
        ->check(CLI::ExistingDirectory)
        ->type_name("FOLDER");
    app.add_option("--report", options->report,
                   "JSON with the changes, the removed and added material in mm^3, and the time of "
                   "each stroke, in ms; - is standard output (default: none)")
        ->type_name("FILE");
    app.add_option(
        "--iso", options->iso,
        "With --report or --write-strokes, of grey values: samples at or above it are material "
        "(default: 300 HU for CT, else half of the range)");
    auto* recover = app.add_flag("--recover", options->recover,
                                 "Continue an interrupted edit from FILE.journal; STROKES, if "
                                 "given, must begin with its strokes");
    app.add_flag("--discard", options->discard, "Drop the strokes in FILE.journal")
        ->excludes(recover);
    refuse_where_wrong(app, [options]() -> Result<void> {
        if (!options->write_strokes.empty())
            return {};
        if (options->strokes.empty() && !options->recover)
            return fail("edit: expected STROKES, or --recover; --write-strokes FILE makes some");
        if (options->out.empty())
            return fail("edit: expected -o FILE");
        return {};
    });
    return {[options, &app] {
                return options->write_strokes.empty() ? run_edit(*options)
                                                      : write_starter(*options, app);
            },
            [options] { return files_of(*options); }};
}

} // namespace palpate
