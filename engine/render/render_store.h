#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/render/frame_block.h"
#include "engine/render/mirrored_buffer.h"
#include "engine/render/scene_surface.h"
#include "engine/render/shared_pool.h"
#include "engine/render/targets.h"
#include "engine/render/transfer_image.h"
#include "engine/render/volume_residency.h"

// The shared state of a renderer's passes. For engine/render alone.
namespace palpate {

class Renderer;

// The styles of labels 0 .. largest, as a buffer.
struct LabelStyles {
    std::optional<std::pair<LabelLayer, uint32_t>> made_for; // up to which label
    MirroredBuffer buffer;
};

// The resources that several renderers share on the device.
struct RenderStore {
    RenderStore(GpuDevice& on, RendererOptions asked);

    GpuDevice& device;
    RendererOptions options;
    PipelineCache pipelines;
    Sampler linear, nearest, label_sampler;
    VolumeResidency volume;
    SurfaceStore surfaces;
    SharedPool<TransferImage> transfers;
    SharedPool<LabelStyles> styles;
    std::vector<Renderer*> views;

    // Bring a view the table of a transfer function, and the styles of all labels that there are.
    void take_table(std::shared_ptr<TransferImage>& held, const TransferFunction& function,
                    double step_mm, Commands& commands);
    void take_styles(std::shared_ptr<LabelStyles>& held, const LabelLayer& layer,
                     const Volume& labels, Commands& commands);
    // Nothing on the device is relied upon any more.
    void forget();
};

// A frame of one view, while it is recorded.
struct ViewFrame {
    const Scene& scene;
    const SceneData& data;
    const std::vector<View>& views; // one an eye
    Commands& commands;
    Targets& targets;
    VolumeUse& voxels;
    LabelStyles* styles;                   // null where the scene shows no labels
    double step_factor;                    // of the longest steps
    LabelStyles* overlay_styles = nullptr; // null where slices show no overlay

    // The block of constants: the volume's, styles', and those of a table, where one is used.
    FrameInputs inputs(const TransferImage* table) const;
};

} // namespace palpate
