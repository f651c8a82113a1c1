#include "engine/edit/editor.h"

#include <chrono>
#include <utility>

#include "engine/base/profile.h"
#include "engine/edit/step.h"

namespace palpate {

namespace {
constexpr std::chrono::microseconds kNap(250); // while nothing is to be done
} // namespace

Editor::Editor(Volume volume, std::optional<Volume> guide, EditorOptions options)
    : now_(volume),
      guide_(std::move(guide)),
      options_(std::move(options)),
      history_(options_.history),
      inputs_(options_.ring_inputs),
      states_(std::make_unique<EditState>(EditState{.volume = std::move(volume)})),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Editor::~Editor() {
    thread_.request_stop();
    thread_.join();
    if (command_)
        delete command_->setup;
    for (Command command; commands_.pop(command);)
        delete command.setup;
}

bool Editor::push(const EditInput& input) noexcept {
    if (!inputs_.push(input))
        return false;
    pushed_.fetch_add(1, std::memory_order_release);
    return true;
}

bool Editor::command(Command::Kind kind, Setup* setup) {
    return commands_.push({kind, setup, pushed_.load(std::memory_order_acquire)});
}

bool Editor::use(Json shape, Tool tool, Operation operation) {
    auto setup =
        std::make_unique<Setup>(Setup{std::move(shape), std::move(tool), std::move(operation)});
    if (!command(Command::Kind::use, setup.get()))
        return false;
    setup.release(); // the ring's now
    return true;
}

void Editor::run(const std::stop_token& stop) {
    profile::name_thread("editor");
    while (!stop.stop_requested())
        try {
            if (!go_on(stop))
                std::this_thread::sleep_for(kNap);
        } catch (const std::exception& error) { // samples that cannot be read, memory that ran out
            drop_stroke(error.what());
        }
}

bool Editor::go_on(const std::stop_token& stop) {
    const bool taken = take_inputs();
    const bool begun = begin_next();
    if (!stroke_)
        return taken || begun;
    feed();
    const int64_t until = profile::now_ns() + static_cast<int64_t>(options_.slice_ms * 1e6);
    const bool done = stroke_->work([&] { return profile::now_ns() < until; }, stop);
    if (stop.stop_requested())
        return false;
    if (done)
        last_done_ = last_fed_;
    bool any = taken || !done || lifted_;
    if (const Volume next = stroke_->publish();
        !next.is_same_as(now_) || last_done_.number != states_.latest().inputs_done) {
        now_ = next;
        any = true;
        if (!(done && lifted_)) // else finish_stroke() does
            publish(now_);
    }
    if (done && lifted_)
        finish_stroke();
    return any;
}

void Editor::drop_stroke(const char* why) {
    refusal_ = why;
    if (stroke_) {
        now_ = taken_back(stroke_->before(), now_);
        stroke_.reset();
        refusal_ += "; the stroke is taken back";
    }
    last_done_ = last_fed_;
    publish(now_);
}

bool Editor::take_inputs() {
    bool any = false;
    for (EditInput input; inputs_.pop(input); any = true) {
        waiting_.push_back(input);
        taken_.store(input.number, std::memory_order_release);
    }
    return any;
}

bool Editor::begin_next() {
    if (stroke_)
        return false;
    bool any = do_commands();
    while (!waiting_.empty()) {
        const EditInput input = waiting_.front();
        if (input.kind == EditInput::Kind::down) {
            refusal_.clear();
            Result<ToolPose> pose = checked_pose(input.pose);
            auto begun = !setup_ ? fail("a stroke began before there was a tool")
                         : !pose ? pass_on(pose)
                                 : StrokeRun::start(now_, setup_->tool, setup_->operation, guide_);
            if (begun) {
                stroke_ = std::move(*begun);
                poses_.clear();
                lifted_ = false;
                return true;
            }
            refusal_ = begun.error().message;
        }
        // Of a stroke that was refused, or of none: passed over.
        next_input();
        last_done_ = input;
        any = true;
        if (input.kind != EditInput::Kind::move)
            publish(now_);
        do_commands();
    }
    return any;
}

bool Editor::do_commands() {
    bool any = false;
    for (;; any = true) {
        if (Command next; !command_ && commands_.pop(next))
            command_ = next;
        // Inputs pushed before it come first; no stroke is under way, so they are done if fed.
        if (!command_ || command_->after > fed_)
            return any;
        const Command now = *std::exchange(command_, std::nullopt);
        if (now.kind == Command::Kind::use)
            setup_.reset(now.setup);
        else
            step(now.kind == Command::Kind::undo);
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
        Result<ToolPose> pose = checked_pose(input.pose);
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
    stroke_.reset();
    if (keep({JournalEntry::Kind::stroke,
              {setup_->shape, setup_->tool, setup_->operation, std::move(poses_)}})) {
        history_.record(before, now_);
        ++strokes_done_;
    } else {
        now_ = taken_back(before, now_);
        refusal_ += "; the stroke is taken back";
    }
    publish(now_);
}

bool Editor::keep(JournalEntry entry) {
    if (!options_.journal)
        return true;
    const Result<void> written = options_.journal->append(entry);
    if (!written)
        refusal_ = written.error().message;
    return written.has_value();
}

void Editor::step(bool back) {
    refusal_.clear();
    const auto take = [&](bool backwards) {
        return backwards ? history_.undo(now_) : history_.redo(now_);
    };
    Result<std::optional<Volume>> taken = take(back);
    if (!taken)
        refusal_ = taken.error().message;
    else if (!*taken)
        refusal_ = back ? "nothing is left to undo" : "nothing is left to redo";
    else {
        now_ = **taken;
        strokes_done_ += back ? -1 : 1;
        if (!keep({back ? JournalEntry::Kind::undo : JournalEntry::Kind::redo, {}})) {
            taken = take(!back); // the same step, just taken
            if (taken && *taken) {
                now_ = **taken;
                strokes_done_ -= back ? -1 : 1;
                refusal_ += back ? "; nothing is undone" : "; nothing is redone";
            } else { // it lies on a disk that failed meanwhile, too
                refusal_ += back ? "; the undo stands without it" : "; the redo stands without it";
            }
        }
    }
    publish(now_);
}

void Editor::publish(const Volume& volume) {
    const History::Stats history = history_.stats();
    states_.publish(std::make_unique<EditState>(
        EditState{volume, last_done_.number, last_done_.pushed_ns, profile::now_ns(), ++published_,
                  strokes_done_, history.undo_steps, history.redo_steps, refusal_}));
}

} // namespace palpate
