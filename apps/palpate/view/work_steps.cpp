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

} // namespace palpate::view
