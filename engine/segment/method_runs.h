#pragma once

#include "engine/segment/methods.h"

// The functions behind the table of methods: one function a method, from values that are within
// their ranges, NaN where they are to be found from the data. Those that take seeds have some.
namespace palpate {

using RunMethod = Result<Segmented>(const SegmentInput& input, const ParameterValues& values,
                                    const Task& task);

RunMethod run_threshold, run_otsu, run_growing, run_grow, run_watershed, run_connectedness,
    run_walker, run_march_edges, run_march_statistics, run_mesh, run_wires, run_level_threshold,
    run_level_edges, run_level_regions;

} // namespace palpate
