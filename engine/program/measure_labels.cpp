#include "engine/program/measure_labels.h"

namespace palpate {

Result<std::vector<MeasureReport::Label>> measured_labels(const LoadedVolume& labels,
                                                          const Volume& volume, size_t histogram,
                                                          const std::stop_token& stop) {
    const auto found = label_statistics(labels.volume, &volume, stop, histogram);
    const auto surfaces = label_surfaces(labels.volume, stop);
    if (!found || !surfaces)
        return fail("stopped before all was measured");
    std::vector<MeasureReport::Label> out;
    for (const LabelStatistics& label : *found) {
        MeasureReport::Label& entry = out.emplace_back();
        entry.statistics = label;
        entry.surface = surfaces->at(static_cast<uint16_t>(label.label));
        for (const LabelName& name : labels.labels)
            if (name.label == label.label)
                entry.name = name.name;
    }
    return out;
}

} // namespace palpate
