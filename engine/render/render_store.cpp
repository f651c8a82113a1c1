#include "engine/render/render_store.h"

#include <algorithm>

namespace palpate {

namespace {

RendererOptions complete(RendererOptions options, const GpuDevice& device) {
    if (options.memory_limit_bytes == 0)
        options.memory_limit_bytes = device.info().memory_bytes / 4 * 3;
    return options;
}

} // namespace

RenderStore::RenderStore(GpuDevice& on, RendererOptions asked)
    : device(on),
      options(complete(std::move(asked), on)),
      pipelines(on),
      linear(on, SampleFilter::linear, Edge::clamp),
      nearest(on, SampleFilter::nearest, Edge::clamp),
      label_sampler(on, SampleFilter::nearest, Edge::border_zero),
      volume(on, options),
      surfaces(on, options) {}

void RenderStore::take_table(std::shared_ptr<TransferImage>& held, const TransferFunction& function,
                             double step_mm, Commands& commands) {
    transfers.take(
        held, [&](const TransferImage& one) { return one.is_for(function, step_mm); },
        [&] { return std::make_shared<TransferImage>(device, "transfer function"); });
    held->hold(function, step_mm, commands);
}

void RenderStore::take_styles(std::shared_ptr<LabelStyles>& held, const LabelLayer& layer,
                              const Volume& labels, Commands& commands) {
    const auto largest = static_cast<uint32_t>(std::max(0.0f, labels.range().max));
    const std::pair wanted(layer, largest);
    styles.take(
        held, [&](const LabelStyles& one) { return one.made_for == wanted; },
        [] { return std::make_shared<LabelStyles>(); });
    if (held->made_for == wanted)
        return;
    const auto entries = make_label_styles(layer, largest);
    held->buffer.hold(device, "label styles", std::as_bytes(std::span(entries)), commands);
    held->made_for = wanted;
}

void RenderStore::forget() {
    volume.forget();
    surfaces.clear();
    transfers.clear();
    styles.clear();
}

FrameInputs ViewFrame::inputs(const TransferImage* table) const {
    FrameInputs inputs;
    inputs.value_scale = voxels.volume().value_scale();
    inputs.value_bias = voxels.volume().value_bias();
    if (styles)
        inputs.style_count = styles->made_for->second + 1;
    if (table) {
        inputs.table_low = table->low();
        inputs.table_high = table->high();
        inputs.table_first = table->first();
        inputs.table_last = table->last();
    }
    return inputs;
}

} // namespace palpate
