#pragma once

#include <cstring>
#include <optional>
#include <span>

#include "engine/gpu/resource.h"

namespace palpate {

// Keeps a small buffer in step with its contents: written only when they differ.
class MirroredBuffer {
 public:
    void hold(GpuDevice& device, const char* name, std::span<const std::byte> bytes) {
        if (buffer_ && bytes.size() == buffer_->bytes() &&
            std::memcmp(bytes.data(), buffer_->mapped().data(), bytes.size()) == 0)
            return;
        buffer_.emplace(device, name, bytes.size(), Memory::upload); // the old one is retired
        std::memcpy(buffer_->mapped().data(), bytes.data(), bytes.size());
    }
    void drop() { buffer_.reset(); }
    Buffer& get() { return *buffer_; }

 private:
    std::optional<Buffer> buffer_;
};

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

} // namespace palpate
