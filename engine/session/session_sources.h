#pragma once

#include <optional>
#include <string>

#include "engine/edit/document.h"
#include "haptics/field/algorithm.h"

namespace palpate {

// The volumes of a document that are seen and felt, and all that is felt beside them.
struct SessionSources {
    std::string grey, labels;  // names of volumes; empty or not in the document: none
    haptics::TouchScene touch; // a field, a mesh, a tool; its grey and labels are not used
    // Seen and not felt: more labels of the document, and grey values that are no part of it.
    std::string overlay{};
    std::optional<Volume> fused{};
};

// Nothing where the name is empty, or not in the document.
inline std::optional<Volume> volume_of(const Document& document, const std::string& name) {
    const Volume* found = name.empty() ? nullptr : document.find(name);
    return found ? std::optional(*found) : std::nullopt;
}

} // namespace palpate
