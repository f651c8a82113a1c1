#include "engine/edit/editor.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "engine/base/failure.h"
#include "engine/base/profile.h"
#include "engine/edit/spared.h"
#include "engine/edit/step.h"
#include "engine/volume/changes.h"

namespace palpate {

namespace {
constexpr std::chrono::microseconds kNap(250); // while a tool is down and inputs are polled
} // namespace

Editor::Editor(Document document, EditorOptions options)
    : now_(document),
      options_(std::move(options)),
      history_(options_.begun ? std::move(options_.begun)
                              : std::make_unique<History>(options_.history)),
      inputs_(options_.ring_inputs),
      states_(std::make_unique<EditState>(EditState{.document = std::move(document),
                                                    .strokes_done = history_->stats().undo_steps,
                                                    .undo_steps = history_->stats().undo_steps,
                                                    .redo_steps = history_->stats().redo_steps})) {
    strokes_done_ = history_->stats().undo_steps;
    reach_ = JournalReach(history_->stats(), options_.before_journal);
    if (options_.threaded)
        thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Editor::~Editor() {
    if (thread_.joinable()) {
        thread_.request_stop();
        thread_.join();
    }
    if (command_)
        delete command_->command;
    for (InRing next; commands_.pop(next);)
        delete next.command;
}

bool Editor::push(const EditInput& input) noexcept {
    if (!inputs_.push(input))
        return false;
    pushed_.fetch_add(1, std::memory_order_release);
    if (input.kind == EditInput::Kind::down || !polls_.load(std::memory_order_acquire))
        wake_.wake();
    return true;
}

void Editor::poll_inputs(bool polls) {
    polls_.store(polls, std::memory_order_release);
    wake_.wake(); // for inputs that woke nobody
}

bool Editor::command(Command command) {
    auto owned = std::make_unique<Command>(std::move(command));
    if (!commands_.push({owned.get(), pushed_.load(std::memory_order_acquire)}))
        return false;
    owned.release(); // the ring's now
    commanded_.fetch_add(1, std::memory_order_release);
    wake_.wake();
    return true;
}

bool Editor::use(EditSetup setup, uint8_t tool) {
    PALPATE_ASSERT_CMP(tool, <, kTools);
    return command(Use{std::move(setup), tool});
}

bool Editor::put(NamedVolume volume, std::string title, Json parameters, NotePages::Texts notes,
                 EditLimits limits) {
    return command(Put{std::move(volume), std::move(title), std::move(parameters), std::move(notes),
                       std::move(limits)});
}

bool Editor::note(NotePages::Texts pages, std::string title, bool is_step, bool joins) {
    return command(Note{std::move(pages), std::move(title), is_step, joins});
}

bool Editor::remove(std::string volume) {
    return command(Remove{std::move(volume)});
}

Result<Document> JournalChange::wait(std::chrono::milliseconds limit) {
    if (reached_.wait_for(limit) != std::future_status::ready && !claimed_->exchange(true))
        return fail(
            "expected the end of the stroke under way within {:g} s; lift the tool and try again",
            std::chrono::duration<double>(limit).count());
    try {
        return reached_.get();
    } catch (const std::future_error&) { // it ran out of memory
        return fail("the editor could not begin the new journal");
    }
}

std::optional<JournalChange> Editor::change_journal(Journal journal, std::optional<Document> from) {
    ChangeJournal change{std::move(journal), std::move(from), {}, {}, {}};
    JournalChange asked;
    asked.reached_ = change.reached.get_future();
    asked.claimed_ = change.claimed = std::make_shared<std::atomic<bool>>(false);
    asked.steps_ = change.steps = std::make_shared<std::vector<History::PackedStep>>();
    return command(std::move(change)) ? std::optional(std::move(asked)) : std::nullopt;
}

std::string Editor::take_refusal() {
    const std::scoped_lock held(refusals_mutex_);
    if (!refusals_to_take_.empty()) {
        std::string oldest = std::move(refusals_to_take_.front());
        refusals_to_take_.pop_front();
        return oldest;
    }
    const size_t more = std::exchange(refusals_left_out_, 0);
    return more == 0 ? "" : fmt::format("{} more steps had no effect", more);
}

void Editor::settle() {
    PALPATE_ASSERT(!options_.threaded);
    while (try_to_go_on({})) {
    }
}

void Editor::run(const std::stop_token& stop) {
    profile::name_thread("editor");
    while (!stop.stop_requested())
        if (!try_to_go_on(stop))
            rest(stop);
}

// False: there was nothing to do, or it cannot be done now.
bool Editor::try_to_go_on(const std::stop_token& stop) {
    constexpr int kMostFailures = 3;
    try {
        if (!failed_.empty()) {
            take_back();
            return true;
        }
        return go_on(stop);
    } catch (const std::exception& error) { // samples that cannot be read, memory that ran out
        failed_ = failure_text(error);
        if (stroke_)
            failed_ = fmt::format("{}: {}", name_of(setup()->operation.kind), failed_);
    }
    failures_ = failures_ < kMostFailures ? failures_ + 1 : 1;
    return failures_ < kMostFailures;
}

void Editor::rest(const std::stop_token& stop) {
    if (!failed_.empty() || (is_down_ && polls_.load(std::memory_order_acquire)))
        wake_.wait(stop, Wake::Clock::now() + kNap);
    else
        wake_.wait(stop);
}

bool Editor::go_on(const std::stop_token& stop) {
    const bool taken = take_inputs();
    const bool begun = begin_next();
    if (!stroke_)
        return taken || begun;
    feed();
    const int64_t until = profile::now_ns() + static_cast<int64_t>(options_.slice_ms * 1e6);
    const auto in_slice = [&] { return !options_.threaded || profile::now_ns() < until; };
    const bool done = stroke_->work(in_slice, stop);
    if (stop.stop_requested())
        return false;
    if (done)
        last_done_ = last_fed_;
    bool any = taken || !done || lifted_;
    const bool meets_now = stroke_->met_spared() != 0 && !stroke_met_spared_;
    if (meets_now) {
        stroke_met_spared_ = true;
        note_spared(stroke_->met_spared());
    }
    if (const Volume next = stroke_->publish(); meets_now || !next.is_same_as(edited()) ||
                                                last_done_.number != states_.latest().inputs_done) {
        edited() = next;
        any = true;
        if (!(done && lifted_)) // else finish_stroke() does
            publish();
    }
    if (done && lifted_)
        finish_stroke();
    return any;
}

void Editor::take_back() {
    if (stroke_) {
        edited() = taken_back(stroke_->before(), edited());
        stroke_.reset();
        failed_ += "; the stroke is taken back";
    }
    refuse(std::exchange(failed_, {}));
    failures_ = 0;
    last_done_ = last_fed_;
    publish();
}

void Editor::refuse(std::string why) {
    refusal_ = std::move(why);
    ++refusals_;
}

void Editor::note_spared(uint16_t label) {
    if (label == 0)
        return;
    ++met_spared_;
    spared_label_ = label;
}

bool Editor::take_inputs() {
    bool any = false;
    for (EditInput input; inputs_.pop(input); any = true) {
        waiting_.push_back(input);
        is_down_ = input.kind != EditInput::Kind::up;
    }
    return any;
}

Result<std::unique_ptr<StrokeRun>> Editor::begin_stroke(const EditInput& down) {
    if (!setup())
        return fail("a stroke began before there was a tool");
    PALPATE_TRY(checked_pose(down.pose));
    for (const std::string* name : {&setup()->on, &setup()->guide})
        if (!name->empty())
            PALPATE_TRY(expect_volume(now_, *name));
    const Volume* guide = setup()->guide.empty() ? nullptr : now_.find(setup()->guide);
    setup()->operation = settled(std::move(setup()->operation), edited()); // as it is kept
    return StrokeRun::start(edited(), setup()->tool, setup()->operation,
                            guide ? std::optional(*guide) : std::nullopt);
}

bool Editor::begin_next() {
    if (stroke_)
        return false;
    bool any = do_commands();
    while (!waiting_.empty()) {
        const EditInput input = waiting_.front();
        if (input.kind == EditInput::Kind::down) {
            refusal_.clear();
            tool_ = std::min<uint8_t>(input.tool, kTools - 1);
            find_edited();
            auto begun = attempt(setup() ? name_of(setup()->operation.kind) : "stroke",
                                 [&] { return begin_stroke(input); });
            if (begun) {
                stroke_ = std::move(*begun);
                poses_.clear();
                lifted_ = stroke_met_spared_ = false;
                return true;
            }
            refuse(begun.error().message);
        }
        // An input of a refused stroke, or of none, is passed over.
        next_input();
        last_done_ = input;
        any = true;
        if (input.kind != EditInput::Kind::move)
            publish();
        do_commands();
    }
    if (last_done_.number != states_.latest().inputs_done)
        publish(); // moves of a stroke that was refused are done, too
    return any;
}

bool Editor::do_commands() {
    bool any = false;
    for (;; any = true) {
        if (InRing next; !command_ && commands_.pop(next))
            command_ = next;
        // Inputs pushed before it come first; no stroke is under way, so they are done if fed.
        if (!command_ || command_->after > fed_)
            return any;
        const std::unique_ptr<Command> command(std::exchange(command_, std::nullopt)->command);
        ++commands_done_;
        before_command_.reset();
        const std::string name =
            std::visit([](const auto& what) { return title_of(what); }, *command);
        try {
            std::visit([&](auto& what) { obey(std::move(what)); }, *command);
        } catch (const std::exception& error) { // it has changed nothing
            refuse(fmt::format("{}: {}", name, failure_text(error)));
            publish();
        }
    }
}

EditInput Editor::next_input() {
    last_fed_ = waiting_.front();
    waiting_.pop_front();
    ++fed_;
    return last_fed_;
}

void Editor::feed() {
    if (lifted_)
        return;
    const size_t before = poses_.size();
    while (!lifted_ && !waiting_.empty()) {
        const EditInput input = waiting_.front();
        if (input.kind == EditInput::Kind::down && !poses_.empty()) {
            lifted_ = true; // an up was lost; the next stroke begins with this
            break;
        }
        next_input();
        lifted_ = input.kind == EditInput::Kind::up;
        Result<StrokePose> pose = checked_pose(input.pose);
        if (!pose) {
            refusal_ =
                fmt::format("input {} is passed over: {}", input.number, pose.error().message);
            continue;
        }
        if (!poses_.empty()) // a clock that goes back is a clock that stands
            pose->time_s = std::max(pose->time_s, poses_.back().time_s);
        poses_.push_back(*pose);
    }
    stroke_->add(std::span(poses_).subspan(before));
    if (lifted_)
        stroke_->lift();
}

void Editor::finish_stroke() {
    const Volume before = stroke_->before();
    const bool guided = setup()->operation.needs_guide();
    JournalEntry entry{JournalEntry::Kind::stroke,
                       {setup()->shape, setup()->tool, setup()->operation, std::move(poses_)},
                       now_.volumes[edited_].name,
                       guided ? setup()->guide : std::string(),
                       {}};
    // All that may fail comes before the journal has it, and while the stroke can be taken back.
    Document was = now_;
    was.volumes[edited_].volume = before;
    history_->begin(was, now_, palpate::title_of(entry));
    if (keep(std::move(entry))) {
        history_->end();
        ++strokes_done_;
        joinable_.clear();
        reach_.recorded();
    } else {
        edited() = taken_back(before, edited());
        refusal_ += "; the stroke is taken back";
    }
    stroke_.reset();
    publish();
}

bool Editor::keep(JournalEntry entry) {
    if (!options_.journal)
        return true;
    const Result<void> written = options_.journal->append(entry);
    if (written)
        return true;
    if (options_.journal_may_end)
        end_journal(written.error().message);
    else
        refuse(written.error().message);
    return options_.journal_may_end;
}

void Editor::end_journal(const std::string& why) {
    options_.journal.reset();
    refuse(fmt::format("{}; steps are not kept on disk any more until they are saved", why));
}

void Editor::find_edited() {
    edited_ = 0;
    for (size_t i = 0; setup() && i < now_.volumes.size(); ++i)
        if (now_.volumes[i].name == setup()->on)
            edited_ = i;
}

void Editor::obey(Use use) {
    tool_ = use.tool;
    setup() = std::move(use.setup);
    find_edited();
    publish();
}

void Editor::change_to(Document next, std::string title, Json parameters, bool is_step) {
    refusal_.clear();
    JournalEntry entry{.kind = JournalEntry::Kind::change};
    if (options_.journal) {
        entry.change = {title, std::move(parameters), pack_step(step_between(now_, next)), is_step};
        const std::string why = "the journal's entry needs more memory than there is";
        if (entry.change.packed.empty() && options_.journal_may_end)
            end_journal(why);
        else if (entry.change.packed.empty())
            refuse(why + "; nothing is changed");
    }
    if (is_step)
        history_->begin(now_, next, std::move(title));
    if ((refusal_.empty() || !options_.journal) && keep(std::move(entry))) {
        if (is_step) {
            history_->end();
            ++strokes_done_;
            joinable_.clear();
            reach_.recorded();
        }
        now_ = std::move(next);
        find_edited();
    }
    publish();
}

void Editor::obey(Put put) {
    if (const Result<void> named = check_volume_name(put.volume.name); !named) {
        refuse(named.error().message);
        return publish();
    }
    const Volume* before = now_.find(put.volume.name);
    if (before && !put.limits.are_none() && before->grid() == put.volume.volume.grid()) {
        Spared kept = sparing(*before, put.volume.volume, put.limits);
        note_spared(kept.met);
        if (kept.met != 0 && !kept.met_mask && changed_bricks(*before, kept.labels).empty()) {
            refuse(fmt::format("{}: nothing is changed but label {}, which is locked", put.title,
                               kept.met));
            return publish();
        }
        if (kept.met_mask && changed_bricks(*before, kept.labels).empty()) {
            refuse(fmt::format("{}: the mask leaves nothing of it to change", put.title));
            return publish();
        }
        put.volume.volume = std::move(kept.labels);
    }
    Document next = with_volume(now_, std::move(put.volume));
    next.notes = now_.notes.with(put.notes);
    change_to(std::move(next), std::move(put.title), std::move(put.parameters));
}

void Editor::obey(Note note) {
    Document next = now_;
    next.notes = now_.notes.with(note.pages);
    if (next.notes == now_.notes) {
        refusal_.clear();
        return publish();
    }
    const bool joins = note.joins && note.is_step;
    if (joins && joinable_ == note.title) {
        step(true);
        if (!refusal_.empty() || next.notes == now_.notes) // or both together change nothing
            return;
    }
    const std::string title = note.title;
    change_to(std::move(next), std::move(note.title), Json::object(), note.is_step);
    if (joins && refusal_.empty())
        joinable_ = title;
}

void Editor::obey(Remove remove) {
    Document next = now_;
    std::erase_if(next.volumes, [&](const NamedVolume& v) { return v.name == remove.name; });
    const Result<void> there = expect_volume(now_, remove.name);
    if (there && !next.volumes.empty())
        return change_to(std::move(next), "remove", Json::object());
    refuse(there ? "the last volume of a document cannot be removed" : there.error().message);
    publish();
}

Result<Document> Editor::change_to(ChangeJournal& change) {
    if (change.from && !now_.is_same_as(*change.from)) {
        const JournalEntry entry{.kind = JournalEntry::Kind::change,
                                 .change = {"since the copy", Json::object(),
                                            pack_step(step_between(*change.from, now_)), true}};
        if (entry.change.packed.empty())
            return fail("the journal's entry needs more memory than there is");
        PALPATE_TRY(change.journal.append(entry));
    }
    Document now = now_;
    *change.steps = history_->newest(JournalChange::kMostSteps_bytes);
    options_.journal.emplace(std::move(change.journal));
    options_.journal_may_end = false;
    reach_ = {};
    return now;
}

void Editor::obey(ChangeJournal change) {
    Result<Document> changed =
        change.claimed->exchange(true) ? Result<Document>(fail("given up")) : change_to(change);
    publish();
    change.reached.set_value(std::move(changed));
}

void Editor::step(bool back) {
    before_command_ = edited();
    refusal_.clear();
    const char* const undone = back ? "; nothing is undone" : "; nothing is redone";
    Result<std::optional<Document>> next = history_->look(now_, back);
    if (!next) {
        refuse(next.error().message);
    } else if (!*next) {
        refuse(back ? "nothing is left to undo" : "nothing is left to redo");
    } else {
        const JournalEntry entry =
            options_.journal ? reach_.entry(back, now_, **next) : JournalEntry();
        const bool lacks_memory =
            entry.kind == JournalEntry::Kind::change && entry.change.packed.empty();
        if (lacks_memory)
            refuse("the journal's entry needs more memory than there is");
        if (lacks_memory || !keep(entry)) {
            refusal_ += undone;
        } else {
            history_->move(back);
            joinable_.clear();
            now_ = std::move(**next);
            strokes_done_ += back ? -1 : 1;
            if (options_.journal)
                reach_.moved(back, entry);
        }
    }
    find_edited();
    publish();
}

void Editor::publish() {
    if (std::exchange(refusals_kept_, refusals_) != refusals_) {
        const std::scoped_lock held(refusals_mutex_);
        if (refusals_to_take_.size() < kMostRefusals && refusals_left_out_ == 0)
            refusals_to_take_.push_back(refusal_);
        else
            ++refusals_left_out_;
    }
    const History::Stats history = history_->stats();
    states_.publish(std::make_unique<EditState>(
        EditState{now_, edited_, last_done_.number, last_done_.pushed_ns, profile::now_ns(),
                  ++published_, commands_done_, before_command_, strokes_done_, history.undo_steps,
                  history.redo_steps, refusals_, met_spared_, spared_label_, refusal_}));
    followers_.wake();
}

} // namespace palpate
