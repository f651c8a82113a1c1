#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "engine/base/mailbox.h"
#include "engine/base/ring.h"
#include "engine/edit/history.h"
#include "engine/edit/journal.h"
#include "engine/edit/stroke_run.h"

namespace palpate {

// What the hand does: one entry a tick while the tool is down.
struct EditInput {
    enum class Kind : uint8_t { down, move, up };
    Kind kind = Kind::move;
    ToolPose pose;
    uint64_t number = 0;   // of this input; rises by one
    int64_t pushed_ns = 0; // profile::now_ns() when it was pushed: latencies count from here
};

// What everybody else sees of an edit.
struct EditState {
    Volume volume;
    uint64_t inputs_done = 0;    // the number of the last input that `volume` has whole
    int64_t newest_input_ns = 0; // when that was pushed
    int64_t published_ns = 0;
    uint64_t snapshot = 0;   // how many were published before this
    size_t strokes_done = 0; // and not undone
    size_t undo_steps = 0, redo_steps = 0;
    // Why the last stroke, undo or redo did nothing, or passed over a pose; else empty. A stroke
    // that met samples which cannot be read is taken back whole.
    std::string refusal;
};

struct EditorOptions {
    size_t ring_inputs = 4096; // four seconds of a hand at 1 kHz
    double slice_ms = 4.0;     // between two snapshots of work that takes long
    HistoryOptions history;
    // Each stroke, undo and redo is on disk before it counts as done. One that cannot be written,
    // to a full disk say, is taken back and told; the next is tried anew. So what is published
    // between strokes is what the journal gives, whatever happens.
    std::optional<Journal> journal;
};

// The one writer of a volume: a thread that turns poses into snapshots.
//
// Poses come through a ring from one thread, the servo, which waits for nothing; a full ring
// refuses, and the sweep to the next accepted pose leaves no gap. A pose that is none (a zero
// quaternion, a number that is not finite) is passed over in the same way and told; at tool-down it
// refuses the stroke. Commands come through a second
// ring from one other thread, the frame's. Snapshots leave through a wait-free mailbox. The editor
// empties the ring at least once a slice, whatever it is doing, and publishes between slices: a
// stroke that takes long appears piece by piece. What it publishes at the end of each stroke is
// what apply_stroke() gives.
class Editor {
 public:
    using Readers = Mailbox<EditState>;

    Editor(Volume volume, std::optional<Volume> guide, EditorOptions options = {});
    ~Editor(); // ends the thread; what has been pushed and not done is dropped
    Editor(const Editor&) = delete;
    Editor& operator=(const Editor&) = delete;

    // The servo's thread; wait-free. False: full, and nothing happened.
    bool push(const EditInput& input) noexcept;

    // One other thread; never waits. Takes effect between strokes, in order: after the inputs that
    // were pushed before the call, and the stroke they leave under way. False: full.
    bool use(Json shape, Tool tool, Operation operation); // for strokes that begin later
    bool undo() { return command(Command::Kind::undo, nullptr); }
    bool redo() { return command(Command::Kind::redo, nullptr); }

    // For one reading thread each: before that thread starts, at most 16 in all.
    Readers::Reader add_reader() { return states_.add_reader(); }

    // The newest input popped from the ring, by number; for tests and status lines.
    uint64_t inputs_taken() const { return taken_.load(std::memory_order_acquire); }

 private:
    struct Setup {
        Json shape;
        Tool tool;
        Operation operation;
    };
    struct Command { // trivially destructible, as rings want: owns `setup` all the same
        enum class Kind : uint8_t { use, undo, redo };
        Kind kind = Kind::use;
        Setup* setup = nullptr;
        uint64_t after = 0; // how many inputs had been pushed
    };
    bool command(Command::Kind kind, Setup* setup);
    void run(const std::stop_token& stop);
    bool go_on(const std::stop_token& stop); // false: there was nothing to do
    void drop_stroke(const char* why);
    bool take_inputs();
    bool begin_next();      // the next stroke or command, where none is under way
    bool do_commands();     // those whose turn it is
    EditInput next_input(); // of waiting_
    void feed();            // poses that have come for the stroke under way
    void finish_stroke();
    void step(bool back);
    bool keep(JournalEntry entry); // in the journal, if there is one; false: refused
    void publish(const Volume& volume);

    Volume now_;
    std::optional<Volume> guide_;
    EditorOptions options_;
    History history_;
    Ring<EditInput> inputs_;
    Ring<Command> commands_{64};
    Mailbox<EditState> states_;
    std::atomic<uint64_t> pushed_{0}; // how many inputs the ring took
    std::atomic<uint64_t> taken_{0};

    // The thread's own.
    std::unique_ptr<Setup> setup_;
    std::optional<Command> command_; // the next
    std::deque<EditInput> waiting_;
    uint64_t fed_ = 0; // how many inputs have left waiting_
    std::unique_ptr<StrokeRun> stroke_;
    std::vector<ToolPose> poses_; // of it
    bool lifted_ = false;
    EditInput last_fed_, last_done_;
    uint64_t published_ = 0;
    size_t strokes_done_ = 0;
    std::string refusal_;
    std::jthread thread_; // last: ends before the rest goes
};

} // namespace palpate
