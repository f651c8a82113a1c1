#include "apps/view/document/wire_tracer.h"

#include "apps/view/tools/wire_tool.h"
#include "engine/segment/label_merge.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate::view {

std::vector<glm::uvec3> WireTracer::path(glm::uvec3 from, glm::uvec3 to, int axis) {
    const Volume grey = document_.grey();
    glm::uvec3 first(0), size = grey.size();
    first[axis] = from[axis];
    size[axis] = 1;
    const Slice slice{grey.version(), axis, from[axis]};
    if (!wire_ || slice_ != slice) {
        Result<LiveWireRegion> region = live_wire_region(grey, first, size, {}, {});
        if (!region) {
            document_.tell(region.error().message);
            return {from, to};
        }
        wire_.emplace(std::move(*region));
        slice_ = slice;
        anchor_.reset();
    }
    if (anchor_ != from)
        wire_->set_anchor(from - first);
    anchor_ = from;
    std::vector<glm::uvec3> path = wire_->path(to - first);
    for (glm::uvec3& at : path)
        at += first;
    return path;
}

void WireTracer::fill(const ViewState& state) {
    document_.session().settle();
    const Volume map = document_.labels_or_empty();
    const ScalarType type = state.label > 255 ? ScalarType::u16 : ScalarType::u8;
    VolumeEdit inside(VolumeBuilder(document_.subject().grid, type).finish());
    const Wiring& wiring = state.own.of<Wiring>();
    const std::vector<glm::uvec3> samples = filled(wiring.closed, wiring.axis);
    for (const glm::uvec3 at : samples)
        inside.set(at, state.label);
    const Result<Volume> merged = with_labels(map, inside.commit(), {}, {});
    if (!merged)
        return document_.tell(merged.error().message);
    if (merged->is_same_as(map))
        return document_.tell("live-wire: no sample changed");
    // Locked labels are left to the editor, which tells of them.
    const Json parameters{{"axis", wiring.axis},
                          {"slice", wiring.closed.front()[wiring.axis]},
                          {"label", state.label}};
    if (document_.put_labels(*merged, "live-wire", parameters))
        document_.tell(fmt::format("live-wire: {} samples of label {}", samples.size(),
                                   document_.name_of_label(state.label)));
}

} // namespace palpate::view
