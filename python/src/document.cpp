// Documents that are edited: strokes, undo and redo, a journal.

#include <pybind11/stl.h>

#include <filesystem>
#include <mutex>

#include "engine/base/log.h"
#include "engine/edit/replay.h"
#include "engine/io/volume_io.h"
#include "python/src/bind.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

using VolumePtr = std::shared_ptr<LoadedVolume>;

// Volumes with one history. Python may call it from any thread; one call works at a time.
class EditedDocument {
 public:
    EditedDocument(Document document, const std::string& journal, bool recover)
        : now_(std::move(document)), history_(history_options()) {
        run<void>(py::none(), [&](const Report& report) {
            return journal.empty() ? Result<void>() : begin_journal(journal, recover, report.stop);
        });
    }

    VolumePtr volume(const std::string& name) {
        const Document now = present();
        value_of(expect_volume(now, name));
        return std::make_shared<LoadedVolume>(LoadedVolume{*now.find(name), {}, {}, {}, {}, {}});
    }
    std::vector<std::string> names() {
        std::vector<std::string> all;
        for (const NamedVolume& volume : present().volumes)
            all.push_back(volume.name);
        return all;
    }

    // `text`: strokes as in a stroke file. How many samples lay within their tools, and a sentence
    // for each that changed nothing. Where one fails, none is done.
    std::pair<uint64_t, std::vector<std::string>> apply(const std::string& text,
                                                        const std::string& on,
                                                        const std::string& guide,
                                                        const py::object& progress) {
        using Done = std::pair<uint64_t, std::vector<std::string>>;
        return run<Done>(progress, [&](const Report& report) -> Result<Done> {
            const std::lock_guard lock(mutex_);
            PALPATE_TRY(expect_volume(now_, on));
            PALPATE_TRY(std::vector<Stroke> strokes, parse_strokes(text, "strokes"));
            Done done;
            std::vector<JournalEntry> entries;
            for (size_t i = 0; i < strokes.size(); ++i) {
                strokes[i].operation = settled(std::move(strokes[i].operation), *now_.find(on));
                JournalEntry entry{
                    JournalEntry::Kind::stroke, std::move(strokes[i]), on, guide, {}};
                const Result<Replayed> replayed = replay(now_, history_, entry, report.stop);
                if (!replayed)
                    return take_back(entries.size(), replayed.error());
                entries.push_back(std::move(entry));
                done.first += replayed->samples_seen;
                if (!replayed->why_idle.empty())
                    done.second.push_back(replayed->why_idle);
                report.progress(static_cast<double>(i + 1) / static_cast<double>(strokes.size()));
            }
            if (journal_)
                if (const Result<void> kept = journal_->append(entries); !kept)
                    return take_back(entries.size(), kept.error());
            return done;
        });
    }

    void step(JournalEntry::Kind kind) {
        run<void>(py::none(), [&](const Report& report) -> Result<void> {
            const std::lock_guard lock(mutex_);
            PALPATE_TRY(do_entry({kind, {}, "volume", "", {}}, report.stop));
            return {};
        });
    }

    // A step that puts a volume in the place of the one of this name, or beside the others.
    void put(const std::string& name, const LoadedVolume& volume, bool labels,
             const std::string& title) {
        run<void>(py::none(), [&](const Report&) -> Result<void> {
            const std::lock_guard lock(mutex_);
            if (journal_)
                return fail("a document with a journal takes no volumes, only strokes");
            PALPATE_TRY(check_volume_name(name));
            Document after = with_volume(
                now_, {name, labels ? VolumeKind::labels : VolumeKind::grey, volume.volume});
            history_.record(now_, after, title);
            now_ = std::move(after);
            return {};
        });
    }

    std::vector<std::string> titles() { return history_.titles(); }
    std::pair<size_t, size_t> steps() {
        const py::gil_scoped_release others_run;
        const std::lock_guard lock(mutex_);
        const History::Stats stats = history_.stats();
        return {stats.undo_steps, stats.redo_steps};
    }

    // Its result is saved elsewhere: the file goes.
    void end_journal() {
        const py::gil_scoped_release others_run;
        const std::lock_guard lock(mutex_);
        if (journal_)
            journal_->remove();
        journal_.reset();
    }

 private:
    static HistoryOptions history_options() {
        return {.notice = [](const std::string& text) { log::warning("{}", text); }};
    }
    Document present() {
        const py::gil_scoped_release others_run;
        const std::lock_guard lock(mutex_);
        return now_;
    }

    // The newest steps of the history, for what followed them failed.
    tl::unexpected<Error> take_back(size_t steps, const Error& why) {
        for (; steps > 0; --steps)
            if (Result<std::optional<Document>> was = history_.undo(now_); was && *was)
                now_ = std::move(**was);
        history_.forget_redo();
        return fail("{}", why.message);
    }

    Result<Replayed> do_entry(const JournalEntry& entry, const std::stop_token& stop) {
        PALPATE_TRY(const Replayed replayed, replay(now_, history_, entry, stop));
        if (journal_)
            PALPATE_TRY(journal_->append(entry));
        return replayed;
    }

    Result<void> begin_journal(const std::string& path, bool recover, const std::stop_token& stop) {
        const Journal::Base base = Journal::base_of(now_);
        std::error_code error;
        if (!recover || !std::filesystem::exists(path, error)) {
            PALPATE_TRY(Journal made, Journal::create(path, base));
            journal_.emplace(std::move(made));
            return {};
        }
        PALPATE_TRY(Journal::Found found, Journal::open(path, base));
        if (found.damage)
            log::warning("{}: damaged at byte {}: {}; the whole journal is kept in {}", path,
                         found.damage->at_byte, found.damage->what, found.damage->kept_as.string());
        for (const JournalEntry& entry : found.entries)
            PALPATE_TRY(do_entry(entry, stop));
        journal_.emplace(std::move(found.journal));
        return {};
    }

    std::mutex mutex_;
    Document now_;
    History history_;
    std::optional<Journal> journal_;
};

using Parts = std::vector<std::tuple<std::string, VolumePtr, bool>>;

std::shared_ptr<EditedDocument> document_of(const Parts& parts, const std::string& journal,
                                            bool recover) {
    std::vector<NamedVolume> volumes;
    for (const auto& [name, volume, labels] : parts)
        volumes.push_back({name, labels ? VolumeKind::labels : VolumeKind::grey, volume->volume});
    return std::make_shared<EditedDocument>(value_of(make_document(std::move(volumes))), journal,
                                            recover);
}

} // namespace

void bind_document(py::module_& module) {
    using Kind = JournalEntry::Kind;
    py::class_<EditedDocument, std::shared_ptr<EditedDocument>>(module, "Document")
        .def(py::init(&document_of))
        .def("volume", &EditedDocument::volume)
        .def("names", &EditedDocument::names)
        .def("apply", &EditedDocument::apply)
        .def("undo", [](EditedDocument& d) { d.step(Kind::undo); })
        .def("redo", [](EditedDocument& d) { d.step(Kind::redo); })
        .def("put", &EditedDocument::put)
        .def("titles", &EditedDocument::titles)
        .def("steps", &EditedDocument::steps)
        .def("end_journal", &EditedDocument::end_journal);
}

} // namespace palpate::python
