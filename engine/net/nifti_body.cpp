#include "engine/net/nifti_body.h"

#include <zlib.h>

#include "engine/base/assert.h"
#include "engine/io/volume_headers.h"
#include "engine/net/bytes.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

// Packs bytes as one gzip stream behind what is in `packed`.
class Packer {
 public:
    Packer() {
        constexpr int kGzip = 16, kLargestWindow = 15, kMemory = 8, kFast = 1;
        PALPATE_ASSERT(deflateInit2(&stream_, kFast, Z_DEFLATED, kLargestWindow + kGzip, kMemory,
                                    Z_DEFAULT_STRATEGY) == Z_OK);
    }
    ~Packer() { deflateEnd(&stream_); }
    Packer(const Packer&) = delete;
    Packer& operator=(const Packer&) = delete;

    // At most 4 GiB at once.
    void take(std::span<const std::byte> bytes, bool is_last) {
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
        stream_.avail_in = uInt(bytes.size());
        do {
            std::byte part[1 << 16];
            stream_.next_out = reinterpret_cast<Bytef*>(part);
            stream_.avail_out = sizeof part;
            deflate(&stream_, is_last ? Z_FINISH : Z_NO_FLUSH);
            packed.insert(packed.end(), part, part + sizeof part - stream_.avail_out);
        } while (stream_.avail_out == 0);
    }

    std::vector<std::byte> packed;

 private:
    z_stream stream_{};
};

} // namespace

Result<std::vector<std::byte>> nifti_body(const Volume& volume, const std::stop_token& stop) {
    Packer packer;
    packer.take(bytes_of(io::nifti_volume_header(volume.grid(), volume.type()).bytes), false);
    const glm::ivec3 size(volume.size());
    return visit_scalar(volume.type(), [&](auto type) -> Result<std::vector<std::byte>> {
        std::vector<decltype(type)> slice(size_t(size.x) * size_t(size.y));
        for (int z = 0; z < size.z; ++z) {
            if (stop.stop_requested())
                return fail("stopped before it was done");
            read_box(volume, {0, 0, z}, {size.x, size.y, 1}, packed(volume.size()), slice.data());
            packer.take(std::as_bytes(std::span(slice)), z + 1 == size.z);
        }
        return std::move(packer.packed);
    });
}

} // namespace palpate
