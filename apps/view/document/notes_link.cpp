#include "apps/view/document/notes_link.h"

#include <algorithm>

namespace palpate::view {

namespace {

constexpr const char* kWindow = "window"; // is kept, and no step

// Names a change, by the first page that it sets.
const char* title_of(const NotePages::Texts& changes) {
    constexpr std::pair<const char*, const char*> titles[] = {
        {"measures", "measures"},         {"clip_planes", "clip planes"},
        {"label_names", "label names"},   {"label_styles", "looks of labels"},
        {"locked_labels", "label locks"}, {"bound", "bound"}};
    for (const auto& [page, title] : titles)
        if (changes.contains(page))
            return title;
    return "notes";
}

// Whether nothing but what is seen of labels changes: looking at one after the other is one step.
bool changes_sight_alone(const Notes& before, const Notes& after) {
    const auto is_as_before = [&](const auto& styled) {
        LabelStyle was = style_of(before, styled.first), is = style_of(after, styled.first);
        was.visible = is.visible;
        return was == is;
    };
    Notes same = before;
    same.window = after.window;
    same.label_styles = after.label_styles;
    return same == after && before.label_styles != after.label_styles &&
           std::ranges::all_of(before.label_styles, is_as_before) &&
           std::ranges::all_of(after.label_styles, is_as_before);
}

// A thing that a hand has chosen may be gone.
void forget_absent(ViewState& state) {
    Measuring& measuring = state.measuring;
    if (measuring.selected && *measuring.selected >= state.notes.measures.size())
        measuring.selected = measuring.held = std::nullopt;
    Clipping& clipping = state.clipping;
    if (clipping.selected && *clipping.selected >= state.notes.clip_planes.size())
        clipping.selected = clipping.held = std::nullopt;
}

} // namespace

NotesLink::NotesLink(Session& session)
    : session_(&session),
      pages_(session.state().document.notes),
      known_(notes_of(pages_).value_or(Notes())) {}

void NotesLink::follow(ViewState& state, bool is_busy) {
    const EditState now = session_->state();
    state.notes.window = {state.window.low, state.window.high, state.window_inverted};
    if (now.commands_done >= command_ && now.document.notes != pages_) {
        const NotePages::Texts own =
            state.notes == known_ ? NotePages::Texts() : changes_to(state.notes);
        pages_ = now.document.notes;
        known_ = notes_of(pages_).value_or(known_); // one that this program wrote
        state.notes = notes_of(pages_.with(own)).value_or(known_);
        forget_absent(state);
    }
    if (!is_busy)
        keep(state.notes);
}

void NotesLink::keep(const Notes& notes) {
    if (notes == known_)
        return;
    NotePages::Texts steps = changes_to(notes), others;
    if (auto window = steps.extract(kWindow))
        others.insert(std::move(window));
    const bool joins = changes_sight_alone(known_, notes);
    for (const auto& [pages, is_step] : {std::pair(&others, false), {&steps, true}}) {
        if (pages->empty())
            continue;
        const char* const title = joins && is_step ? "labels shown or hidden" : title_of(*pages);
        if (!session_->note(*pages, title, is_step, joins))
            return; // too many commands at once: with one of the next frames
        pages_ = pages_.with(*pages);
        command_ = session_->commands_given();
    }
    known_ = notes;
}

NotePages::Texts NotesLink::changes_to(const Notes& notes) const {
    return changes_between(pages_, pages_of(notes));
}

void NotesLink::expect_change() {
    command_ = session_->commands_given();
}

} // namespace palpate::view
