#include "apps/palpate/edit_replay.h"

#include "engine/base/timer.h"
#include "engine/edit/replay.h"
#include "engine/volume/changes.h"
#include "engine/volume/content_hash.h"

namespace palpate {

Replay::Replay(Document document, HistoryOptions history)
    : now_(std::move(document)), history_(std::move(history)) {}

Result<void> Replay::apply(const JournalEntry& entry, const std::stop_token& stop) {
    using Kind = JournalEntry::Kind;
    const Timer timer;
    const Volume before = volume();
    PALPATE_TRY(const Replayed done, replay(now_, history_, entry, stop));
    Json line;
    const bool is_stroke = entry.kind == Kind::stroke;
    line["operation"] = is_stroke                    ? name_of(entry.stroke.operation.kind)
                        : entry.kind == Kind::change ? entry.change.title
                        : entry.kind == Kind::undo   ? "undo"
                                                     : "redo";
    if (is_stroke)
        line["poses"] = entry.stroke.poses.size();
    const size_t changed = changed_bricks(before, volume()).size();
    line["ms"] = timer.ms();
    line["changed_bricks"] = changed;
    line["volume_version"] = volume().version();
    steps_.push_back(line);
    if (is_stroke) {
        ++strokes_;
        idle_ += changed == 0;
        if (changed == 0 && first_idle_.empty())
            first_idle_ = fmt::format("of stroke {}, {}", strokes_, done.why_idle);
    }
    return {};
}

Json Replay::report() {
    history_.settle();
    const History::Stats stats = history_.stats();
    return {{"steps", steps_},
            {"content_hash", fmt::format("{:016x}", content_hash(volume()))},
            {"history",
             {{"undo_steps", stats.undo_steps},
              {"redo_steps", stats.redo_steps},
              {"packed_steps", stats.packed_steps},
              {"spilled_steps", stats.spilled_steps},
              {"dropped_steps", stats.dropped_steps},
              {"memory_bytes", stats.memory_bytes},
              {"spilled_bytes", stats.spilled_bytes}}}};
}

std::string Replay::what_was_idle() const {
    if (idle_ == 0)
        return {};
    return fmt::format("{} of {} stroke{} changed no sample: {}", idle_, strokes_,
                       strokes_ == 1 ? "" : "s", first_idle_);
}

} // namespace palpate
