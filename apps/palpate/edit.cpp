#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/palpate/command.h"
#include "apps/palpate/interrupt.h"
#include "apps/palpate/option_checks.h"
#include "apps/palpate/progress.h"
#include "apps/palpate/read_options.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "engine/base/writable.h"
#include "engine/edit/history.h"
#include "engine/edit/journal.h"
#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "engine/volume/content_hash.h"

namespace palpate {

namespace {

namespace fs = std::filesystem;
using Report = nlohmann::ordered_json;

struct EditOptions {
    ReadFlags read;
    std::string strokes, out, guide, report, history_folder;
    double history_memory_mib = 512;
    uint32_t undo = 0;
    bool recover = false, discard = false;
};

Result<std::vector<JournalEntry>> wanted_entries(const EditOptions& options) {
    std::vector<JournalEntry> entries;
    if (!options.strokes.empty()) {
        const Result<std::string> text = load_text(options.strokes, uint64_t{1} << 30);
        if (!text)
            return tl::unexpected(text.error());
        Result<std::vector<Stroke>> strokes = parse_strokes(*text, options.strokes);
        if (!strokes)
            return pass_on(strokes);
        for (Stroke& stroke : *strokes)
            entries.push_back({JournalEntry::Kind::stroke, std::move(stroke)});
    }
    for (uint32_t i = 0; i < options.undo; ++i)
        entries.push_back({JournalEntry::Kind::undo, {}});
    return entries;
}

// Whether the entries work on labels; they must agree.
Result<bool> on_labels(const std::vector<JournalEntry>& entries) {
    std::optional<bool> labels;
    for (const JournalEntry& entry : entries) {
        if (entry.kind != JournalEntry::Kind::stroke)
            continue;
        const bool is = entry.stroke.operation.on_labels();
        if (labels && *labels != is)
            return fail("expected strokes on labels or strokes on grey values, found both");
        labels = is;
    }
    return labels.value_or(false);
}

// Does entries one after the other, with history.
class Replay {
 public:
    Replay(Volume volume, std::optional<Volume> guide, const EditOptions& options)
        : now_(std::move(volume)),
          guide_(std::move(guide)),
          history_({static_cast<uint64_t>(std::min(options.history_memory_mib, 1e9) * 1048576.0),
                    options.history_folder,
                    [](const std::string& notice) { log::warning("{}", notice); }}) {}

    Result<void> apply(const JournalEntry& entry, const std::stop_token& stop) {
        const Timer timer;
        const Volume before = now_;
        Report line;
        if (entry.kind == JournalEntry::Kind::stroke) {
            auto run = StrokeRun::start(now_, entry.stroke.tool, entry.stroke.operation, guide_);
            if (!run)
                return tl::unexpected(run.error());
            (*run)->add(entry.stroke.poses);
            (*run)->lift();
            if (!(*run)->work([&] { return !stop.stop_requested(); }))
                return fail("interrupted");
            now_ = (*run)->publish();
            line["operation"] = name_of(entry.stroke.operation.kind);
            line["poses"] = entry.stroke.poses.size();
            history_.record(before, now_);
        } else {
            const bool back = entry.kind == JournalEntry::Kind::undo;
            const Result<std::optional<Volume>> taken =
                back ? history_.undo(now_) : history_.redo(now_);
            if (!taken)
                return tl::unexpected(taken.error());
            if (!*taken)
                return fail("expected a stroke to {}, found none left in the history",
                            back ? "undo" : "redo");
            now_ = **taken;
            line["operation"] = back ? "undo" : "redo";
        }
        line["ms"] = timer.ms();
        line["changed_bricks"] = changed_bricks(before, now_).size();
        line["volume_version"] = now_.version();
        steps_.push_back(line);
        return {};
    }

    const Volume& volume() const { return now_; }

    Report report() {
        history_.settle();
        const History::Stats stats = history_.stats();
        return {{"steps", steps_},
                {"content_hash", fmt::format("{:016x}", content_hash(now_))},
                {"history",
                 {{"undo_steps", stats.undo_steps},
                  {"redo_steps", stats.redo_steps},
                  {"packed_steps", stats.packed_steps},
                  {"spilled_steps", stats.spilled_steps},
                  {"dropped_steps", stats.dropped_steps},
                  {"memory_bytes", stats.memory_bytes},
                  {"spilled_bytes", stats.spilled_bytes}}}};
    }

