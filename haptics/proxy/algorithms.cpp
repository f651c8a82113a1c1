#include "haptics/proxy/algorithms.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

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

constexpr uint32_t kSwept = kTakesSource | kTakesLabels | kTakesFriction | kTakesStiction |
                            kTakesYield | kTakesDrag | kTakesVibration;
constexpr uint32_t kEriksson = kTakesSource | kTakesRadius | kTakesFriction | kTakesVibration;
constexpr uint32_t kBilateral = kTakesTransfer | kTakesAcross;

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
     fading<make_vidholm_2004, Reads::source>,
     kTakesSource | kTakesRadius | kTakesSamples | kTakesFriction | kTakesYield},
    {"wish-2008-surface", "gradient frame, unilateral rule (Nystroem et al. 2008)", true,
     fading<make_wish_2008_surface, Reads::grey>, kBilateral},
    {"wish-2008-surface-literal", "the same with the sign of the print", true,
     fading<make_wish_2008_surface_literal, Reads::grey>, kBilateral},
    {"wish-2008-viscosity", "bilateral rules on all axes (Nystroem et al. 2008)", true,
     fading<make_wish_2008_viscosity, Reads::grey>, kBilateral},
    {"wish-2008-potential", "directed force along the gradient (Nystroem et al. 2008)", true,
     fading<make_wish_2008_potential, Reads::grey>, kTakesTransfer},
    {"wish-2008-vector", "directed force along a vector field (Nystroem et al. 2008)", true,
     fading<make_wish_2008_vector, Reads::grey_and_field>, kTakesTransfer | kTakesField},
    {"eriksson-2006", "tangential-then-normal milling proxy (Eriksson et al. 2006)", true,
     fading<make_eriksson_2006, Reads::source>, kEriksson},
    {"eriksson-2006-literal", "the same with the sign of the print", true,
     fading<make_eriksson_2006_literal, Reads::source>, kEriksson},
    {"koerner-1999", "intermediate local surface of 7x7x7 samples (Koerner et al. 1999)", true,
     fading<make_koerner_1999, Reads::source>,
     kTakesSource | kTakesFriction | kTakesOpacity | kTakesDelay},
    {"drill-three-step", "contact point on marching cubes, drilling in three steps (UEA)", true,
     fading<make_drill_three_step, Reads::source>, kTakesSource | kTakesDrill},
    {"guide-inside", "drawn back into an object, by a volume of distances", false,
     fading<make_guide_inside, Reads::nothing>, kTakesYield, /*is_guide=*/true},
    {"guide-onto", "drawn to an edge, a path or a plane, by a volume of distances", false,
     fading<make_guide_onto, Reads::nothing>, kTakesYield, /*is_guide=*/true},
    {"swept-point", "a point held out of grey values or labels, at any speed", false,
     make_swept_point, kSwept},
    {"swept-tool", "a tool of thousands of samples held out of grey values or labels", false,
     make_swept_tool, kSwept | kTakesRadius | kTakesSamples | kTakesTool},
    {"swept-mesh", "a point held out of a mesh", false, make_swept_mesh,
     kSwept | kTakesMesh | kTakesOpacity},
    {"swept-local", "a point held out of marching cubes made in the tick", false, make_swept_local,
     kSwept | kTakesOpacity},
};

// Whether all whose names begin so take it.
bool all_take(std::string_view begin, uint32_t what) {
    return std::all_of(std::begin(kAlgorithms), std::end(kAlgorithms), [&](const auto& entry) {
        return !std::string_view(entry.name).starts_with(begin) || entry.takes(what);
    });
}

std::string_view common_beginning(std::string_view a, std::string_view b) {
    const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
    return a.substr(0, static_cast<size_t>(end - a.begin()));
}

} // namespace

std::span<const AlgorithmEntry> algorithms() {
    return kAlgorithms;
}

std::string takers_text(uint32_t what) {
    std::vector<std::string> names;
    for (const AlgorithmEntry& entry : kAlgorithms) {
        if (!entry.takes(what))
            continue;
        std::string_view begin = entry.name;
        const char* star = "";
        for (const AlgorithmEntry& other : kAlgorithms) {
            const std::string_view common = common_beginning(begin, other.name);
            if (&other == &entry || common.empty() || !all_take(common, what))
                continue;
            begin = common;
            star = "*";
        }
        std::string text = fmt::format("{}{}", begin, star);
        if (std::find(names.begin(), names.end(), text) == names.end())
            names.push_back(std::move(text));
    }
    std::string all;
    for (size_t i = 0; i < names.size(); ++i)
        all += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
    return all;
}

const AlgorithmEntry* find_algorithm(std::string_view name) {
    for (const AlgorithmEntry& entry : kAlgorithms)
        if (name == entry.name)
            return &entry;
    return nullptr;
}

} // namespace palpate::haptics
