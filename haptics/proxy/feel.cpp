#include "haptics/proxy/feel.h"

#include <algorithm>

#include "engine/volume/cubic_weights.h"
#include "haptics/field/samples.h"

namespace palpate::haptics {

namespace {

constexpr double kLeastWeight = 1e-6; // less of a spline is rounding

} // namespace

Feel softest_feel(const TouchParameters& q) {
    Feel feel = plain_feel(q);
    if (q.source == TouchSource::labels)
        for (uint32_t k = 0; k < std::min(q.label_count, TouchParameters::kMostLabels); ++k)
            if (const double t0 = q.labels[k].yield_n; t0 > 0.0)
                feel.yield_n = feel.yield_n > 0.0 ? std::min(feel.yield_n, t0) : t0;
    return feel;
}

void FeelMean::add(const Volume& labels, glm::dvec3 index, glm::dvec3 inward, double weight) {
    if (is_plain())
        return;
    for (const double halves : {1.0, 4.0, 8.0})
        if (add_at(labels, index + halves * inward, weight) > kLeastWeight * weight ||
            inward == glm::dvec3(0.0))
            return;
}

// Returns the weight of the labels that it found.
double FeelMean::add_at(const Volume& labels, glm::dvec3 index, double weight) {
    const TouchParameters& q = parameters_;
    if (!glm::all(glm::lessThan(glm::abs(index), glm::dvec3(1e6))))
        return 0.0;
    const glm::dvec3 low = glm::floor(index);
    const glm::dvec3 f = index - low;
    const auto x = cubic_weights(f.x).value, y = cubic_weights(f.y).value,
               z = cubic_weights(f.z).value;
    const uint32_t count = std::min(q.label_count, TouchParameters::kMostLabels);
    double found = 0.0;
    for (int i = 0; i < 64; ++i) {
        const glm::ivec3 at(i & 3, i >> 2 & 3, i >> 4);
        const float label = resident_sample(labels, glm::ivec3(low) - 1 + at);
        if (!(label > 0.0f))
            continue;
        const double share = weight * x[size_t(at.x)] * y[size_t(at.y)] * z[size_t(at.z)];
        Feel feel = plain_feel(q);
        for (uint32_t k = 0; k < count; ++k) {
            const LabelTouch& l = q.labels[k];
            if (double{label} != l.label)
                continue;
            feel = {l.stiffness_n_per_m, l.friction_static, l.friction_dynamic, l.yield_n, l.label};
            shares_[k] += share;
            if (shares_[k] > heaviest_) {
                heaviest_ = shares_[k];
                sum_.label = l.label;
            }
        }
        sum_.stiffness_n_per_m += share * feel.stiffness_n_per_m;
        sum_.friction_static += share * feel.friction_static;
        sum_.friction_dynamic += share * feel.friction_dynamic;
        give_ += feel.yield_n > 0.0 ? share / feel.yield_n : 0.0; // without T0 it gives nothing
        found += share;
    }
    total_ += found;
    return found;
}

std::optional<Feel> FeelMean::feel() const {
    if (is_plain())
        return plain_feel(parameters_);
    if (!(total_ > kLeastWeight))
        return {};
    return Feel{sum_.stiffness_n_per_m / total_, sum_.friction_static / total_,
                sum_.friction_dynamic / total_, give_ > 0.0 ? total_ / give_ : 0.0, sum_.label};
}

} // namespace palpate::haptics
