#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/edit/document.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"

namespace palpate {

// The bricks that an edit replaced, before and after, shared with their snapshots.
struct ReplacedBrick {
    ChangedBrick where;
    BrickPtr before, after;
};

// Reads no sample that the snapshots share; where others cannot be read, bricks count as changed.
std::vector<ReplacedBrick> replaced_bricks(const Volume& before, const Volume& after);

// A later snapshot than `after` that holds what `before`, the one it comes from, held. Reads no
// sample.
Volume taken_back(const Volume& before, const Volume& after);

// The part of a step that changed one volume. A volume that came or went is told by how it
// differs from zeros; one whose grid, type or kind changed went, and came.
struct VolumeStep {
    enum class Kind : uint8_t { changed, came, went };
    struct Frame { // of a volume that came or went
        VolumeKind kind = VolumeKind::grey;
        Grid grid;
        size_t place = 0; // in the list of volumes
    };
    Kind kind = Kind::changed;
    std::string name;
    ScalarType type{};
    Frame frame;
    std::vector<ReplacedBrick> bricks;
};
// The difference of two documents: empty where they hold the same samples and the same notes.
struct Step {
    std::vector<VolumeStep> volumes;            // in the order in which they are done
    NotePages::Texts notes_before, notes_after; // of the pages that differ: NotePages::with()

    bool empty() const { return volumes.empty() && notes_after.empty(); }
};

Step step_between(const Document& before, const Document& after);

// `now`, one side of the step, becomes the other: back is from after to before. Reads no sample.
Result<Document> apply_step(const Document& now, const Step& step, bool back);

// The differences of both sides, bit by bit (exclusive or) in blocks of 8x8x8, packed by zstd: they
// lead from either side to the other. A line of JSON that names the volumes, then the bytes of
// each: a list of the volumes, or, where notes differ, an object that has the list and both sides
// of the notes. Empty where memory ran out.
std::string pack_step(const Step& step);

// The same as apply_step(). Fails where the bytes are not those of pack_step(), or of a step that
// has another document on this side. Notes are set, whatever they were.
Result<Document> apply_packed_step(const Document& now, std::string_view packed, bool back);

} // namespace palpate
