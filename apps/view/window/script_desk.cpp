#include "apps/view/window/script_desk.h"

#include <algorithm>
#include <cmath>

#include "apps/view/document/free_name.h"

namespace palpate::view {

namespace {

// Whether a person wants the window back.
bool takes_over(const Event& event) {
    return ((event.kind == Event::Kind::button || event.kind == Event::Kind::key) && event.down) ||
           event.kind == Event::Kind::wheel || event.kind == Event::Kind::close;
}

// Whether it comes from the window, and not from a hand.
bool is_of_window(const Event& event) {
    return event.kind == Event::Kind::resize || event.kind == Event::Kind::close;
}

} // namespace

ScriptDesk::ScriptDesk(const std::filesystem::path& record, glm::uvec2 size_px, double text_scale)
    : recorder_(record, size_px, text_scale) {}

void ScriptDesk::play(Script script, double speed) {
    playing_ = std::make_unique<Playing>(std::move(script), speed);
    playing_->window_s = -1.0; // its first frame tells
}

void ScriptDesk::let_go() {
    for (const Button button : playing_->buttons)
        waiting_.push({.kind = Event::Kind::button, .button = button});
    for (auto& [name, event] : playing_->keys) {
        event.down = false;
        event.modifiers = {};
        waiting_.push(event);
    }
    playing_.reset();
}

void ScriptDesk::stop(const std::string& why, Viewer& viewer) {
    let_go();
    viewer.work().tell(why);
}

void ScriptDesk::obey(Viewer& viewer) {
    const std::optional<ScriptOrder> order = viewer.take_script_order();
    if (!order)
        return;
    if (const auto* record = std::get_if<order::RecordScript>(&*order)) {
        own_path_ = std::filesystem::absolute(free_name(record->path)).string();
        own_.emplace(own_path_, viewer.state().size_px, viewer.state().text_scale);
        if (own_->failed()) {
            viewer.work().tell(Message::name(own_path_) + ": cannot be written");
            own_.reset();
        }
    } else if (const auto* play = std::get_if<order::PlayScript>(&*order)) {
        Result<Script> script = load_script(play->path);
        if (script)
            this->play(std::move(*script), play->speed);
        else
            viewer.work().tell(Message::why(script.error()));
    } else if (own_) {
        own_->drop_last_press();
        viewer.work().tell(own_->failed() ? Message::name(own_path_) + ": cannot be written"
                                          : "recorded: " + Message::name(own_path_));
        own_.reset();
    }
}

std::vector<Event> ScriptDesk::play_on(double window_s, Viewer& viewer) {
    Playing& now = *playing_;
    if (now.script.lines.empty()) {
        stop(fmt::format("{}: it has no events", now.script.name), viewer);
        return {};
    }
    const double first_s = now.script.lines.front().event.time_s;
    if (now.window_s < 0.0) {
        now.window_s = window_s;
        now.began_s = time_s_;
    }
    const Script::Line& next = now.cursor.next();
    const double since_s = window_s - now.window_s; // 0 times infinity is no number
    const double reached_s = since_s > 0.0 ? first_s + since_s * now.speed : first_s;
    time_s_ = std::max(time_s_, now.began_s + std::min(reached_s, next.event.time_s) - first_s);
    if (now.frames_to_wait > 0) {
        --now.frames_to_wait;
        return {};
    }
    if (reached_s < next.event.time_s)
        return {};
    const uint64_t frame = next.frame;
    Result<std::vector<Event>> events = now.cursor.take(frame, viewer);
    if (!events) {
        stop(events.error().message, viewer);
        return {};
    }
    if (!now.cursor.is_done())
        now.frames_to_wait = std::min(now.cursor.next().frame - frame, kSettling_frames) - 1;
    for (Event& event : *events) {
        event.time_s = std::max(time_s_, now.began_s + event.time_s - first_s);
        if (event.kind == Event::Kind::button) {
            if (event.down)
                now.buttons.insert(event.button);
            else
                now.buttons.erase(event.button);
        } else if (event.kind == Event::Kind::key) {
            if (event.down)
                now.keys[event.key] = event;
            else
                now.keys.erase(event.key);
        }
    }
    std::erase_if(*events, [](const Event& event) { // the window keeps its own size
        return is_of_window(event);
    });
    if (now.cursor.is_done()) // a person's next press is not part of it
        stop(fmt::format("{}: played", now.script.name), viewer);
    return std::move(*events);
}

std::vector<Event> ScriptDesk::take(uint64_t frame, std::vector<Event> person, double window_s,
                                    Viewer& viewer) {
    obey(viewer);
    if (!playing_)
        time_s_ = std::max(time_s_, window_s + shift_s_);
    std::vector<Event> events;
    if (playing_ && std::any_of(person.begin(), person.end(), takes_over)) {
        stop(fmt::format(
                 "{}: left at {:.0f} %, and the window is yours", playing_->script.name,
                 100.0 * static_cast<double>(playing_->cursor.done()) /
                     static_cast<double>(std::max<size_t>(1, playing_->script.lines.size()))),
             viewer);
        std::erase_if(person, [](const Event& event) { return !is_of_window(event); });
    } else if (playing_) {
        std::erase_if(person, [](const Event& event) { return !is_of_window(event); });
        if (person.empty())
            events = play_on(window_s, viewer);
    }
    if (!playing_)
        shift_s_ = time_s_ - window_s;
    for (Event& event : person) {
        event.time_s = std::max(time_s_, event.time_s + shift_s_);
        waiting_.push(std::move(event));
    }
    if (events.empty())
        events = waiting_.take_frame();
    for (const Event& event : events)
        time_s_ = std::max(time_s_, event.time_s);
    recorder_.add(frame, events, viewer);
    if (own_)
        own_->add(frame, events, viewer);
    viewer.show_scripts({own_ ? own_path_ : "", playing_ ? playing_->script.name : ""});
    return events;
}

} // namespace palpate::view
