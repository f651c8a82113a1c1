#include "apps/palpate/view/latency.h"

#include <cmath>
#include <deque>
#include <random>
#include <thread>

#include "engine/base/percentile.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"

namespace palpate::view {

namespace {

constexpr double kLongestRefinement_s = 120.0;
constexpr int kStrokes = 20, kMovesPerStroke = 8;
constexpr double kTurning_s = 5.0, kWandering_s = 3.0;

double ms(int64_t ns) {
    return 1e-6 * static_cast<double>(ns);
}

Json figures(const std::vector<double>& values) {
    if (values.empty())
        return Json{{"count", 0}};
    return Json{{"median", percentile(values, 0.5)},
                {"p95", percentile(values, 0.95)},
                {"most", percentile(values, 1.0)},
                {"count", values.size()}};
}

// One of the tasks: what its frames and pictures took.
struct Task {
    std::vector<double> frame_ms, slices_ms, volume_ms, error_db;
    size_t slices = 0, volumes = 0;
    Timer timer{};
};

class Rehearsal {
 public:
    Rehearsal(Viewer& viewer, const std::function<void()>& show) : viewer_(viewer), show_(show) {
        viewer_.saw_picture = [this](const Picture& picture) { saw(picture); };
    }
    ~Rehearsal() { viewer_.saw_picture = {}; }

    Result<Json> run() {
        Json report;
        begin();
        if (Result<void> full = refine(); !full)
            return pass_on(full);
        begin();
        for (const char* side : {"home", "end", "page_down", "home", "end", "page_down"}) {
            press_key(side);
            if (Result<void> full = refine(); !full)
                return pass_on(full);
        }
        report["interface_ms"] = figures(task_.frame_ms);
        report["camera"] = turn();
        report["crosshair"] = wander();
        for (const auto& [key, name] : {std::pair("b", "draw"), {"x", "cut"}}) {
            press_key(key);
            begin();
            for (int i = 0; i < kStrokes; ++i) {
                stroke(i);
                if (Result<void> full = refine(); !full)
                    return pass_on(full);
            }
            report[name] = {{"slices_ms", figures(task_.slices_ms)},
                            {"volume_ms", figures(task_.volume_ms)},
                            {"interface_ms", figures(task_.frame_ms)}};
        }
        return report;
    }

 private:
    struct Input { // of a stroke, which no picture has shown yet
        int64_t at_ns, pushed_ns;
    };

    void begin() {
        task_ = {};
        unseen_slices_.clear();
        unseen_volume_.clear();
    }

    void saw(const Picture& picture) {
        const bool is_volume = picture.panel == Panel::volume;
        complete_[static_cast<size_t>(picture.panel)] = picture.complete;
        if (!is_volume && picture.panel != Panel::axial)
            return;
        ++(is_volume ? task_.volumes : task_.slices);
        if (is_volume && picture.error_estimate > 0.0)
            task_.error_db.push_back(-20.0 * std::log10(picture.error_estimate));
        std::deque<Input>& unseen = is_volume ? unseen_volume_ : unseen_slices_;
        for (; !unseen.empty() && unseen.front().pushed_ns <= picture.newest_input_ns;
             unseen.pop_front())
            (is_volume ? task_.volume_ms : task_.slices_ms)
                .push_back(ms(picture.made_ns - unseen.front().at_ns));
    }

    // `draws`: the events are of a stroke.
    void frame(std::vector<Event> events, bool draws = false) {
        const int64_t begun_ns = profile::now_ns();
        const std::uniform_real_distribution<double>::param_type since(
            0.0, static_cast<double>(begun_ns - last_frame_ns_));
        last_frame_ns_ = begun_ns;
        time_s_ += kFrame_s;
        for (Event& event : events)
            event.time_s = time_s_;
        const auto waited = static_cast<int64_t>(moment_(random_, since));
        if (draws) // before it is pushed: a picture of it may come at once
            for (std::deque<Input>* unseen : {&unseen_slices_, &unseen_volume_})
                unseen->push_back({begun_ns - waited, begun_ns});
        viewer_.frame(std::move(events), time_s_);
        show_();
        const int64_t taken_ns = profile::now_ns() - begun_ns;
        task_.frame_ms.push_back(ms(taken_ns));
        std::this_thread::sleep_for(
            std::chrono::duration<double>(std::max(0.0, kFrame_s - 1e-9 * double(taken_ns))));
    }

