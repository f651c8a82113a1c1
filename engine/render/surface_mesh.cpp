#include "engine/render/surface_mesh.h"

#include <algorithm>
#include <cstring>

#include "engine/base/assert.h"
#include "shaders/shared/surface.h"

namespace palpate {

namespace {

void upload(GpuDevice& device, std::optional<Buffer>& buffer, const std::string& name,
            std::span<const std::byte> bytes) {
    buffer.emplace(device, name, bytes.size(), Memory::device);
    Buffer staging(device, name + " staging", bytes.size(), Memory::upload);
    std::memcpy(staging.mapped().data(), bytes.data(), bytes.size());
    Commands commands(device);
    commands.copy(staging, *buffer);
    commands.submit();
}

} // namespace

Result<GpuMesh> GpuMesh::make(GpuDevice& device, const std::string& name,
                              std::shared_ptr<const Mesh> source) {
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
    GpuMesh made(std::move(source));
    made.triangle_count_ = static_cast<uint32_t>(mesh.triangles.size());
    if (mesh.triangles.empty())
        return made;
    uint32_t last = 0;
    for (const glm::uvec3 t : mesh.triangles)
        last = std::max({last, t.x, t.y, t.z});
    PALPATE_ASSERT_CMP(size_t{last}, <, mesh.positions.size());
    upload(device, made.positions_, name + " positions", std::as_bytes(std::span(mesh.positions)));
    upload(device, made.triangles_, name + " triangles", std::as_bytes(std::span(mesh.triangles)));
    if (!mesh.normals.empty())
        upload(device, made.normals_, name + " normals", std::as_bytes(std::span(mesh.normals)));
    for (const auto* labels : {&mesh.labels, &mesh.outer_labels})
        if (!labels->empty())
            made.largest_label_ = std::max<uint32_t>(
                made.largest_label_, *std::max_element(labels->begin(), labels->end()));
    if (made.largest_label_ > 0) {
        std::vector<uint32_t> labels(mesh.labels.begin(), mesh.labels.end());
        for (size_t i = 0; i < mesh.outer_labels.size(); ++i)
            labels[i] |= uint32_t{mesh.outer_labels[i]} << 16;
        upload(device, made.labels_, name + " labels", std::as_bytes(std::span(labels)));
    }
    return made;
}

} // namespace palpate
