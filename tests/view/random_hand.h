#pragma once

#include <algorithm>
#include <random>

#include "apps/view/window/viewer.h"

namespace palpate::view {

// A hand that does anything, as fast as it can: moves, clicks and drags on views and widgets, turns
// the wheel, types, drops files and resizes the window. Releases get lost, and buttons are pressed
// twice. A function of the seed and of the window that it sees.
class RandomHand {
 public:
    explicit RandomHand(uint64_t seed) : random_(seed) {}

    // The input of the next frame: a run of moves, or one event of another kind.
    std::vector<Event> next(const Viewer& viewer) {
        time_s_ += one_in(200) ? 1.0 : one_in(10) ? 0.0 : kFrame_s;
        if (planned_.empty() && one_in(40))
            plan_number(viewer);
        std::vector<Event> events(1);
        Event& event = events.front();
        if (!planned_.empty()) {
            event = std::move(planned_.front());
            planned_.erase(planned_.begin());
            event.time_s = time_s_;
            return events;
        }
        event.kind = kind();
        switch (event.kind) {
            case Event::Kind::move: {
                // One frame a run: no more than GLFW gathers in it.
                events.resize(1 + below(6));
                for (Event& move : events)
                    move.at_px = at_px_ = place(viewer);
                break;
            }
            case Event::Kind::button: {
                const size_t which = one_in(2) ? 0 : below(3);
                event.button = static_cast<Button>(which);
                event.down = one_in(10) ? one_in(2) : !pressed_[which];
                pressed_[which] = event.down;
                break;
            }
            case Event::Kind::wheel:
                event.wheel = {one_in(5) ? 1.0 : 0.0,
                               one_in(50) ? 1000.0 : static_cast<double>(below(7)) - 3.0};
                break;
            case Event::Kind::key: {
                const auto& names = key_names();
                event.down = one_in(10) || typed_.empty();
                event.key = event.down ? names[below(names.size())] : typed_;
                typed_ = event.down ? event.key : "";
                (event.key == "shift"  ? held_.shift
                 : event.key == "ctrl" ? held_.ctrl
                 : event.key == "alt"  ? held_.alt
                                       : ignored_) = event.down && !one_in(3);
                break;
            }
            case Event::Kind::text: {
                event.text = text();
                break;
            }
            case Event::Kind::resize:
                event.size_px = {300 + below(500), 200 + below(400)};
                if (one_in(10))
                    event.size_px = {below(2) * 1900, below(2) * 1500};
                break;
            case Event::Kind::drop: {
                constexpr const char* paths[] = {
                    "synthetic:ball?size=9",
                    "synthetic:phantom?size=24",
                    "synthetic:ramp?size=1",
                    "synthetic:checkerboard?size=2,17,40&spacing=1,1,9",
                    "synthetic:torus?size=33,5,12",
                    "synthetic:nothing",
                    "none.nii",
                    "",
                    "a\nb"};
                for (size_t i = 0; i <= below(3); ++i)
                    event.paths.emplace_back(paths[below(std::size(paths))]);
                break;
            }
            case Event::Kind::close:
                break;
        }
        for (Event& each : events) {
            each.modifiers = held_;
            each.time_s = time_s_;
        }
        return events;
    }

    double time_s() const { return time_s_; }

    uint64_t below(uint64_t end) { return random_() % end; }
    bool one_in(uint64_t n) { return below(n) == 0; }

 private:
    // No '/': what is typed as a file's name stays in the working folder.
    std::string text() {
        constexpr const char* texts[] = {"a",    "7", "-", "0", "1e308", "-1e999", "nan", "1e-9",
                                         "%s%n", " ", "ä", "𝛼", "\n",    "..",     "\x7f"};
        return one_in(20) ? std::string(2000, 'x') : texts[below(std::size(texts))];
    }
    // Types into a field of numbers, which a click with Ctrl opens.
    void plan_number(const Viewer& viewer) {
        const auto& widgets = viewer.interface().widgets();
        if (widgets.empty())
            return;
        auto widget = widgets.begin();
        std::advance(widget, below(widgets.size()));
        const Modifiers ctrl{.ctrl = true};
        planned_ = {{.kind = Event::Kind::move, .modifiers = ctrl},
                    {.kind = Event::Kind::button, .modifiers = ctrl, .down = true},
                    {.kind = Event::Kind::button, .modifiers = ctrl},
                    {.kind = Event::Kind::text, .text = text()},
                    {.kind = Event::Kind::key, .down = true, .key = "enter"},
                    {.kind = Event::Kind::key, .key = "enter"}};
        planned_.front().at_px =
            glm::dvec2(widget->second.low_px) + 0.25 * glm::dvec2(widget->second.size_px);
    }
    Event::Kind kind() {
        const uint64_t percent = below(100);
        return percent < 38   ? Event::Kind::move
               : percent < 66 ? Event::Kind::button
               : percent < 74 ? Event::Kind::wheel
               : percent < 94 ? Event::Kind::key
               : percent < 98 ? Event::Kind::text
               : one_in(4)    ? Event::Kind::drop
               : one_in(9)    ? Event::Kind::close
                              : Event::Kind::resize;
    }
    glm::dvec2 within(glm::dvec2 low, glm::dvec2 size) {
        const auto share = [&] { return static_cast<double>(below(1001)) / 1000.0; };
        return glm::floor(low + glm::dvec2(share() * size.x, share() * size.y));
    }
    glm::dvec2 place(const Viewer& viewer) {
        const auto& widgets = viewer.interface().widgets();
        const uint64_t where = below(100);
        if (where < 40 && !widgets.empty()) {
            auto widget = widgets.begin();
            std::advance(widget, below(widgets.size()));
            return within(glm::dvec2(widget->second.low_px), glm::dvec2(widget->second.size_px));
        }
        if (where < 50)
            return at_px_ + within({-8, -8}, {16, 16});
        if (where < 52)
            return within({-1e5, -1e5}, {2e5, 2e5});
        return within({-5, -5}, glm::dvec2(viewer.state().size_px) + 10.0);
    }

    std::mt19937_64 random_;
    glm::dvec2 at_px_{0.0};
    Modifiers held_;
    std::array<bool, 3> pressed_{};
    std::string typed_; // a key that is down
    std::vector<Event> planned_;
    bool ignored_ = false;
    double time_s_ = 1.0;
};

} // namespace palpate::view
