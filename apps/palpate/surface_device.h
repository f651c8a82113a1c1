#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/gpu/device.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"

namespace palpate {

enum class ExtractOn { automatic, cpu, gpu };

// Whether processor or graphics device extracts a surface, and why.
struct Extractor {
    std::unique_ptr<GpuDevice> device; // null: the CPU
    std::string why;
    bool may_fall_back = false; // to the CPU, where the device proves unable at work
};

// Automatic: the CPU where there is no other device, where the device stands for it (lavapipe), or
// where the device cannot; else the device. `select` as in DeviceOptions; with `gpu`, what stands
// against it is an error. Throws GpuError where `gpu` is asked for and no device can be used.
Result<Extractor> choose_extractor(ExtractOn on, const std::string& select, const Volume& volume,
                                   const SurfaceOptions& options);

// Times by pass, in ms.
using ExtractPasses = std::vector<std::pair<std::string, double>>;
using DeviceExtraction = std::function<Mesh(GpuDevice& device, const Volume& volume, float iso,
                                            const SurfaceOptions& options, ExtractPasses& passes)>;

// All of it on a device. Throws GpuError where memory does not suffice or the device is lost.
Mesh extract_on_device(GpuDevice& device, const Volume& volume, float iso,
                       const SurfaceOptions& options, ExtractPasses& passes);

// By what choose_extractor() chose. Where the device fails, out of memory say, and the choice was
// automatic, the CPU does it; this is logged, and `extractor` says so from then on. Else it is an
// error.
Result<Mesh> extract_on(Extractor& extractor, const Volume& volume, float iso,
                        const SurfaceOptions& options, ExtractPasses& passes,
                        const DeviceExtraction& by_device = extract_on_device);

// The walls between labels, by the device. Fails where it cannot.
Result<Mesh> nets_on_device(const std::string& select, const Volume& labels,
                            const SurfaceNetsOptions& options);

} // namespace palpate
