#pragma once

#include "bench/suite/measure.h"

namespace palpate::bench {

// Dabs of radius 5 mm in a surface that is in the picture: the head CT's skull at 512 x 512 x 174
// samples, 300 HU, closed, and for --tiny a phantom's. Each dab takes a ball out at a vertex of the
// surface. One row for each way of keeping the picture up to date:
//   device  a live surface whose blocks the device makes
//   cpu     a live surface whose blocks the CPU makes
//   mesh    the blocks that the CPU makes, joined to a mesh, of which the renderer uploads pieces
//   of
//           4 KiB that differ
// with what is made anew (blocks of 8^3 samples), bytes that copies bring to the device, and the
// time of the thread that records the frame, all of a dab. Adds a sentence to `failures` where a
// picture after the last dab is not, to the bit, that of the mesh made from scratch.
Result<Json> measure_live(Bench& bench, std::vector<std::string>& failures);

} // namespace palpate::bench
