#include "engine/segment/level_set_band.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace palpate {

namespace {

constexpr int kSide = int(kBrickSide);
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
// Of the least distance between a sample and the plane through its neighbours: a sample beyond the
// active layer stays on its side if its neighbours, at 0 or farther from the surface before, come
// by less. The rest is room for the correction, at most a quarter of a sample.
constexpr double kStep = 0.6;

template <class Work>
void for_bricks(const std::vector<size_t>& bricks, const Work& work) {
    tbb::parallel_for(size_t{0}, bricks.size(), [&](size_t i) { work(bricks[i], i); });
}

bool any(const LevelSetBand::Bits& bits) {
    return std::ranges::any_of(bits, [](uint32_t row) { return row != 0; });
}

} // namespace

LevelSetBand::LevelSetBand(const Grid& grid)
    : grid_(grid),
      metric_(grid),
      most_step_mm_(kStep * double(metric_.least())),
      phi_(grid.size, kNone),
      change_(grid.size, 0.0f),
      bricks_(size_t{brick_count().x} * brick_count().y * brick_count().z) {
    const glm::dvec3 h = spacing_mm(grid);
    // A sample in no layer is at least four steps over faces from the surface's nearest sample on
    // its side. On a plane's normal n, some axis has |n_k| h_k >= least h / sqrt(3), and four such
    // steps are more than two of the least h.
    limit_mm_ = float(2.0 * std::min({h.x, h.y, h.z}));
    tbb::parallel_for(size_t{0}, bricks_.size(), [&](size_t n) {
        const glm::uvec3 valid =
            glm::min(glm::uvec3(kBrickSide), grid.size - position_of(n) * kBrickSide);
        const uint32_t beyond = valid.x == kBrickSide ? 0u : ~0u << valid.x;
        for (uint32_t row = 0; row < kRows; ++row)
            bricks_[n].walls[row] =
                row % kBrickSide < valid.y && row / kBrickSide < valid.z ? beyond : ~0u;
    });
}

glm::uvec3 LevelSetBand::position_of(size_t brick) const {
    const glm::uvec3 count = brick_count();
    return {brick % count.x, brick / count.x % count.y, brick / (size_t{count.x} * count.y)};
}

