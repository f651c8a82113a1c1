#include "apps/palpate/surface_device.h"

#include <algorithm>

#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "engine/gpu/error.h"
#include "engine/surface_gpu/gpu_nets.h"
#include "engine/surface_gpu/gpu_surface.h"

namespace palpate {

namespace {

bool has_graphics_card() {
    const std::vector<DeviceInfo> devices = list_devices();
    return std::any_of(devices.begin(), devices.end(), [](const DeviceInfo& info) {
        return info.refusal.empty() && !info.is_cpu();
    });
}

Extractor automatic(const std::string& select, const Volume& volume,
                    const SurfaceOptions& options) {
    try {
        if (!has_graphics_card())
            return {nullptr, "no graphics device but the processor's own"};
        auto device = std::make_unique<GpuDevice>(DeviceOptions{.select = select});
        if (device->info().is_cpu())
            return {nullptr, fmt::format("{} runs on the processor", device->info().name)};
        if (const Result<void> can = GpuSurface::supports(*device, volume, options); !can)
            return {nullptr, can.error().message};
        std::string name = device->info().name;
        return {std::move(device), std::move(name), /*may_fall_back=*/true};
    } catch (const GpuError& error) {
        return {nullptr, error.what()};
    }
}

} // namespace

Result<Extractor> choose_extractor(ExtractOn on, const std::string& select, const Volume& volume,
                                   const SurfaceOptions& options) {
    if (on == ExtractOn::cpu)
        return Extractor{nullptr, "asked for", false};
    if (on == ExtractOn::automatic)
        return automatic(select, volume, options);
    auto device = std::make_unique<GpuDevice>(DeviceOptions{.select = select});
    if (const Result<void> can = GpuSurface::supports(*device, volume, options); !can)
        return fail("--on gpu: {}", can.error().message);
    return Extractor{std::move(device), "asked for", false};
}

Mesh extract_on_device(GpuDevice& device, const Volume& volume, float iso,
                       const SurfaceOptions& options, ExtractPasses& passes) {
    Timer timer;
    ExtractPipelines pipelines(device);
    GpuSurface surface(pipelines, volume, iso, options);
    passes.emplace_back("upload and extract", timer.ms());
    for (const PassTime& pass : surface.pass_times())
        passes.emplace_back(pass.name, pass.gpu_ms);
    timer = Timer();
    Mesh mesh = surface.mesh();
    passes.emplace_back("read back", timer.ms());
    return mesh;
}

Result<Mesh> extract_on(Extractor& extractor, const Volume& volume, float iso,
                        const SurfaceOptions& options, ExtractPasses& passes,
                        const DeviceExtraction& by_device) {
    if (!extractor.device)
        return marching_cubes(volume, iso, options);
    try {
        return by_device(*extractor.device, volume, iso, options, passes);
    } catch (const GpuError& error) {
        if (!extractor.may_fall_back)
            return fail("--on gpu: {}", error.what());
        extractor.why = fmt::format("{}: {}", extractor.device->info().name, error.what());
    }
    log::warning("{}; the processor extracts the surface instead", extractor.why);
    extractor.device.reset();
    passes.clear();
    return marching_cubes(volume, iso, options);
}

Result<Mesh> nets_on_device(const std::string& select, const Volume& labels,
                            const SurfaceNetsOptions& options) {
    try {
        GpuDevice device({.select = select});
        NetPipelines pipelines(device);
        Result<GpuNets> nets = GpuNets::make(pipelines, labels, options);
        if (!nets)
            return fail("--on gpu: {}", nets.error().message);
        return nets->mesh();
    } catch (const GpuError& error) {
        return fail("--on gpu: {}", error.what());
    }
}

} // namespace palpate
