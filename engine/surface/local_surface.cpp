#include "engine/surface/local_surface.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

using namespace block;

// Reads samples first - 1 .. first + 9 of a volume, those beyond it as the nearest within.
void read_window(const Volume& volume, glm::ivec3 first, Samples& samples) {
    read_box(volume, first - 1, glm::ivec3(11), {Samples::kStride[1], Samples::kStride[2]},
             samples.value.data());
    samples.has_gaps = false;
    if (volume.no_data_count() > 0)
        for (int z = -1; z < 10; ++z)
            for (int y = -1; y < 10; ++y)
                for (int x = -1; x < 10; ++x)
                    if (const float v = samples.value[Samples::at(x, y, z)]; v != v)
                        samples.has_gaps = true;
}

} // namespace

LocalSurface::LocalSurface(uint32_t side, SurfaceTopology topology)
    : side_(side), topology_(topology), moved_(kMostEdges + kMostInner) {
    PALPATE_ASSERT(side >= 2 && side <= kMostSamples);
}

LocalSurface::Patch LocalSurface::extract(const Volume& volume, glm::dvec3 index, float iso) {
    if (!(std::isfinite(index.x) && std::isfinite(index.y) && std::isfinite(index.z)))
        return {};
    const glm::ivec3 size(volume.size());
    const int side = static_cast<int>(side_);
    glm::ivec3 first, last;
    for (int a = 0; a < 3; ++a) {
        const double wanted = std::floor(index[a] - 0.5 * (side - 1) + 0.5);
        first[a] = static_cast<int>(std::clamp(wanted, 0.0, std::max(0.0, double(size[a] - side))));
        last[a] = std::min(side, size[a]) - 1;
    }
    read_window(volume, first, mesher_.samples());
    const Place place{first, glm::vec3(spacing_mm(volume.grid()))};
    const BlockMesher::Result made = mesher_.mesh(last, place, iso, topology_, /*normals=*/true);
    const auto vertices = static_cast<size_t>(made.vertices);
    return {{made.positions, vertices},
            {made.normals, vertices},
            {made.triangle, static_cast<size_t>(made.triangles)},
            first};
}

LocalSurface::Patch LocalSurface::extract(std::span<const float> in, glm::vec3 spacing_mm,
                                          glm::vec3 origin_mm, float iso) {
    const int side = static_cast<int>(side_);
    PALPATE_ASSERT_CMP(in.size(), ==, size_t{side_} * side_ * side_);
    Samples& samples = mesher_.samples();
    samples.has_gaps = false;
    for (int z = -1; z < 10; ++z)
        for (int y = -1; y < 10; ++y)
            for (int x = -1; x < 10; ++x) {
                const int i = std::clamp(x, 0, side - 1), j = std::clamp(y, 0, side - 1),
                          k = std::clamp(z, 0, side - 1);
                const float v = in[static_cast<size_t>(i + side * (j + side * k))];
                samples.value[Samples::at(x, y, z)] =
                    std::isfinite(v) ? v : std::numeric_limits<float>::quiet_NaN();
                samples.has_gaps = samples.has_gaps || !std::isfinite(v);
            }
    const BlockMesher::Result made = mesher_.mesh(glm::ivec3(side - 1), {glm::ivec3(0), spacing_mm},
                                                  iso, topology_, /*normals=*/true);
    const auto vertices = static_cast<size_t>(made.vertices);
    for (size_t v = 0; v < vertices; ++v)
        moved_[v] = made.positions[v] + origin_mm;
    return {{moved_.data(), vertices},
            {made.normals, vertices},
            {made.triangle, static_cast<size_t>(made.triangles)},
            glm::ivec3(0)};
}

} // namespace palpate
