#include "apps/view/window/latency.h"

#include <cmath>
#include <deque>
#include <random>
#include <thread>
#include <utility>

#include "apps/view/window/pacing.h"
#include "engine/base/percentile.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"

namespace palpate::view {

namespace {

constexpr double kLongestRefinement_s = 120.0;
constexpr int kStrokes = 21, kMovesPerStroke = 8;
constexpr double kTurning_s = 2.5, kWandering_s = 3.0;
constexpr double kSoonest_s = 0.008, kLatest_s = 0.025; // from an input to the next

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

// The other way round: the lowest are those that matter.
Json decibels(const std::vector<double>& values) {
    if (values.empty())
        return Json{{"count", 0}};
    return Json{{"median", percentile(values, 0.5)},
                {"p95", percentile(values, 0.05)},
                {"most", percentile(values, 0.0)},
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
    Rehearsal(Viewer& viewer, const std::function<std::optional<Ticket>()>& show)
        : viewer_(viewer), show_(show) {
        viewer_.saw_picture = [this](const Picture& picture) { saw(picture); };
    }
    ~Rehearsal() { viewer_.saw_picture = {}; }

    Result<Json> run() {
        Json report;
        begin();
        if (Result<void> full = refine(); !full)
            return pass_on(full);
        begin();
        constexpr std::array kSides{"home", "end", "page_down"};
        for (int i = 0; i < 2; ++i)
            for (const char* side : kSides) {
                complete_ = {};
                press_key(side);
                if (Result<void> full = refine(); !full)
                    return pass_on(full);
            }
        report["interface_ms"] = figures(task_.frame_ms);
        begin();
        double turned_s = 0.0;
        for (const char* side : kSides) {
            press_key(side);
            turned_s += turn();
        }
        report["camera"] = {{"pictures_per_s", static_cast<double>(task_.volumes) / turned_s},
                            {"error_db", decibels(task_.error_db)},
                            {"interface_ms", figures(task_.frame_ms)}};
        report["crosshair"] = wander();
        for (const auto& [key, name] : {std::pair("b", "draw"), {"x", "cut"}}) {
            press_key(key);
            until(seconds() + 0.2); // views may be made ready for labels
            if (Result<void> full = refine(); !full)
                return pass_on(full);
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
        if (!is_volume && picture.panel != slice_)
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

    struct Frame { // of the interface
        int64_t begun_ns;
        Ticket done;
    };

    static double seconds() { return 1e-9 * static_cast<double>(profile::now_ns()); }

    // One turn of the window's loop.
    void take_turn(std::vector<Event> events) {
        const int64_t begun_ns = profile::now_ns();
        const bool draws = pacing_.begin(seconds(), !under_way_.full());
        for (Event& event : events)
            event.time_s = seconds();
        viewer_.frame(std::move(events), seconds());
        if (!draws)
            return;
        const uint64_t looks = viewer_.looks();
        if (std::exchange(looks_, looks) == looks)
            return;
        if (const std::optional<Ticket> done = show_()) {
            under_way_.add(*done);
            frames_.push_back({begun_ns, *done});
        }
    }

    void look_at_frames() {
        for (; !frames_.empty() && frames_.front().done.ready(); frames_.pop_front())
            task_.frame_ms.push_back(ms(profile::now_ns() - frames_.front().begun_ns));
    }

    // Turns without input until then.
    void until(double then_s) {
        constexpr double kLook_s = 0.0003; // at frames under way
        for (double now_s = seconds(); now_s < then_s; now_s = seconds()) {
            look_at_frames();
            if (now_s >= pacing_.draw_s()) {
                take_turn({});
                continue;
            }
            const double wait_s = std::min(then_s, pacing_.draw_s()) - now_s;
            std::this_thread::sleep_for(std::chrono::duration<double>(
                frames_.empty() ? wait_s : std::min(wait_s, kLook_s)));
        }
    }

    // An input at a random moment. `draws`: it is of a stroke.
    void input(Event event, bool draws = false) {
        input_s_ = std::max(input_s_ + moment_(random_), seconds() - kLatest_s);
        until(input_s_);
        until(pacing_.turn_s());
        look_at_frames();
        if (draws) // before it is pushed: a picture of it may come at once
            for (std::deque<Input>* unseen : {&unseen_slices_, &unseen_volume_})
                unseen->push_back({static_cast<int64_t>(1e9 * input_s_), profile::now_ns()});
        take_turn({std::move(event)});
    }

    void press_key(const char* key) {
        input({.kind = Event::Kind::key, .down = true, .key = key});
        input({.kind = Event::Kind::key, .key = key});
    }
    void move(glm::dvec2 to, bool shift = false, bool draws = false) {
        input({.kind = Event::Kind::move, .modifiers = {.shift = shift}, .at_px = to}, draws);
    }
    void press(bool down, bool draws = false) {
        input({.kind = Event::Kind::button, .down = down}, draws);
    }

    // Until all views show their full pictures, and what was done. An input that changed no sample
    // is never seen.
    Result<void> refine() {
        const Timer timer;
        constexpr int kSettling = 6, kNeverSeen = 90; // frames in which nothing new comes
        for (int quiet = 0;;) {
            const size_t before = task_.volumes + task_.slices;
            until(seconds() + kFrame_s);
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

    // For how long the volume was turned.
    double turn() {
        const glm::dvec2 at = middle(Panel::volume);
        move(at);
        press(true);
        const Timer timer;
        for (int i = 0; timer.ms() < 1000.0 * kTurning_s; ++i)
            move(at + 60.0 * glm::dvec2(std::sin(0.05 * i), 0.5 * std::sin(0.031 * i)));
        const double seconds = timer.ms() / 1000.0;
        press(false);
        return seconds;
    }

    Json wander() {
        const glm::dvec2 at = middle(Panel::axial);
        slice_ = Panel::coronal; // which follows; the slice in which the crosshair moves stays
        begin();
        for (int i = 0; task_.timer.ms() < 1000.0 * kWandering_s; ++i)
            move(at + 70.0 * glm::dvec2(std::sin(0.07 * i), std::sin(0.045 * i)), true);
        const double seconds = task_.timer.ms() / 1000.0;
        return {{"pictures_per_s", static_cast<double>(task_.slices) / seconds},
                {"interface_ms", figures(task_.frame_ms)}};
    }

    void stroke(int number) {
        complete_ = {};
        slice_ = static_cast<Panel>(number % kSlicePanels);
        const glm::dvec2 from =
            middle(slice_) + 50.0 * glm::dvec2(std::sin(1.0 + number), std::cos(2.0 * number));
        move(from);
        press(true, true);
        for (int i = 1; i <= kMovesPerStroke; ++i)
            move(from + 3.0 * glm::dvec2(i, i % 3), false, true);
        press(false);
    }

    Viewer& viewer_;
    const std::function<std::optional<Ticket>()>& show_;
    Task task_;
    Pacing pacing_;
    uint64_t looks_ = 0;
    FramesUnderWay under_way_;
    std::deque<Frame> frames_;   // whose time is not known yet
    Panel slice_ = Panel::axial; // in which a person works
    std::array<bool, kPanels.size()> complete_{};
    std::deque<Input> unseen_slices_, unseen_volume_;
    std::mt19937 random_{1};
    std::uniform_real_distribution<double> moment_{kSoonest_s, kLatest_s};
    double input_s_ = 0.0; // when the last was
};

} // namespace

Result<Json> measure_latency(Viewer& viewer, const std::function<std::optional<Ticket>()>& show) {
    return Rehearsal(viewer, show).run();
}

} // namespace palpate::view
