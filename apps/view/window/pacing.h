#pragma once

#include <algorithm>
#include <deque>

#include "apps/view/script/script.h"
#include "engine/gpu/commands.h"

namespace palpate::view {

// When the loop of a window takes turns: input is taken as soon as it comes, so that an edit waits
// for no picture of the window, and the window is drawn kFrame_s after it was drawn last, or when
// the device has drawn what it was given. Times are in seconds on one clock, which never falls.
class Pacing {
 public:
    // The earliest next turn, also where there is input: a mouse that tells of a thousand moves a
    // second does not take the processor.
    double turn_s() const { return turn_s_; }
    // The next turn without input; not before turn_s().
    double draw_s() const { return std::max(draw_s_, turn_s_); }

    // A turn begins. `can_draw`: the device is not behind. Whether this turn draws.
    bool begin(double now_s, bool can_draw) {
        constexpr double kApart_s = 0.25 * kFrame_s;
        turn_s_ = now_s + kApart_s;
        if (now_s < draw_s_ || !can_draw)
            return false;
        // On time on average where a turn comes a little late; after a pause from now on.
        draw_s_ = (now_s - draw_s_ < kFrame_s ? draw_s_ : now_s) + kFrame_s;
        return true;
    }

 private:
    double turn_s_ = 0.0, draw_s_ = 0.0;
};

// Frames of the window that the device is drawing.
class FramesUnderWay {
 public:
    static constexpr size_t kMost = 2;

    void add(Ticket frame) { frames_.push_back(std::move(frame)); }
    bool full() {
        while (!frames_.empty() && frames_.front().ready())
            frames_.pop_front();
        return frames_.size() >= kMost;
    }

 private:
    std::deque<Ticket> frames_;
};

} // namespace palpate::view
