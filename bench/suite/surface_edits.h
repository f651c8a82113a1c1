#pragma once

#include "bench/suite/surface_peers.h"
#include "engine/surface_gpu/extract_pipelines.h"

namespace palpate::bench {

// Table 1 of Vidholm & Agmund (2004): a Gaussian of 128^3 cut at a level that gives some number of
// triangles, eroded by balls of 5 and 10 samples at points of its surface. A dab is what brings the
// surface up to date once the volume has been edited:
//   tracker     the paper's extractor: its arrays updated locally, all triangles again, as printed.
//               The segmentation that it reads follows the values outside the time.
//   blocks      finding what changed, and the blocks made again that read a changed sample
//   blocks_gpu  the same on the device, upload of the changed samples included
//   vtkFlyingEdges3D  everything extracted again
// Each dab starts from the whole Gaussian, so that the number of triangles stays. Rounds of some
// dabs go through all of them in turn. Adds a sentence to `failures` where two of ours hold
// different numbers of triangles after the same dab. One row for each number of triangles, radius
// and who.
Result<Json> measure_edits(ExtractPipelines& pipelines, SurfacePeers& peers, const Options& options,
                           std::vector<std::string>& failures);

// The aims of the rows at 100 000 triangles: {what, aim, figure, reached}.
void add_edit_aims(const Json& rows, bool cpu_device, Json& aims);

} // namespace palpate::bench
