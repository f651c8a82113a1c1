#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json_value.h"
#include "engine/edit/note_pages.h"
#include "engine/volume/volume.h"

namespace palpate {

// The meaning of a volume's samples.
enum class VolumeKind : uint8_t { grey, labels, other };
const char* name_of(VolumeKind kind); // "grey", "labels" or "other"
VolumeKind read_volume_kind(const JsonValue& in);

struct NamedVolume {
    std::string name; // see check_volume_name()
    VolumeKind kind = VolumeKind::grey;
    Volume volume;
};

// All that one person works on, and can undo: volumes, one at least, of different names, each on a
// grid of its own, and notes. A value, as a Volume is: copying it shares all samples, and each
// volume in it has its version.
struct Document {
    std::vector<NamedVolume> volumes;
    NotePages notes;

    // A document of one volume, named "volume".
    Document(Volume volume, VolumeKind kind = VolumeKind::grey); // NOLINT: as one value

    const Volume* find(std::string_view name) const; // null where there is none
    const Volume& first() const { return volumes.front().volume; }

    // Two handles of the same snapshots, with equal notes.
    bool is_same_as(const Document& other) const;
};

// Refused: no volume, names that check_volume_name() refuses, two volumes of one name.
Result<Document> make_document(std::vector<NamedVolume> volumes);

// The document with this volume in the place of the one of its name, or behind all others.
Document with_volume(Document document, NamedVolume volume);

// 1 to 64 letters, digits, '-', '_' and '.', of which '.' is not the first: names are parts of
// file names, too.
Result<void> check_volume_name(std::string_view name);

// An error that lists the names, where the document has none of this.
Result<void> expect_volume(const Document& document, std::string_view name);

} // namespace palpate
