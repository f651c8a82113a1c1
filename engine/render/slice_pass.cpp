#include "engine/render/slice_pass.h"

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
            inputs = {frame.voxels.fused().value_scale(), frame.voxels.fused().value_bias(),
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
    std::vector<Bound> bound{
        bind_uniform(gpu::kSliceFrame, *block_),
        bind_sampled(gpu::kSliceVolume, frame.voxels.volume().image(), store_->linear),
        bind_sampled(gpu::kSliceTable, table_->image(), store_->nearest)};
    if (frame.styles) {
        bound.push_back(
            bind_sampled(gpu::kSliceLabels, frame.voxels.labels(), store_->label_sampler));
        bound.push_back(bind_storage(gpu::kSliceStyles, frame.styles->buffer.get()));
    }
    bound.push_back(bind_uniform(gpu::kSlicePlanes, *planes_));
    if (over_)
        bound.push_back(bind_uniform(gpu::kSliceOver, *over_));
    if (fused_table_) {
        bound.push_back(
            bind_sampled(gpu::kSliceFused, frame.voxels.fused().image(), store_->linear));
        bound.push_back(
            bind_sampled(gpu::kSliceFusedTable, fused_table_->image(), store_->nearest));
    }
    if (frame.overlay_styles) {
        bound.push_back(
            bind_sampled(gpu::kSliceOverlay, frame.voxels.overlay(), store_->label_sampler));
        bound.push_back(bind_storage(gpu::kSliceOverlayStyles, frame.overlay_styles->buffer.get()));
    }
    const bool behind = targets.behind.has_value();
    bound.push_back(
        bind_storage_image(gpu::kSliceColor, behind ? *targets.behind : *targets.color));
    bound.push_back(
        bind_storage_image(gpu::kSliceValues, behind ? *targets.behind_values : *targets.values));
    frame.voxels.bind_atlas(bound, gpu::kSlicePages, gpu::kSliceAtlas, store_->nearest);
    const PixelBox box = only.value_or(PixelBox{glm::uvec2(0), frame.scene.size_px});
    if (box.empty())
        return uploaded;
    const glm::uvec2 first = box.low / gpu::kTileSide;
    commands.begin_pass("slices");
    commands.dispatch(store_->pipelines.get(
                          spirv::Slices{.has_labels = frame.styles != nullptr,
                                        .has_atlas = frame.voxels.volume().is_atlas(),
                                        .has_fusion = fused_table_ != nullptr,
                                        .has_overlay = frame.overlay_styles != nullptr,
                                        .manual = store_->options.sampling == Sampling::by_hand}),
                      bound, {tile_count(box.high) - first, eye_count(frame.scene)}, {first, 0});
    commands.end_pass();
    return uploaded;
}

} // namespace palpate
