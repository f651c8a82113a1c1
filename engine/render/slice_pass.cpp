#include "engine/render/slice_pass.h"

#include "engine/gpu/offer.h"
#include "engine/render/frame_block.h"
#include "shaders/shared/slices.h"
#include "shaders/shared/tiles.h"
#include "spirv/slices.h"

namespace palpate {

void SlicePass::prepare(const ViewFrame& frame) {
    store_->take_table(table_, frame.scene.slice_transfer, 1.0, frame.commands);
    block_ = frame.commands.upload(bytes_of(
        make_frame_block(frame.scene, frame.data, frame.views, frame.inputs(table_.get()))));
    over_.reset();
    if (const Scene& scene = frame.scene; scene.fusion || scene.overlay) {
        OverInputs inputs;
        if (scene.fusion) {
            store_->take_table(fused_table_, scene.fusion->transfer, 1.0, frame.commands);
            inputs = {frame.voxels.fused()->value_scale(), frame.voxels.fused()->value_bias(),
                      fused_table_->low(), fused_table_->high(), 1};
        }
        if (frame.overlay_styles)
            inputs.style_count = frame.overlay_styles->made_for->second + 1;
        over_ = frame.commands.upload(bytes_of(make_slice_over(scene, frame.data, inputs)));
    }
    if (!frame.scene.fusion)
        store_->transfers.drop(fused_table_);
    auto planes = make_slice_planes(frame.scene, frame.data.volume.grid());
    planes.resize(gpu::kMaxSlices);
    planes_ = frame.commands.upload(std::as_bytes(std::span(planes)));
}

size_t SlicePass::record(const ViewFrame& frame, const std::optional<PixelBox>& only) {
    Targets& targets = frame.targets;
    Commands& commands = frame.commands;
    const size_t uploaded = frame.voxels.show_slices(frame.scene, commands);
    GpuVolume* const fused = frame.voxels.fused();
    const auto styles_of = [](LabelStyles* styles) {
        return styles ? &styles->buffer.get() : nullptr;
    };
    const bool behind = targets.behind.has_value();
    Offer offer;
    offer.uniform(gpu::kSliceFrame, block_)
        .sampled(gpu::kSliceVolume, &frame.voxels.volume().image(), store_->linear)
        .sampled(gpu::kSliceTable, &table_->image(), store_->nearest)
        .sampled(gpu::kSliceLabels, frame.voxels.labels(), store_->label_sampler)
        .storage(gpu::kSliceStyles, styles_of(frame.styles))
        .uniform(gpu::kSlicePlanes, planes_)
        .uniform(gpu::kSliceOver, over_)
        .sampled(gpu::kSliceFused, fused ? &fused->image() : nullptr, store_->linear)
        .sampled(gpu::kSliceFusedTable, fused_table_ ? &fused_table_->image() : nullptr,
                 store_->nearest)
        .sampled(gpu::kSliceOverlay, frame.voxels.overlay(), store_->label_sampler)
        .storage(gpu::kSliceOverlayStyles, styles_of(frame.overlay_styles))
        .storage_image(gpu::kSliceColor, pointer_to(behind ? targets.behind : targets.color))
        .storage_image(gpu::kSliceValues,
                       pointer_to(behind ? targets.behind_values : targets.values));
    frame.voxels.offer_atlas(offer, gpu::kSlicePages, gpu::kSliceAtlas, store_->nearest);
    const PixelBox box = only.value_or(PixelBox{glm::uvec2(0), frame.scene.size_px});
    if (box.empty())
        return uploaded;
    const glm::uvec2 first = box.low / gpu::kTileSide;
    const auto smooth = [](const std::optional<LabelLayer>& layer, uint32_t bit) {
        return layer && layer->edges == LabelEdges::smooth ? bit : 0u;
    };
    const ComputePipeline& pipeline = store_->pipelines.get(
        spirv::Slices{.has_labels = frame.styles != nullptr,
                      .has_atlas = frame.voxels.volume().is_atlas(),
                      .has_fusion = fused != nullptr,
                      .has_overlay = frame.overlay_styles != nullptr,
                      .manual = store_->options.sampling == Sampling::by_hand,
                      .smooth = smooth(frame.scene.labels, gpu::kSmoothLabels) |
                                smooth(frame.scene.overlay, gpu::kSmoothOverlay)});
    commands.begin_pass("slices");
    commands.dispatch(pipeline, offer.taken_by(pipeline),
                      {tile_count(box.high) - first, eye_count(frame.scene)}, {first, 0});
    commands.end_pass();
    return uploaded;
}

} // namespace palpate
