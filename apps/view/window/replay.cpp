#include "apps/view/window/replay.h"

#include <algorithm>

namespace palpate::view {

namespace {

Shown shown_by(const Viewer& viewer) {
    const Interface& interface = viewer.interface();
    return {&viewer.state(), &interface.widgets(), &viewer.grid(), &interface.seen_widgets()};
}

} // namespace

Recorder::Recorder(const std::filesystem::path& path, glm::uvec2 size_px, double text_scale)
    : path_(path) {
    if (path.empty())
        return;
    file_.open(path, std::ios::trunc);
    file_ << header_line(size_px, text_scale) << std::flush;
    before_press_ = file_.tellp();
}

void Recorder::add(uint64_t frame, const std::vector<Event>& events, const Viewer& viewer) {
    if (!file_.is_open() || events.empty())
        return;
    for (const Event& event : events) {
        if (event.kind == Event::Kind::button && event.down)
            before_press_ = file_.tellp();
        file_ << event_line(frame, event, placing_.place_of(event, shown_by(viewer)));
    }
    file_ << std::flush;
}

void Recorder::drop_last_press() {
    if (!file_.is_open() || file_.fail())
        return;
    file_.close();
    std::error_code error;
    std::filesystem::resize_file(path_, static_cast<uintmax_t>(before_press_), error);
    if (error)
        file_.setstate(std::ios::failbit);
}

Result<std::vector<Event>> ScriptCursor::take(uint64_t frame, const Viewer& viewer) {
    std::vector<Event> events;
    for (; !is_done() && next().frame <= frame; ++next_) {
        Event event = next().event;
        const Place& place = next().place;
        if (event.kind == Event::Kind::move) {
            absent_.clear();
            if (!std::holds_alternative<std::monostate>(place)) {
                const Shown shown = shown_by(viewer);
                const std::optional<glm::dvec2> px = pixel_of(place, shown);
                if (!px)
                    absent_ = name_of(place) + " to be shown";
                else if (is_scrolled_away(place, *px, shown))
                    absent_ = name_of(place) + ", which is scrolled out of view, to be seen";
                event.at_px = px.value_or(viewer.state().pointer_px);
            }
        } else if (!absent_.empty() && ((event.kind == Event::Kind::button && event.down) ||
                                        event.kind == Event::Kind::wheel)) {
            return fail("{}: frame {}: expected {} where a button is pressed", script_->name,
                        next().frame, absent_);
        }
        events.push_back(std::move(event));
    }
    return events;
}

Result<void> replay(Viewer& viewer, const Script& script, Recorder* recorder) {
    double time_s = 0.0;
    ScriptCursor cursor(script);
    for (uint64_t frame = 0; !cursor.is_done(); ++frame) {
        const uint64_t next = cursor.next().frame;
        frame = std::max(frame, next - std::min(next, kSettling_frames));
        PALPATE_TRY(std::vector<Event> events, cursor.take(frame, viewer));
        // Frames without events take their share of the time that passes.
        time_s = events.empty() ? std::min(time_s + kFrame_s, cursor.next().event.time_s)
                                : events.back().time_s;
        if (recorder)
            recorder->add(frame, events, viewer);
        viewer.frame(std::move(events), time_s);
    }
    for (int i = 1; i <= 2; ++i) // widgets answer in the frame after a release
        viewer.frame({}, time_s + i * kFrame_s);
    return {};
}

} // namespace palpate::view
