#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "engine/base/error.h"
#include "engine/gpu/commands.h"
#include "engine/mesh/mesh.h"

namespace palpate {

// A mesh on the GPU, as it is on the CPU; of one that is not labelled, or without normals, no bytes
// are held for them.
class GpuMesh {
 public:
    // Fails with a sentence where the mesh is larger than the device's buffers. Every index of a
    // triangle is below the number of positions. With `room_to_grow` buffers are an eighth larger.
    static Result<GpuMesh> make(GpuDevice& device, const std::string& name,
                                std::shared_ptr<const Mesh> mesh, bool room_to_grow,
                                Commands& commands);

    // Takes another mesh in place of this one and uploads where they differ, in pieces of a few
    // KiB: what keeps its place among vertices and triangles costs no upload. False, and nothing
    // has changed, where it needs larger buffers, or others.
    bool update(const std::shared_ptr<const Mesh>& next, Commands& commands);

    const std::shared_ptr<const Mesh>& source() const { return source_; }
    uint32_t triangle_count() const { return triangle_count_; }
    uint32_t largest_label() const { return largest_label_; }
    bool has_labels() const { return buffers_[kLabels].has_value(); }
    bool has_outer_labels() const { return has_labels() && !source_->outer_labels.empty(); }
    bool has_normals() const { return buffers_[kNormals].has_value(); }

    Buffer& positions() { return *buffers_[kPositions]; } // vec3[]
    Buffer& triangles() { return *buffers_[kTriangles]; } // uvec3[]
    // vec3[], and uint[] of label | outer label << 16; where the mesh has none, a buffer that must
    // not be read.
    Buffer& normals() { return has_normals() ? *buffers_[kNormals] : positions(); }
    Buffer& labels() { return has_labels() ? *buffers_[kLabels] : triangles(); }

 private:
    enum Array { kPositions, kTriangles, kNormals, kLabels, kArrays };
    struct Arrays;
    explicit GpuMesh(std::shared_ptr<const Mesh> source) : source_(std::move(source)) {}

    std::shared_ptr<const Mesh> source_;
    uint32_t triangle_count_ = 0, largest_label_ = 0;
    std::array<std::optional<Buffer>, kArrays> buffers_;
};

} // namespace palpate
