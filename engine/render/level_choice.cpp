#include "engine/render/level_choice.h"

#include <algorithm>

namespace palpate {

namespace {

constexpr double kNoneBetween = 1e9; // of the rays of every second pixel

// From the best to the coarsest: the front of error against time, for MIP, iso and alpha alike.
// Longer steps take off little time beside rays that are few (docs/log/rendering.md).
constexpr std::array<Level, LevelChoice::kCount> kLevels{{{1.0, 1.0, 2},
                                                          {1.0, 1.5, 2},
                                                          {1.0, 2.0, 2},
                                                          {1.0, 3.0, 2},
                                                          {1.0, 4.0, 2},
                                                          {1.0, 6.0, 2},
                                                          {1.0, kNoneBetween, 2},
                                                          {1.0, 1.0, 4},
                                                          {2.0, 1.0, 8},
                                                          {2.0, 1.0, 16}}};

// How many samples a level takes, beside one step and one ray a pixel, where one in two pixels both
// ways and those listed are `listed_share` of all.
double samples_of(const Level& level, bool has_steps, double listed_share) {
    const double rays =
        level.px_per_ray == 2 ? listed_share : 1.0 / (1.0 * level.px_per_ray * level.px_per_ray);
    return rays / (has_steps ? level.step_factor : 1.0);
}

// A level is left for a better one when that is expected to take less than this share of the
// budget, so that the two do not take turns.
constexpr double kComfortable = 0.9;

// A coarser level is tried, one at a time, by frames that take more than the budget and whose error
// is below the aim by this factor: a level and the next are less far apart.
constexpr double kFarBetter = 0.3;

// A better level that is not known is tried where frames take less than this share of the room.
constexpr double kTried = 0.6;

// The known time of a level fades by this factor a frame, so that a level that took a tenth too
// long is tried again within 40 frames.
constexpr double kForgotten = 0.995;

// A frame that takes so much longer than those before is of another view, and not averaged.
constexpr double kSudden = 1.5;

} // namespace

const Level& LevelChoice::level() const {
    return kLevels[level_];
}

void LevelChoice::drawn(const Frame& frame, const Budget& budget) {
    const Level level = kLevels[level_];
    if (level.px_per_ray == 2)
        listed_share_ = std::max(frame.traced_share, 0.01);
    const double longest_ms = std::max(budget.frame_ms, budget.longest_ms);
    for (double& known_ms : level_ms_)
        known_ms *= kForgotten; // so that it is tried again
    double& own_ms = level_ms_[level_];
    const bool is_alike = own_ms > 0.0 && frame.wall_ms < kSudden * own_ms;
    own_ms = is_alike ? 0.5 * (own_ms + frame.wall_ms) : frame.wall_ms;
    const double wall_ms = own_ms;
    // The time of an unknown level is guessed from its samples. That is too much for a better
    // level: rays that lie far apart take longer each.
    const auto expected_ms = [&](size_t other) {
        if (level_ms_[other] > 0.0)
            return level_ms_[other];
        return wall_ms - frame.ray_ms +
               frame.ray_ms * samples_of(kLevels[other], frame.has_steps, listed_share_) /
                   samples_of(level, frame.has_steps, listed_share_);
    };
    const bool is_good = frame.error_estimate <= budget.aim;
    // A good frame may take less than its time, and one that is far better than it need be should.
    const bool is_too_good = frame.error_estimate <= kFarBetter * budget.aim;
    if (wall_ms > longest_ms) {
        while (!is_coarsest() && expected_ms(level_) > longest_ms)
            ++level_;
    } else if (wall_ms > budget.frame_ms && is_too_good) {
        level_ = std::min(level_ + 1, kCount - 1);
    } else if (level_ > 0) {
        const double room_ms = kComfortable * (is_good ? budget.frame_ms : longest_ms);
        const bool is_unknown = level_ms_[level_ - 1] == 0.0;
        if (expected_ms(level_ - 1) < room_ms || (is_unknown && wall_ms < kTried * room_ms))
            --level_;
    }
}

} // namespace palpate
