#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "engine/base/mailbox.h"
#include "engine/base/ring.h"
#include "engine/base/wake.h"
#include "engine/edit/history.h"
#include "engine/edit/journal.h"
#include "engine/edit/replay.h"
#include "engine/edit/spared.h"
#include "engine/edit/stroke_run.h"

namespace palpate {

// Input of the hand: one entry a tick while the tool is down.
struct EditInput {
    enum class Kind : uint8_t { down, move, up };
    Kind kind = Kind::move;
    StrokePose pose;
    uint64_t number = 0;   // of this input; rises by one
    int64_t pushed_ns = 0; // profile::now_ns() when it was pushed: latencies count from here
    uint8_t tool = 0;      // of a stroke that goes down: with which of the tools (Editor::use())
};

// The published state of an edit.
struct EditState {
    Document document;
    size_t edited = 0;           // which volume of it strokes work on
    uint64_t inputs_done = 0;    // the number of the last input that the document has whole
    int64_t newest_input_ns = 0; // when that was pushed
    int64_t published_ns = 0;
    uint64_t snapshot = 0; // how many were published before this
    uint64_t commands_done = 0;
    // The edited volume as strokes had left it, where the last command was an undo or a redo: what
    // they did can be told from what it did.
    std::optional<Volume> before_command;
    size_t strokes_done = 0; // and other changes, and not undone
    size_t undo_steps = 0, redo_steps = 0;
    size_t refusals = 0; // so far
    // How many strokes and volumes of put() have met a spared label so far, and the lowest that the
    // last of them has met.
    size_t met_spared = 0;
    uint16_t spared_label = 0;
    // Why the last stroke, command or step had no effect, or left out a pose; else empty. A stroke
    // that meets unreadable samples is taken back whole.
    std::string refusal;

    const Volume& volume() const { return document.volumes[edited].volume; }
};

struct EditorOptions {
    size_t ring_inputs = 4096; // four seconds of a hand at 1 kHz
    double slice_ms = 4.0;     // between two snapshots of work that takes long
    HistoryOptions history;
    // Steps that led to the document, of the entries in `journal` (replay.h); null: none.
    std::unique_ptr<History> begun;
    size_t before_journal = 0; // how many of its steps are none of `journal`
    // Each stroke, undo and redo is on disk before it counts as done. A step that cannot be
    // written, to a full disk say, is taken back and reported in `refusal`; the next is tried
    // again. So the published state between strokes always equals the journal.
    std::optional<Journal> journal;
    // The journal is a help and no promise: if a step cannot be written, the step stays, a refusal
    // says so once, and the journal ends with the step before.
    bool journal_may_end = false;
    // Without a thread, work happens in settle() only, and the result is a function of the inputs
    // and commands.
    bool threaded = true;
};

// Which tool a stroke is done with, what it does, and to which volume.
struct EditSetup {
    Json shape; // what `tool` was made from
    Tool tool;
    Operation operation;
    std::string on;    // the name of a volume; empty: the first
    std::string guide; // the name of the volume that Operation::needs_guide(); empty: none
};

// A change of journal that an editor was asked for (Editor::change_journal()).
class JournalChange {
 public:
    // The document that the new journal goes on from; once, from any thread. An error: it could not
    // be begun, or its turn did not come within the limit, because a stroke is under way. The
    // editor then goes on with the journal that it has, and closes this one.
    Result<Document> wait(std::chrono::milliseconds limit);
    // The newest steps that led there, of kMostSteps_bytes at most (History::newest()); after
    // wait().
    static constexpr uint64_t kMostSteps_bytes = uint64_t{64} << 20;
    std::vector<History::PackedStep> take_steps() { return std::move(*steps_); }

 private:
    friend class Editor;
    std::shared_ptr<std::vector<History::PackedStep>> steps_; // by the editor, at its turn
    std::future<Result<Document>> reached_;
    std::shared_ptr<std::atomic<bool>> claimed_; // by the editor that does it, or who gave it up
};

// The one writer of a document: a thread that turns poses into snapshots.
//
// Poses come through a ring from one thread, the servo, which waits for nothing; a full ring
// refuses, and the sweep to the next accepted pose leaves no gap. An invalid pose (a zero
// quaternion, a number that is not finite) is left out and reported; at tool-down it refuses the
// stroke. Commands come through a second ring from one other thread, the frame's. Snapshots leave
// through a wait-free mailbox. The editor empties the ring at least once a slice and publishes
// between slices: a long stroke appears piece by piece. The state published at the end of a stroke
// equals apply_stroke(). Its thread sleeps until there is an input or a command, and wakes the
// followers of its states.
class Editor {
 public:
    using Readers = Mailbox<EditState>;

