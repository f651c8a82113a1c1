#include "haptics/field/sample_tiles.h"

#include <algorithm>

#include "haptics/field/four.h"
#include "haptics/field/samples.h"

namespace palpate::haptics {

namespace {

using Bits = int __attribute__((vector_size(16)));

} // namespace

void SampleTiles::follow(const Volume& volume, const StoredSamples& stored, float threshold,
                         float missing, uint64_t settings, uint64_t generation) {
    volume_ = &volume;
    if (generation == generation_)
        return;
    generation_ = generation;
    if (settings == outer_settings_ && threshold == threshold_)
        return;
    ++settings_;
    outer_settings_ = settings;
    stored_ = stored;
    threshold_ = threshold;
    missing_ = missing;
}

// Notes what the volume has at a place; whether that is anything else than before.
bool SampleTiles::renew(Tile& tile, glm::ivec3 at) {
    if (tile.position != at || tile.settings != settings_) {
        tile.position = at;
        tile.settings = settings_;
        tile.stamp = 0;
    }
    tile.generation = generation_;
    const glm::ivec3 first = kSide * at;
    const bool inside = glm::all(glm::greaterThanEqual(first, glm::ivec3(0))) &&
                        glm::all(glm::lessThan(first, glm::ivec3(volume_->size())));
    if (!inside) {
        if (tile.stamp == kOutside)
            return false;
        tile.stamp = kOutside;
        tile.highest = stored_.of(missing_);
        tile.lacks = tile.is_read = false;
        return true;
    }
    const Brick& brick = volume_->brick(glm::uvec3(first) / kBrickSide);
    const uint32_t block = block_of(glm::uvec3(first) % kBrickSide);
    const uint64_t stamp = brick.block_stamp(block);
    if (tile.stamp == stamp && !tile.lacks)
        return false;
    tile.stamp = stamp;
    const ValueRange range = brick.is_constant() ? brick.range() : brick.block_range(block);
    tile.highest = stored_.of(range.empty() ? missing_ : std::max(range.max, missing_));
    tile.lacks = brick.is_in_source();
    tile.is_read = false;
    return true;
}

void SampleTiles::read(Tile& tile) {
    const glm::ivec3 first = kSide * tile.position;
    float* numbers = numbers_.data() + at_x(first.x) + at_y(first.y) + at_z(first.z);
    copy_resident(*volume_, first, glm::ivec3(kSide), missing_, numbers);
    stored_.make({numbers, kSamples});
    const Four threshold{threshold_, threshold_, threshold_, threshold_};
    tile.solid.fill(0);
    for (uint32_t row = 0; row < kSide * kSide; ++row) {
        const Four low = load(numbers + kSide * row), high = load(numbers + kSide * row + 4);
        const Bits bits =
            ((low >= threshold) & Bits{1, 2, 4, 8}) | ((high >= threshold) & Bits{16, 32, 64, 128});
        const auto byte = static_cast<uint64_t>(bits[0] | bits[1] | bits[2] | bits[3]);
        tile.solid[row / kSide] |= byte << kSide * (row % kSide);
    }
    tile.is_read = true;
}

void SampleTiles::hold(glm::ivec3 low, glm::ivec3 high, Read what) {
    low >>= 3;
    high >>= 3;
    if (held_generation_ == generation_ && what <= what_ &&
        glm::all(glm::greaterThanEqual(low, low_)) && glm::all(glm::lessThanEqual(high, high_)))
        return;
    bool is_new = low != low_ || high != high_ || what != what_ || held_ == 0;
    low_ = low;
    high_ = high;
    what_ = what;
    held_generation_ = generation_;
    any_solid_ = lacks_ = false;
    const auto for_tiles = [&](const auto& visit) {
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    const glm::ivec3 at(x, y, z);
                    visit(tile(at), at);
                }
    };
    for_tiles([&](Tile& t, glm::ivec3 at) {
        if (t.generation != generation_ || t.position != at || t.settings != settings_)
            is_new |= renew(t, at);
        any_solid_ |= t.highest >= threshold_;
        lacks_ |= t.lacks;
    });
    held_ += is_new;
    if (what == Read::all || (what == Read::where_solid && any_solid_))
        for_tiles([&](Tile& t, glm::ivec3) {
            if (!t.is_read)
                read(t);
        });
}

const std::array<uint64_t, SampleTiles::kSide>& SampleTiles::near(glm::ivec3 at) {
    Tile& t = tile(at);
    if (t.near_held != held_) {
        t.near_held = held_;
        find_near(t);
    }
    return t.near;
}

// Rows are bytes and slices words, or-ed along x, y and z: samples -1 .. 2 about each cell.
void SampleTiles::find_near(Tile& t) {
    std::array<const Tile*, 27> about{};
    bool any = false;
    for (int i = 0; i < 27; ++i) {
        const glm::ivec3 at = t.position + glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1;
        if (glm::any(glm::lessThan(at, low_)) || glm::any(glm::greaterThan(at, high_)))
            continue;
        const Tile& other = tile(at);
        if (other.highest < threshold_)
            continue;
        about[static_cast<size_t>(i)] = &other;
        any = true;
    }
    const bool in_whole = what_ == Read::none;
    t.near.fill(in_whole && any ? ~uint64_t{0} : 0);
    if (in_whole || !any)
        return;
    // Slices -1 .. 9 of this tile and of those below and above on y, or-ed along x.
    std::array<uint64_t, kSide + 3> slices;
    for (int z = -1; z < kSide + 2; ++z) {
        const int layer = z < 0 ? 0 : z < kSide ? 1 : 2;
        const auto in = static_cast<size_t>(z & 7);
        std::array<uint64_t, 3> along_x{};
        for (int y = 0; y < 3; ++y) {
            const auto slice = [&](int x) {
                const Tile* from = about[static_cast<size_t>(x + 3 * (y + 3 * layer))];
                return from ? from->solid[in] : 0;
            };
            const uint64_t own = slice(1), before = slice(0), after = slice(2);
            along_x[static_cast<size_t>(y)] =
                own | (own << 1 & 0xfefefefefefefefeu) | (before >> 7 & 0x0101010101010101u) |
                (own >> 1 & 0x7f7f7f7f7f7f7f7fu) | (after << 7 & 0x8080808080808080u) |
                (own >> 2 & 0x3f3f3f3f3f3f3f3fu) | (after << 6 & 0xc0c0c0c0c0c0c0c0u);
        }
        const auto [before, own, after] = along_x;
        slices[static_cast<size_t>(z + 1)] =
            own | own << 8 | before >> 56 | own >> 8 | after << 56 | own >> 16 | after << 48;
    }
    for (size_t z = 0; z < size_t{kSide}; ++z)
        t.near[z] = slices[z] | slices[z + 1] | slices[z + 2] | slices[z + 3];
}

} // namespace palpate::haptics
