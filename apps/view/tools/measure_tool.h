#pragma once

#include "apps/view/tools/tool.h"

namespace palpate::view {

// The measuring tool.
//
// In slices a press puts a point into the plane; a ruler or a sphere can be drawn in one drag. In
// 3D a click puts it on what is seen there, and drags turn the camera; polygons are drawn in
// slices. A polygon lies in the plane of the slice in which it was begun, and ends by a click on
// its first corner, a double click or Enter. A press on a handle moves it: a sphere's centre with
// the sphere, a polygon's corner in its plane, in 3D on what is seen.

// A point of a measure that can be seen in a panel, and may be taken hold of.
struct MeasureHandle {
    size_t measure = 0, point = 0;
    glm::dvec2 at_px{0.0};
};
constexpr double kMeasureHandle_px = 8.0; // how near a press has to be
// Those of a slice lie in its plane, within half a layer of samples.
std::vector<MeasureHandle> measure_handles(const ViewState& state, const Grid& grid, Panel panel);

extern const Tool kMeasureTool;
void draw_measures(ImDrawList& list, const ViewState& state, Work& work, Panel panel,
                   const Box& box);

// How a measure of a kind is placed: "click end, vertex, end".
const char* placing_of(MeasureKind kind);

// Whether a point lies in the plane of a slice.
bool lies_in(const ViewState& state, const Grid& grid, Panel panel, glm::dvec3 point_mm);

} // namespace palpate::view
