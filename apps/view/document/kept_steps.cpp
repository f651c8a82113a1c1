#include "apps/view/document/kept_steps.h"

#include <bit>

#include "apps/view/document/open_document.h"
#include "engine/base/log.h"
#include "engine/edit/replay.h"

namespace palpate::view {

namespace fs = std::filesystem;

namespace {

constexpr int kMostWindows = 9; // of one document

// The name of a journal: a hash of the samples and where they lie, and a number.
std::string steps_name(const Journal::Base& base, int number) {
    uint64_t all = 14695981039346656037u; // FNV-1a of the hashes' bytes
    const auto add = [&](uint64_t value) {
        for (int byte = 0; byte < 8; ++byte)
            all = (all ^ ((value >> (8 * byte)) & 0xff)) * 1099511628211u;
    };
    for (const Journal::Base::Entry& entry : base.volumes) {
        add(entry.hash);
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 3; ++row)
                add(std::bit_cast<uint64_t>(entry.grid.world_from_index[column][row]));
    }
    return fmt::format("{:016x}-{}.journal", all, number);
}

uint64_t document_bytes(const Document& document) {
    uint64_t bytes = 0;
    for (const NamedVolume& volume : document.volumes)
        bytes += sample_count(volume.volume.grid()) * bytes_per_sample(volume.volume.type());
    return bytes;
}

// Applies what a journal holds; what cannot be applied leaves the document as it was opened.
Result<void> apply_steps(KeptSteps& steps, const Journal::Contents& found,
                         const std::stop_token& stop) {
    Document document = steps.document;
    auto history = std::make_unique<History>();
    for (const JournalEntry& entry : found.entries)
        if (Result<Replayed> done = replay(document, *history, entry, stop); !done)
            return pass_on(done);
    steps.document = std::move(document);
    steps.history = std::move(history);
    steps.recovered = steps.history->stats().undo_steps;
    if (found.damage)
        steps.note =
            fmt::format("steps are lost: {}; {} later ones are kept in {}", found.damage->what,
                        found.damage->later, found.damage->kept_as.string());
    return {};
}

} // namespace

Document fresh_document(const SceneData& data) {
    std::vector<NamedVolume> volumes{{OpenDocument::kGrey, VolumeKind::grey, data.volume}};
    // Maps that a person may draw on are no edits: they are there from the start.
    volumes.push_back({OpenDocument::kLabels, VolumeKind::labels,
                       data.labels ? *data.labels : empty_labels(data.volume.grid())});
    volumes.push_back({OpenDocument::kSeeds, VolumeKind::labels, empty_labels(data.volume.grid())});
    return *make_document(std::move(volumes)); // of names that differ
}

KeptSteps keep_steps(Document document, const fs::path& folder, const std::stop_token& stop) {
    KeptSteps steps{.document = std::move(document), .history = {}, .journal = {}, .path = {}};
    if (folder.empty() || document_bytes(steps.document) > kMostKept_bytes)
        return steps;
    const Journal::Base base = Journal::base_of(steps.document);
    std::error_code error;
    fs::create_directories(folder, error);
    fs::path best; // with steps; else the first that no window has
    for (int number = 1; number <= kMostWindows; ++number) {
        const fs::path path = folder / steps_name(base, number);
        if (!fs::exists(path, error)) {
            best = best.empty() ? path : best;
            continue;
        }
        if (!Journal::expect_ended(path))
            continue;
        const Result<Journal::Contents> found = Journal::peek(path);
        const bool has_steps = found && !found->entries.empty();
        if (best.empty() || has_steps)
            best = path;
        if (has_steps)
            break;
    }
    if (best.empty())
        return steps;
    std::string why;
    if (fs::exists(best, error)) {
        Result<Journal::Found> found = Journal::open(best, base);
        Result<void> applied =
            found ? apply_steps(steps, *found, stop) : Result<void>(pass_on(found));
        if (applied) {
            steps.journal.emplace(std::move(found->journal));
            steps.path = best;
            return steps;
        }
        why = applied.error().message;
        if (stop.stop_requested()) // it stays for the next time
            return steps;
        found = fail("closed");
        fs::path aside = best;
        for (int n = 1; fs::exists(aside, error); ++n)
            aside = best.string() + (n == 1 ? ".damaged" : fmt::format(".damaged-{}", n));
        fs::rename(best, aside, error);
        why += fmt::format("; they are kept in {}", aside.string());
    }
    Result<Journal> made = Journal::create(best, base);
    if (made) {
        steps.journal.emplace(std::move(*made));
        steps.path = best;
    }
    if (why.empty() && !made)
        why = made.error().message;
    if (!why.empty())
        steps.note = made ? fmt::format("steps of an earlier window are lost: {}", why)
                          : fmt::format("steps are not kept on disk until they are saved: {}", why);
    return steps;
}

StepsFile::~StepsFile() {
    if (drops_)
        discard();
}

void StepsFile::discard() {
    if (path_.empty())
        return;
    if (const Result<void> gone = Journal::discard(path_); !gone)
        log::info("{}", gone.error().message);
    path_.clear();
}

} // namespace palpate::view
