#include "engine/edit/note_pages.h"

#include <utility>

namespace palpate {

NotePages::NotePages(Texts texts) {
    std::erase_if(texts, [](const auto& page) { return page.second.empty(); });
    if (!texts.empty())
        texts_ = std::make_shared<const Texts>(std::move(texts));
}

const NotePages::Texts& NotePages::texts() const {
    static const Texts none;
    return texts_ ? *texts_ : none;
}

NotePages NotePages::with(const Texts& changes) const {
    Texts next = texts();
    for (const auto& [page, text] : changes)
        next[page] = text;
    NotePages made(std::move(next));
    return made == *this ? *this : made;
}

NotePages::Texts changes_between(const NotePages& before, const NotePages& after) {
    NotePages::Texts changes;
    for (const auto& [page, text] : before.texts())
        if (!after.texts().contains(page))
            changes[page] = "";
    for (const auto& [page, text] : after.texts())
        if (const auto was = before.texts().find(page);
            was == before.texts().end() || was->second != text)
            changes[page] = text;
    return changes;
}

} // namespace palpate
