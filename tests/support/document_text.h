#pragma once

#include <fmt/format.h>

#include <string>

#include "engine/edit/document.h"
#include "engine/volume/content_hash.h"

namespace palpate {

// All that a document is, as text.
inline std::string all_of(const Document& document) {
    std::string text;
    for (const NamedVolume& v : document.volumes) {
        text += fmt::format("{} {} {} {:016x}", v.name, name_of(v.kind), name_of(v.volume.type()),
                            content_hash(v.volume));
        for (int i = 0; i < 16; ++i)
            text += fmt::format(" {}", v.volume.grid().world_from_index[i / 4][i % 4]);
        text += "\n";
    }
    for (const auto& [page, note] : document.notes.texts())
        if (note != "null") // a page that says nothing is as good as none
            text += page + " " + note + "\n";
    return text;
}

} // namespace palpate
