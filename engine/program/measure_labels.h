#pragma once

#include "engine/io/volume_io.h"
#include "engine/measure/measure_report.h"

namespace palpate {

// Each label of a label map: its samples in `volume`, its surface and its name.
Result<std::vector<MeasureReport::Label>> measured_labels(const LoadedVolume& labels,
                                                          const Volume& volume, size_t histogram,
                                                          const std::stop_token& stop);

} // namespace palpate
