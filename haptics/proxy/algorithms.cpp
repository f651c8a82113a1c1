#include "haptics/proxy/algorithms.h"

#include "haptics/field/coupling.h"
#include "haptics/papers/papers.h"
#include "haptics/papers/papers_mesh.h"
#include "haptics/proxy/fading.h"
#include "haptics/proxy/guide.h"
#include "haptics/proxy/swept_mesh.h"
#include "haptics/proxy/swept_point.h"
#include "haptics/proxy/swept_tool.h"

namespace palpate::haptics {

namespace {

struct NoState {};

TickOutput untouched(NoState&, const TickInput& input) noexcept {
    TickOutput output;
    if (is_sane(input))
        output.proxy = input.tool;
    else
        output.contact = Contact::unknown;
    return output;
}

template <std::unique_ptr<Algorithm> (*Make)(), Reads kReads>
std::unique_ptr<Algorithm> fading() {
    return with_fading(Make(), kReads);
}

constexpr AlgorithmEntry kAlgorithms[] = {
    {"none", "nothing is felt: the proxy is the tool", false,
     make_algorithm_of<NoState, untouched>},
    {"vidholm-2004", "sphere of sample points (Vidholm & Agmund 2004)", true,
     fading<make_vidholm_2004, Reads::source>},
    {"wish-2008-surface", "gradient frame, unilateral rule (Nystroem et al. 2008)", true,
     fading<make_wish_2008_surface, Reads::grey>},
    {"wish-2008-surface-literal", "the same with the sign of the print", true,
     fading<make_wish_2008_surface_literal, Reads::grey>},
    {"wish-2008-viscosity", "bilateral rules on all axes (Nystroem et al. 2008)", true,
     fading<make_wish_2008_viscosity, Reads::grey>},
    {"wish-2008-potential", "directed force along the gradient (Nystroem et al. 2008)", true,
     fading<make_wish_2008_potential, Reads::grey>},
    {"wish-2008-vector", "directed force along a vector field (Nystroem et al. 2008)", true,
     fading<make_wish_2008_vector, Reads::grey_and_field>},
    {"eriksson-2006", "tangential-then-normal milling proxy (Eriksson et al. 2006)", true,
     fading<make_eriksson_2006, Reads::source>},
    {"eriksson-2006-literal", "the same with the sign of the print", true,
     fading<make_eriksson_2006_literal, Reads::source>},
    {"koerner-1999", "intermediate local surface of 7x7x7 samples (Koerner et al. 1999)", true,
     fading<make_koerner_1999, Reads::source>},
    {"drill-three-step", "contact point on marching cubes, drilling in three steps (UEA)", true,
     fading<make_drill_three_step, Reads::source>},
    {"guide-inside", "drawn back into an object, by a volume of distances", false,
     fading<make_guide_inside, Reads::nothing>, /*is_guide=*/true},
    {"guide-onto", "drawn to an edge, a path or a plane, by a volume of distances", false,
     fading<make_guide_onto, Reads::nothing>, /*is_guide=*/true},
    {"swept-point", "a point held out of grey values or labels, at any speed", false,
     make_swept_point},
    {"swept-tool", "a tool of thousands of samples held out of grey values or labels", false,
     make_swept_tool},
    {"swept-mesh", "a point held out of a mesh", false, make_swept_mesh},
    {"swept-local", "a point held out of marching cubes made in the tick", false, make_swept_local},
};

} // namespace

std::span<const AlgorithmEntry> algorithms() {
    return kAlgorithms;
}

const AlgorithmEntry* find_algorithm(std::string_view name) {
    for (const AlgorithmEntry& entry : kAlgorithms)
        if (name == entry.name)
            return &entry;
    return nullptr;
}

} // namespace palpate::haptics
