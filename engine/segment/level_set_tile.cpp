#include <algorithm>
#include <limits>

#include "engine/segment/level_set_band.h"

namespace palpate {

void LevelSetTile::load(const LevelSetBand& band, size_t n, const LevelSetBand::Bits& at,
                        int layers, bool changes) {
    const BrickArray<float>& field = changes ? band.change_ : band.phi_;
    constexpr int kBrick = int(kBrickSide);
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    thread_local std::array<uint8_t, size_t(kSide) * kSide> needed;
    needed.fill(0);
    const auto need = [&](int y, int z) {
        needed[size_t(y + kMargin + kSide * (z + kMargin))] = 1;
    };
    for (uint32_t row = 0; row < LevelSetBand::kRows; ++row) {
        if (at[row] == 0)
            continue;
        const int y = int(row) % kBrick, z = int(row) / kBrick;
        for (int d = -kMargin; d <= kMargin; ++d)
            need(y + d, z), need(y, z + d);
        for (const int d : {-1, 1})
            need(y - 1, z + d), need(y + 1, z + d);
    }
    const glm::ivec3 position(band.position_of(n));
    for (int z = -kMargin; z < kBrick + kMargin; ++z)
        for (int y = -kMargin; y < kBrick + kMargin; ++y) {
            if (!needed[size_t(y + kMargin + kSide * (z + kMargin))])
                continue;
            float* to = &values_[size_t(kSide * (y + kMargin) + kPlane * (z + kMargin))];
            const auto beyond = [](int v) { return v < 0 ? -1 : v >= kBrick ? 1 : 0; };
            const uint32_t row = uint32_t((y & (kBrick - 1)) + kBrick * (z & (kBrick - 1)));
            for (int dx = -1; dx <= 1; ++dx) {
                const glm::ivec3 from = position + glm::ivec3(dx, beyond(y), beyond(z));
                const LevelSetBand::BandBrick* brick = band.find(from);
                const uint32_t usable = brick ? band.row_of(*brick, row, layers) : 0u;
                const int first = dx < 0 ? kBrick - kMargin : 0;
                const int last = dx > 0 ? kMargin : kBrick;
                float* out = to + kMargin + dx * kBrick;
                if (usable == 0) {
                    std::fill(out + first, out + last, kNothing);
                    continue;
                }
                const float* values = field.find(glm::uvec3(from)) + row * kBrickSide;
                for (int x = first; x < last; ++x)
                    out[x] = (usable >> x & 1u) != 0 ? values[x] : kNothing;
            }
        }
}

} // namespace palpate
