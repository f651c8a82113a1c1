#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/fd.h"
#include "engine/edit/document.h"
#include "engine/edit/stroke.h"

namespace palpate {

// A change of a document that is no stroke: what a filter or a segmentation made of it, say.
struct Change {
    std::string title;                // for people: "gaussian"
    Json parameters = Json::object(); // likewise; an object
    std::string packed;               // of pack_step()
    bool is_step = true;              // false: it is kept, and undo passes over it
    // A step back or forth beyond the journal's own steps: readers that have the step in their
    // history take it from there; for others it is a change like any other.
    enum class Move { none, back, forth } move = Move::none;
};

// One entry: a stroke, another change of the document (a filter's result, say), or a step back or
// forth.
struct JournalEntry {
    enum class Kind { stroke, undo, redo, change };
    Kind kind = Kind::stroke;
    Stroke stroke;             // of Kind::stroke
    std::string on = "volume"; // of it: the name of the volume it works on
    std::string guide;         // and of the one that Operation::needs_guide(); empty: none
    Change change;             // of Kind::change

    bool is_step() const { // that undo takes back
        return kind == Kind::stroke || (kind == Kind::change && change.is_step);
    }
    std::string text() const; // one entry as it is kept; equal texts are equal entries
};

// For people: "draw 3 on labels", "undo", the title of a change.
std::string title_of(const JournalEntry& entry);

// The entry of such a text. `name` is the file's, for messages.
Result<JournalEntry> parse_entry(std::string_view text, const std::string& name);

// The strokes of an edit on disk while it goes on, so that none is lost when the program ends
// without a word.
//
// Strokes and not voxels: doing them again gives the same bytes. Changes of other kinds are kept as
// packed differences (step.h), for what made them is not run again. The file begins with a line
// that says which volumes it belongs to, by the hash of their samples; each entry follows with its
// length and CRC-32, and is on the disk when append() returns. A write that was cut, or
// whose bytes are zeros after a loss of power, ends the journal at the entry before: readers stop
// there, and writers go on from there. They do so, too, where bytes have changed since they were
// written, for strokes stand on those before them; the whole is then kept under another name.
//
// A journal open for writing is locked (flock) until the process ends, in whatever way:
// no other process opens or discards it meanwhile. A file system without locks gives
// none.
class Journal {
 public:
    // The state that entries apply to: volumes by their samples, or (save above 0) the save-th save
    // of a project.
    struct Base {
        struct Entry {
            std::string name;
            uint64_t hash = 0; // content_hash()
            Grid grid;
        };
        std::vector<Entry> volumes;
        uint64_t save = 0;
    };
    static Base base_of(const Document& document);

    // A new one; fails where the file is there already or cannot be made.
    static Result<Journal> create(const std::filesystem::path& path, const Base& base);

    struct Damage {
        uint64_t at_byte = 0;          // where the first entry that has changed begins
        std::string what;              // expected and found
        size_t later = 0;              // entries behind it that are whole
        std::filesystem::path kept_as; // of open(): a copy of the journal as it was
    };
    struct Contents {
        std::vector<JournalEntry> entries; // before the damage, if there is any
        bool cut = false;                  // there was more, of an entry that never was whole
        std::optional<Damage> damage;      // also of many zeros, which may have been entries
    };

    // One that is there, to go on with, and what it holds. Refused where it belongs to other
    // volumes, where its first line is not a journal's (zeros, say, that were written over it), and
    // where what tells the volumes has changed: the file stays, and the error tells how many steps
    // in it could be read. A volume that it knows and that is not in `base` is missing only where
    // an entry names it.
    struct Found;
    static Result<Found> open(const std::filesystem::path& path, const Base& base);

    // Reads a journal without its volumes; changes nothing, needs no lock. Refused as open() does,
    // but for the volumes.
    static Result<Contents> peek(const std::filesystem::path& path);

    // Whether another has it open for writing; false, too, where it cannot be read.
    static bool is_running(const std::filesystem::path& path);
    // An error if another process has it open for writing.
    static Result<void> expect_ended(const std::filesystem::path& path);

    // Removes a journal that no process has open for writing.
    static Result<void> discard(const std::filesystem::path& path);

    // When this fails, a full disk say, the journal is what it was before, and may be tried again.
    Result<void> append(const JournalEntry& entry) { return append(std::span(&entry, 1)); }
    // All of them or, where this fails, none.
    Result<void> append(std::span<const JournalEntry> entries);

    // Removes the file, once its result is saved elsewhere.
    void remove();

 private:
    Journal(std::filesystem::path path, Fd fd) : path_(std::move(path)), fd_(std::move(fd)) {}
    Result<void> begin(const Base& base);
    Result<void> write_records(const std::string& records);

    std::filesystem::path path_;
    Fd fd_;
    uint64_t end_ = 0;  // of the last whole entry
    bool torn_ = false; // there is more behind it, which could not be taken away
};

struct Journal::Found : Contents {
    Journal journal;
};

} // namespace palpate