    explicit Editor(Document document, EditorOptions options = {});
    ~Editor(); // ends the thread; what has been pushed and not done is dropped
    Editor(const Editor&) = delete;
    Editor& operator=(const Editor&) = delete;

    // The servo's thread; wait-free. False: full, and nothing happened. Where the editor sleeps it
    // is woken by one system call, which neither locks nor allocates.
    bool push(const EditInput& input) noexcept;
    // While inputs are polled, only a tool that goes down wakes the editor; until that tool is up
    // the editor looks by itself, four times a tick, and a servo makes one system call a stroke.
    // The thread of commands.
    void poll_inputs(bool polls);

    // One other thread; never waits. Takes effect between strokes, in order: after the inputs that
    // were pushed before the call, and the stroke they leave under way. False: full.
    // For strokes that begin later with tool number `tool`, below kTools.
    static constexpr uint8_t kTools = 2;
    bool use(EditSetup setup, uint8_t tool = 0);
    bool use(Json shape, Tool tool, Operation operation) {
        return use({std::move(shape), std::move(tool), std::move(operation), {}, {}});
    }
    bool undo() { return command(Undo{}); }
    bool redo() { return command(Redo{}); }
    // A volume comes, or takes the place of the one of its name: a filter's result, say. It is a
    // step like a stroke. `title` and `parameters` (an object) are for people.
    // `notes` are changed by the same step. A label map that takes the place of another one keeps
    // within the limits as sparing() says; where that leaves no change, it is refused.
    bool put(NamedVolume volume, std::string title, Json parameters = Json::object(),
             NotePages::Texts notes = {}, EditLimits limits = {});
    // Pages of the notes change (NotePages::with()): a step, or, without one, a change that is kept
    // and that undo passes over. Nothing happens where the notes stay what they are. A step that
    // joins takes the place of the one just before it, if that was noted so, too, under one title.
    bool note(NotePages::Texts pages, std::string title, bool is_step = true, bool joins = false);
    bool remove(std::string volume); // a step, too; the last volume stays

    // From its turn on entries go to another journal, and undo beyond it is kept as a difference.
    // Where `from` is given, the journal belongs to that earlier state, and its first entry leads
    // from there to the document at its turn. Nothing: full.
    std::optional<JournalChange> change_journal(Journal journal,
                                                std::optional<Document> from = std::nullopt);

    // The oldest refusal (EditState::refusal) that has not been taken; empty: none. Any thread. At
    // most kMostRefusals are kept; in the place of those that came beyond it stands one sentence
    // with their number.
    static constexpr size_t kMostRefusals = 64;
    std::string take_refusal();

    // Does all that was pushed and commanded, in an editor without a thread. A stroke under way
    // stays so.
    void settle();

    // For one reading thread each, Mailbox::kMaxReaders at a time.
    Readers::Reader add_reader() { return states_.add_reader(); }
    // Woken after each publication of a state.
    Followers& followers() { return followers_; }

    // How many inputs and commands were accepted; EditState says how many of them are done. Any
    // thread.
    uint64_t commands_given() const { return commanded_.load(std::memory_order_acquire); }
    // History::titles(). Any thread.
    std::vector<std::string> step_titles() const { return history_->titles(); }

