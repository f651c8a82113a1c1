#include "apps/view/window/replay.h"

#include <algorithm>

namespace palpate::view {

namespace {

Shown shown_by(const Viewer& viewer) {
    return {&viewer.state(), &viewer.interface().widgets(), &viewer.grid()};
}

} // namespace

Recorder::Recorder(const std::filesystem::path& path, glm::uvec2 size_px, double text_scale) {
    if (path.empty())
        return;
    file_.open(path, std::ios::trunc);
    file_ << header_line(size_px, text_scale) << std::flush;
}

void Recorder::add(uint64_t frame, const std::vector<Event>& events, const Viewer& viewer) {
    if (!file_.is_open() || events.empty())
        return;
    for (const Event& event : events)
        file_ << event_line(frame, event, placing_.place_of(event, shown_by(viewer)));
    file_ << std::flush;
}

Result<void> replay(Viewer& viewer, const Script& script, Recorder* recorder) {
    constexpr uint64_t kIdle = 3; // frames after which nothing changes without events
    double time_s = 0.0;
    uint64_t frame = 0;
    std::string absent; // the place of the last move, where it is not shown
    for (size_t next = 0; next < script.lines.size(); ++frame) {
        frame =
            std::max(frame, script.lines[next].frame - std::min(script.lines[next].frame, kIdle));
        std::vector<Event> events;
        for (; next < script.lines.size() && script.lines[next].frame <= frame; ++next) {
            Event event = script.lines[next].event;
            const Place& place = script.lines[next].place;
            if (event.kind == Event::Kind::move) {
                absent.clear();
                if (!std::holds_alternative<std::monostate>(place)) {
                    const std::optional<glm::dvec2> px = pixel_of(place, shown_by(viewer));
                    if (!px)
                        absent = name_of(place);
                    event.at_px = px.value_or(viewer.state().pointer_px);
                }
            } else if (!absent.empty() && ((event.kind == Event::Kind::button && event.down) ||
                                           event.kind == Event::Kind::wheel)) {
                return fail("{}: frame {}: expected {} to be shown where a button is pressed",
                            script.name, script.lines[next].frame, absent);
            }
            events.push_back(std::move(event));
        }
        // Frames without events take their share of the time that passes.
        time_s = events.empty() ? std::min(time_s + kFrame_s, script.lines[next].event.time_s)
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
