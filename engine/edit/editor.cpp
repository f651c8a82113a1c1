#include "engine/edit/editor.h"

#include <chrono>

#include "engine/base/profile.h"

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
    for (Command command; commands_.pop(command);)
        delete command.setup;
}

bool Editor::use(Json shape, Tool tool, Operation operation) {
    auto setup =
        std::make_unique<Setup>(Setup{std::move(shape), std::move(tool), std::move(operation)});
    if (!commands_.push({Command::Kind::use, setup.get()}))
        return false;
    setup.release(); // the ring's now
    return true;
}

void Editor::run(const std::stop_token& stop) {
    profile::name_thread("editor");
    while (!stop.stop_requested()) {
        const bool taken = take_inputs();
        const bool begun = begin_next();
        if (!stroke_) {
            if (!taken && !begun)
                std::this_thread::sleep_for(kNap);
            continue;
        }
        feed();
        const int64_t until = profile::now_ns() + static_cast<int64_t>(options_.slice_ms * 1e6);
        const bool done =
            stroke_->work([&] { return !stop.stop_requested() && profile::now_ns() < until; });
        if (done)
            last_done_ = last_fed_;
        if (const Volume next = stroke_->publish();
            !next.is_same_as(now_) || last_done_.number != states_.latest().inputs_done) {
            now_ = next;
            if (!(done && lifted_)) // else finish_stroke() does
                publish(now_);
        } else if (done && !lifted_ && !taken) {
            std::this_thread::sleep_for(kNap);
        }
        if (done && lifted_)
            finish_stroke();
    }
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
    bool any = false;
    for (Command command; commands_.pop(command); any = true) {
        if (command.kind == Command::Kind::use)
            setup_.reset(command.setup);
        else
            step(command.kind == Command::Kind::undo);
    }
    while (!waiting_.empty() && !stroke_) {
        const EditInput input = waiting_.front();
        if (input.kind == EditInput::Kind::down) {
            refusal_.clear();
            const Result<ToolPose> pose = checked_pose(input.pose);
            auto begun = !setup_ ? fail("a stroke began before there was a tool")
                         : !pose ? tl::unexpected(pose.error())
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
        waiting_.pop_front();
        last_fed_ = last_done_ = input;
        any = true;
        if (input.kind != EditInput::Kind::move)
            publish(now_);
    }
    return any;
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
        waiting_.pop_front();
        last_fed_ = input;
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
    if (options_.journal) {
        const Result<void> written = options_.journal->append(
            {JournalEntry::Kind::stroke,
             {setup_->shape, setup_->tool, setup_->operation, std::move(poses_)}});
        if (!written)
            refusal_ = written.error().message;
    }
    history_.record(before, now_);
    ++strokes_done_;
    publish(now_);
}

void Editor::step(bool back) {
    refusal_.clear();
    const Result<std::optional<Volume>> taken = back ? history_.undo(now_) : history_.redo(now_);
    if (!taken)
        refusal_ = taken.error().message;
    else if (!*taken)
        refusal_ = back ? "nothing is left to undo" : "nothing is left to redo";
    else
        now_ = **taken;
    if (refusal_.empty()) {
        strokes_done_ += back ? -1 : 1;
        if (options_.journal)
            if (const Result<void> written = options_.journal->append(
                    {back ? JournalEntry::Kind::undo : JournalEntry::Kind::redo, {}});
                !written)
                refusal_ = written.error().message;
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
