#pragma once

#include <cmath>

#include "haptics/field/coupling.h"
#include "haptics/proxy/effects.h"
#include "haptics/proxy/feel.h"
#include "haptics/proxy/yielding.h"

namespace palpate::haptics {

// The contact state after the tick before, and the place of the proxy.
struct Felt {
    bool has_proxy = false, touching = false, slipping = false;
    bool is_restarted = false; // whatever is felt now is another than before
    glm::dvec3 proxy{0.0}, normal{0.0};
    uint64_t version = 0;
    double iso = 0.0;
    TouchSource source = TouchSource::grey;

    static const std::optional<Volume>& volume_of(const TickInput& input) {
        return input.parameters->source == TouchSource::labels ? input.scene->labels
                                                               : input.scene->grey;
    }
    // Whatever is felt at a place is to be found anew.
    void restart(glm::dvec3 at_mm) {
        *this = Felt{};
        has_proxy = is_restarted = true;
        proxy = at_mm;
    }
    // Notes what is felt now, and says whether it is anything else than before. The first proxy is
    // at the tool.
    bool exchange(const TickInput& input, const Volume& volume) {
        const TouchParameters& p = *input.parameters;
        const bool other = !has_proxy || is_restarted || volume.version() != version ||
                           p.iso != iso || p.source != source;
        is_restarted = false;
        version = volume.version();
        iso = p.iso;
        source = p.source;
        if (!has_proxy)
            proxy = input.tool.position_mm;
        has_proxy = true;
        return other;
    }
};

// The geometric result of a tick.
struct Geometry {
    glm::dvec3 proxy_mm{0.0};
    glm::dvec3 normal{0.0}; // out of what holds it; unit length where touching
    bool touching = false;
    bool submerged = false;    // in material, and no way out is known; nothing is felt
    bool was_replaced = false; // the touched scene was exchanged since the tick before
    bool lacks_data = false;   // what holds the proxy is made of samples without data
    bool is_behind = false;    // work ended before the proxy was where the hand draws it
    double confidence = 1.0;
    uint32_t iterations = 0, contacts = 0;
};

// From geometry to force, the same for every repaired algorithm: slewed parameters, yielding,
// exchanged surfaces bled off, fading, vibration. swept_point.h lists what each does.
class Coupler {
 public:
    void reset(glm::dvec3 tool_mm);

    const Feel& feel() const { return feel_; }
    // A tick begins: the hand as geometry is to take it. is_free(p): nothing solid is at a place p
    // that the proxy yielded to; grain_mm: what geometry may err by. Where is_inside() says so
    // afterwards, geometry is not asked in this tick; where has_come_out(), it begins at
    // place_mm().
    template <class IsFree>
    glm::dvec3 hand(const TickInput& input, double grain_mm, const IsFree& is_free) {
        const bool was_inside = yielding_.is_inside();
        has_come_out_ = was_inside && !stays_inside(is_free(yielding_.place_mm()), grain_mm);
        return hand_of(input);
    }
    bool is_inside() const { return yielding_.is_inside(); } // material that yields
    bool has_come_out() const { return has_come_out_; }
    glm::dvec3 place_mm() const { return yielding_.place_mm(); }
    // Friction, for a proxy that was in contact: where it is drawn to in place of the hand, which
    // it follows but for what the cone lets it stay behind. `slipping` is of the tick before, and
    // then of this one.
    glm::dvec3 rubbed(glm::dvec3 hand_mm, glm::dvec3 proxy_mm, glm::dvec3 normal,
                      bool& slipping) const;
    // The proxy is rendered at the hand: there is no force left.
    bool is_at_hand() const { return rendered_ == hand_; }
    // Fades out; for inputs that cannot be used.
    TickOutput unknown();

    // `may_be`: the feel where the proxy touches. Without one, that of the tick before stays while
    // a force is felt.
    // Where geometry.lacks_data, the spring of the tick before goes along with the hand, shrinks as
    // edits are felt, and nothing else of geometry counts. The caller's next geometry starts from
    // what was known before this tick; once is_at_hand(), at the hand.
    TickOutput couple(const TickInput& input, const Geometry& geometry,
                      const std::optional<Feel>& may_be);

 private:
    bool stays_inside(bool is_free, double grain_mm);
    glm::dvec3 hand_of(const TickInput& input);
    void take_feel(const TickInput& input, const Geometry& geometry,
                   const std::optional<Feel>& may_be);
    void yield(const TickInput& input, const Geometry& geometry);
    TickOutput finish(const TickInput& input, const Geometry& geometry);

    // Kept from the last tick: what was rendered, the hand, and the hand as geometry took it.
    glm::dvec3 rendered_{0.0}, tool_{0.0}, hand_{0.0};
    double presence_ = 1.0, trust_ = 1.0;
    double spring_n_ = 0.0;      // in the last tick, before it faded
    double catching_up_s_ = 0.0; // since an exchange
    bool is_first_ = true, had_force_ = false, has_come_out_ = false;
    bool lacked_data_ = false; // in the last tick
    bool was_submerged_ = false;
    bool is_returning_ = false; // from a force that was held back while behind
    bool has_settled_ = true;   // in the last tick: on a surface, or where the hand is
    Feel feel_;                 // where nothing yields, yield_n is that of kNever_n
    Yielding yielding_;
    ForceCut cut_;
    Bleed bleed_;
    BandNoise vibration_;
    glm::dvec3 last_normal_{0.0}; // of the last contact; 0: there was none
};

} // namespace palpate::haptics
