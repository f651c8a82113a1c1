// The part of a document's work that undoes and redoes steps.

#include <algorithm>

#include "apps/view/document/work.h"

namespace palpate::view {

void Work::step_back(bool is_undo) {
    size_t redo_steps = edited().redo_steps;
    const auto step = [&] { return is_undo ? session().undo() : session().redo(); };
    if (!step()) { // a long way back: the editor comes after
        session().settle();
        redo_steps = edited().redo_steps;
        step();
    }
    stepping_ = {is_undo, redo_steps, session().commands_given()};
    notes().expect_change();
}

// Says which step was undone or redone, once all that was asked for is done.
void Work::tell_step() {
    if (!stepping_)
        return;
    const EditState now = edited();
    if (now.commands_done < stepping_->command)
        return;
    const Stepping asked = *std::exchange(stepping_, std::nullopt);
    if (now.redo_steps == asked.redo_steps)
        return; // it was refused
    const std::vector<std::string> titles = session().step_titles();
    const size_t step = now.undo_steps - (asked.is_undo ? 0 : 1);
    if (step < titles.size())
        message_ = fmt::format("{}: {}", asked.is_undo ? "undone" : "redone", titles[step]);
}

void Work::follow_notes(ViewState& state, bool is_busy) {
    const std::optional<Notes::Bound> before = notes().known().bound;
    notes().follow(state, is_busy || widget_down_);
    if (notes().known().bound != before)
        follow_bound(notes().known().bound);
}

void Work::follow_bound(const std::optional<Notes::Bound>& bound) {
    if (strength_ && bound && strength_->id == bound->strength && strength_->bound == bound->value)
        return;
    strength_.reset();
    for (const Strength& one : strengths_) {
        if (!bound || one.id != bound->strength || one.method->name != bound->method)
            continue;
        strength_ = one;
        if (one.bound == bound->value) // else of the same run, bounded anew since then
            break;
        strength_->bound = bound->value;
    }
}

void Work::keep_strength() {
    constexpr size_t kMost = 4; // each is as large as the volume
    std::erase_if(strengths_, [&](const Strength& one) {
        return one.id == strength_->id && one.is_unbounded == strength_->is_unbounded;
    });
    strengths_.push_back(*strength_);
    if (strengths_.size() > kMost)
        strengths_.pop_front();
}

} // namespace palpate::view