 private:
    Volume now_;
    std::optional<Volume> guide_;
    History history_;
    Report steps_ = Report::array();
};

// The journal to go on with, and what it holds already.
Result<Journal::Found> find_journal(const EditOptions& options, const fs::path& path,
                                    const Journal::Base& base) {
    std::error_code error;
    if (fs::exists(path, error) && options.discard && !fs::remove(path, error))
        return fail("{}: cannot be taken away: {}", path.string(), error.message());
    if (!fs::exists(path, error)) {
        if (options.recover && options.strokes.empty())
            return fail("{}: no such file, so there is nothing to recover", path.string());
        Result<Journal> made = Journal::create(path, base);
        if (!made)
            return pass_on(made);
        return Journal::Found{std::move(*made), {}, false};
    }
    if (!options.recover)
        return fail(
            "{}: holds strokes of an edit that did not end; --recover does them, "
            "--discard drops them",
            path.string());
    return Journal::open(path, base);
}

Result<void> run_edit(const EditOptions& options) {
    const fs::path journal_path = options.out + ".journal";
    for (const auto& other : {NamedFile{"V", options.read.path}, {"-o", options.out}})
        if (auto apart =
                each_its_own({other, {"STROKES", options.strokes}, {"--report", options.report}});
            !apart)
            return apart;
    // Before the work, not after it.
    for (const std::string& path : {options.out, options.report})
        if (!path.empty())
            if (Result<void> can = expect_writable(path); !can)
                return can;
    const Interrupt interrupt;
    Result<std::vector<JournalEntry>> wanted = wanted_entries(options);
    if (!wanted)
        return tl::unexpected(wanted.error());
    Result<bool> labels = on_labels(*wanted);
    if (labels && options.strokes.empty()) // of a journal alone: its strokes tell
        if (const Result<std::vector<JournalEntry>> kept = Journal::peek(journal_path); kept)
            labels = on_labels(*kept);
    if (!labels)
        return fail("{}: {}", options.strokes, labels.error().message);
    const Result<LoadedVolume> loaded = load(options.read, *labels, interrupt);
    if (!loaded)
        return tl::unexpected(loaded.error());
    std::optional<Volume> guide;
    if (!options.guide.empty()) {
        ReadFlags flags = options.read;
        flags.path = options.guide;
        const Result<LoadedVolume> found = load(flags, false, interrupt);
        if (!found)
            return tl::unexpected(found.error());
        guide = found->volume;
    }
    for (const JournalEntry& entry : *wanted) // before anything is begun
        if (entry.kind == JournalEntry::Kind::stroke)
            if (const Result<void> fits =
                    check(entry.stroke.operation, loaded->volume, guide ? &*guide : nullptr);
                !fits)
                return fail("{}: {}", options.strokes, fits.error().message);

    Result<Journal::Found> found = find_journal(
        options, journal_path, Journal::base_of(loaded->volume, guide ? &*guide : nullptr));
    if (!found)
        return tl::unexpected(found.error());
    std::vector<JournalEntry> entries = std::move(found->entries);
    const size_t kept = entries.size();
    if (kept > 0)
        log::info("{}: {} step{} recovered{}", journal_path.string(), kept, kept == 1 ? "" : "s",
                  found->cut ? ", and one that had not ended is dropped" : "");
    if (options.strokes.empty()) {
        for (JournalEntry& entry : *wanted)
            entries.push_back(std::move(entry));
    } else { // what is kept must be where STROKES began
        for (size_t i = 0; i < kept; ++i)
            if (i >= wanted->size() || entries[i].text() != (*wanted)[i].text())
                return fail(
                    "{}: expected the beginning of {}, found another step {}; --recover "
                    "without STROKES does what the journal holds",
                    journal_path.string(), options.strokes, i + 1);
        entries = std::move(*wanted);
    }
    const auto keep_journal = [&](const Error& why) {
        return fail("{}; the steps done so far are in {}, and --recover does them", why.message,
                    journal_path.string());
    };
    const Timer timer;
    Replay replay(loaded->volume, std::move(guide), options);
    {
        Progress progress("editing");
        for (size_t i = 0; i < entries.size(); ++i) {
            if (const Result<void> done = replay.apply(entries[i], interrupt.token()); !done)
                return keep_journal(done.error());
            if (i >= kept)
                if (const Result<void> written = found->journal.append(entries[i]); !written)
                    return keep_journal(written.error());
            progress.show(static_cast<double>(i + 1) / static_cast<double>(entries.size()));
        }
    }
    const double edit_ms = timer.ms();
    if (const Result<void> saved = save_volume(options.out, replay.volume(), interrupt.token());
        !saved)
        return keep_journal(saved.error());
    found->journal.remove();
    if (options.report.empty())
        return {};
    Report report = replay.report();
    report["edit_ms"] = edit_ms;
    report["save_ms"] = timer.ms() - edit_ms;
    const std::string text = report.dump(1) + "\n";
    return save_bytes(options.report, std::as_bytes(std::span(text)));
}

} // namespace

Command add_edit(CLI::App& app) {
    auto options = std::make_shared<EditOptions>();
    add_read_flags(app, options->read);
    app.add_option("STROKES", options->strokes,
                   "Strokes to do, JSON lines (docs/carve.md); lengths in mm, times in s");
    app.add_option("-o,--output", options->out,
                   "File to write: .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk or .pbv. While the edit "
                   "goes on, FILE.journal keeps its strokes")
        ->required()
        ->type_name("FILE");
    app.add_option("--guide", options->guide,
                   "Grey values for only_values of strokes on labels; of V's size (default: none)")
        ->type_name("VOLUME");
    app.add_option("--undo", options->undo, "Then take back the last N strokes (default: 0)")
        ->type_name("N");
    app.add_option("--history-memory", options->history_memory_mib,
                   "Most memory for steps that can be undone, in MiB (default: 512)")
        ->check(non_negative())
        ->type_name("MIB");
    app.add_option("--history-folder", options->history_folder,
                   "Where older steps go that need more (default: they are dropped)")
        ->check(CLI::ExistingDirectory)
        ->type_name("FOLDER");
    app.add_option("--report", options->report,
                   "Write what each stroke changed and took, in ms, as JSON (default: none)")
        ->type_name("FILE");
    auto* recover = app.add_flag("--recover", options->recover,
                                 "Begin with the steps in FILE.journal, of an edit that did not "
                                 "end; STROKES, if given, must begin with them");
    app.add_flag("--discard", options->discard, "Drop the steps in FILE.journal")
        ->excludes(recover);
    return [options]() -> Result<void> {
        if (options->strokes.empty() && !options->recover)
            return fail("expected STROKES, or --recover");
        return run_edit(*options);
    };
}

} // namespace palpate
