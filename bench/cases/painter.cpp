#include "bench/cases/painter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "engine/reference/twin.h"

namespace palpate::cases {

Image GpuPainter::draw(const Scene& scene, const SceneData& data, const Choices& choices) {
    auto kept = std::find_if(renderers_.begin(), renderers_.end(),
                             [&](const auto& entry) { return entry.first == choices; });
    if (kept == renderers_.end()) {
        const RendererOptions options{.volume_format = choices.volume_format,
                                      .skipping = choices.skipping,
                                      .residency = choices.residency,
                                      .sampling = choices.sampling};
        renderers_.emplace_back(choices, std::make_unique<Renderer>(device_, options));
        kept = renderers_.end() - 1;
    }
    Result<Frame> frame = kept->second->render(scene, data);
    if (!frame)
        throw std::runtime_error(frame.error().message);
    return std::move(frame->eyes[0]);
}

double GpuPainter::weight_rounding() const {
    // CPU devices interpolate in fp32 (measured on lavapipe); hardware rounds to a few bits.
    if (device_.info().is_cpu())
        return 0.0;
    return std::ldexp(1.0, -static_cast<int>(device_.limits().subTexelPrecisionBits) - 1);
}

Image TwinPainter::draw(const Scene& scene, const SceneData& data, const Choices&) {
    return render_twin(scene, data);
}

} // namespace palpate::cases
