#include "engine/edit/replay.h"

#include <algorithm>
#include <span>

#include "engine/edit/step.h"
#include "engine/edit/stroke_run.h"

namespace palpate {

namespace {

constexpr size_t kPosesAtOnce = 4096;

Result<Volume> stroked(const Document& now, const JournalEntry& entry, uint64_t& samples_seen,
                       const std::stop_token& stop) {
    for (const std::string* name : {&entry.on, &entry.guide})
        if (!name->empty())
            if (Result<void> there = expect_volume(now, *name); !there)
                return pass_on(there);
    const Volume* guide = entry.guide.empty() ? nullptr : now.find(entry.guide);
    auto run = StrokeRun::start(*now.find(entry.on), entry.stroke.tool, entry.stroke.operation,
                                guide ? std::optional(*guide) : std::nullopt);
    if (!run)
        return pass_on(run);
    // In portions, which change no byte, so that a long way is not laid out at once.
    const auto go_on = [&] { return !stop.stop_requested(); };
    for (std::span<const StrokePose> left(entry.stroke.poses); !left.empty();) {
        const size_t n = std::min(kPosesAtOnce, left.size());
        (*run)->add(left.first(n));
        left = left.subspan(n);
        if (left.empty())
            (*run)->lift();
        if (!(*run)->work(go_on, stop))
            return fail("interrupted");
    }
    samples_seen = (*run)->samples_seen();
    return (*run)->publish();
}

} // namespace

Result<Replayed> replay(Document& now, History& history, const JournalEntry& entry,
                        const std::stop_token& stop) {
    using Kind = JournalEntry::Kind;
    Replayed replayed;
    if (entry.kind == Kind::undo || entry.kind == Kind::redo) {
        const bool back = entry.kind == Kind::undo;
        Result<std::optional<Document>> taken = back ? history.undo(now) : history.redo(now);
        if (!taken)
            return pass_on(taken);
        if (!*taken)
            return fail("expected a stroke to {}, found none left in the history",
                        back ? "undo" : "redo");
        now = std::move(**taken);
        return replayed;
    }
    Document next = now;
    if (entry.kind == Kind::change) {
        Result<Document> changed = apply_packed_step(now, entry.change.packed, false);
        if (!changed)
            return pass_on(changed);
        next = std::move(*changed);
    } else {
        Result<Volume> after = stroked(now, entry, replayed.samples_seen, stop);
        if (!after)
            return pass_on(after);
        for (NamedVolume& volume : next.volumes)
            if (volume.name == entry.on)
                volume.volume = *after;
    }
    history.record(now, next);
    now = std::move(next);
    return replayed;
}

} // namespace palpate
