#include "engine/render/surface_mesh.h"

#include <algorithm>

#include "engine/base/assert.h"
#include "shaders/shared/surface.h"

namespace palpate {

Result<GpuMesh> GpuMesh::make(GpuDevice& device, const std::string& name,
                              std::shared_ptr<const Mesh> source, Commands& commands) {
    const Mesh& mesh = *source;
    PALPATE_ASSERT(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
    PALPATE_ASSERT(mesh.labels.empty() || mesh.labels.size() == mesh.triangles.size());
    PALPATE_ASSERT(mesh.outer_labels.empty() || mesh.outer_labels.size() == mesh.labels.size());
    const uint64_t largest = device.limits().maxStorageBufferRange;
    const uint64_t most =
        std::min<uint64_t>(largest / sizeof(glm::uvec3), uint64_t{1} << gpu::kSurfaceMeshShift);
    for (const auto& [count, what] : {std::pair(mesh.triangles.size(), "triangles"),
                                      std::pair(mesh.positions.size(), "vertices")})
        if (count > most)
            return fail("{}: expected at most {} {}, which the device's buffers hold, found {}",
                        name, most, what, count);
    const auto upload = [&](std::optional<Buffer>& to, const char* what, const auto& values) {
        const auto bytes = std::as_bytes(std::span(values));
        to.emplace(device, name + what, bytes.size(), Memory::device);
        commands.upload(bytes, *to);
    };
    GpuMesh made(std::move(source));
    made.triangle_count_ = static_cast<uint32_t>(mesh.triangles.size());
    if (mesh.triangles.empty())
        return made;
    uint32_t last = 0;
    for (const glm::uvec3 t : mesh.triangles)
        last = std::max({last, t.x, t.y, t.z});
    PALPATE_ASSERT_CMP(size_t{last}, <, mesh.positions.size());
    upload(made.positions_, " positions", mesh.positions);
    upload(made.triangles_, " triangles", mesh.triangles);
    if (!mesh.normals.empty())
        upload(made.normals_, " normals", mesh.normals);
    for (const auto* labels : {&mesh.labels, &mesh.outer_labels})
        if (!labels->empty())
            made.largest_label_ = std::max<uint32_t>(
                made.largest_label_, *std::max_element(labels->begin(), labels->end()));
    if (made.largest_label_ > 0) {
        std::vector<uint32_t> labels(mesh.labels.begin(), mesh.labels.end());
        for (size_t i = 0; i < mesh.outer_labels.size(); ++i)
            labels[i] |= uint32_t{mesh.outer_labels[i]} << 16;
        upload(made.labels_, " labels", labels);
    }
    return made;
}

} // namespace palpate
