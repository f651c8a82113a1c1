#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/json_value.h"
#include "engine/edit/note_pages.h"
#include "engine/io/label_names.h"
#include "engine/measure/measure.h"
#include "engine/scene/scene.h"

namespace palpate {

// The notes of a person about the volumes of a document, undone with them. A value.
//
// A document holds it as pages (engine/edit/note_pages.h): one a member, whose text is JSON.
struct Notes {
    // The bound of the objects that a segmentation found last.
    struct Bound {
        std::string method;
        std::string strength; // a hash of the volume that is bounded
        double value = 0.0;

        friend bool operator==(const Bound&, const Bound&) = default;
    };
    // Values shown as black and as white in slices.
    struct Window {
        double low = 0.0, high = 1.0; // low < high
        bool is_inverted = false;

        friend bool operator==(const Window&, const Window&) = default;
    };

    std::vector<LabelName> label_names;          // as files gave them or a person typed them
    std::map<uint32_t, LabelStyle> label_styles; // of labels that have one of their own
    std::vector<uint16_t> locked_labels;         // that no tool changes; ascending
    std::vector<Measure> measures;
    std::vector<ClipPlane> clip_planes; // normals of unit length
    std::optional<Bound> bound;
    std::optional<Window> window;

    friend bool operator==(const Notes&, const Notes&) = default;
};

// Its members under their names; those that are absent or empty are null.
Json notes_json(const Notes& notes);
// Reads it from an object that may have other members.
Notes read_notes(const JsonValue& in);

// All pages; those of what is absent or empty say "null".
NotePages pages_of(const Notes& notes);
// An error names the page, what was expected and what was found.
Result<Notes> notes_of(const NotePages& pages);

// The style of a label: its own, or the generated one.
LabelStyle style_of(const Notes& notes, uint32_t label);
// A label that gets the generated style has none of its own.
void set_style(Notes& notes, uint32_t label, const LabelStyle& style);
// The names of labels that have one, or a colour: a label of this name has it from then on. An
// empty name takes away an entry without a colour.
void name_label(Notes& notes, uint32_t label, const std::string& name);
std::string name_of_label(const Notes& notes, uint32_t label); // "kidney", or ""
std::string numbered_name(const Notes& notes, uint32_t label); // "7", or "7 kidney"

// Clip planes and styles of labels that a scene has, as notes; and back.
void take_from_scene(Notes& notes, const Scene& scene);
void show_in_scene(const Notes& notes, Scene& scene);
// The same where only some pages may be known: the others are the scene's.
Result<NotePages> with_notes_of_scene(const NotePages& pages, const Scene& scene);
Result<void> show_pages(const NotePages& pages, Scene& scene);

} // namespace palpate
