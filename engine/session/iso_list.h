#pragma once

#include <string>
#include <vector>

#include "engine/base/json_value.h"
#include "engine/scene/scene.h"

namespace palpate {

// An iso-surface of the 3D view, as a person lists it.
struct ListedIso {
    IsoSurface surface;
    std::string name{}; // "bone"; may be empty
    bool shown = true;

    friend bool operator==(const ListedIso&, const ListedIso&) = default;
};

// The list of a view, in the order in which a person made it, each of its own value. What is shown
// are the iso-surfaces of the scene's rays (RayCastLayer::isos); the list has the others and all
// names. At least one is shown.
using IsoList = std::vector<ListedIso>;
constexpr size_t kMostListed = 24; // shown or not; of those that are shown kMaxIsos at most

// As JSON, and back. A list that cannot be is an error of `in`.
Json iso_list_json(const IsoList& list);
IsoList read_iso_list(const JsonValue& in);

// The list after the scene's surfaces were changed elsewhere. What is shown takes the scene's
// values, colours and opacities: by equal values first, then, where as many are left on both sides,
// in order; names stay with their surfaces. Surfaces that are new to the list come last.
IsoList followed(IsoList list, const std::vector<IsoSurface>& seen);

// The surfaces that are shown, in rising values. Empty where none is.
std::vector<IsoSurface> shown_surfaces(const IsoList& list);

bool is_listed(const IsoList& list, double value);

// Adds a surface; its value becomes the next double where one of that value is listed.
// Not shown where as many are shown as can be. False: the list is full.
bool add_iso(IsoList& list, ListedIso one);

} // namespace palpate