    void press_key(const char* key) {
        complete_ = {};
        frame({{.kind = Event::Kind::key, .down = true, .key = key}});
        frame({{.kind = Event::Kind::key, .key = key}});
    }
    void move(glm::dvec2 to, bool shift = false, bool draws = false) {
        frame({{.kind = Event::Kind::move, .modifiers = {.shift = shift}, .at_px = to}}, draws);
    }
    void press(bool down, bool draws = false) {
        frame({{.kind = Event::Kind::button, .down = down}}, draws);
    }

    // Until all views show their full pictures, and what was done. An input that changed no sample
    // is never seen.
    Result<void> refine() {
        const Timer timer;
        constexpr int kSettling = 6, kNeverSeen = 90; // frames in which nothing new comes
        for (int quiet = 0;;) {
            const size_t before = task_.volumes + task_.slices;
            frame({});
            if (const auto failure = viewer_.failure())
                return fail("{}", *failure);
            const bool complete = complete_[static_cast<size_t>(Panel::volume)];
            quiet = complete && before == task_.volumes + task_.slices ? quiet + 1 : 0;
            const bool seen = unseen_slices_.empty() && unseen_volume_.empty();
            if (quiet >= (seen ? kSettling : kNeverSeen))
                break;
            if (timer.ms() > 1000.0 * kLongestRefinement_s)
                return fail("--latency: expected full pictures within {} s, found none",
                            kLongestRefinement_s);
        }
        unseen_slices_.clear();
        unseen_volume_.clear();
        return {};
    }

    glm::dvec2 middle(Panel panel) const {
        const Box box = box_of(viewer_.state(), panel).value();
        return glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px);
    }

    Json turn() {
        const glm::dvec2 at = middle(Panel::volume);
        move(at);
        press(true);
        begin();
        for (int i = 0; task_.timer.ms() < 1000.0 * kTurning_s; ++i)
            move(at + 60.0 * glm::dvec2(std::sin(0.05 * i), 0.5 * std::sin(0.031 * i)));
        const double seconds = task_.timer.ms() / 1000.0;
        const Json report{{"pictures_per_s", static_cast<double>(task_.volumes) / seconds},
                          {"error_db", figures(task_.error_db)},
                          {"interface_ms", figures(task_.frame_ms)}};
        press(false);
        return report;
    }

    Json wander() {
        const glm::dvec2 at = middle(Panel::axial);
        begin();
        for (int i = 0; task_.timer.ms() < 1000.0 * kWandering_s; ++i)
            move(at + 70.0 * glm::dvec2(std::sin(0.07 * i), std::sin(0.045 * i)), true);
        const double seconds = task_.timer.ms() / 1000.0;
        return {{"pictures_per_s", static_cast<double>(task_.slices) / seconds},
                {"interface_ms", figures(task_.frame_ms)}};
    }

    void stroke(int number) {
        complete_ = {};
        const glm::dvec2 from = middle(Panel::axial) +
                                50.0 * glm::dvec2(std::sin(1.0 + number), std::cos(2.0 * number));
        move(from);
        press(true, true);
        for (int i = 1; i <= kMovesPerStroke; ++i)
            move(from + 3.0 * glm::dvec2(i, i % 3), false, true);
        press(false);
    }

    Viewer& viewer_;
    const std::function<void()>& show_;
    Task task_;
    std::array<bool, kPanels.size()> complete_{};
    std::deque<Input> unseen_slices_, unseen_volume_;
    std::mt19937 random_{1};
    std::uniform_real_distribution<double> moment_;
    int64_t last_frame_ns_ = profile::now_ns();
    double time_s_ = 1.0;
};

} // namespace

Result<Json> measure_latency(Viewer& viewer, const std::function<void()>& show) {
    return Rehearsal(viewer, show).run();
}

} // namespace palpate::view
