#include "engine/segment/level_set_band.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace palpate {

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
// The longest step, as a share of a sample's least distance from the plane through its neighbours:
// a sample beyond the active layer stays on its side if its neighbours, at 0 or farther from the
// surface before, come by less. The rest is room for the correction, at most a quarter of a sample.
constexpr double kStep = 0.6;

template <class Work>
void for_bricks(const std::vector<size_t>& bricks, const Work& work) {
    tbb::parallel_for(size_t{0}, bricks.size(), [&](size_t i) { work(bricks[i], i); });
}

bool is_within(glm::ivec3 at, glm::uvec3 count) {
    return glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
           glm::all(glm::lessThan(at, glm::ivec3(count)));
}

uint32_t any_of(const std::array<uint32_t, 6>& bits) {
    return bits[0] | bits[1] | bits[2] | bits[3] | bits[4] | bits[5];
}

size_t number_of(glm::uvec3 at, glm::uvec3 count) {
    return at.x + count.x * (at.y + size_t{count.y} * at.z);
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
        for (uint32_t row = 0; row < kBrickRows; ++row)
            bricks_[n].walls[row] =
                row % kBrickSide < valid.y && row / kBrickSide < valid.z ? beyond : ~0u;
    });
}

glm::uvec3 LevelSetBand::position_of(size_t brick) const {
    const glm::uvec3 count = brick_count();
    return {brick % count.x, brick / count.x % count.y, brick / (size_t{count.x} * count.y)};
}

LevelSetBand::Bits LevelSetBand::layer(const BandBrick& brick, int k) const {
    Bits bits = (*brick.within)[size_t(k)];
    for (uint32_t row = 0; k > 0 && row < kBrickRows; ++row)
        bits[row] &= ~(*brick.within)[size_t(k) - 1][row];
    return bits;
}

// The bits that row_of(brick, row) gives of a brick and those that share a face with it.
template <class Row>
BitTile LevelSetBand::tile(size_t brick, const Row& row_of) const {
    std::array<const BandBrick*, 7> bricks{&bricks_[brick]};
    for (int i = 0; i < 6; ++i) {
        glm::ivec3 to(position_of(brick));
        to[i / 2] += i % 2 == 0 ? -1 : 1;
        if (is_within(to, brick_count()))
            bricks[size_t(i) + 1] = &bricks_[number_of(glm::uvec3(to), brick_count())];
    }
    return BitTile(
        [&](size_t i, uint32_t row) { return bricks[i] ? row_of(*bricks[i], row) : 0u; });
}

// Calls visit(row, samples whose neighbour on low and high x, y, z is on the other side).
template <class Visit>
void LevelSetBand::for_active_rows(size_t n, const Visit& visit) const {
    const BitTile in =
        tile(n, [](const BandBrick& b, uint32_t r) { return b.inside[r] & ~b.walls[r]; });
    const BitTile out =
        tile(n, [](const BandBrick& b, uint32_t r) { return ~b.inside[r] & ~b.walls[r]; });
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y) {
            const std::array<uint32_t, 6> a = in.beside(y, z), b = out.beside(y, z);
            std::array<uint32_t, 6> beyond;
            for (size_t k = 0; k < 6; ++k)
                beyond[k] = (in.row(y, z) & b[k]) | (out.row(y, z) & a[k]);
            visit(y + kBrickSide * z, beyond);
        }
}

// These bricks and all beside them, ascending.
std::vector<size_t> LevelSetBand::around(const std::vector<uint8_t>& bricks) const {
    std::vector<uint8_t> reached(bricks.size());
    for (size_t n = 0; n < bricks.size(); ++n) {
        if (!bricks[n])
            continue;
        const glm::uvec3 at = position_of(n);
        const glm::uvec3 low = glm::max(at, 1u) - 1u, high = glm::min(at + 2u, brick_count());
        for (uint32_t z = low.z; z < high.z; ++z)
            for (uint32_t y = low.y; y < high.y; ++y)
                for (uint32_t x = low.x; x < high.x; ++x)
                    reached[number_of({x, y, z}, brick_count())] = 1;
    }
    std::vector<size_t> found;
    for (size_t n = 0; n < reached.size(); ++n)
        if (reached[n])
            found.push_back(n);
    return found;
}