const LevelSetBand::BandBrick* LevelSetBand::find(glm::ivec3 at) const {
    const glm::ivec3 count(brick_count());
    if (glm::any(glm::lessThan(at, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(at, count)))
        return nullptr;
    return &bricks_[size_t(at.x) +
                    size_t(count.x) * (size_t(at.y) + size_t(count.y) * size_t(at.z))];
}

LevelSetBand::Beside LevelSetBand::beside(size_t brick) const {
    const glm::ivec3 at(position_of(brick));
    Beside bricks{&bricks_[brick]};
    for (int i = 0; i < 6; ++i) {
        glm::ivec3 to = at;
        to[i / 2] += i % 2 == 0 ? -1 : 1;
        bricks[size_t(i) + 1] = find(to);
    }
    return bricks;
}

// Samples of a row with a face neighbour on each axis whose bit is set: bits_of(brick, row) gives
// the bits of a brick.
template <class Row>
std::array<uint32_t, 3> LevelSetBand::around(const Beside& bricks, uint32_t row,
                                             const Row& bits_of) {
    constexpr uint32_t kPlane = kBrickSide, kWhole = kRows;
    const uint32_t y = row % kBrickSide, z = row / kBrickSide, last = kBrickSide - 1;
    const auto bits = [&](size_t i, uint32_t r) { return bricks[i] ? bits_of(*bricks[i], r) : 0u; };
    const uint32_t here = bits(0, row);
    return {here << 1 | bits(1, row) >> 31 | here >> 1 | bits(2, row) << 31,
            (y > 0 ? bits(0, row - 1) : bits(3, row + last)) |
                (y < last ? bits(0, row + 1) : bits(4, row - last)),
            (z > 0 ? bits(0, row - kPlane) : bits(5, row + kWhole - kPlane)) |
                (z < last ? bits(0, row + kPlane) : bits(6, row + kPlane - kWhole))};
}

// Samples of a row with a neighbour on the other side, along each axis.
std::array<uint32_t, 3> LevelSetBand::across(const Beside& bricks, uint32_t row) {
    const auto in = [](const BandBrick& b, uint32_t r) { return b.inside[r] & ~b.walls[r]; };
    const auto out = [](const BandBrick& b, uint32_t r) { return ~b.inside[r] & ~b.walls[r]; };
    std::array<uint32_t, 3> found = around(bricks, row, out);
    const std::array<uint32_t, 3> beside_in = around(bricks, row, in);
    for (size_t k = 0; k < 3; ++k)
        found[k] = (in(*bricks[0], row) & found[k]) | (out(*bricks[0], row) & beside_in[k]);
    return found;
}

uint32_t LevelSetBand::row_of(const BandBrick& brick, uint32_t row, int layers) {
    if (!brick.layers)
        return 0;
    uint32_t bits = 0;
    for (int k = 0; k < layers; ++k)
        bits |= (*brick.layers)[size_t(k)][row];
    return bits & ~brick.walls[row];
}

LevelSetBand::Bits LevelSetBand::layer_bits(const BandBrick& brick, int layer) {
    Bits bits = (*brick.layers)[size_t(layer)];
    for (uint32_t row = 0; row < kRows; ++row)
        bits[row] &= ~brick.walls[row];
    return bits;
}

// All layers from the sides. The active samples lie in `candidates`. Samples that come into a layer
// have no distance until they are solved.
void LevelSetBand::find_layers(const std::vector<size_t>& candidates) {
    const glm::ivec3 count(brick_count());
    std::vector<std::vector<size_t>> reached(candidates.size());
    std::vector<std::unique_ptr<std::array<Bits, kLayers>>> before(bricks_.size());
    for (const size_t n : near_)
        before[n] = std::move(bricks_[n].layers);
    for_bricks(candidates, [&](size_t n, size_t i) {
        BandBrick& brick = bricks_[n];
        const Beside bricks = beside(n);
        Bits found;
        glm::ivec3 low(kSide), high(-1);
        for (uint32_t row = 0; row < kRows; ++row) {
            const std::array<uint32_t, 3> axes = across(bricks, row);
            found[row] = axes[0] | axes[1] | axes[2];
            if (found[row] == 0)
                continue;
            const int y = int(row) % kSide, z = int(row) / kSide;
            low = glm::min(low, glm::ivec3(std::countr_zero(found[row]), y, z));
            high = glm::max(high, glm::ivec3(31 - std::countl_zero(found[row]), y, z));
        }
        if (high.x < 0)
            return;
        brick.layers = std::make_unique<std::array<Bits, kLayers>>();
        (*brick.layers)[0] = found;
        // Bricks that the other layers may reach into.
        const glm::ivec3 origin = glm::ivec3(position_of(n)) * kSide;
        const glm::ivec3 first = glm::max(origin + low - (kLayers - 1), 0) / kSide;
        const glm::ivec3 last = glm::min((origin + high + (kLayers - 1)) / kSide, count - 1);
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    reached[i].push_back(size_t(x) + size_t(count.x) *
                                                         (size_t(y) + size_t(count.y) * size_t(z)));
    });
    const std::vector<size_t> old = std::move(near_);
    near_.clear();
    for (const std::vector<size_t>& bricks : reached)
        near_.insert(near_.end(), bricks.begin(), bricks.end());
    std::ranges::sort(near_);
    near_.erase(std::ranges::unique(near_).begin(), near_.end());
    for (const size_t n : old)
        if (!std::ranges::binary_search(near_, n)) {
            phi_.clear(position_of(n));
            change_.clear(position_of(n));
        }
    for_bricks(near_, [&](size_t n, size_t) {
        if (!bricks_[n].layers)
            bricks_[n].layers = std::make_unique<std::array<Bits, kLayers>>();
        phi_.write(position_of(n));
        change_.write(position_of(n));
    });
    for (int k = 1; k < kLayers; ++k) {
        const auto nearer = [k](const BandBrick& brick, uint32_t row) {
            uint32_t bits = 0;
            for (int j = 0; brick.layers && j < k; ++j)
                bits |= (*brick.layers)[size_t(j)][row];
            return bits;
        };
        for_bricks(near_, [&](size_t n, size_t) {
            const Beside bricks = beside(n);
            for (uint32_t row = 0; row < kRows; ++row) {
                const std::array<uint32_t, 3> axes = around(bricks, row, nearer);
                (*bricks_[n].layers)[size_t(k)][row] =
                    (axes[0] | axes[1] | axes[2]) & ~nearer(bricks_[n], row);
            }
        });
    }
    for_bricks(near_, [&](size_t n, size_t) {
        Bits fresh;
        for (uint32_t row = 0; row < kRows; ++row) {
            fresh[row] = row_of(bricks_[n], row, kLayers);
            for (size_t k = 0; before[n] && k < kLayers; ++k)
                fresh[row] &= ~(*before[n])[k][row];
        }
        float* phi = phi_.find(position_of(n));
        for_each_bit(fresh,
                     [&](uint32_t row, int x) { phi[row * kBrickSide + uint32_t(x)] = kNone; });
    });
}

namespace {

// A neighbour of a sample on each axis, towards the surface, of those that is_usable(offset).
struct Nearer {
    std::array<SimplexDistance::Neighbour, 3> axes;
    std::array<int, 3> to{}; // offset in the tile; 0: none
    bool any = false;
};
template <class Value>
Nearer nearer_of(const Value& value) {
    Nearer found;
    for (size_t i = 0; i < 3; ++i) {
        const int stride = LevelSetTile::kStrides[i];
        const float low = value(-stride), high = value(stride);
        const bool is_low = std::isnan(high) || low <= high;
        if (std::isnan(is_low ? low : high))
            continue;
        found.any = true;
        found.to[i] = is_low ? -stride : stride;
        found.axes[i] = {is_low ? low : high, is_low ? -1 : 1};
    }
    return found;
}

} // namespace

// Distances of the layers beyond the active one, each from those before it.
void LevelSetBand::solve_layers() {
    const glm::vec3 h(spacing_mm(grid_));
    for (int k = 1; k < kLayers; ++k) {
        for_bricks(near_, [&](size_t n, size_t) {
            BandBrick& brick = bricks_[n];
            brick.solved.clear();
            const Bits bits = layer_bits(brick, k);
            if (!any(bits))
                return;
            thread_local LevelSetTile distances, changes;
            distances.load(*this, n, bits, kLayers);
            changes.load(*this, n, bits, k, true);
            for_each_bit(bits, [&](uint32_t row, int x) {
                const float sign = (brick.inside[row] >> x & 1u) != 0 ? -1.0f : 1.0f;
                const float* at = distances.sample(row, x);
                const float* changed = changes.sample(row, x); // NaN: has not moved yet
                const Nearer first = nearer_of(
                    [&](int to) { return std::isnan(changed[to]) ? kNone : sign * at[to]; });
                if (!first.any) { // behind a corner of walls
                    brick.solved.emplace_back(sign * limit_mm_, 0.0f);
                    return;
                }
                const SimplexDistance::Solution rough = metric_.solve(first.axes);
                float change = 0.0f;
                for (size_t i = 0; i < 3; ++i)
                    if (first.to[i] != 0)
                        change += rough.shares[int(i)] * changed[first.to[i]];
                // Of this layer and later ones: as they will be.
                const auto value = [&](int to) {
                    return sign * (std::isnan(changed[to]) ? at[to] + change : at[to]);
                };
                Nearer nearer = nearer_of(value);
                for (size_t i = 0; i < 3; ++i)
                    if (const int to = nearer.to[i]; to != 0) {
                        // 0 where its own is not known yet. A surface that bends more than one of
                        // a radius of two samples is not on this grid: then values are off.
                        const float bend =
                            upwind_bend(value(-to) - 2.0f * value(0) + value(to),
                                        value(0) - 2.0f * value(to) + value(2 * to), h[int(i)]);
                        const float most = 0.5f * h[int(i)];
                        nearer.axes[i].value -= 0.5f * std::clamp(bend, -most, most);
                    }
                brick.solved.emplace_back(sign * metric_.solve(nearer.axes).u, change);
            });
        });
        for_bricks(near_, [&](size_t n, size_t) {
            if (bricks_[n].solved.empty())
                return;
            float* phi = phi_.find(position_of(n));
            float* change = change_.find(position_of(n));
            const glm::vec2* next = bricks_[n].solved.data();
            for_each_bit(layer_bits(bricks_[n], k), [&](uint32_t row, int x) {
                phi[row * kBrickSide + uint32_t(x)] = next->x;
                change[row * kBrickSide + uint32_t(x)] = next++->y;
            });
        });
    }
}

// The same with an active layer that has not moved.
void LevelSetBand::complete() {
    for_bricks(near_, [&](size_t n, size_t) {
        float* change = change_.find(position_of(n));
        for_each_bit(active(n),
                     [&](uint32_t row, int x) { change[row * kBrickSide + uint32_t(x)] = 0.0f; });
    });
    solve_layers();
}

void LevelSetBand::start_layers(const std::function<float(glm::uvec3 index)>& distance) {
    for_bricks(near_, [&](size_t n, size_t) {
        const BandBrick& brick = bricks_[n];
        const glm::uvec3 position = position_of(n);
        float* phi = phi_.find(position);
        for (int k = 0; k < (distance ? kLayers : 0); ++k)
            for_each_bit(layer_bits(brick, k), [&](uint32_t row, int x) {
                const glm::uvec3 local(uint32_t(x), row % kBrickSide, row / kBrickSide);
                phi[row * kBrickSide + uint32_t(x)] = distance(position * kBrickSide + local);
            });
        if (distance)
            return;
        for_each_bit(active(n), [&](uint32_t row, int x) {
            const glm::ivec3 local(x, int(row) % kSide, int(row) / kSide);
            float& to = phi[row * kBrickSide + uint32_t(x)];
            const bool is_inside = (brick.inside[row] >> x & 1u) != 0;
            const float sign = is_inside ? -1.0f : 1.0f;
            std::array<SimplexDistance::Neighbour, 3> axes;
            for (int i = 0; i < 3; ++i)
                for (const int side : {-1, 1}) {
                    glm::ivec3 to_side = local;
                    to_side[i] += side;
                    const glm::ivec3 beyond = glm::ivec3(glm::equal(to_side, glm::ivec3(kSide))) -
                                              glm::ivec3(glm::equal(to_side, glm::ivec3(-1)));
                    const BandBrick* other = find(glm::ivec3(position) + beyond);
                    const glm::ivec3 there = to_side - beyond * kSide;
                    const uint32_t at = uint32_t(there.y + kSide * there.z);
                    if (other && !(other->walls[at] >> there.x & 1u) &&
                        (other->inside[at] >> there.x & 1u) != uint32_t(is_inside))
                        axes[size_t(i)] = {0.0f, side};
                }
            to = 0.5f * sign * metric_.solve(axes).u; // the surface is midway
        });
    });
}

void LevelSetBand::begin(const std::function<float(glm::uvec3 index)>& distance) {
    std::vector<size_t> all(bricks_.size());
    std::iota(all.begin(), all.end(), size_t{0});
    find_layers(all);
    start_layers(distance);
    complete();
}

size_t LevelSetBand::active_count() const {
    size_t count = 0;
    for (const size_t n : near_)
        for (const uint32_t row : active(n))
            count += size_t(std::popcount(row));
    return count;
}

double LevelSetBand::move(const std::vector<std::vector<float>>& changes) {
    std::vector<double> squares(near_.size());
    const glm::vec3 h(spacing_mm(grid_));
    for_bricks(near_, [&](size_t n, size_t i) {
        float* phi = phi_.find(position_of(n));
        const Beside bricks = beside(n);
        float* changed = change_.find(position_of(n));
        const float* change = changes[i].data();
        for (uint32_t row = 0; row < kRows; ++row) {
            if (active(n)[row] == 0)
                continue;
            const std::array<uint32_t, 3> beyond = across(bricks, row);
            for (uint32_t left = active(n)[row]; left != 0; left &= left - 1) {
                const int x = std::countr_zero(left);
                float farthest = std::numeric_limits<float>::infinity();
                for (int k = 0; k < 3; ++k)
                    if ((beyond[size_t(k)] >> x & 1u) != 0)
                        farthest = std::min(farthest, h[k]);
                float& at = phi[row * kBrickSide + uint32_t(x)];
                const float now = std::clamp(at + *change++, -farthest, farthest);
                changed[row * kBrickSide + uint32_t(x)] = now - at;
                squares[i] += double(now - at) * double(now - at);
                at = now;
            }
        }
    });
    solve_layers();
    for_bricks(near_, [&](size_t n, size_t) {
        const float* phi = phi_.find(position_of(n));
        for_each_bit(active(n), [&](uint32_t row, int x) {
            const uint32_t bit = 1u << x;
            const bool is_inside = phi[row * kBrickSide + uint32_t(x)] < 0.0f;
            uint32_t& inside = bricks_[n].inside[row];
            inside = is_inside ? inside | bit : inside & ~bit;
        });
    });
    find_layers(std::vector<size_t>(near_));
    double sum = 0.0;
    for (const double one : squares)
        sum += one;
    return sum;
}

float LevelSetBand::distance(size_t n, uint32_t offset) const {
    const BandBrick& brick = bricks_[n];
    const uint32_t row = offset / kBrickSide, bit = 1u << offset % kBrickSide;
    if ((row_of(brick, row, kLayers) & bit) != 0)
        return std::clamp(phi_.find(position_of(n))[offset], -limit_mm_, limit_mm_);
    return (brick.inside[row] & bit) != 0 ? -limit_mm_ : limit_mm_;
}

} // namespace palpate
