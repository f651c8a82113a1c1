#pragma once

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
    // triangle is below the number of positions.
    static Result<GpuMesh> make(GpuDevice& device, const std::string& name,
                                std::shared_ptr<const Mesh> mesh, Commands& commands);

    const std::shared_ptr<const Mesh>& source() const { return source_; }
    uint32_t triangle_count() const { return triangle_count_; }
    uint32_t largest_label() const { return largest_label_; }
    bool has_labels() const { return labels_.has_value(); }
    bool has_outer_labels() const { return has_labels() && !source_->outer_labels.empty(); }
    bool has_normals() const { return normals_.has_value(); }

    Buffer& positions() { return *positions_; } // vec3[]
    Buffer& triangles() { return *triangles_; } // uvec3[]
    // vec3[], and uint[] of label | outer label << 16; where the mesh has none, a buffer that must
    // not be read.
    Buffer& normals() { return normals_ ? *normals_ : *positions_; }
    Buffer& labels() { return labels_ ? *labels_ : *triangles_; }

 private:
    explicit GpuMesh(std::shared_ptr<const Mesh> source) : source_(std::move(source)) {}

    std::shared_ptr<const Mesh> source_;
    uint32_t triangle_count_ = 0, largest_label_ = 0;
    std::optional<Buffer> positions_, normals_, triangles_, labels_;
};

} // namespace palpate
