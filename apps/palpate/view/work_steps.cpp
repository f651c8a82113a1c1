// The part of a document's work that undoes and redoes steps.

#include "apps/palpate/view/work.h"

namespace palpate::view {

void Work::step_back(bool is_undo) {
    const EditState now = edited();
    const bool is_idle = now.inputs_done == session_.inputs_given();
    if (!is_idle || (is_undo ? now.undo_steps : now.redo_steps) > 0) // else it is refused
        stepping_ = {is_undo, now.redo_steps};
    const auto step = [&] { return is_undo ? session_.undo() : session_.redo(); };
    if (!step()) { // a long way back: the editor comes after
        session_.settle();
        step();
    }
}

// Which step has been undone or redone: of what is no step, as a move of a clip plane, the one
// before it is.
void Work::tell_step() {
    if (!stepping_)
        return;
    const EditState now = edited();
    if (now.redo_steps == stepping_->redo_steps)
        return;
    const auto [is_undo, before] = *std::exchange(stepping_, std::nullopt);
    if ((now.redo_steps > before) != is_undo)
        return; // a new step has come
    const std::vector<std::string> titles = session_.step_titles();
    const size_t step = now.undo_steps - (is_undo ? 0 : 1);
    if (step < titles.size())
        message_ = fmt::format("{}: {}", is_undo ? "undone" : "redone", titles[step]);
}

} // namespace palpate::view
