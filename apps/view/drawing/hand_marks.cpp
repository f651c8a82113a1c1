#include "apps/view/drawing/hand_marks.h"

#include <algorithm>
#include <cmath>

namespace palpate::view {

std::optional<HandMarks> hand_marks(const ViewState& state, const Grid& grid, Panel panel,
                                    const TouchSample& now) {
    const glm::dvec3 proxy = now.proxy.position_mm;
    const auto at = pixel_of(state, grid, panel, proxy);
    const auto probe = pixel_of(state, grid, panel, now.probe.position_mm);
    if (!at || !probe)
        return std::nullopt;
    HandMarks marks{.proxy_px = *at, .probe_px = *probe};
    glm::dvec3 right;
    double radius_mm = state.radius_mm;
    if (is_slice(panel)) {
        const SliceView& slice = state.slices[static_cast<size_t>(panel)];
        right = slice.right;
        const double off_mm = glm::dot(slice.towards, proxy - state.crosshair_mm);
        marks.is_cut = std::abs(off_mm) < radius_mm;
        if (marks.is_cut && state.stylus.shape == TipShape::ball)
            radius_mm = std::sqrt(radius_mm * radius_mm - off_mm * off_mm);
    } else {
        right = make_view(state.camera, volume_size_px(state)).right;
    }
    if (const auto rim = pixel_of(state, grid, panel, proxy + radius_mm * right))
        marks.radius_px = glm::distance(*rim, *at);
    const auto tip = pixel_of(state, grid, panel, proxy + kArrow_mm_per_n * now.force_n);
    if (tip && glm::distance(*tip, *at) > 1.0)
        marks.arrow_to_px = tip;
    return marks;
}

} // namespace palpate::view
