#pragma once

#include <string>

#include "engine/base/error.h"
#include "engine/render/renderer.h"

namespace CLI {
class App;
}

namespace palpate {

// How a volume lies on the device and is sampled there.
struct DeviceMemoryOptions {
    Residency residency = Residency::automatic;
    Sampling sampling = Sampling::device;
    std::string gradients = "auto", gpu_memory;
};

// Adds --residency, --gpu-memory, --sampling and --gradients.
void add_device_memory_options(CLI::App& app, DeviceMemoryOptions& options);

// Fills the fields of `renderer` that they stand for. `many_frames` says that what takes as long as
// some frames to make still pays.
void apply(const DeviceMemoryOptions& options, const GpuDevice& device, bool many_frames,
           RendererOptions& renderer);

// Bytes of "512M", "1.5G" or "2000000000": K, M, G and T are powers of 1024.
Result<uint64_t> parse_bytes(const std::string& text);

} // namespace palpate
