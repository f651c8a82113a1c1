#include "engine/render/upload_ring.h"

#include "engine/base/assert.h"

namespace palpate {

namespace {
constexpr uint64_t kAlignment = 256; // of what copies start at
} // namespace

UploadRing::UploadRing(GpuDevice& device, uint64_t bytes)
    : device_(&device), buffer_(device, "upload ring", bytes, Memory::upload) {}

UploadRing::Room UploadRing::take(uint64_t bytes) {
    const uint64_t wanted = (bytes + kAlignment - 1) / kAlignment * kAlignment;
    PALPATE_ASSERT_CMP(wanted, <=, capacity() / 2);
    const bool around = next_ + wanted > capacity();
    const uint64_t first = around ? 0 : next_;
    while (!pieces_.empty()) { // oldest first, which is as they lie ahead of next_
        const Piece& piece = pieces_.front();
        const bool passed_over = around && piece.first >= next_;
        const bool in_the_way = piece.first < first + wanted && first < piece.last;
        if (!passed_over && !in_the_way)
            break;
        PALPATE_ASSERT(piece.value != 0);
        device_->wait(piece.value);
        pieces_.pop_front();
    }
    pieces_.push_back({first, first + wanted, 0});
    next_ = first + wanted;
    return {buffer_.mapped().subspan(first, bytes), first};
}

void UploadRing::sent(uint64_t value) {
    for (auto piece = pieces_.rbegin(); piece != pieces_.rend() && piece->value == 0; ++piece)
        piece->value = value;
}

} // namespace palpate
