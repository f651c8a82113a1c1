#pragma once

#include <algorithm>
#include <stop_token>
#include <string>

#include "engine/edit/history.h"
#include "engine/edit/journal.h"

namespace palpate {

// Cost and outcome of applying an entry of a journal.
struct Replayed {
    uint64_t samples_seen = 0; // of a stroke: within its tool, each once
    std::string why_idle;      // of a stroke that changed no sample: the reason; else empty
};

// Does one entry on `now`, and records it in the history. What fails, or is stopped, leaves both as
// they were.
Result<Replayed> replay(Document& now, History& history, const JournalEntry& entry,
                        const std::stop_token& stop);

// How far back and forth the entries of a journal lead by themselves, for readers that do not have
// the steps before them. Steps beyond are kept as differences.
class JournalReach {
 public:
    JournalReach() = default;
    // By a history, so many of whose first steps are none of the journal.
    JournalReach(const History::Stats& steps, size_t before_journal)
        : undos_(steps.undo_steps - std::min(steps.undo_steps, before_journal)),
          redos_(before_journal > 0 ? 0 : steps.redo_steps) {}

    void recorded() { ++undos_, redos_ = 0; } // a step
    // The entry of an undo (back) or a redo that leads from one document to the other. A change
    // without `packed` where memory ran out.
    JournalEntry entry(bool back, const Document& from, const Document& to) const;
    void moved(bool back, const JournalEntry& entry); // once it is kept

 private:
    size_t undos_ = 0, redos_ = 0;
};

} // namespace palpate
