#pragma once

#include <cstdint>

#include "apps/view/window/state.h"
#include "engine/session/session.h"

namespace palpate::view {

// The notes of a state and those of its document, kept the same. What a person changes becomes a
// step of the document, and what undo and redo change there is shown.
class NotesLink {
 public:
    explicit NotesLink(Session& session); // whose document has all pages of the notes

    // For each frame. Takes what the document has, then keeps what a person has changed; not while
    // they are at it, in the middle of a drag or of a word.
    void follow(ViewState& state, bool is_busy);
    // Keeps what a person has changed, now.
    void keep(const Notes& notes);
    // Pages that a step changes, for Session::put().
    NotePages::Texts changes_to(const Notes& notes) const;
    // After a command of another changed notes.
    void expect_change();

    // The document's, as they were last seen or kept.
    const Notes& known() const { return known_; }

 private:
    Session* session_;
    NotePages pages_; // known_ as the document has it
    Notes known_;
    uint64_t command_ = 0; // the last that changed notes
};

} // namespace palpate::view
