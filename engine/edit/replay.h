#pragma once

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

} // namespace palpate
