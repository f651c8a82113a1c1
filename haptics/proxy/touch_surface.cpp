// The mesh that swept-mesh feels, made before it is published; declared in swept_mesh.h.

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <vector>

#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "haptics/field/field.h"
#include "haptics/field/fine_samples.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate::haptics {

namespace {

// How far triangles bulge at most, as a share of their mean edge.
constexpr double kBulge = 0.25;
constexpr size_t kMostPoints = size_t{1} << 26; // of the finer lattice: 256 MiB of floats
constexpr int kBorder = 2;                      // samples beyond the volume, where all is free

// One brick of the finer lattice, whose first point is point `from` of `samples`.
BrickPtr fine_brick(FineSamples& samples, const Grid& grid, glm::uvec3 position, glm::ivec3 from) {
    constexpr int kSide = FineSamples::kMostSide, kBricks = static_cast<int>(kBrickSide);
    const glm::uvec3 start = position * kBrickSide;
    const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), grid.size - start);
    const glm::ivec3 first = from + glm::ivec3(start);
    // Where all points and those next to them lie on one side of the surface, any value on that
    // side will do: normals come from elsewhere.
    using Matter = FineSamples::Matter;
    const float free = samples.free_value(), solid = 2.0f * samples.threshold() - free;
    const auto value_of = [&](Matter matter) { return matter == Matter::free ? free : solid; };
    if (const Matter all = samples.matter(first - 1, first + kBricks); all != Matter::unknown) {
        const float value = value_of(all);
        return Brick::make(std::span<const float>(&value, 1), valid);
    }
    std::vector<float> staged(kBrickSamples);
    for (int z = 0; z < kBricks; z += kSide)
        for (int y = 0; y < kBricks; y += kSide)
            for (int x = 0; x < kBricks; x += kSide) {
                const glm::ivec3 low(x, y, z), size = glm::min(glm::ivec3(kSide), kBricks - low);
                const Matter all = samples.matter(first + low - 1, first + low + kSide);
                const float* sharp =
                    all == Matter::unknown ? samples.sharp(first + low, kSide).values : nullptr;
                for (int k = 0; k < size.z; ++k)
                    for (int j = 0; j < size.y; ++j) {
                        float* row = &staged[offset_in_brick(glm::uvec3(x, y + j, z + k))];
                        if (sharp)
                            std::copy_n(sharp + kSide * (j + kSide * k), size.x, row);
                        else
                            std::fill_n(row, size.x, value_of(all));
                    }
            }
    return Brick::make(std::span<const float>(staged), valid);
}

} // namespace

Mesh touch_surface(const Volume& volume, const TouchParameters& parameters) {
    int finer = FineSamples::kMostFiner;
    while (finer > 1 && sample_count(volume.grid()) * size_t(finer * finer * finer) > kMostPoints)
        --finer;
    FineSamples samples(finer);
    samples.follow(volume, parameters);
    const auto scale = static_cast<uint32_t>(finer);
    Grid grid = volume.grid();
    grid.size = (grid.size - 1u + 2u * kBorder) * scale + 1u;
    grid.world_from_index = glm::scale(glm::translate(grid.world_from_index, glm::dvec3(-kBorder)),
                                       glm::dvec3(1.0 / finer));
    VolumeBuilder builder(grid, ScalarType::f32);
    const glm::uvec3 count = builder.brick_count();
    for (uint32_t z = 0; z < count.z; ++z)
        for (uint32_t y = 0; y < count.y; ++y)
            for (uint32_t x = 0; x < count.x; ++x)
                builder.set_brick(
                    {x, y, z}, fine_brick(samples, grid, {x, y, z}, glm::ivec3(-kBorder * finer)));
    Mesh mesh = marching_cubes(builder.finish(), samples.threshold());

    // Normals of the smooth view at the vertices themselves. (A field knows no opacity table.)
    if (parameters.opacity.point_count == 0) {
        const auto field = std::make_unique<Field>();
        field->follow(volume, parameters);
        const glm::dmat3 mesh_from_world = glm::inverse(glm::dmat3(mesh.world_from_mesh));
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            const glm::dvec3 at(mesh.world_from_mesh * glm::dvec4(mesh.positions[i], 1.0));
            const glm::dvec3 down = field->smooth(at).gradient;
            if (glm::length(down) > 0.0)
                mesh.normals[i] = glm::vec3(-glm::normalize(mesh_from_world * down));
        }
    }
    return mesh;
}

std::shared_ptr<const TouchMesh> make_touch_mesh(std::shared_ptr<const Mesh> mesh, double cell_mm) {
    auto made = std::make_shared<TouchMesh>();
    made->mesh = mesh;
    made->mesh_from_world = glm::inverse(mesh->world_from_mesh);
    glm::vec3 low(0.0f), high(0.0f);
    if (!mesh->positions.empty())
        low = high = mesh->positions[0];
    for (const glm::vec3 p : mesh->positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    double cell = std::max(cell_mm, 1e-3);
    const auto cells_of = [&] { return glm::ivec3((high - low) / static_cast<float>(cell)) + 1; };
    while (double(cells_of().x) * cells_of().y * cells_of().z > 4194304.0)
        cell *= 1.26;
    made->low_mm = low;
    made->cell_mm = static_cast<float>(cell);
    made->cells = cells_of();
    const size_t count = size_t(made->cells.x) * size_t(made->cells.y) * size_t(made->cells.z);
    made->first.assign(count + 1, 0);
    const auto for_cells = [&](const glm::uvec3 t, const auto& visit) {
        const glm::vec3 a = mesh->positions[t.x], b = mesh->positions[t.y],
                        c = mesh->positions[t.z];
        const glm::ivec3 last = made->cells - 1;
        const glm::ivec3 from = glm::clamp(
            glm::ivec3((glm::min(glm::min(a, b), c) - low) / made->cell_mm), glm::ivec3(0), last);
        const glm::ivec3 to = glm::clamp(
            glm::ivec3((glm::max(glm::max(a, b), c) - low) / made->cell_mm), glm::ivec3(0), last);
        for (int z = from.z; z <= to.z; ++z)
            for (int y = from.y; y <= to.y; ++y)
                for (int x = from.x; x <= to.x; ++x)
                    visit(size_t(x) +
                          size_t(made->cells.x) * (size_t(y) + size_t(made->cells.y) * size_t(z)));
    };
    for (const glm::uvec3 t : mesh->triangles)
        for_cells(t, [&](size_t c) { ++made->first[c + 1]; });
    for (size_t c = 0; c < count; ++c)
        made->first[c + 1] += made->first[c];
    if (!mesh->normals.empty()) {
        double edges = 0.0;
        for (const glm::uvec3 t : mesh->triangles)
            for (int k = 0; k < 3; ++k)
                edges +=
                    double{glm::distance(mesh->positions[t[k]], mesh->positions[t[(k + 1) % 3]])};
        made->bulge_mm =
            kBulge * edges / std::max(1.0, 3.0 * static_cast<double>(mesh->triangles.size()));
    }
    made->which.resize(made->first[count]);
    std::vector<uint32_t> at(made->first.begin(), made->first.end() - 1);
    for (uint32_t i = 0; i < mesh->triangles.size(); ++i)
        for_cells(mesh->triangles[i], [&](size_t c) { made->which[at[c]++] = i; });
    return made;
}

} // namespace palpate::haptics
