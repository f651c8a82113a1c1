#include "engine/render/scene_surface.h"

#include <algorithm>

#include "shaders/shared/surface.h"

namespace palpate {

namespace {

bool is_of(const GpuSurface& live, const Volume& volume) {
    return live.volume().grid() == volume.grid() && live.volume().type() == volume.type();
}

// Whether keys have numbers for all triangles of a pool.
Result<void> expect_numbers(const std::string& name, SurfacePool& pool) {
    uint64_t triangles = 0;
    for (const SurfacePool::Arena& arena : pool.arenas())
        triangles += arena.free_triangles.capacity();
    if (triangles > gpu::kSurfaceLeaving)
        return fail("{}: expected room for at most {} triangles, found {}", name,
                    gpu::kSurfaceLeaving, triangles);
    return {};
}

} // namespace

bool SceneSurface::shows(const Source& source) const {
    if (source.live_labels && !source.labels)
        return !mesh_ && !live_ && !walls_;
    if (source.live_labels)
        return walls_ && walls_->labels().grid() == source.labels->grid() &&
               walls_->labels().is_same_as(*source.labels);
    if (source.live_iso)
        return live_ && live_->iso() == *source.live_iso && is_of(*live_, source.volume) &&
               live_->volume().is_same_as(source.volume);
    return mesh_ && mesh_->source() == source.mesh;
}

glm::dmat4 SceneSurface::world_from_mesh() const {
    if (mesh_)
        return mesh_->source()->world_from_mesh;
    return live_    ? palpate::world_from_mesh(live_->volume().grid())
           : walls_ ? palpate::world_from_mesh(walls_->labels().grid())
                    : glm::dmat4(1.0);
}

uint32_t SceneSurface::largest_label() const {
    if (walls_)
        return static_cast<uint32_t>(std::max(0.0f, walls_->labels().range().max));
    return mesh_ ? mesh_->largest_label() : 0;
}

void SceneSurface::list_arrays() {
    arrays_.clear();
    if (mesh_ && mesh_->triangle_count() > 0)
        arrays_.push_back({mesh_->positions(), mesh_->triangles(), mesh_->normals(),
                           mesh_->labels(), mesh_->triangle_count(), mesh_->triangle_count(), 0});
    uint32_t first_number = 0;
    if (live_ || walls_)
        for (SurfacePool::Arena& arena : (live_ ? live_->pool() : walls_->pool()).arenas()) {
            const uint32_t capacity = arena.free_triangles.capacity();
            Buffer& labels = arena.labels ? *arena.labels : arena.triangles; // or not read
            if (arena.end > 0)
                arrays_.push_back({arena.positions, arena.triangles, *arena.normals, labels,
                                   arena.end, capacity, first_number});
            first_number += capacity;
        }
    if (!walls_)
        return;
    std::vector<SurfaceArrays*> of_arena;
    size_t next = 0;
    for (const SurfacePool::Arena& arena : walls_->pool().arenas())
        of_arena.push_back(arena.end > 0 ? &arrays_[next++] : nullptr);
    for (const std::optional<LabelWalls::Placed>& placed : walls_->placed())
        if (placed)
            of_arena[placed->range.arena]->parts.push_back(
                {placed->range.first_triangle,
                 placed->range.triangles,
                 {glm::dvec3(placed->low_mm), glm::dvec3(placed->high_mm)}});
}

Result<size_t> SurfaceStore::take(Held& held, const std::string& name,
                                  const SceneSurface::Source& source, Commands& commands) {
    const auto shows = [&](const auto& surface) { return surface && surface->shows(source); };
    if (!shows(held.surface)) {
        if (const auto found = std::ranges::find_if(all_, shows); found != all_.end())
            held.surface = *found;
        else if (!held.surface || held.surface->version_ != held.version) // or another view's now
            held.surface = all_.emplace_back(std::make_shared<SceneSurface>());
        drop_unused();
    }
    SceneSurface& surface = *held.surface;
    size_t made_blocks = 0;
    if (!surface.shows(source)) {
        ++surface.version_;
        surface.arrays_.clear();
        if (source.live_labels) {
            PALPATE_TRY(made_blocks, keep_walls(surface, name, source.labels, commands));
        } else if (source.live_iso) {
            PALPATE_TRY(made_blocks,
                        keep_live(surface, name, *source.live_iso, source.volume, commands));
        } else {
            PALPATE_TRY(keep_mesh(surface, name, source.mesh, commands));
        }
        surface.list_arrays();
        surface.bounds_ =
            source.live_iso || source.live_labels ? std::nullopt : box_of(*source.mesh);
    }
    held.version = surface.version_;
    return made_blocks;
}

void SurfaceStore::drop(Held& held) {
    held.surface.reset();
    drop_unused();
}

void SurfaceStore::drop_unused() {
    std::erase_if(all_, [](const auto& surface) { return surface.use_count() == 1; });
}

Result<void> SurfaceStore::keep_mesh(SceneSurface& surface, const std::string& name,
                                     const std::shared_ptr<const Mesh>& mesh, Commands& commands) {
    surface.live_.reset();
    surface.walls_.reset();
    const bool changes = surface.mesh_.has_value();
    if (changes && surface.mesh_->update(mesh, commands))
        return {};
    surface.mesh_.reset();
    PALPATE_TRY(GpuMesh made,
                GpuMesh::make(*device_, name, mesh, /*room_to_grow=*/changes, commands));
    surface.mesh_.emplace(std::move(made));
    return {};
}

Result<size_t> SurfaceStore::keep_live(SceneSurface& surface, const std::string& name, float iso,
                                       const Volume& volume, Commands& commands) {
    surface.mesh_.reset();
    surface.walls_.reset();
    size_t made_blocks = 0;
    std::optional<GpuSurface>& live = surface.live_;
    if (live && is_of(*live, volume)) {
        if (!live->volume().is_same_as(volume)) {
            const std::vector<ChangedBrick> changed = changed_bricks(live->volume(), volume);
            made_blocks += live->record_update(commands, volume, changed).blocks.size();
        }
        if (live->iso() != iso) {
            commands.flush(); // what it submits comes after what was recorded
            live->set_iso(iso);
            made_blocks += live->blocks().size();
        }
    } else {
        const SurfaceOptions closed{.closed_at_border = true}; // so that caps are right
        const auto by = [&](BlockMaker maker) {
            return GpuSurface::supports(*device_, volume, closed, maker);
        };
        const bool on_device = !device_->info().is_cpu() && by(BlockMaker::device);
        const BlockMaker maker =
            options_->block_maker.value_or(on_device ? BlockMaker::device : BlockMaker::cpu);
        if (Result<void> can = by(maker); !can)
            return fail("{}: {}", name, can.error().message);
        if (!extraction_)
            extraction_.emplace(*device_);
        live.reset();
        commands.flush();
        live.emplace(*extraction_, volume, iso, closed, maker);
        made_blocks += live->blocks().size();
    }
    Result<void> can_number = expect_numbers(name, live->pool());
    if (!can_number) {
        live.reset();
        return pass_on(can_number);
    }
    return made_blocks;
}

Result<size_t> SurfaceStore::keep_walls(SceneSurface& surface, const std::string& name,
                                        const Volume* labels, Commands& commands) {
    surface.mesh_.reset();
    surface.live_.reset();
    std::optional<LabelWalls>& walls = surface.walls_;
    if (!labels) {
        walls.reset();
        return size_t{0};
    }
    size_t made_blocks = 0;
    if (walls && walls->labels().grid() == labels->grid()) {
        made_blocks = walls->record_update(commands, *labels);
    } else {
        walls.reset();
        walls.emplace(*device_, *labels, commands);
        made_blocks = walls->block_count();
    }
    Result<void> can_number = expect_numbers(name, walls->pool());
    if (!can_number) {
        walls.reset();
        return pass_on(can_number);
    }
    return made_blocks;
}

} // namespace palpate
