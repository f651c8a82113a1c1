#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/render/render_options.h"
#include "engine/render/seen_box.h"
#include "engine/render/surface_mesh.h"
#include "engine/scene/scene.h"
#include "engine/surface_gpu/gpu_surface.h"
#include "engine/surface_gpu/label_walls.h"

namespace palpate {

// Triangles of a surface that lie together, with a box about them in mesh space.
struct SurfacePart {
    uint32_t first, count;
    AxisBox box;
};

// Buffers of the device that are drawn at once.
struct SurfaceArrays {
    Buffer &positions, &triangles, &normals, &labels; // as GpuMesh's
    uint32_t triangle_count, capacity;                // drawn, and at most, until all are new
    uint32_t first_number;                            // of the triangles, in keys
    std::vector<SurfacePart> parts{}; // all triangles; none: their places are unknown
};

// A surface of a scene on the device: a mesh, or a live surface, which is extracted into the
// device's memory (GpuSurface) and drawn from there, or the walls between live labels (LabelWalls).
class SceneSurface {
 public:
    // The surface that a scene asks for. `mesh` is null for a live surface.
    struct Source {
        std::optional<float> live_iso;
        const Volume& volume; // of a live surface
        const std::shared_ptr<const Mesh>& mesh;
        bool live_labels = false;
        const Volume* labels = nullptr; // of these; null: there are none, and nothing is drawn
    };
    bool shows(const Source& source) const;

    const std::vector<SurfaceArrays>& arrays() const { return arrays_; }
    bool has_labels() const { return mesh_ ? mesh_->has_labels() : !live_; }
    bool has_outer_labels() const { return mesh_ ? mesh_->has_outer_labels() : !live_; }
    bool has_normals() const { return mesh_ ? mesh_->has_normals() : true; }
    uint32_t largest_label() const; // on it, or more
    glm::dmat4 world_from_mesh() const;
    // The bounds of a mesh in its own space; none: unknown, as for a live surface.
    const std::optional<AxisBox>& bounds() const { return bounds_; }

 private:
    friend class SurfaceStore;
    void list_arrays();

    std::optional<GpuMesh> mesh_;
    std::optional<GpuSurface> live_;  // or this
    std::optional<LabelWalls> walls_; // or this; none of them: labels that are not there
    std::vector<SurfaceArrays> arrays_;
    std::optional<AxisBox> bounds_;
    uint64_t version_ = 0; // counts its changes
};

// The surfaces of all views on one device. Views that show the same mesh, or the same live surface,
// share one, and its changes are uploaded once.
class SurfaceStore {
 public:
    SurfaceStore(GpuDevice& device, const RendererOptions& options)
        : device_(&device), options_(&options) {}

    // A view's hold on a surface.
    struct Held {
        std::shared_ptr<SceneSurface> surface;
        uint64_t version = 0; // that the view drew last
    };

    // Brings a view the surface that shows `source`, by copies recorded into `commands`. The first
    // view to ask for a later mesh or volume changes the surface for all that share it; a view that
    // still asks for the earlier one then gets a surface of its own. Where the iso-value, or all of
    // the volume, is another, a live surface is extracted whole, which submits `commands` and waits
    // for the device. Returns how many blocks were extracted. `name` is for messages. Fails with a
    // sentence where the device cannot draw the surface.
    Result<size_t> take(Held& held, const std::string& name, const SceneSurface::Source& source,
                        Commands& commands);
    // A view needs it no more: a surface that no view holds goes.
    void drop(Held& held);
    void clear() { all_.clear(); }

 private:
    Result<void> keep_mesh(SceneSurface& surface, const std::string& name,
                           const std::shared_ptr<const Mesh>& mesh, Commands& commands);
    Result<size_t> keep_walls(SceneSurface& surface, const std::string& name, const Volume* labels,
                              Commands& commands);
    Result<size_t> keep_live(SceneSurface& surface, const std::string& name, float iso,
                             const Volume& volume, Commands& commands);
    void drop_unused();

    GpuDevice* device_;
    const RendererOptions* options_;
    std::optional<ExtractPipelines> extraction_; // before the surfaces that refer to it
    std::vector<std::shared_ptr<SceneSurface>> all_;
};

} // namespace palpate
