#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json.h"
#include "engine/image/image.h"
#include "engine/io/scene_data.h"
#include "engine/render/renderer.h"

namespace palpate {

// A picture of a coarser level of a brick file's volume, drawn before the picture itself.
struct Preview {
    std::vector<Image> eyes;
    size_t level = 0; // 1: half as fine, ..
    double ms = 0;    // from the start of drawing to the picture
};

// Draws the finest coarser level of at most 256^3 samples. Fails where there is none.
Result<Preview> draw_preview(GpuDevice& device, const RendererOptions& options, const Scene& scene,
                             const LoadedScene& loaded);

// How the volume lay on the device, for people (where that is worth a line) and for programs.
void say_residency(const FrameStats& stats);
Json residency_json(const FrameStats& stats);

// The most memory that this process has had in use, as the system counts it.
uint64_t peak_rss_bytes();

} // namespace palpate