 private:
    struct Undo {};
    struct Redo {};
    struct Put {
        NamedVolume volume;
        std::string title;
        Json parameters;
        NotePages::Texts notes;
        EditLimits limits;
    };
    struct Note {
        NotePages::Texts pages;
        std::string title;
        bool is_step, joins;
    };
    struct Remove {
        std::string name;
    };
    struct ChangeJournal {
        Journal journal;
        std::optional<Document> from;
        std::promise<Result<Document>> reached;
        std::shared_ptr<std::atomic<bool>> claimed;
        std::shared_ptr<std::vector<History::PackedStep>> steps;
    };
    struct Use {
        EditSetup setup;
        uint8_t tool;
    };
    // For a person, of one that failed.
    static std::string title_of(const Undo&) { return "undo"; }
    static std::string title_of(const Redo&) { return "redo"; }
    static std::string title_of(const Use&) { return "tool"; }
    static std::string title_of(const Put& put) { return put.title; }
    static std::string title_of(const Note& note) { return note.title; }
    static std::string title_of(const Remove& remove) { return "remove " + remove.name; }
    static std::string title_of(const ChangeJournal&) { return "save"; }
    using Command = std::variant<Undo, Redo, Use, Put, Note, Remove, ChangeJournal>;
    struct InRing { // trivially destructible, as rings want: owns `command` all the same
        Command* command = nullptr;
        uint64_t after = 0; // how many inputs had been pushed
    };
    bool command(Command command);
    void run(const std::stop_token& stop);
    void rest(const std::stop_token& stop);         // until there may be something to do
    bool go_on(const std::stop_token& stop);        // false: there was nothing to do
    bool try_to_go_on(const std::stop_token& stop); // go_on(), of which nothing is thrown
    void take_back();                               // what failed_
    void refuse(std::string why);
    void note_spared(uint16_t label); // 0: none was met
    bool take_inputs();
    bool begin_next();      // the next stroke or command, where none is under way
    bool do_commands();     // those whose turn it is
    EditInput next_input(); // of waiting_
    Result<std::unique_ptr<StrokeRun>> begin_stroke(const EditInput& down);
    void feed(); // poses that have come for the stroke under way
    void finish_stroke();
    void obey(Undo) { step(true); }
    void obey(Redo) { step(false); }
    void obey(Use use);
    void obey(Put put);
    void obey(Note note);
    void obey(Remove remove);
    void obey(ChangeJournal change);
    Result<Document> change_to(ChangeJournal& change);
    void step(bool back);
    void change_to(Document next, std::string title, Json parameters, bool is_step = true);
    bool keep(JournalEntry entry); // in the journal, if there is one; false: refused
    void end_journal(const std::string& why);
    std::optional<EditSetup>& setup() { return setups_[tool_]; }
    Volume& edited() { return now_.volumes[edited_].volume; }
    void find_edited(); // after volumes came or went
    void publish();

    Document now_;
    EditorOptions options_;
    std::unique_ptr<History> history_;
    Ring<EditInput> inputs_;
    Ring<InRing> commands_{64};
    Mailbox<EditState> states_;
    Followers followers_;
    Wake wake_; // of the thread
    std::atomic<bool> polls_{false};
    std::atomic<uint64_t> pushed_{0}; // how many inputs the ring took
    std::atomic<uint64_t> commanded_{0};

    // The thread's own.
    std::array<std::optional<EditSetup>, kTools> setups_;
    uint8_t tool_ = 0; // of the stroke under way, or of the last command
    size_t edited_ = 0;
    std::optional<InRing> command_; // the next
    std::deque<EditInput> waiting_;
    bool is_down_ = false; // the tool, after the last input that was taken
    uint64_t fed_ = 0;     // how many inputs have left waiting_
    std::unique_ptr<StrokeRun> stroke_;
    // Why what was done was broken off: it is to be taken back. How often in a row that failed,
    // too.
    std::string failed_;
    int failures_ = 0;
    std::vector<StrokePose> poses_; // of it
    bool lifted_ = false;
    EditInput last_fed_, last_done_;
    uint64_t published_ = 0, commands_done_ = 0;
    std::optional<Volume> before_command_; // EditState
    size_t strokes_done_ = 0;
    std::string joinable_;           // the title of the newest step, if another one may join it
    bool stroke_met_spared_ = false; // the stroke under way, and it is counted
    size_t met_spared_ = 0;          // EditState
    uint16_t spared_label_ = 0;      // likewise
    JournalReach reach_;             // of options_.journal
    size_t refusals_ = 0, refusals_kept_ = 0;
    std::string refusal_;

    std::mutex refusals_mutex_; // of these two
    std::deque<std::string> refusals_to_take_;
    size_t refusals_left_out_ = 0;
    std::jthread thread_; // last: ends before the rest goes
};

} // namespace palpate
