#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "engine/volume/brick.h"

namespace palpate {

// Round a point or a ball, arrival is nearly cost * (distance - radius), whose third derivatives
// grow without bound towards a point. Differences there are taken of what is left when that is
// subtracted, and its derivatives are put in exactly (additive factoring: Luo & Qian, Factored
// singularities and high-order Lax-Friedrichs sweeping schemes, 2011).
struct MarchNearField {
    glm::dvec3 center;   // mm along the index axes, from sample (0, 0, 0) of the volume
    double radius = 0.0; // of the ball, mm
    double reach = 0.0;  // from the centre, mm
    double cost = 0.0;   // at the source
};

// The part of a fast march within one brick of the volume.
//
// Arrival times of a brick and of two samples beyond it on each side, so that no stencil asks where
// it is. A sample is known once its time is below the end of the open window [begin, end) of times.
// run() relaxes the samples of the window until none changes; those beyond it wait. Known samples
// near a face are told to the tile on the other side, which has them in its margin. Times of first
// order only fall while that is done. Those of second order may also rise: a neighbour's neighbour
// whose time was too late gave a time too early.
class MarchTile {
 public:
    struct Window {
        float begin, end;
    };
    struct Told {
        uint16_t at; // in the padded tile of the receiver
        float time;
    };
    // Faces: 0, 1 are low and high x; 2, 3 y; 4, 5 z.
    using Faces = std::array<std::vector<Told>, 6>;

    // Samples whose cost is not finite, or that lie beyond the `valid` ones, are never reached.
    MarchTile(glm::dvec3 spacing_mm, glm::uvec3 position, const Brick& cost, glm::uvec3 valid,
              std::vector<MarchNearField> near);

    // A sample of known time; it stays as it is. local < 32.
    void start(glm::uvec3 local, float time);

    // Takes in what neighbours told, and marches on within the window. order 1 or 2.
    void run(Window window, int order, const Brick& cost);

    Faces inbox, outbox;
    float earliest_waiting() const { return std::min(near_time_, far_time_); }

    // Sums over the samples that became known in the last run(): their number, and 1 / cost.
    uint64_t known() const { return known_; }
    double inverse_cost() const { return inverse_cost_; }

    // Arrival of the brick's samples, kBrickSamples of them; NaN above `last` and where not
    // reached.
    void copy_out(float last, float* times) const;

 private:
    static constexpr int kMargin = 2, kSide = 36, kPlane = kSide * kSide;
    // Flags; above them, how often the sample's time rose.
    static constexpr uint8_t kQueued = 1, kNear = 2, kFar = 4, kRise = 8, kMostRises = 15;

    // A ring of samples to relax; each is in it once, so that it cannot overflow.
    struct Queue {
        std::array<uint16_t, 65536> at;
        uint16_t begin = 0, end = 0;
    };

    template <int kOrder>
    void relax(Window window, const Brick& cost);
    template <int kOrder>
    float solve(int at, float cost, float end) const;
    template <int kOrder>
    float solve_near(int at, glm::ivec3 local, const MarchNearField& field, float cost,
                     float end) const;
    const MarchNearField* near_field(glm::ivec3 local) const;
    // Second order: whether a sample's time, computed before its neighbours had theirs, is to be
    // raised to `time`. Counted, so that samples which raise each other come to an end.
    bool rises(int at, float before, float& time, float end);
    void take_in();
    void open_waiting(Window window, const float* cost, uint32_t stride);
    void touch(int at, glm::ivec3 local, float before);
    // Queues a neighbour of a sample that is known now, from `time` on.
    [[gnu::always_inline]] void push(int at, float time) {
        const bool go = !(flags_[size_t(at)] & kQueued) & (times_[size_t(at)] > time);
        flags_[size_t(at)] |= uint8_t(go); // kQueued
        queue_->at[queue_->end] = static_cast<uint16_t>(at);
        queue_->end = uint16_t(queue_->end + go);
    }
    void wait(int at, float time);
    void count(float cost) {
        ++known_;
        inverse_cost_ += 1.0 / std::max(double(cost), 1e-30);
    }

    glm::dvec3 spacing_mm_;
    glm::ivec3 origin_;                      // index of the brick's first sample
    std::array<float, 3> weight1_, weight2_; // 1 / h^2 and 9 / (4 h^2)
    std::vector<MarchNearField> near_;
    std::vector<float> times_;
    std::vector<uint8_t> flags_; // kQueued for good where a sample is not this tile's to change
    std::vector<uint16_t> near_list_, far_list_;
    Queue* queue_ = nullptr;                                   // while it runs
    float near_time_ = std::numeric_limits<float>::infinity(); // at most that of any in the list
    float far_time_ = std::numeric_limits<float>::infinity();
    float horizon_ = 0.0f; // those that wait beyond it are in the far list
    uint64_t known_ = 0;
    double inverse_cost_ = 0.0;
};

} // namespace palpate
