#include "apps/palpate/view/label_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "engine/io/mesh_io.h"
#include "engine/io/volume_io.h"
#include "engine/surface/surface_nets.h"

namespace palpate::view {

namespace {

constexpr std::array<std::string_view, 4> kMeshes{".ply", ".stl", ".obj", ".vtp"};
constexpr uint32_t kPasses = 10; // of smoothing, as `palpate surface --smooth bounded` has them

} // namespace

uint64_t count_of_label(const Volume& labels, uint16_t label) {
    uint64_t count = 0;
    const glm::uvec3 size = labels.size();
    std::vector<float> row(size.x);
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y) {
            read_row(labels, {0, y, z}, size.x, row.data());
            count += static_cast<uint64_t>(std::ranges::count(row, static_cast<float>(label)));
        }
    return count;
}

Result<std::string> export_labels(const Volume& labels, uint16_t label,
                                  const std::filesystem::path& path, const std::stop_token& stop) {
    if (std::ranges::find(kMeshes, path.extension().string()) == kMeshes.end()) {
        PALPATE_TRY(expect_volume_name(path));
        PALPATE_TRY(save_volume(path, labels, stop));
        return fmt::format("all labels written to {}", path.string());
    }
    if (count_of_label(labels, label) == 0)
        return fail("{}: expected samples of label {}, found none", path.string(), label);
    const Mesh all = surface_nets(labels, {.passes = kPasses, .stop = stop});
    const Mesh mesh = surface_of_label(all, label);
    PALPATE_TRY(save_mesh(path, mesh, {.stop = stop}));
    return fmt::format("label {}: {} triangles written to {}", label, mesh.triangles.size(),
                       path.string());
}

} // namespace palpate::view