// All layers from the sides. They may have changed in the candidates alone (ascending). Samples
// that come into a layer have no distance until they are solved.
void LevelSetBand::find_layers(const std::vector<size_t>& candidates) {
    std::vector<Bits> before(candidates.size());
    for_bricks(candidates, [&](size_t n, size_t i) {
        BandBrick& brick = bricks_[n];
        if (brick.within)
            before[i] = brick.within->back();
        else
            brick.within = std::make_unique<std::array<Bits, kLayers>>();
        Bits& active = brick.within->front();
        for_active_rows(n, [&](uint32_t row, const std::array<uint32_t, 6>& beyond) {
            active[row] = any_of(beyond);
        });
    });
    for (size_t k = 1; k < kLayers; ++k)
        for_bricks(candidates, [&](size_t n, size_t) {
            const BitTile nearer = tile(n, [k](const BandBrick& b, uint32_t row) {
                return b.within ? (*b.within)[k - 1][row] : 0u;
            });
            Bits& bits = (*bricks_[n].within)[k];
            for (uint32_t z = 0; z < kBrickSide; ++z)
                for (uint32_t y = 0; y < kBrickSide; ++y) {
                    const uint32_t row = y + kBrickSide * z;
                    bits[row] =
                        nearer.row(y, z) | (any_of(nearer.beside(y, z)) & ~bricks_[n].walls[row]);
                }
        });
    for_bricks(candidates, [&](size_t n, size_t i) {
        const glm::uvec3 position = position_of(n);
        std::unique_ptr<std::array<Bits, kLayers>>& within = bricks_[n].within;
        if (!any(within->back())) {
            within.reset();
            phi_.clear(position);
            change_.clear(position);
            return;
        }
        float* phi = phi_.write(position);
        change_.write(position);
        Bits& gone = before[i];
        for (uint32_t row = 0; row < kBrickRows; ++row)
            gone[row] &= ~within->back()[row];
        for_each_bit(gone,
                     [&](uint32_t row, int x) { phi[row * kBrickSide + uint32_t(x)] = kNone; });
    });
    std::vector<size_t> both;
    std::ranges::set_union(near_, candidates, std::back_inserter(both));
    std::erase_if(both, [&](size_t n) { return !bricks_[n].within; });
    near_ = std::move(both);
}

// The same with an active layer that has not moved.
void LevelSetBand::complete() {
    for_bricks(near_, [&](size_t n, size_t) {
        float* change = change_.find(position_of(n));
        std::fill_n(change, kBrickSamples, kNone);
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
        if (distance) {
            for_each_bit(brick.within->back(), [&](uint32_t row, int x) {
                const glm::uvec3 local(uint32_t(x), row % kBrickSide, row / kBrickSide);
                phi[row * kBrickSide + uint32_t(x)] = distance(position * kBrickSide + local);
            });
            return;
        }
        for_active_rows(n, [&](uint32_t row, const std::array<uint32_t, 6>& beyond) {
            for (uint32_t left = active(n)[row]; left != 0; left &= left - 1) {
                const int x = std::countr_zero(left);
                const auto is_beyond = [&](size_t i) { return (beyond[i] >> x & 1u) != 0; };
                std::array<SimplexDistance::Neighbour, 3> axes;
                for (size_t i = 0; i < 3; ++i)
                    axes[i] = {0.0f, is_beyond(2 * i + 1) ? 1 : is_beyond(2 * i) ? -1 : 0};
                // The surface is midway.
                const float sign = (brick.inside[row] >> x & 1u) != 0 ? -0.5f : 0.5f;
                phi[row * kBrickSide + uint32_t(x)] = sign * metric_.solve(axes).u;
            }
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

double LevelSetBand::move(const std::vector<std::vector<float>>& rates, double step) {
    std::vector<uint8_t> crossed(bricks_.size());
    for_bricks(near_, [&](size_t n, size_t i) {
        float* phi = phi_.find(position_of(n));
        float* changed = change_.find(position_of(n));
        std::fill_n(changed, kBrickSamples, kNone);
        const float* rate = rates[i].data();
        for_each_bit(active(n), [&](uint32_t row, int x) {
            const size_t at = row * kBrickSide + size_t(x);
            const uint32_t bit = 1u << x;
            uint32_t& inside = bricks_[n].inside[row];
            changed[at] = float(step) * *rate++;
            phi[at] += changed[at];
            if ((phi[at] < 0.0f) != ((inside & bit) != 0)) {
                inside ^= bit;
                crossed[n] = 1;
            }
        });
    });
    // Only samples that are beside the surface still are summed.
    std::vector<double> squares(near_.size());
    const glm::vec3 h(spacing_mm(grid_));
    for_bricks(near_, [&](size_t n, size_t i) {
        if (!any(active(n)))
            return;
        float* phi = phi_.find(position_of(n));
        float* changed = change_.find(position_of(n));
        for_active_rows(n, [&](uint32_t row, const std::array<uint32_t, 6>& beyond) {
            for (uint32_t left = active(n)[row]; left != 0; left &= left - 1) {
                const int x = std::countr_zero(left);
                const size_t at = row * kBrickSide + size_t(x);
                float farthest = std::numeric_limits<float>::infinity();
                for (size_t k = 0; k < 6; ++k)
                    if ((beyond[k] >> x & 1u) != 0)
                        farthest = std::min(farthest, h[int(k / 2)]);
                const float now = std::clamp(phi[at], -farthest, farthest);
                changed[at] += now - phi[at];
                phi[at] = now;
                squares[i] += double(changed[at]) * double(changed[at]);
            }
        });
    });
    solve_layers();
    find_layers(around(crossed));
    double sum = 0.0;
    for (const double one : squares)
        sum += one;
    return sum;
}

float LevelSetBand::distance(size_t n, uint32_t offset) const {
    const BandBrick& brick = bricks_[n];
    const uint32_t row = offset / kBrickSide, bit = 1u << offset % kBrickSide;
    if (brick.within && (brick.within->back()[row] & bit) != 0)
        return std::clamp(phi_.find(position_of(n))[offset], -limit_mm_, limit_mm_);
    return (brick.inside[row] & bit) != 0 ? -limit_mm_ : limit_mm_;
}

} // namespace palpate
