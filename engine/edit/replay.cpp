#include "engine/edit/replay.h"

#include <algorithm>
#include <span>

#include "engine/edit/step.h"
#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

constexpr size_t kPosesAtOnce = 4096;

// The box that a tool may reach along its way.
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
    const Operation& operation = stroke.operation;
    if (samples == 0 && !operation.area.is_everywhere())
        return operation.only_values
                   ? "no sample of its area with a value of only_values is in its tool"
                   : "no sample of its area is in its tool";
    if (samples == 0 && operation.only_values)
        return "no sample with a value of only_values is in its tool";
    if (samples == 0)
        return operation.on_labels() || operation.spared.empty()
                   ? "no sample is in its tool"
                   : "no sample beside the locked labels is in its tool";
    return fmt::format("'{}' finds nothing to change in the {} samples within its tool",
                       name_of(stroke.operation.kind), samples);
}

Result<Volume> stroked(const Document& now, const JournalEntry& entry, uint64_t& samples_seen,
                       const std::stop_token& stop) {
    for (const std::string* name : {&entry.on, &entry.guide})
        if (!name->empty())
            PALPATE_TRY(expect_volume(now, *name));
    const Volume* guide = entry.guide.empty() ? nullptr : now.find(entry.guide);
    PALPATE_TRY(const auto run,
                StrokeRun::start(*now.find(entry.on), entry.stroke.tool, entry.stroke.operation,
                                 guide ? std::optional(*guide) : std::nullopt));
    // In portions, which change no byte, so that a long way is not laid out at once.
    const auto go_on = [&] { return !stop.stop_requested(); };
    for (std::span<const StrokePose> left(entry.stroke.poses); !left.empty();) {
        const size_t n = std::min(kPosesAtOnce, left.size());
        run->add(left.first(n));
        left = left.subspan(n);
        if (left.empty())
            run->lift();
        if (!run->work(go_on, stop))
            return fail("interrupted");
    }
    samples_seen = run->samples_seen();
    return run->publish();
}

} // namespace

JournalEntry JournalReach::entry(bool back, const Document& from, const Document& to) const {
    if ((back ? undos_ : redos_) > 0)
        return {.kind = back ? JournalEntry::Kind::undo : JournalEntry::Kind::redo};
    return {.kind = JournalEntry::Kind::change,
            .change = {back ? "undo" : "redo", Json::object(), pack_step(step_between(from, to)),
                       true, back ? Change::Move::back : Change::Move::forth}};
}

void JournalReach::moved(bool back, const JournalEntry& entry) {
    size_t& known = back ? undos_ : redos_;
    size_t& other = back ? redos_ : undos_;
    if (entry.kind != JournalEntry::Kind::change) {
        --known;
        ++other;
        return;
    }
    undos_ += !back;
    redos_ = 0; // a new entry ends what could be redone
}

Result<Replayed> replay(Document& now, History& history, const JournalEntry& entry,
                        const std::stop_token& stop) {
    using Kind = JournalEntry::Kind;
    Replayed replayed;
    if (entry.kind == Kind::undo || entry.kind == Kind::redo) {
        const bool back = entry.kind == Kind::undo;
        PALPATE_TRY(std::optional<Document> taken, back ? history.undo(now) : history.redo(now));
        if (!taken)
            return fail("expected a stroke to {}, found none left in the history",
                        back ? "undo" : "redo");
        now = std::move(*taken);
        return replayed;
    }
    Document next = now;
    if (entry.kind == Kind::change) {
        PALPATE_TRY(next, apply_packed_step(now, entry.change.packed, false));
        const bool back = entry.change.move == Change::Move::back;
        const History::Stats steps = history.stats();
        if (entry.change.move != Change::Move::none &&
            (back ? steps.undo_steps : steps.redo_steps) > 0) {
            PALPATE_TRY(std::optional<Document> taken,
                        back ? history.undo(now) : history.redo(now));
            if (step_between(*taken, next).empty()) {
                now = std::move(*taken);
                return replayed;
            }
            // Another step lies there: the history lacks the one that was meant.
            PALPATE_TRY(taken, back ? history.redo(*taken) : history.undo(*taken));
        }
    } else {
        PALPATE_TRY(const Volume after, stroked(now, entry, replayed.samples_seen, stop));
        if (const Volume& before = *now.find(entry.on); changed_bricks(before, after).empty())
            replayed.why_idle = why_idle(entry.stroke, before, replayed.samples_seen);
        for (NamedVolume& volume : next.volumes)
            if (volume.name == entry.on)
                volume.volume = after;
    }
    if (entry.is_step())
        history.record(now, next, title_of(entry));
    now = std::move(next);
    return replayed;
}

} // namespace palpate
