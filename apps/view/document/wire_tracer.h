#pragma once

#include <optional>
#include <vector>

#include "apps/view/document/open_document.h"
#include "engine/segment/live_wire.h"

namespace palpate::view {

// Live-wires: paths along edges of the grey values in one slice, and labels of what they surround.
class WireTracer {
 public:
    explicit WireTracer(OpenDocument& document) : document_(document) {}

    // The path of least cost between two samples of a slice across an axis (Subject::path).
    std::vector<glm::uvec3> path(glm::uvec3 from, glm::uvec3 to, int axis);
    // Gives the inside of the contour that was closed the label that is drawn, as one step.
    void fill(const ViewState& state);

 private:
    struct Slice { // of which volume
        uint64_t version;
        int axis;
        uint32_t layer;
        friend bool operator==(const Slice&, const Slice&) = default;
    };

    OpenDocument& document_;
    std::optional<LiveWire> wire_; // what it knows of slice_, from anchor_
    std::optional<Slice> slice_;
    std::optional<glm::uvec3> anchor_;
};

} // namespace palpate::view
