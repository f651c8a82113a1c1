#include "apps/palpate/edit_replay.h"

#include <algorithm>

#include "engine/base/timer.h"
#include "engine/edit/replay.h"
#include "engine/volume/changes.h"
#include "engine/volume/content_hash.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

// Where a tool may reach along its way.
WorldBox box_of(const Stroke& stroke) {
    WorldBox box{stroke.poses.front().tool.position_mm, stroke.poses.front().tool.position_mm};
    for (const StrokePose& pose : stroke.poses) {
        box.low = glm::min(box.low, pose.tool.position_mm);
        box.high = glm::max(box.high, pose.tool.position_mm);
    }
    double reach = 0.0; // of a point
    if (const ShapePtr& shape = stroke.tool.shape)
        reach = shape->ball_radius_mm().value_or(shape->bounds().reach_mm());
    return {box.low - reach, box.high + reach};
}

std::string why_idle(const Stroke& stroke, const Volume& volume, uint64_t samples) {
    const WorldBox way = box_of(stroke);
    std::vector<HalfSpace> both = half_spaces(volume.grid(), 0.5); // a point marks its cell
    const std::vector<HalfSpace> along = half_spaces(way);
    both.insert(both.end(), along.begin(), along.end());
    if (!have_common_point(both, slack_mm(volume.grid())))
        return fmt::format("its tool stays within {}, and the volume lies elsewhere, within {}",
                           text_of(way), text_of(world_box(volume.grid())));
    if (samples == 0)
        return stroke.operation.only_values ? "no sample with a value of only_values is in its tool"
                                            : "no sample is in its tool";
    return fmt::format("'{}' finds nothing to change in the {} samples within its tool",
                       name_of(stroke.operation.kind), samples);
}

} // namespace

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
            first_idle_ = fmt::format("of stroke {}, {}", strokes_,
                                      why_idle(entry.stroke, before, done.samples_seen));
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
