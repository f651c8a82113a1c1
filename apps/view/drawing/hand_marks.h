#pragma once

#include <optional>

#include "apps/view/document/touch.h"
#include "apps/view/window/state.h"

namespace palpate::view {

// The hand as it lies in a view, in pixels of the window.
struct HandMarks {
    glm::dvec2 proxy_px{0.0}, probe_px{0.0};
    double radius_px = 0.0;                // of the tool; in a slice of what the plane cuts from it
    bool is_cut = true;                    // slices: the plane goes through the tool
    std::optional<glm::dvec2> arrow_to_px; // from the proxy; none where it points at the eye
};
constexpr double kArrow_mm_per_n = 10.0;

// The tool is drawn at the proxy, where the hand cannot push it further; the probe is where the
// hand is. Nothing where the view is not shown, or a point is behind the eye.
std::optional<HandMarks> hand_marks(const ViewState& state, const Grid& grid, Panel panel,
                                    const TouchSample& now);

} // namespace palpate::view
