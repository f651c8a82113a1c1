#pragma once

#include <memory>
#include <string>

#include "engine/base/error.h"
#include "engine/gpu/device.h"
#include "engine/surface/marching_cubes.h"

namespace palpate {

enum class ExtractOn { automatic, cpu, gpu };

// Who extracts a surface, and why.
struct Extractor {
    std::unique_ptr<Device> device; // null: the CPU
    std::string why;
};

// Automatic: the CPU where there is no other device, where the device stands for it (lavapipe), or
// where the device cannot; else the device. `select` as in DeviceOptions; with `gpu`, what stands
// against it is an error. Throws GpuError where `gpu` is asked for and no device can be used.
Result<Extractor> choose_extractor(ExtractOn on, const std::string& select, const Volume& volume,
                                   const SurfaceOptions& options);

// By what choose_extractor() chose; times by pass, in ms, go to `passes`.
Mesh extract_on(const Extractor& extractor, const Volume& volume, float iso,
                const SurfaceOptions& options, std::vector<std::pair<std::string, double>>& passes);

} // namespace palpate
