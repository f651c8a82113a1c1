#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"

namespace palpate {

// Keeps a buffer of the device in step with its contents: written only when they differ, by a copy
// that comes after the frames on their way.
class MirroredBuffer {
 public:
    void hold(GpuDevice& device, const char* name, std::span<const std::byte> bytes,
              Commands& commands) {
        if (buffer_ && std::equal(bytes.begin(), bytes.end(), bytes_.begin(), bytes_.end()))
            return;
        if (!buffer_ || buffer_->bytes() != bytes.size())
            buffer_.emplace(device, name, bytes.size(), Memory::device); // the old one is retired
        bytes_.assign(bytes.begin(), bytes.end());
        commands.upload(bytes, *buffer_);
    }
    void drop() { buffer_.reset(); }
    Buffer& get() { return *buffer_; }

 private:
    std::optional<Buffer> buffer_;
    std::vector<std::byte> bytes_;
};

} // namespace palpate
