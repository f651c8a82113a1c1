#pragma once

#include <array>
#include <optional>

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// Haptic properties of what is touched: the parameters, or means over labels.
struct Feel {
    double stiffness_n_per_m = 0.0;
    double friction_static = 0.0, friction_dynamic = 0.0;
    double yield_n = 0.0; // 0 is never
    uint32_t label = 0;   // the one that counts most
};

// The feel where no label has its own.
inline Feel plain_feel(const TouchParameters& p) {
    return {p.stiffness_n_per_m, p.friction_static, p.friction_dynamic, p.yield_n, 0};
}

// The feel while something is touched and nothing tells what: T0 is the least there is.
Feel softest_feel(const TouchParameters& parameters);

// The feel of the material that a proxy touches at one place or several. It is plain_feel() where
// no labels are felt or none has properties of its own. Else it is the mean over the labels around
// the places, weighted by the cubic B-spline of 4x4x4 samples; of T0 it is the mean of what gives,
// 1 / T0.
//
// Places are contact points, never the tool's centre: a ball's centre lies in the air while the
// ball touches. About 0.4 us a place.
class FeelMean {
 public:
    explicit FeelMean(const TouchParameters& parameters) : parameters_(parameters) {}
    bool is_plain() const {
        return parameters_.source != TouchSource::labels || parameters_.label_count == 0;
    }
    // A place in index space. `inward`: the way into the material in index space, as long as half
    // a sample; along it labels are looked for up to four samples, where none lies around the place
    // itself. 0: at the place alone.
    void add(const Volume& labels, glm::dvec3 index, glm::dvec3 inward, double weight = 1.0);
    // None where places were in the air: they say nothing of the material.
    std::optional<Feel> feel() const;

 private:
    double add_at(const Volume& labels, glm::dvec3 index, double weight);

    const TouchParameters& parameters_;
    Feel sum_;
    double total_ = 0.0, give_ = 0.0; // of weights; of weights by 1 / T0
    std::array<double, TouchParameters::kMostLabels> shares_{};
    double heaviest_ = 0.0;
};

} // namespace palpate::haptics
