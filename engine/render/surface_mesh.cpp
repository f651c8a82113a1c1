#include "engine/render/surface_mesh.h"

#include <algorithm>
#include <cstring>

#include "engine/base/assert.h"
#include "engine/surface_gpu/surface_pool.h"
#include "shaders/shared/surface.h"

namespace palpate {

namespace {

constexpr const char* kNames[] = {" positions", " triangles", " normals", " labels"};

// Pieces of this size are compared, and uploaded where they differ; if more than kMostInPieces
// differ in all, the whole is uploaded.
constexpr size_t kPieceBytes = 4096;
constexpr uint64_t kMostInPieces = uint64_t{4} << 20;

void upload_changes(std::span<const std::byte> before, std::span<const std::byte> now, Buffer& to,
                    Commands& commands) {
    std::vector<UploadPiece> pieces;
    uint64_t total = 0;
    for (size_t at = 0; at < now.size(); at += kPieceBytes) {
        const size_t count = std::min(kPieceBytes, now.size() - at);
        if (at + count <= before.size() &&
            std::memcmp(before.data() + at, now.data() + at, count) == 0)
            continue;
        const bool goes_on = !pieces.empty() && pieces.back().to + pieces.back().bytes.size() == at;
        const uint64_t first = goes_on ? pieces.back().to : at;
        if (goes_on)
            pieces.pop_back();
        pieces.push_back({now.subspan(first, at + count - first), first});
        total += count;
    }
    if (total > kMostInPieces)
        pieces = {{now, 0}};
    upload_pieces(commands, pieces, to);
}

} // namespace

// The arrays of a mesh on the device; empty where the mesh has nothing of a kind.
struct GpuMesh::Arrays {
    explicit Arrays(const Mesh& mesh) {
        PALPATE_ASSERT(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
        PALPATE_ASSERT(mesh.labels.empty() || mesh.labels.size() == mesh.triangles.size());
        PALPATE_ASSERT(mesh.outer_labels.empty() || mesh.outer_labels.size() == mesh.labels.size());
        if (mesh.triangles.empty())
            return;
        uint32_t last = 0;
        for (const glm::uvec3 t : mesh.triangles)
            last = std::max({last, t.x, t.y, t.z});
        PALPATE_ASSERT_CMP(size_t{last}, <, mesh.positions.size());
        for (const auto* some : {&mesh.labels, &mesh.outer_labels})
            if (!some->empty())
                largest_label = std::max<uint32_t>(largest_label,
                                                   *std::max_element(some->begin(), some->end()));
        if (largest_label > 0)
            labels.assign(mesh.labels.begin(), mesh.labels.end());
        for (size_t i = 0; i < std::min(labels.size(), mesh.outer_labels.size()); ++i)
            labels[i] |= uint32_t{mesh.outer_labels[i]} << 16;
        bytes = {std::as_bytes(std::span(mesh.positions)), std::as_bytes(std::span(mesh.triangles)),
                 std::as_bytes(std::span(mesh.normals)), std::as_bytes(std::span(labels))};
    }
    Arrays(const Arrays&) = delete;
    Arrays& operator=(const Arrays&) = delete;

    uint32_t largest_label = 0;
    std::vector<uint32_t> labels; // packed
    std::array<std::span<const std::byte>, kArrays> bytes;
};

Result<GpuMesh> GpuMesh::make(GpuDevice& device, const std::string& name,
                              std::shared_ptr<const Mesh> source, bool room_to_grow,
                              Commands& commands) {
    const Mesh& mesh = *source;
    const uint64_t largest = device.limits().maxStorageBufferRange;
    const uint64_t most =
        std::min<uint64_t>(largest / sizeof(glm::uvec3), uint64_t{gpu::kSurfaceLeaving});
    for (const auto& [count, what] : {std::pair(mesh.triangles.size(), "triangles"),
                                      std::pair(mesh.positions.size(), "vertices")})
        if (count > most)
            return fail("{}: expected at most {} {}, which the device's buffers hold, found {}",
                        name, most, what, count);
    const Arrays arrays(mesh);
    GpuMesh made(std::move(source));
    made.triangle_count_ = static_cast<uint32_t>(mesh.triangles.size());
    made.largest_label_ = arrays.largest_label;
    for (size_t k = 0; k < kArrays; ++k) {
        const uint64_t bytes = arrays.bytes[k].size();
        if (bytes == 0)
            continue;
        const uint64_t spare = room_to_grow ? bytes / 8 / sizeof(glm::vec3) * sizeof(glm::vec3) : 0;
        made.buffers_[k].emplace(device, name + kNames[k], std::min(bytes + spare, largest),
                                 Memory::device);
        commands.upload(arrays.bytes[k], *made.buffers_[k]);
    }
    return made;
}

bool GpuMesh::update(const std::shared_ptr<const Mesh>& next, Commands& commands) {
    const Arrays now(*next);
    for (size_t k = 0; k < kArrays; ++k)
        if (now.bytes[k].empty() == buffers_[k].has_value() ||
            (buffers_[k] && now.bytes[k].size() > buffers_[k]->bytes()))
            return false;
    const Arrays before(*source_);
    for (size_t k = 0; k < kArrays; ++k)
        if (buffers_[k])
            upload_changes(before.bytes[k], now.bytes[k], *buffers_[k], commands);
    source_ = next;
    triangle_count_ = static_cast<uint32_t>(next->triangles.size());
    largest_label_ = now.largest_label;
    return true;
}

} // namespace palpate
