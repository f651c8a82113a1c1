#include "engine/render/slice_pass.h"

#include "engine/render/frame_block.h"
#include "shaders/shared/slices.h"
#include "spirv/slices.h"

namespace palpate {

void SlicePass::prepare(const ViewFrame& frame) {
    store_->take_table(table_, frame.scene.slice_transfer, 1.0, frame.commands);
    block_ = frame.commands.upload(bytes_of(
        make_frame_block(frame.scene, frame.data, frame.views, frame.inputs(table_.get()))));
    auto planes = make_slice_planes(frame.scene, frame.data.volume.grid());
    planes.resize(gpu::kMaxSlices);
    planes_ = frame.commands.upload(std::as_bytes(std::span(planes)));
}

size_t SlicePass::record(const ViewFrame& frame) {
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
    const bool behind = targets.behind.has_value();
    bound.push_back(
        bind_storage_image(gpu::kSliceColor, behind ? *targets.behind : *targets.color));
    bound.push_back(
        bind_storage_image(gpu::kSliceValues, behind ? *targets.behind_values : *targets.values));
    frame.voxels.bind_atlas(bound, gpu::kSlicePages, gpu::kSliceAtlas, store_->nearest);
    commands.begin_pass("slices");
    commands.dispatch(store_->pipelines.get(
                          spirv::Slices{.has_labels = frame.styles != nullptr,
                                        .has_atlas = frame.voxels.volume().is_atlas(),
                                        .manual = store_->options.sampling == Sampling::by_hand}),
                      bound, {tile_count(frame.scene.size_px), eye_count(frame.scene)});
    commands.end_pass();
    return uploaded;
}

} // namespace palpate
