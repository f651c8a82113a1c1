#include "apps/palpate/edit_replay.h"

#include <cmath>

#include "engine/base/timer.h"
#include "engine/edit/replay.h"
#include "engine/measure/label_statistics.h"
#include "engine/volume/box.h"
#include "engine/volume/changes.h"
#include "engine/volume/content_hash.h"

namespace palpate {

namespace {

// Adds how many samples changed, and the volume of those that were material and are none after,
// and the other way round.
void add_changes(Json& to, const Volume& before, const Volume& after, double solid) {
    constexpr auto kCount = size_t{kBrickSide} * kBrickSide * kBrickSide;
    const glm::ivec3 side(kBrickSide);
    std::vector<float> was(kCount), is(kCount);
    uint64_t changed = 0, removed = 0, added = 0;
    for (const ChangedBrick& brick : changed_bricks(before, after)) {
        const glm::ivec3 first = glm::ivec3(brick.position) * side;
        const glm::ivec3 size = glm::min(side, glm::ivec3(after.size()) - first);
        const BoxStrides strides = packed(glm::uvec3(size));
        read_box(before, first, size, strides, was.data());
        read_box(after, first, size, strides, is.data());
        for (size_t i = 0; i < strides.plane * size_t(size.z); ++i) {
            // Samples without data are NaN before and after.
            changed += was[i] != is[i] && !(std::isnan(was[i]) && std::isnan(is[i]));
            const bool before_solid = was[i] >= solid, after_solid = is[i] >= solid;
            removed += before_solid && !after_solid;
            added += after_solid && !before_solid;
        }
    }
    const double each_mm3 = sample_mm3(after.grid());
    to["changed_samples"] = changed;
    to["removed_mm3"] = static_cast<double>(removed) * each_mm3;
    to["added_mm3"] = static_cast<double>(added) * each_mm3;
}

} // namespace

Replay::Replay(Document document, HistoryOptions history, double solid)
    : now_(std::move(document)),
      first_(now_.first()),
      history_(std::move(history)),
      solid_(solid) {}

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
    add_changes(line, before, volume(), solid_);
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
    Json report{{"steps", steps_}, {"solid", solid_}};
    add_changes(report, first_, volume(), solid_);
    report["content_hash"] = fmt::format("{:016x}", content_hash(volume()));
    report["history"] = {
        {"undo_steps", stats.undo_steps},       {"redo_steps", stats.redo_steps},
        {"packed_steps", stats.packed_steps},   {"spilled_steps", stats.spilled_steps},
        {"dropped_steps", stats.dropped_steps}, {"memory_bytes", stats.memory_bytes},
        {"spilled_bytes", stats.spilled_bytes}};
    return report;
}

std::string Replay::what_was_idle() const {
    if (idle_ == 0)
        return {};
    return fmt::format("{} of {} stroke{} changed no sample: {}", idle_, strokes_,
                       strokes_ == 1 ? "" : "s", first_idle_);
}

} // namespace palpate
