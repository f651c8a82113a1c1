// The part of a document's work that undoes and redoes steps.

#include <algorithm>

#include "apps/view/document/work.h"

namespace palpate::view {

void Work::step_back(bool is_undo) {
    size_t redo_steps = edited().redo_steps;
    const auto step = [&] { return is_undo ? session_.undo() : session_.redo(); };
    if (!step()) { // a long way back: the editor comes after
        session_.settle();
        redo_steps = edited().redo_steps;
        step();
    }
    stepping_ = {is_undo, redo_steps, session_.commands_given()};
    went_back_ = went_back_ || is_undo;
}

// Says which step was undone or redone, once all that was asked for is done. Moves of clip planes,
// for example, are no steps.
void Work::tell_step() {
    if (!stepping_)
        return;
    const EditState now = edited();
    if (now.commands_done < stepping_->command)
        return;
    const Stepping asked = *std::exchange(stepping_, std::nullopt);
    if (now.redo_steps == asked.redo_steps)
        return; // it was refused
    const std::vector<std::string> titles = session_.step_titles();
    const size_t step = now.undo_steps - (asked.is_undo ? 0 : 1);
    if (step < titles.size())
        message_ = fmt::format("{}: {}", asked.is_undo ? "undone" : "redone", titles[step]);
}

Work::Beside Work::beside() const {
    Beside now{loaded_.label_names, {}, {}};
    if (const auto& layer = session_.scene().labels)
        now.styles = layer->styles;
    now.strength = strength_;
    return now;
}

void Work::exchange_beside(Beside& other) {
    Beside now = beside();
    loaded_.label_names = other.names;
    Scene scene = session_.scene();
    if (scene.labels && scene.labels->styles != other.styles) {
        scene.labels->styles = other.styles;
        session_.show(std::move(scene));
    }
    if (strength_ && other.strength && strength_->owner.is_same_as(other.strength->owner))
        strength_ = other.strength; // of one run, by another bound
    other = std::move(now);
}

void Work::keep_beside(Beside before, std::string title) {
    steps_beside_.push_back(
        {session_.commands_given(), std::move(title), {}, true, std::move(before)});
}

void Work::follow_beside() {
    const EditState now = edited();
    const std::array<uint64_t, 3> at{now.commands_done, now.undo_steps, now.redo_steps};
    if (steps_beside_.empty() || std::exchange(beside_at_, at) == at)
        return;
    const std::vector<std::string> titles = session_.step_titles();
    const auto is_done = [&](const StepBeside& one) { return *one.step <= now.undo_steps; };
    for (StepBeside& one : steps_beside_) { // the newest step of its title, which may be undone
        if (one.step || now.commands_done < one.command)
            continue;
        for (size_t step = std::min(now.undo_steps, titles.size()); step > 0 && !one.step; --step)
            if (titles[step - 1] == one.title)
                one.step = step;
        for (size_t step = now.undo_steps + 1; step <= titles.size() && !one.step; ++step)
            if (titles[step - 1] == one.title)
                one.step = step;
    }
    for (size_t i = steps_beside_.size(); i-- > 0;) {
        StepBeside& one = steps_beside_[i];
        if (now.commands_done < one.command)
            continue;
        const bool is_there =
            one.step && *one.step <= titles.size() && titles[*one.step - 1] == one.title;
        // Another step is in its place: it was undone, and a new one came, or it was refused.
        const bool was_undone = !is_there && (went_back_ || !one.step);
        if (one.is_done && (was_undone || (is_there && !is_done(one)))) {
            exchange_beside(one.other);
            one.is_done = false;
        }
        if (!is_there)
            steps_beside_.erase(steps_beside_.begin() + static_cast<ptrdiff_t>(i));
    }
    for (StepBeside& one : steps_beside_)
        if (one.step && !one.is_done && is_done(one)) {
            exchange_beside(one.other);
            one.is_done = true;
        }
    went_back_ = stepping_ && stepping_->is_undo;
}

} // namespace palpate::view
