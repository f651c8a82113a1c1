#include "apps/view/document/removed_material.h"

#include <exception>

#include "engine/measure/label_statistics.h"

namespace palpate::view {

RemovedMaterial::RemovedMaterial(OpenDocument& document) : document_(document) {
    counter_.begin(document_.first_grey());
}

void RemovedMaterial::reset() {
    counter_.begin(document_.grey());
}

std::optional<RemovedMaterial::Amounts> RemovedMaterial::now() {
    const EditState state = document_.edited();
    const Volume* labels = state.document.find(document_.labels_name());
    Amounts amounts;
    amounts.solid_from = document_.session().parameters().iso;
    try {
        const Volume& grey = *state.document.find(document_.grey_name());
        const double one_mm3 = sample_mm3(grey.grid());
        for (const auto& [label, samples] : counter_.count(
                 grey, amounts.solid_from, labels ? std::optional(*labels) : std::nullopt)) {
            amounts.by_label_mm3.emplace_back(label, one_mm3 * static_cast<double>(samples));
            amounts.all_mm3 += amounts.by_label_mm3.back().second;
        }
    } catch (const std::exception&) { // who edits or draws them says so
        return std::nullopt;
    }
    return amounts;
}

} // namespace palpate::view
