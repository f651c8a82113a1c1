#include "apps/palpate/preview.h"

#include <sys/resource.h>

#include "engine/base/log.h"
#include "engine/base/timer.h"

namespace palpate {

namespace {
constexpr uint64_t kMostSamples = 256ull * 256 * 256;
}

Result<Preview> draw_preview(GpuDevice& device, const RendererOptions& options, const Scene& scene,
                             const LoadedScene& loaded) {
    for (size_t i = 0; i < loaded.coarser.size(); ++i) {
        if (sample_count(loaded.coarser[i].grid()) > kMostSamples)
            continue;
        const Timer timer;
        Renderer renderer(device, options);
        PALPATE_TRY(Frame frame, renderer.render(scene, {loaded.coarser[i], loaded.data.labels,
                                                         loaded.data.meshes}));
        return Preview{std::move(frame.eyes), i + 1, timer.ms()};
    }
    return fail("--preview: expected a brick file (palpate convert IN OUT.pbv) of several levels");
}

void say_residency(const FrameStats& stats) {
    if (!stats.atlas)
        return;
    log::info(
        "the volume is stored in a brick atlas, because {}: {} bricks can be seen, and {} fit",
        stats.residency_reason, stats.needed_bricks, stats.room_for_bricks);
    if (stats.parts > 1)
        log::info("it was marched in {} parts, one after the other", stats.parts);
}

Json residency_json(const FrameStats& stats) {
    Json json;
    json["kind"] = stats.atlas ? "atlas" : "dense";
    json["because"] = stats.residency_reason;
    json["uploaded_bricks"] = stats.uploaded_bricks;
    if (stats.atlas) {
        json["needed_bricks"] = stats.needed_bricks;
        json["room_for_bricks"] = stats.room_for_bricks;
        json["parts"] = stats.parts;
    }
    return json;
}

uint64_t peak_rss_bytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

} // namespace palpate
