#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "engine/render/mirrored_buffer.h"
#include "engine/render/surface_mesh.h"
#include "engine/scene/scene.h"
#include "engine/surface_gpu/gpu_surface.h"
#include "shaders/shared/surface.h"

namespace palpate {

// Draws a scene's meshes and live surfaces: what its rays meet before anything is marched.
//
// A live surface is extracted into the device's memory (GpuSurface) and drawn from there. An edit
// of the volume makes the blocks again that read a changed sample, in the frame's own commands.
//
// One compute invocation a triangle finds the pixels whose rays meet it (wide ones get a workgroup
// each) and leaves the smallest key, so that one code serves devices with and without a rasteriser,
// both eyes and any camera, and no order of execution shows: docs/decisions. Rays run exactly
// through the centres of pixels, and of triangles with a common edge one is met.
class SurfacePass {
 public:
    // `maker` of live surfaces; none: the CPU where the device stands for it, or cannot.
    SurfacePass(GpuDevice& device, const Sampler& nearest, std::optional<BlockMaker> maker)
        : device_(&device), nearest_(&nearest), maker_(maker) {}

    // Brings surfaces and styles in line with the scene: data.meshes[i] belongs to
    // scene.surfaces[i], and one that is the same object as before is not uploaded again. Live
    // surfaces follow data.volume. Where their iso-value, or all of the volume, is another, they
    // are extracted whole, which submits `commands` and waits for the device. Fails with a sentence
    // where the device cannot draw them. record() belongs into the same commands.
    Result<void> prepare(const Scene& scene, const SceneData& data, std::span<const View> views,
                         Commands& commands);

    bool has_see_through() const { return see_through_; }
    // Of live surfaces, made by the last prepare(): after an edit, those that read a changed
    // sample.
    size_t made_blocks() const { return made_blocks_; }

    // Where the picture comes together; all have one layer an eye, but for `layers`.
    struct Images {
        GpuImage& behind;        // RGBA: holds slices or background; opaque meshes are added
        GpuImage& behind_values; // (value, distance in mm) of these, NaN where there is none
        GpuImage& color;         // gets the picture without ray casting
        GpuImage* values;        // gets its values and distances; may be null
        GpuImage* layers;        // gets Scene::surface_depth layers an eye for the ray caster
    };
    void record(Commands& commands, PipelineCache& pipelines, const Images& images);

 private:
    // What the rows drawn at a time need, a pixel each.
    struct Scratch {
        uint32_t places, mesh_count, depth; // pixels; depth and counts only where used
        bool clips;
        Buffer nearest, work, large;
        std::optional<Buffer> through, kept, counts;
    };

    // Arrays on the device that are drawn at once.
    struct Arrays {
        Buffer &positions, &triangles, &normals, &labels; // as GpuMesh's
        uint32_t triangle_count, capacity;                // drawn, and at most, until all are new
        uint32_t first_number;                            // of the triangles, in keys
    };
    // A surface of the scene: one of the two.
    struct Surface {
        std::optional<GpuMesh> mesh;
        std::optional<GpuSurface> live;
        std::vector<Arrays> arrays{};

        bool has_labels() const { return mesh && mesh->has_labels(); }
        bool has_normals() const { return live || mesh->has_normals(); }
        uint32_t largest_label() const { return mesh ? mesh->largest_label() : 0; }
        glm::dmat4 world_from_mesh() const;
        void list_arrays();
    };

    Result<void> keep_surfaces(const Scene& scene, const SceneData& data, Commands& commands);
    Result<void> keep_mesh(Surface& surface, const std::string& name,
                           const std::shared_ptr<const Mesh>& mesh, Commands& commands);
    Result<void> keep_live(Surface& surface, const std::string& name, float iso,
                           const Volume& volume, Commands& commands);
    Result<void> keep_styles(const Scene& scene, Commands& commands);
    void keep_frames(const Scene& scene, std::span<const View> views, Commands& commands);
    void keep_scratch(const Scene& scene);
    uint32_t rows_at_a_time(const Scene& scene) const;
    void draw(Commands& commands, PipelineCache& pipelines, BufferSlice frame, uint32_t surface,
              const Arrays& arrays, bool through, uint32_t turn);
    std::vector<Bound> pixel_bindings(BufferSlice frame, bool through, bool styles);
    void start_work(Commands& commands, uint32_t surface, const Arrays& arrays, uint32_t turn);

    GpuDevice* device_;
    const Sampler* nearest_;
    std::optional<BlockMaker> maker_;
    std::optional<ExtractPipelines> extraction_; // before the surfaces that refer to it
    std::deque<Surface> surfaces_;
    size_t made_blocks_ = 0;
    MirroredBuffer styles_;
    struct StyledFor { // what the styles were made from
        std::vector<SurfaceLayer> layers;
        std::vector<std::pair<bool, uint32_t>> labels; // of each surface: any, and the largest
        friend bool operator==(const StyledFor&, const StyledFor&) = default;
    };
    std::optional<StyledFor> styled_for_;
    std::vector<uint32_t> first_styles_, style_counts_;
    std::vector<bool> has_opaque_, has_through_; // of each surface
    bool see_through_ = false;
    struct Rows {
        uint32_t count;
        BufferSlice frame;
    };
    std::vector<Rows> rows_; // each eye's, of this frame
    glm::uvec2 size_px_{0};
    std::optional<Scratch> scratch_;
};

} // namespace palpate
