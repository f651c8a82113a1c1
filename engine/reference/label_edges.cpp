#include "engine/reference/label_edges.h"

#include <algorithm>
#include <map>

namespace palpate::reference {

LabelPlace label_place(const std::function<uint32_t(glm::ivec3)>& label_of, glm::dvec3 index) {
    struct Weight {
        double weight = 0.0;
        glm::dvec3 slope{0.0};
    };
    const glm::dvec3 low = glm::floor(index), f = index - low;
    std::map<uint32_t, Weight> weights;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 at(corner & 1, corner >> 1 & 1, corner >> 2);
        glm::dvec3 share, rise;
        for (int axis = 0; axis < 3; ++axis) {
            share[axis] = at[axis] ? f[axis] : 1.0 - f[axis];
            rise[axis] = at[axis] ? 1.0 : -1.0;
        }
        Weight& weight = weights[label_of(glm::ivec3(low) + at)];
        weight.weight += share.x * share.y * share.z;
        weight.slope += rise * glm::dvec3(share.y * share.z, share.x * share.z, share.x * share.y);
    }
    const auto lighter = [](const auto& a, const auto& b) {
        return a.second.weight < b.second.weight;
    };
    const auto most = std::max_element(weights.begin(), weights.end(), lighter);
    LabelPlace place{most->first, most->first, most->second.weight, most->second.slope};
    weights.erase(most);
    if (weights.empty())
        return place;
    const auto next = std::max_element(weights.begin(), weights.end(), lighter);
    place.other = next->first;
    place.margin -= next->second.weight;
    place.slope -= next->second.slope;
    return place;
}

double label_cover(uint32_t label, double depth_px, bool edge, double outline_px, double fill) {
    if (label == 0)
        return 0.0;
    const double line = edge ? 1.0 : std::clamp(outline_px - depth_px + 0.5, 0.0, 1.0);
    return glm::mix(fill, 1.0, outline_px > 0.0 ? line : 0.0);
}

} // namespace palpate::reference
