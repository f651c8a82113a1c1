#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/render/render_store.h"
#include "shaders/shared/surface.h"
#include "spirv/surface_draw.h"

namespace palpate {

// Draws a scene's meshes and live surfaces: what its rays meet before anything is marched.
//
// They lie in the SurfaceStore, once for all views. An edit of the volume makes the blocks of a
// live surface again that read a changed sample, in the frame's own commands.
//
// One compute invocation a triangle finds the pixels whose rays meet it (wide ones get a workgroup
// each) and leaves the smallest key, so that one code serves devices with and without a rasteriser,
// both eyes and any camera, and no order of execution shows: docs/decisions. Rays run exactly
// through the centres of pixels, and of triangles with a common edge one is met. Of surfaces whose
// parts are known (SurfacePart) those are left out that lie beside the pixels that are drawn, or
// behind opaque surfaces that have been.
class SurfacePass {
 public:
    explicit SurfacePass(RenderStore& store) : store_(&store) {}
    ~SurfacePass();
    SurfacePass(const SurfacePass&) = delete;
    SurfacePass& operator=(const SurfacePass&) = delete;

    // Brings surfaces and styles in line with the scene: data.meshes[i] belongs to
    // scene.surfaces[i], and one that is the same object as before is not uploaded again. Live
    // surfaces follow data.volume. As SurfaceStore::take(). record() belongs into the same
    // commands.
    Result<void> prepare(const Scene& scene, const SceneData& data, Commands& commands);

    bool has_see_through() const { return see_through_; }
    // The blocks of live surfaces that the last prepare() made: after an edit, those that read a
    // changed sample.
    size_t made_blocks() const { return made_blocks_; }

    // The images in which the picture comes together; all have one layer an eye, but for `layers`.
    struct Images {
        GpuImage& behind;        // RGBA: holds slices or background; opaque meshes are added
        GpuImage& behind_values; // (value, distance in mm) of these, NaN where there is none
        // Gets the picture without ray casting. May be `behind` itself where no mesh can be seen
        // through: then that alone is written.
        GpuImage& color;
        GpuImage* values; // gets its values and distances; may be null
        GpuImage* layers; // gets Scene::surface_depth layers an eye for the ray caster
    };
    // `only`: these pixels, with those of their tiles, over the frame before. Behind them lie the
    // scene's slices, which have been drawn there, or nothing.
    void record(const ViewFrame& frame, const Images& images,
                const std::optional<PixelBox>& only = {});

 private:
    // Buffers with one entry for each pixel of the rows that are drawn at a time.
    struct Scratch {
        uint32_t places, mesh_count, depth; // pixels; depth and counts only where used
        bool clips;
        Buffer nearest, work, search, large, chunks;
        std::optional<Buffer> through, kept, counts;
    };

    Result<void> keep_surfaces(const Scene& scene, const SceneData& data, Commands& commands);
    Result<void> keep_styles(const Scene& scene, Commands& commands);
    void keep_scratch(const Scene& scene);
    uint32_t rows_at_a_time(const Scene& scene) const;
    PixelBox seen_pixels(const View& view, glm::uvec2 size_px) const;
    // Pixels that are drawn at a time, of one eye.
    struct Part {
        const View* view;
        PixelBox box;
        BufferSlice frame;
    };
    std::vector<Part> parts_of(const ViewFrame& frame, const std::optional<PixelBox>& only) const;
    void draw(Commands& commands, const Part& part, uint32_t surface, const SurfaceArrays& arrays,
              bool through, uint32_t turn);
    struct Drawing {
        spirv::SurfaceDraw shader;
        std::vector<Bound> bound;
    };
    Drawing drawing(const Part& part, const SurfaceArrays& arrays, bool through);
    std::vector<Bound> pixel_bindings(BufferSlice frame, bool through, bool styles);
    void start_work(Commands& commands, uint32_t surface, const SurfaceArrays& arrays,
                    uint32_t turn, bool chunked);

    RenderStore* store_;
    std::vector<SurfaceStore::Held> surfaces_; // of the scene
    size_t made_blocks_ = 0;
    MirroredBuffer styles_;
    struct StyledFor { // what the styles were made from
        std::vector<SurfaceLayer> layers;
        std::vector<std::pair<bool, uint32_t>> labels; // of each surface: any, and the largest
        std::optional<LabelLayer> label_layer;         // of live labels
        friend bool operator==(const StyledFor&, const StyledFor&) = default;
    };
    std::optional<StyledFor> styled_for_;
    std::vector<uint32_t> first_styles_, style_counts_;
    std::vector<bool> has_opaque_, has_through_; // of each surface
    bool see_through_ = false;
    std::optional<Scratch> scratch_;
};

} // namespace palpate
