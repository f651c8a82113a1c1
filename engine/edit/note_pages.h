#pragma once

#include <map>
#include <memory>
#include <string>

namespace palpate {

// The notes of a person beside the volumes of a document: texts by the names of their pages, none
// of them empty. An immutable value whose copies share all texts. Editors and journals carry pages
// and know nothing of their meaning (engine/session/notes.h).
class NotePages {
 public:
    using Texts = std::map<std::string, std::string>; // by page

    NotePages() = default;
    explicit NotePages(Texts texts);

    const Texts& texts() const;
    // The same but for these pages. An empty text takes its page away.
    NotePages with(const Texts& changes) const;

    friend bool operator==(const NotePages& a, const NotePages& b) {
        return a.texts_ == b.texts_ || a.texts() == b.texts();
    }

 private:
    std::shared_ptr<const Texts> texts_; // null: none
};

// The changes by which with() leads from one value to another.
NotePages::Texts changes_between(const NotePages& before, const NotePages& after);

} // namespace palpate
