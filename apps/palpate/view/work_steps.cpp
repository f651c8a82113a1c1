// The part of a document's work that undoes and redoes steps.

#include "apps/palpate/view/work.h"

namespace palpate::view {

void Work::step_back(bool is_undo) {
    const auto step = [&] { return is_undo ? session_.undo() : session_.redo(); };
    if (!step()) { // a long way back: the editor comes after
        session_.settle();
        step();
    }
    const EditState now = edited();
    stepping_ = {is_undo, now.redo_steps, session_.commands_given()};
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
    if (strength_)
        now.bound = strength_->bound, now.is_unbounded = strength_->is_unbounded;
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
    if (strength_ && other.bound)
        strength_->bound = *other.bound, strength_->is_unbounded = other.is_unbounded;
    other = std::move(now);
}

void Work::keep_beside(Beside before, std::string title) {
    const size_t step = edited().undo_steps + 1;
    std::erase_if(steps_beside_, [&](const StepBeside& one) { return one.step >= step; });
    steps_beside_.push_back(
        {step, session_.commands_given(), std::move(title), true, std::move(before)});
}

void Work::follow_beside() {
    if (steps_beside_.empty())
        return;
    const EditState now = edited();
    const std::vector<std::string> titles = session_.step_titles();
    std::erase_if(steps_beside_, [&](const StepBeside& one) { // another step is in its place
        return now.commands_done >= one.command &&
               (one.step > titles.size() || titles[one.step - 1] != one.title);
    });
    const auto go_over = [&](StepBeside& one, bool to) {
        if (now.commands_done < one.command || one.is_done == to ||
            (now.undo_steps >= one.step) != to)
            return;
        exchange_beside(one.other);
        one.is_done = to;
    };
    for (auto one = steps_beside_.rbegin(); one != steps_beside_.rend(); ++one)
        go_over(*one, false);
    for (StepBeside& one : steps_beside_)
        go_over(one, true);
}

} // namespace palpate::view
