#include "engine/volume/content_hash.h"

#include <tbb/parallel_for.h>

#include <cstring>
#include <vector>

namespace palpate {

namespace {

__extension__ using Wide = unsigned __int128;

uint64_t mixed(uint64_t h, uint64_t word) { // multiply and fold, as in wyhash
    const auto product = static_cast<Wide>(h ^ word) * 0x9e3779b97f4a7c15u;
    return static_cast<uint64_t>(product) ^ static_cast<uint64_t>(product >> 64) ^ (word << 1);
}

uint64_t hash_of(const Brick& brick) {
    const Brick::Pinned pinned = brick.pin();
    const size_t bytes = (brick.is_constant() ? 1 : kBrickSamples) * bytes_per_sample(brick.type());
    uint64_t h = bytes + 1;
    for (size_t i = 0; i < bytes; i += 8) {
        uint64_t word = 0;
        std::memcpy(&word, pinned.bytes + i, std::min<size_t>(8, bytes - i));
        h = mixed(h, word);
    }
    return h;
}

} // namespace

uint64_t content_hash(const Volume& volume) {
    const glm::uvec3 count = volume.brick_count();
    std::vector<uint64_t> hashes(size_t{count.x} * count.y * count.z);
    tbb::parallel_for(size_t{0}, hashes.size(), [&](size_t i) {
        hashes[i] = hash_of(volume.brick(
            glm::uvec3(i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y))));
    });
    const glm::uvec3 size = volume.size();
    uint64_t h = static_cast<uint64_t>(volume.type()) + 1;
    for (const uint64_t word : {uint64_t{size.x}, uint64_t{size.y}, uint64_t{size.z}})
        h = mixed(h, word);
    for (const uint64_t word : hashes)
        h = mixed(h, word);
    return h;
}

} // namespace palpate
