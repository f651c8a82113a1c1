#pragma once

#include <algorithm>
#include <glm/glm.hpp>

#include "haptics/core/device.h"
#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// How much force may change in a tick because the hand moved, N: that of a spring and a damper
// whose proxy a convex surface holds, with friction, and of vibration at this removal.
// The stiffest and roughest label counts. `moved_mm` and `sped_mm_per_s` are the changes of the
// tool's position and velocity since the tick before.
double natural_change_n(const TouchParameters& parameters, double moved_mm, double sped_mm_per_s,
                        double removal) noexcept;

// Whether the force says nothing of a surface that holds the tool out: there is none, it is not
// known, or it was not reached.
inline bool has_no_surface(Contact contact) noexcept {
    return contact == Contact::submerged || contact == Contact::behind ||
           contact == Contact::unknown;
}

// The rendered force after a command, or after a change of status: another scene, table, switch or
// tool changes at once what is felt, and so does a surface that is lost or found
// (has_no_surface()). The force must not jump.
//
// For kWatch_s from a command or a change on (and surface_delay_s, after which a local surface is
// exchanged), the force changes in a tick by at most the natural change and kRate_n_per_s * dt.
// What is beyond is kept as a difference to the rendered force, which shrinks by as much a tick:
// the spring stays as stiff as it is, and within kWatch_s + 2 * most_n / kRate_n_per_s the force is
// the rendered one. Without either nothing changes. Torque likewise, over a lever of kLever_m.
//
// Neither allocates nor throws; a function of its inputs.
class ForceFade {
 public:
    static constexpr double kRate_n_per_s = 90.0; // as a hand feels an edit (proxy/swept_point.h)
    static constexpr double kWatch_s = 0.1;
    static constexpr double kLever_m = 0.02;

    // most_n: to which the force is limited afterwards; what is beyond makes no jump.
    explicit ForceFade(double most_n) noexcept : most_n_(most_n) {}

    // The tick that follows is the first: its force is taken as it is.
    void reset() noexcept;
    // From now on the force is watched for kWatch_s and so much longer.
    void command(double longer_s) noexcept {
        watch_s_ = kWatch_s + std::clamp(longer_s, 0.0, MostTouch::delay_s);
    }
    // The wrench to send for a rendered one. Values that are not finite are passed on.
    Wrench next(const Wrench& rendered, double natural_n, double dt_s) noexcept;

 private:
    struct Part {
        glm::dvec3 left{0.0}, last{0.0};
        glm::dvec3 next(glm::dvec3 limited, double most_change, double less) noexcept;
    };
    double most_n_;
    double watch_s_ = 0.0;
    bool has_last_ = false;
    Part force_, torque_;
};

} // namespace palpate::haptics
