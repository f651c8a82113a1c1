#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "engine/decode/formats.h"

namespace palpate::io {

// The result of a decoder run in this process, with the stored values as doubles.
struct DecodedHere {
    Decoded decoded;
    VoxelClaim claim;
    std::vector<double> values;

    double sum() const {
        double total = 0;
        for (const double value : values)
            total += value;
        return total;
    }
};

inline Result<DecodedHere> decode_here(const std::filesystem::path& path,
                                       std::optional<uint32_t> frame = {},
                                       uint64_t max_bytes = uint64_t{1} << 30) {
    const int fd = ::memfd_create("voxels", 0);
    VoxelSink sink(fd, -1, max_bytes);
    Result<Decoded> decoded = decode_any({.path = path, .frame = frame, .series = {}}, sink);
    Result<DecodedHere> result = fail("{}: no claim", path.string());
    if (!decoded) {
        result = pass_on(decoded);
    } else if (sink.claim()) {
        result = DecodedHere{*decoded, *sink.claim(), {}};
        const size_t bytes = *claimed_bytes(result->claim);
        void* const memory = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, fd, 0);
        visit_component(result->claim.type, [&](auto t) {
            using T = decltype(t);
            const T* const values = static_cast<const T*>(memory);
            result->values.assign(values, values + bytes / sizeof(T));
        });
        ::munmap(memory, bytes);
    }
    ::close(fd);
    return result;
}

} // namespace palpate::io
