#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "apps/view/document/open_document.h"
#include "engine/measure/removed.h"

namespace palpate::view {

// Material that tools have taken away since the first step that can be undone, which may be one of
// an earlier window, or since reset(): samples that were solid then and are not now. Undo gives it
// back.
class RemovedMaterial {
 public:
    explicit RemovedMaterial(OpenDocument& document);

    struct Amounts {
        double all_mm3 = 0.0;
        std::vector<std::pair<uint16_t, double>> by_label_mm3; // rising; 0: under no label
        double solid_from = 0.0;                               // the value, as the hand feels it
    };
    // Those of the newest state; reads bricks that have changed since. None: samples cannot
    // be read.
    std::optional<Amounts> now();
    void reset(); // count from here on

 private:
    OpenDocument& document_;
    RemovedCounter counter_;
};

} // namespace palpate::view
