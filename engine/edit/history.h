#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/edit/document.h"

namespace palpate {

struct HistoryOptions {
    uint64_t memory_bytes = uint64_t{512} << 20;
    // Steps that no longer fit go to this folder; empty: the oldest are dropped.
    std::filesystem::path spill_folder;
    // Called with a sentence, once each: when steps begin to be dropped, when spilling fails, and
    // when a step cannot be packed. From the thread that calls record().
    std::function<void(const std::string&)> notice;
};

// Steps back and forth between states of a document: strokes, volumes that come, go or are
// replaced, and notes.
//
// A step (step.h) holds the bricks that an edit replaced, with their positions; never a table, and
// never bricks that snapshots share. In the background it becomes the packed difference of its
// changed 8x8x8 blocks. When all steps together need more than memory_bytes, the oldest are moved
// to a file, or dropped.
//
// One thread calls this; a worker of its own packs. A step is exact: undo gives the same samples,
// in volumes with new versions (of a step that changed nothing, in those that are there).
class History {
 public:
    explicit History(HistoryOptions options = {});
    ~History();
    History(const History&) = delete;
    History& operator=(const History&) = delete;

    // After an edit from `before`, the present, to `after`. Steps that could be redone are
    // gone. An edit without changes is a step as well, so that N steps of undo are N
    // edits. `title` is for people.
    void record(const Document& before, const Document& after, std::string title = {});

    // record() in two halves: begin() may throw, and changes nothing that can be undone or redone;
    // end() records what was begun.
    void begin(const Document& before, const Document& after, std::string title = {});
    void end();

    // The document before the newest step, or after the one undone last; nothing where there is
    // none. `now` is the present. An error where a spilled step cannot be read back: the step
    // stays.
    Result<std::optional<Document>> undo(const Document& now);
    Result<std::optional<Document>> redo(const Document& now);
    // undo() or redo() in two halves: look() gives the document and leaves the step where it is;
    // move() takes the step that was looked at.
    Result<std::optional<Document>> look(const Document& now, bool back);
    void move(bool back);

    // A step that can be undone, as it may be kept elsewhere.
    struct PackedStep {
        std::string title;
        std::string packed; // of pack_step()
    };
    // The newest of those that can be undone, the oldest of them first: as many as take at most so
    // many bytes when they are packed, and lie in memory. Any thread; packs what is not packed yet.
    std::vector<PackedStep> newest(uint64_t most_bytes) const;
    // A step before all others that can be undone, for a history that goes on from newest().
    void add_before(PackedStep step);

    // Steps that could be redone are gone: what was undone had to be taken back.
    void forget_redo();

    struct Stats {
        size_t undo_steps = 0, redo_steps = 0;
        size_t packed_steps = 0, spilled_steps = 0;
        size_t dropped_steps = 0;   // in all
        uint64_t memory_bytes = 0;  // of all steps
        uint64_t spilled_bytes = 0; // on disk
        uint64_t newest_bytes = 0;  // of the newest step that can be undone
    };
    Stats stats() const;
    // The titles of all steps, the oldest first; those that can be redone come last. Any thread.
    std::vector<std::string> titles() const;

    // Waits until all steps are packed.
    void settle();

 private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace palpate
