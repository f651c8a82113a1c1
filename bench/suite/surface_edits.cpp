#include "bench/suite/surface_edits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "bench/suite/panel.h"
#include "engine/base/log.h"
#include "engine/base/percentile.h"
#include "engine/surface/block_surface.h"
#include "engine/surface/tracker.h"
#include "engine/surface_gpu/gpu_surface.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {

namespace {

constexpr uint32_t kSide = 128;
constexpr double kSigma = 24.0, kMiddle = (kSide - 1) / 2.0;

// Frames a second as the paper prints them, for 20 000, 30 000, .. 100 000 triangles.
constexpr std::array<std::array<double, 2>, 9> kPrinted{
    {{52, 40}, {39, 25}, {30, 22}, {25, 19}, {21, 17}, {20, 18}, {17, 15}, {11, 10}, {9, 8}}};

struct Gaussian {
    double radius; // of the surface, in samples
    float iso;
    Sample sample;
};

// Marching cubes give a sphere some 12 pi r^2 triangles, r in samples.
Gaussian gaussian_of(uint32_t triangles) {
    const double r = std::sqrt(triangles / (12.0 * std::numbers::pi));
    return {r,
            static_cast<float>(std::exp(-r * r / (2.0 * kSigma * kSigma))),
            {"gaussian", "Gaussian, 128^3",
             synthetic::sample(synthetic::gaussian(glm::dvec3(kMiddle), kSigma, /*peak=*/1.0),
                               make_grid(glm::uvec3(kSide), glm::dvec3(1.0)), ScalarType::f32)}};
}

struct Dab {
    glm::dvec3 centre;
    glm::uvec3 low, high; // samples that may have changed, both included
    Volume after;
};

// A ball taken out: values fall to iso at its surface, as of a distance.
Dab eroded(const Gaussian& base, glm::dvec3 centre, double radius, double slope) {
    const glm::uvec3 low(glm::max(glm::floor(centre - radius), glm::dvec3(0.0)));
    const glm::uvec3 high(glm::min(glm::ceil(centre + radius), glm::dvec3(kSide - 1.0)));
    VolumeEdit edit(base.sample.volume);
    for (uint32_t z = low.z; z <= high.z; ++z)
        for (uint32_t y = low.y; y <= high.y; ++y)
            for (uint32_t x = low.x; x <= high.x; ++x) {
                const glm::uvec3 at(x, y, z);
                const double distance = glm::length(glm::dvec3(at) - centre);
                if (distance < radius)
                    edit.set(at, std::min(double{edit.value(at)},
                                          base.iso + slope * (distance - radius)));
            }
    return {centre, low, high, edit.commit()};
}

struct Done {
    double ms = 0.0;
    uint64_t triangles = 0; // that the surface has after the dab
    double blocks = 0.0;    // made again
};

// Who keeps a surface up to date. dab() does one and undoes it, outside the time; nothing where a
// peer fell silent.
struct Keeper {
    std::string who;
    std::function<std::optional<Done>(const Dab&)> dab;
};

template <class Surface>
Keeper in_blocks(std::string who, std::shared_ptr<Surface> surface) {
    return {std::move(who), [=](const Dab& dab) -> std::optional<Done> {
                const Volume base = surface->volume();
                const Timer timer;
                const auto update = surface->update(dab.after, changed_bricks(base, dab.after));
                const Done done{timer.ms(), surface->triangles(),
                                static_cast<double>(update.blocks.size())};
                surface->update(base);
                return done;
            }};
}

Keeper by_tracker(const Volume& base, float iso) {
    struct Kept {
        Volume mask;
        SurfaceTracker tracker;
    };
    const Volume mask = make_volume(base.grid(), ScalarType::u8,
                                    [&](glm::uvec3 i) { return base.value(i) >= iso ? 1.0 : 0.0; });
    auto kept = std::make_shared<Kept>(Kept{mask, SurfaceTracker(mask, 1)});
    kept->tracker.find_all();
    return {"tracker", [=](const Dab& dab) -> std::optional<Done> {
                VolumeEdit edit(kept->mask);
                for (uint32_t z = dab.low.z; z <= dab.high.z; ++z)
                    for (uint32_t y = dab.low.y; y <= dab.high.y; ++y)
                        for (uint32_t x = dab.low.x; x <= dab.high.x; ++x)
                            edit.set({x, y, z}, dab.after.value({x, y, z}) >= iso ? 1.0 : 0.0);
                const Volume after = edit.commit();
                const Timer timer;
                kept->tracker.update(after, dab.low, dab.high);
                const Mesh mesh = kept->tracker.triangulate();
                const Done done{timer.ms(), mesh.triangles.size(), 0.0};
                kept->tracker.update(kept->mask, dab.low, dab.high);
                return done;
            }};
}

std::vector<Dab> dabs_on(const Gaussian& base, double radius, double slope, int count,
                         std::mt19937& random) {
    std::normal_distribution<double> normal;
    std::vector<Dab> dabs;
    for (int i = 0; i < count; ++i) {
        const double x = normal(random), y = normal(random), z = normal(random);
        const glm::dvec3 out = glm::normalize(glm::dvec3(x, y, z));
        dabs.push_back(eroded(base, kMiddle + base.radius * out, radius, slope));
    }
    return dabs;
}

struct Kept {
    std::vector<double> ms, blocks;
    std::vector<uint64_t> triangles; // after each dab
};

Json row_of(uint32_t triangles, uint32_t radius, const std::string& who, const Kept& kept) {
    const Spread s = spread(kept.ms);
    Json row{{"triangles", triangles},
             {"radius_samples", radius},
             {"who", who},
             {"ms",
              {{"median", s.median},
               {"p95", s.p95},
               {"low", s.low},
               {"high", s.high},
               {"count", s.count}}},
             {"edits_per_s", 1e3 / s.median},
             {"triangles_after_mean",
              std::accumulate(kept.triangles.begin(), kept.triangles.end(), 0.0) /
                  static_cast<double>(kept.triangles.size())}};
    if (who.starts_with("blocks"))
        row["blocks_median"] = percentile(kept.blocks, 0.5);
    if (who == "tracker" && triangles % 10'000 == 0 && triangles >= 20'000 && triangles <= 100'000)
        row["printed_edits_per_s"] = kPrinted[triangles / 10'000 - 2][radius == 5 ? 0 : 1];
    return row;
}

} // namespace

Result<Json> measure_edits(ExtractPipelines& pipelines, SurfacePeers& peers, const Options& options,
                           std::vector<std::string>& failures) {
    std::vector<uint32_t> counts{20'000, 100'000};
    if (options.full)
        counts = {20'000, 40'000, 60'000, 80'000, 100'000};
    if (options.tiny)
        counts = {20'000};
    const int rounds = options.tiny ? 1 : options.full ? 12 : 6;
    const int at_once = options.tiny ? 2 : 25; // dabs one after the other, as of a hand
    Json rows = Json::array();
    for (const uint32_t triangles : counts) {
        const Gaussian base = gaussian_of(triangles);
        const Volume& volume = base.sample.volume;
        const double slope = 0.02 * base.iso;
        std::vector<Keeper> keepers{
            by_tracker(volume, base.iso),
            in_blocks("blocks", std::make_shared<BlockSurface>(volume, base.iso))};
        if (GpuSurface::supports(pipelines.device(), volume, {}))
            keepers.push_back(
                in_blocks("blocks_gpu", std::make_shared<GpuSurface>(pipelines, volume, base.iso)));
        const size_t ours = keepers.size();
        const bool is_open = !peers.open(base.sample, base.iso, {}, /*few=*/true).empty();
        for (const uint32_t radius : {5u, 10u}) {
            log::info("{} triangles, dabs of radius {}", triangles, radius);
            keepers.resize(ours);
            if (is_open)
                keepers.push_back({"vtkFlyingEdges3D", [&](const Dab& dab) -> std::optional<Done> {
                                       const auto done = peers.dab(dab.centre, radius, slope);
                                       if (!done)
                                           return std::nullopt;
                                       return Done{done->ms, done->triangles, 0.0};
                                   }});
            std::vector<Kept> kept(keepers.size());
            std::mt19937 random(1);
            for (int round = -1; round < rounds; ++round) { // the first is not counted
                const std::vector<Dab> dabs = dabs_on(base, radius, slope, at_once, random);
                for (size_t i = 0; i < keepers.size(); ++i)
                    for (const Dab& dab : dabs) {
                        if (options.stop.stop_requested())
                            return fail("interrupted");
                        const std::optional<Done> done = keepers[i].dab(dab);
                        if (!done || round < 0)
                            continue;
                        kept[i].ms.push_back(done->ms);
                        kept[i].blocks.push_back(done->blocks);
                        kept[i].triangles.push_back(done->triangles);
                    }
            }
            for (size_t i = 0; i < keepers.size(); ++i) {
                if (kept[i].ms.empty())
                    continue;
                rows.push_back(row_of(triangles, radius, keepers[i].who, kept[i]));
                if (i < ours && kept[i].triangles != kept[0].triangles)
                    failures.push_back(fmt::format(
                        "{} triangles, r = {}: {} and {} have different numbers of them after the "
                        "same dabs",
                        triangles, radius, keepers[0].who, keepers[i].who));
            }
        }
    }
    return rows;
}

void add_edit_aims(const Json& rows, bool cpu_device, Json& aims) {
    const auto median = [&](uint32_t radius, const char* who) {
        for (const Json& row : rows)
            if (row["triangles"] == 100'000 && row["radius_samples"] == radius && row["who"] == who)
                return row["ms"]["median"].number;
        return 0.0; // not measured
    };
    const auto add = [&](uint32_t radius, const std::string& what, const std::string& aim,
                         double figure, bool reached) {
        add_aim(aims, fmt::format("a dab at 100 000 triangles, r = {}: {}", radius, what), aim,
                figure, reached);
    };
    struct Wanted {
        uint32_t radius;
        double cpu_ms, gpu_ms, times;
    };
    for (const Wanted& wanted : {Wanted{5, 0.11, 0.6, 30}, Wanted{10, 0.33, 2.2, 10}}) {
        const double cpu = median(wanted.radius, "blocks"),
                     gpu = median(wanted.radius, "blocks_gpu"),
                     vtk = median(wanted.radius, "vtkFlyingEdges3D");
        if (cpu > 0)
            add(wanted.radius, "blocks, ms", fmt::format("at most {}", wanted.cpu_ms), cpu,
                cpu <= wanted.cpu_ms);
        if (cpu > 0 && vtk > 0)
            add(wanted.radius, "blocks beside vtkFlyingEdges3D",
                fmt::format("{} times as fast", wanted.times), vtk / cpu,
                vtk / cpu >= wanted.times);
        if (gpu > 0)
            add(wanted.radius, cpu_device ? "blocks_gpu on the processor, ms" : "blocks_gpu, ms",
                fmt::format("at most {}", wanted.gpu_ms), gpu, gpu <= wanted.gpu_ms);
    }
}

} // namespace palpate::bench
