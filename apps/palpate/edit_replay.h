#pragma once

#include <stop_token>
#include <string>

#include "engine/base/json.h"
#include "engine/edit/history.h"
#include "engine/edit/journal.h"

namespace palpate {

// Does the entries of an edit of a document's first volume one after the other, with history, and
// keeps account of each.
class Replay {
 public:
    // Samples at or above `solid` are material, of label maps 1.
    Replay(Document document, HistoryOptions history, double solid = 1.0);

    Result<void> apply(const JournalEntry& entry, const std::stop_token& stop);

    const Volume& volume() const { return now_.first(); }

    // The keys "steps" and "solid"; from the first step to now "changed_samples", "removed_mm3" and
    // "added_mm3"; and "content_hash" and "history".
    Json report();

    // One sentence about the strokes that changed no sample, and why the first of them did not;
    // empty where all did.
    std::string what_was_idle() const;

 private:
    Document now_;
    Volume first_; // before all steps
    History history_;
    double solid_;
    Json steps_ = Json::array();
    size_t strokes_ = 0, idle_ = 0;
    std::string first_idle_; // which, and why
};

} // namespace palpate
