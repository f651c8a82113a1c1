#pragma once

#include <glm/glm.hpp>

namespace palpate::haptics {

// Material that gives way above a force T0, for every repaired algorithm.
//
// Outside, geometry holds the proxy and the coupling is cut at T0. Where it presses along the
// contact's normal with more than T0 the proxy enters the material, and geometry is not asked until
// it is out again. In the material the proxy
//
//   follows the hand at once back the way it entered, and across that way but for friction;
//   goes towards a hand from which the spring is longer than T0 / k, by what it is longer, and by
//   no more than kSpeed_mm_per_s.
//
// Force is that of the spring and at most T0. The proxy is out where nothing solid is at its place.
// There geometry goes on, and force falls to what it says by kRate_n_per_s; then the proxy makes up
// what it lags behind the hand, by kSpeed_mm_per_s beyond the hand's own motion. So force changes
// by yielding no faster than that rate, whatever the body's shape. Units: mm, N, s.
class Yielding {
 public:
    static constexpr double kSpeed_mm_per_s = 200.0;
    static constexpr double kRate_n_per_s = 90.0; // 0.09 N in a millisecond: as edits are felt

    bool is_inside() const { return is_inside_; }
    bool is_leaving() const { return is_leaving_; } // out, and force or place still behind
    glm::dvec3 place_mm() const { return place_; }  // of the proxy inside
    glm::dvec3 normal() const { return entry_; }    // that it entered against

    void enter(glm::dvec3 proxy_mm, glm::dvec3 normal, glm::dvec3 hand_mm);
    // A tick inside. stiffness > 0, N/mm; yield_n may be infinite.
    void sink(glm::dvec3 hand_mm, double stiffness, double yield_n, double friction, double dt_s);
    // Whether it stays inside. is_free: nothing solid is at its place; grain_mm: what geometry may
    // err by. Otherwise it is out, with a force of felt_n towards the place from the hand.
    bool stays(bool is_free, double grain_mm, glm::dvec3 hand_mm, double stiffness, double felt_n);
    // The place that geometry is to take the hand to be at.
    glm::dvec3 hand(glm::dvec3 hand_mm) const { return hand_mm + lag_; }
    // Makes up for part of the lag, once force has fallen.
    void catch_up(double stiffness, double dt_s);
    // How fast what was rendered may move to what geometry says after it is out.
    static double speed_mm_per_s(double stiffness);

 private:
    bool is_inside_ = false, was_in_material_ = false, is_leaving_ = false;
    glm::dvec3 place_{0.0}, hand_{0.0}, entry_{0.0}, lag_{0.0};
    double slack_ = 0.0; // of the spring across the way in, when it entered; shrinks
    double path_ = 0.0;  // since it entered
};

// The largest force of a coupling: at most yield_n (infinite: none), but for changes of that, which
// are felt at Yielding::kRate_n_per_s.
class ForceCut {
 public:
    glm::dvec3 cut(glm::dvec3 force_n, double yield_n, double dt_s);
    double felt_n() const { return felt_n_; } // of the last tick

 private:
    double felt_n_ = 0.0;
    bool was_cut_ = false;
};

} // namespace palpate::haptics
