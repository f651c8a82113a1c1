#include "engine/program/device_options.h"

#include <charconv>

#include "engine/program/option_checks.h"
#include "engine/program/option_texts.h"

namespace palpate {

void add_device_memory_options(CLI::App& app, DeviceMemoryOptions& options) {
    app.add_option(
           "--residency", options.residency,
           "Storage of the volume on the device: dense (one image), atlas (the bricks that can be "
           "seen, in several parts if they do not fit), or auto (dense if it fits and is faster) "
           "(default: auto)")
        ->transform(one_of<Residency>({{"auto", Residency::automatic},
                                       {"dense", Residency::dense},
                                       {"atlas", Residency::atlas}}));
    app.add_option("--gpu-memory", options.gpu_memory,
                   "Limit on device memory, as 512M, 1G or bytes (default: three quarters of the "
                   "device's memory)")
        ->check(readable(parse_bytes))
        ->type_name("BYTES");
    app.add_option("--sampling", options.sampling,
                   "Interpolation: by the device's sampler (device), or in the shader (fp32: "
                   "several times slower, the same bits for dense and atlas) (default: device)")
        ->transform(one_of<Sampling>({{"device", Sampling::device}, {"fp32", Sampling::by_hand}}));
    app.add_option("--gradients", options.gradients,
                   "Gradients of shaded alpha: from six samples each (taps), stored beside the "
                   "volume with 8 bytes a sample (stored), or auto: stored on devices without a "
                   "hardware sampler when several frames are drawn, if they fit (default: auto)")
        ->check(one_of({"auto", "taps", "stored"}));
}

void apply(const DeviceMemoryOptions& options, const GpuDevice& device, bool many_frames,
           RendererOptions& renderer) {
    renderer.residency = options.residency;
    renderer.sampling = options.sampling;
    renderer.stored_gradients =
        options.gradients == "stored" ||
        (options.gradients == "auto" && many_frames && device.info().is_cpu());
    if (!options.gpu_memory.empty())
        renderer.memory_limit_bytes = parse_bytes(options.gpu_memory).value();
}

Result<uint64_t> parse_bytes(const std::string& text) {
    double number = 0;
    const char* end = text.data() + text.size();
    const auto [next, error] = std::from_chars(text.data(), end, number);
    const std::string unit(next, end);
    uint64_t scale = 0;
    if (unit.empty())
        scale = 1;
    else if (unit.size() == 1)
        for (const auto& [letter, shift] :
             {std::pair('K', 10), std::pair('M', 20), std::pair('G', 30), std::pair('T', 40)})
            if (unit[0] == letter)
                scale = uint64_t{1} << shift;
    const double bytes = number * static_cast<double>(scale);
    if (error != std::errc() || scale == 0 || !(bytes >= 1.0 && bytes < 1e18))
        return fail("expected bytes as 512M, 1G or 2000000000, found '{}'", text);
    return static_cast<uint64_t>(bytes);
}

} // namespace palpate
