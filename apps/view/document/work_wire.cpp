// The part of a document's work that live-wires need: costs of its slices, and what a contour
// fills.

#include "apps/view/document/work.h"
#include "apps/view/tools/wire_tool.h"
#include "engine/segment/label_merge.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate::view {

std::vector<glm::uvec3> Work::wire_path(glm::uvec3 from, glm::uvec3 to, int axis) {
    const EditState now = edited();
    const Volume& grey = *now.document.find(grey_name());
    glm::uvec3 first(0), size = grey.size();
    first[axis] = from[axis];
    size[axis] = 1;
    const WireSlice slice{grey.version(), axis, from[axis]};
    if (!wire_ || wire_slice_ != slice) {
        Result<LiveWireRegion> region = live_wire_region(grey, first, size, {}, {});
        if (!region) {
            message_ = region.error().message;
            return {from, to};
        }
        wire_.emplace(std::move(*region));
        wire_slice_ = slice;
        wire_anchor_.reset();
    }
    if (wire_anchor_ != from)
        wire_->set_anchor(from - first);
    wire_anchor_ = from;
    std::vector<glm::uvec3> path = wire_->path(to - first);
    for (glm::uvec3& at : path)
        at += first;
    return path;
}

void Work::fill_wire(const ViewState& state) {
    session().settle();
    const EditState now = edited();
    const Volume* labels = now.document.find(labels_name());
    const Volume map = labels ? *labels : empty_labels(subject_.grid);
    const ScalarType type = state.label > 255 ? ScalarType::u16 : ScalarType::u8;
    VolumeEdit inside(VolumeBuilder(subject_.grid, type).finish());
    const Wiring& wiring = state.own.of<Wiring>();
    const std::vector<glm::uvec3> samples = filled(wiring.closed, wiring.axis);
    for (const glm::uvec3 at : samples)
        inside.set(at, state.label);
    Result<Volume> merged = with_labels(map, inside.commit(), {}, state.notes.locked_labels, {});
    if (!merged) {
        message_ = merged.error().message;
        return;
    }
    if (merged->is_same_as(map)) {
        message_ = "live-wire: no sample changed";
        return;
    }
    const Json parameters{{"axis", wiring.axis},
                          {"slice", wiring.closed.front()[wiring.axis]},
                          {"label", state.label}};
    if (session().put({labels_name(), VolumeKind::labels, std::move(*merged)}, "live-wire",
                      parameters))
        message_ = fmt::format("live-wire: {} samples of label {}", samples.size(),
                               name_of_label(state.label));
}

} // namespace palpate::view
