// The cost of bringing voxels to the device: a whole volume, and the bricks an edit touched,
// beside a plain memcpy of as many bytes.

#include <algorithm>
#include <cstring>

#include "bench/suite/suites.h"
#include "engine/base/percentile.h"
#include "engine/base/timer.h"
#include "engine/volume/edit.h"

namespace palpate::bench {

namespace {

// A picture so small that drawing it is nothing beside an upload; what it takes is subtracted.
Scene small_scene(const Sample& sample) {
    Subject subject = mip_subject(sample, -200, 2000);
    return scene_of(subject, 8);
}

Result<double> draw_ms(Renderer& renderer, const Scene& scene, const Volume& volume) {
    const Timer timer;
    PALPATE_TRY(renderer.draw(scene, {volume, std::nullopt}));
    return timer.ms();
}

// The volume with one voxel changed in each of `count` bricks, spread over all of it.
Volume edited(const Volume& volume, uint32_t count, double value) {
    const glm::uvec3 bricks = volume.brick_count();
    const uint64_t all = uint64_t{bricks.x} * bricks.y * bricks.z;
    VolumeEdit edit(volume);
    for (uint32_t i = 0; i < count; ++i) {
        const uint64_t n = i * all / count;
        const glm::uvec3 brick(n % bricks.x, n / bricks.x % bricks.y,
                               n / (uint64_t{bricks.x} * bricks.y));
        edit.set(glm::min(brick * kBrickSide + 7u, volume.size() - 1u), value);
    }
    return edit.commit();
}

double memcpy_ms(uint64_t bytes, int repeats) {
    std::vector<char> from(bytes, 1), to(bytes, 2);
    std::vector<double> times;
    for (int i = 0; i < repeats; ++i) {
        from[static_cast<size_t>(i) % bytes] ^= 1; // so that no copy is another's
        const Timer timer;
        std::memcpy(to.data(), from.data(), bytes);
        times.push_back(timer.ms());
    }
    return percentile(times, 0.5);
}

Json row(const std::string& what, const std::vector<double>& times, uint64_t bytes, int repeats) {
    const Spread ms = spread(times);
    const double copy = memcpy_ms(bytes, repeats);
    return {{"what", what},
            {"bytes", bytes},
            {"ms", {{"median", ms.median}, {"p95", ms.p95}, {"low", ms.low}, {"high", ms.high}}},
            {"gb_per_s", static_cast<double>(bytes) / ms.median * 1e-6},
            {"memcpy_ms", copy},
            {"share_of_memcpy", copy / ms.median}};
}

} // namespace

Result<Report> run_upload(Bench& bench) {
    const Options& options = bench.options();
    const uint32_t side = options.tiny ? 64 : options.full ? 512 : 256;
    const int repeats = options.tiny ? 2 : options.full ? 31 : 11;
    const Sample sample = phantom(side);
    const Scene scene = small_scene(sample);
    Report report;
    report.json["title"] = sample.title;
    report.json["rows"] = Json::array();
    std::vector<double> whole, still;
    uint64_t whole_bytes = 0;
    for (int i = 0; i < repeats; ++i) {
        if (options.stop.stop_requested())
            return fail("interrupted");
        Renderer renderer(bench.device());
        const uint64_t before = bench.device().traffic().uploaded_bytes;
        PALPATE_TRY(const double first, draw_ms(renderer, scene, sample.volume));
        whole_bytes = bench.device().traffic().uploaded_bytes - before;
        whole.push_back(std::max(1e-3, first - renderer.pipeline_wait_ms()));
    }
    report.json["rows"].push_back(
        row("whole volume and all that is derived from it, first frame of 8 x 8 pixels included",
            whole, whole_bytes, repeats));
    Renderer renderer(bench.device());
    Volume now = sample.volume;
    PALPATE_TRY(draw_ms(renderer, scene, now));
    for (int i = 0; i < repeats; ++i)
        still.push_back(*draw_ms(renderer, scene, now));
    const double still_ms = percentile(still, 0.5);
    report.json["frame_without_edit_ms"] = still_ms;
    double value = 0.0;
    const glm::uvec3 bricks = sample.volume.brick_count();
    for (const uint32_t count : {1u, 16u, 64u, 256u}) {
        if (count > bricks.x * bricks.y * bricks.z)
            continue;
        std::vector<double> times;
        uint64_t bytes = 0;
        for (int i = 0; i < repeats; ++i) {
            now = edited(now, count, value = value > 900 ? 0 : value + 1);
            const uint64_t before = bench.device().traffic().uploaded_bytes;
            PALPATE_TRY(const double ms, draw_ms(renderer, scene, now));
            bytes = bench.device().traffic().uploaded_bytes - before;
            times.push_back(std::max(1e-3, ms - still_ms));
        }
        report.json["rows"].push_back(
            row(fmt::format("{} brick{} with one changed voxel each", count, count == 1 ? "" : "s"),
                times, bytes, repeats));
    }
    return report;
}

} // namespace palpate::bench
