#include "engine/segment/multigrid.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/base/clones.h"

namespace palpate {

namespace {

constexpr int kSide = int(kBrickSide), kWide = kSide + 2; // a brick, and with a sample on each side

using Eight = float __attribute__((vector_size(32)));
using EightBits = int32_t __attribute__((vector_size(32)));

// Samples first .. first + size - 1, rows of `row` and planes of `plane` elements apart; beyond the
// array its outermost samples go on.
void read(const BrickArray<float>& array, glm::ivec3 first, glm::ivec3 size, size_t row,
          size_t plane, float* out) {
    const glm::ivec3 last = glm::ivec3(array.size()) - 1;
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y) {
            const glm::uvec3 at(0, std::clamp(first.y + y, 0, last.y),
                                std::clamp(first.z + z, 0, last.z));
            float* to = out + row * size_t(y) + plane * size_t(z);
            for (int x = 0; x < size.x;) {
                const int from = std::clamp(first.x + x, 0, last.x);
                const float* brick =
                    array.find({uint32_t(from) / kBrickSide, at.y / kBrickSide, at.z / kBrickSide});
                const float* samples =
                    brick + offset_in_brick({0, at.y % kBrickSide, at.z % kBrickSide});
                const int local = from % kSide;
                int run = 1; // one at a time beyond the array
                if (first.x + x == from)
                    run = std::min({size.x - x, kSide - local, last.x + 1 - from});
                std::memcpy(to + x, samples + local, sizeof(float) * size_t(run));
                x += run;
            }
        }
}

// A brick's samples and those that share a face with one, which is what a stencil reads.
void read_wide(const BrickArray<float>& array, glm::uvec3 brick, glm::uvec3 valid, float* out) {
    constexpr size_t kPlane = size_t{kWide} * kWide;
    const glm::ivec3 first = glm::ivec3(brick) * kSide, n(valid);
    const auto part = [&](glm::ivec3 low, glm::ivec3 size) {
        read(array, first + low, size, kWide, kPlane,
             out + (low.x + 1) + kWide * (low.y + 1) + int(kPlane) * (low.z + 1));
    };
    part({-1, 0, 0}, {n.x + 2, n.y, n.z});
    for (const int side : {-1, n.y})
        part({0, side, 0}, {n.x, 1, n.z});
    for (const int side : {-1, n.z})
        part({0, 0, side}, {n.x, n.y, 1});
}

struct Stencil {
    const float* u; // wide
    float* to;
    const float *weight, *right; // bricks
    glm::uvec3 valid;
    std::array<float, 3> k;
    int colour;
};

// The sum over the axes of k (before + after), and of 2 k.
[[gnu::always_inline]] inline Eight around(const Stencil& s, const float* u) {
    const auto at = [&](std::ptrdiff_t offset) {
        Eight v;
        std::memcpy(&v, u + offset, sizeof v);
        return v;
    };
    return s.k[0] * (at(-1) + at(1)) + s.k[1] * (at(-kWide) + at(kWide)) +
           s.k[2] * (at(-kWide * kWide) + at(kWide * kWide));
}

// Calls f(offset of eight samples in a brick, pointer to them in the wide box, z + y).
#define PALPATE_EACH_EIGHT(s, i, u, parity)                                              \
    for (uint32_t z = 0; z < (s).valid.z; ++z)                                           \
        for (uint32_t y = 0; y < (s).valid.y; ++y)                                       \
            for (uint32_t x = 0; x < kBrickSide; x += 8)                                 \
                if (const uint32_t i = offset_in_brick({x, y, z}), parity = (z + y) & 1; \
                    const float* u = (s).u + 1 + x + kWide * (y + 1) + kWide * kWide * (z + 1))

// The samples whose x + y + z is even (colour 0) or odd become the solution for their neighbours;
// the others are written as they are.
PALPATE_CLONES void relax_brick(const Stencil& s) {
    const float both = 2.0f * (s.k[0] + s.k[1] + s.k[2]);
    const EightBits even{-1, 0, -1, 0, -1, 0, -1, 0}, odd{0, -1, 0, -1, 0, -1, 0, -1};
    PALPATE_EACH_EIGHT(s, i, u, parity) {
        Eight weight, right, old;
        std::memcpy(&weight, s.weight + i, sizeof weight);
        std::memcpy(&right, s.right + i, sizeof right);
        std::memcpy(&old, u, sizeof old);
        const Eight made = (right + around(s, u)) / (weight + both);
        const EightBits mine = int(parity) == s.colour ? even : odd;
        const Eight result = mine ? made : old;
        std::memcpy(s.to + i, &result, sizeof result);
    }
}

// right - weight u + mu laplace(u).
PALPATE_CLONES void residual_brick(const Stencil& s) {
    const float both = 2.0f * (s.k[0] + s.k[1] + s.k[2]);
    PALPATE_EACH_EIGHT(s, i, u, parity) {
        Eight weight, right, centre;
        std::memcpy(&weight, s.weight + i, sizeof weight);
        std::memcpy(&right, s.right + i, sizeof right);
        std::memcpy(&centre, u, sizeof centre);
        const Eight made = right - weight * centre + (around(s, u) - both * centre);
        std::memcpy(s.to + i, &made, sizeof made);
        (void)parity;
    }
}
#undef PALPATE_EACH_EIGHT

struct Scratch {
    // The last rows of eight read beyond the box; their results are not used.
    std::vector<float> wide = std::vector<float>(size_t{kWide} * kWide * kWide + 8);
    std::vector<float> made = std::vector<float>(kBrickSamples);
    std::vector<float> weights = std::vector<float>(kBrickSamples);
    std::vector<float> coarse, z_done, y_done;
};
Scratch& scratch() {
    thread_local Scratch own;
    return own;
}

template <class Work>
void for_bricks(glm::uvec3 size, const Work& work) {
    const glm::uvec3 count = (size + (kBrickSide - 1)) / kBrickSide;
    run_all(size_t{count.x} * count.y * count.z, {}, [&](size_t i) {
        work(glm::uvec3(i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y)), i);
    });
}

glm::uvec3 valid_of(glm::uvec3 size, glm::uvec3 brick) {
    return glm::min(glm::uvec3(kBrickSide), size - brick * kBrickSide);
}

BrickArray<float> whole(glm::uvec3 size) {
    BrickArray<float> array(size, 0.0f);
    for_bricks(size, [&](glm::uvec3 at, size_t) { array.write(at); });
    return array;
}

// Means of the samples that a sample of `coarse` stands for, of a brick's `values`. Where a size is
// odd, the last sample has fewer: the missing ones count as 0, which keeps sums as they are.
void add_means(const float* values, glm::uvec3 brick, glm::uvec3 valid, glm::uvec3 by,
               BrickArray<float>& coarse) {
    const glm::uvec3 origin = brick * kBrickSide;
    const float share = 1.0f / float(by.x * by.y * by.z);
    const glm::uvec3 end = (origin + valid + (by - 1u)) / by;
    for (glm::uvec3 c = origin / by; c.z < end.z; ++c.z)
        for (c.y = origin.y / by.y; c.y < end.y; ++c.y)
            for (c.x = origin.x / by.x; c.x < end.x; ++c.x) {
                const glm::uvec3 low = c * by - origin;
                const glm::uvec3 high = glm::min(low + by, valid);
                float sum = 0.0f;
                for (uint32_t z = low.z; z < high.z; ++z)
                    for (uint32_t y = low.y; y < high.y; ++y)
                        for (uint32_t x = low.x; x < high.x; ++x)
                            sum += values[offset_in_brick({x, y, z})];
                coarse.find(c / kBrickSide)[offset_in_brick(c % kBrickSide)] = sum * share;
            }
}

} // namespace

Multigrid::Multigrid(glm::dvec3 spacing_mm, double mu, BrickArray<float> weight,
                     std::optional<PackedWeights> packed)
    : mu_(mu), packed_(packed) {
    const glm::uvec3 whole_size = weight.size();
    levels_.push_back({whole_size, spacing_mm, glm::uvec3(1), BrickArray<float>(whole_size),
                       std::move(weight), BrickArray<float>(whole_size),
                       BrickArray<uint16_t>(whole_size)});
    set_factors(levels_.back());
    if (packed_) {
        pack_weights(levels_.back());
        coarsen(); // now, as floats of a level are held before they are packed
    }
}

void Multigrid::coarsen() {
    while (glm::any(glm::greaterThan(levels_.back().size, glm::uvec3(3)))) {
        const Level& fine = levels_.back();
        double least = 1e300;
        for (int a = 0; a < 3; ++a)
            if (fine.size[a] > 1)
                least = std::min(least, fine.spacing_mm[a]);
        glm::uvec3 by(1);
        for (int a = 0; a < 3; ++a)
            if (fine.size[a] > 1 && fine.spacing_mm[a] < 1.5 * least)
                by[a] = 2;
        const glm::uvec3 size = (fine.size + (by - 1u)) / by;
        Level coarse{size,        fine.spacing_mm * glm::dvec3(by), by, whole(size), whole(size),
                     whole(size), BrickArray<uint16_t>(size)};
        for_bricks(fine.size, [&](glm::uvec3 at, size_t) {
            add_means(weights(fine, at), at, valid_of(fine.size, at), by, coarse.weight);
        });
        set_factors(coarse);
        if (packed_)
            pack_weights(coarse);
        levels_.push_back(std::move(coarse));
    }
}

void Multigrid::set_factors(Level& level) const {
    for (int a = 0; a < 3; ++a)
        level.over_square[size_t(a)] =
            level.size[a] > 1 ? float(mu_ / (level.spacing_mm[a] * level.spacing_mm[a])) : 0.0f;
}

void Multigrid::pack_weights(Level& level) const {
    for_bricks(level.size, [&](glm::uvec3 at, size_t) {
        std::transform(level.weight.find(at), level.weight.find(at) + kBrickSamples,
                       level.packed_weight.write(at), [&](float v) { return packed_->pack(v); });
        level.weight.clear(at);
    });
}

const float* Multigrid::weights(const Level& level, glm::uvec3 brick) const {
    const uint16_t* packed = level.packed_weight.find(brick);
    if (!packed)
        return level.weight.find(brick);
    std::vector<float>& own = scratch().weights;
    std::transform(packed, packed + kBrickSamples, own.begin(),
                   [&](uint16_t code) { return packed_->unpack(code); });
    return own.data();
}

void Multigrid::relax(Level& level, int sweeps) {
    // Bricks that share a face take turns: what one writes no other reads meanwhile.
    for (int step = 0; step < 4 * sweeps; ++step)
        for_bricks(level.size, [&](glm::uvec3 at, size_t) {
            const int colour = step / 2 & 1;
            if (((at.x + at.y + at.z) & 1) != uint32_t(step & 1))
                return;
            Scratch& own = scratch();
            const glm::uvec3 valid = valid_of(level.size, at);
            read_wide(level.u, at, valid, own.wide.data());
            relax_brick({own.wide.data(), level.u.find(at), weights(level, at),
                         level.right.find(at), valid, level.over_square, colour});
        });
}

void Multigrid::restrict_to(const Level& fine, Level& coarse) const {
    for_bricks(fine.size, [&](glm::uvec3 at, size_t) {
        Scratch& own = scratch();
        const glm::uvec3 valid = valid_of(fine.size, at);
        read_wide(fine.u, at, valid, own.wide.data());
        residual_brick({own.wide.data(), own.made.data(), weights(fine, at), fine.right.find(at),
                        valid, fine.over_square, 0});
        add_means(own.made.data(), at, valid, coarse.coarsened, coarse.right);
    });
}

// Adds the coarse solution, interpolated linearly between the centres of its samples.
void Multigrid::correct(Level& fine, const Level& coarse) const {
    const glm::ivec3 by(coarse.coarsened);
    for_bricks(fine.size, [&](glm::uvec3 at, size_t) {
        Scratch& own = scratch();
        const glm::ivec3 valid(valid_of(fine.size, at));
        const glm::ivec3 first = glm::ivec3(at) * kSide / by - 1;
        const glm::ivec3 n = (valid + by - 1) / by + 2;
        const auto row = size_t(n.x), plane = size_t(n.x) * size_t(n.y);
        own.coarse.resize(plane * size_t(n.z));
        read(coarse.u, first, n, row, plane, own.coarse.data());
        // Place of fine sample i: beside coarse sample i / by (+ 1 in the box), and the other one.
        const auto near = [](int i, int b) { return i / b + 1; };
        const auto far = [](int i, int b) { return b == 1 ? i + 1 : i / 2 + 1 + (i % 2 ? 1 : -1); };
        own.z_done.resize(plane * size_t(valid.z));
        for (int z = 0; z < valid.z; ++z) {
            const float* p = own.coarse.data() + plane * size_t(near(z, by.z));
            const float* q = own.coarse.data() + plane * size_t(far(z, by.z));
            float* to = own.z_done.data() + plane * size_t(z);
            for (size_t i = 0; i < plane; ++i)
                to[i] = 0.75f * p[i] + 0.25f * q[i];
        }
        own.y_done.resize(row);
        float* u = fine.u.find(at);
        for (int z = 0; z < valid.z; ++z)
            for (int y = 0; y < valid.y; ++y) {
                const float* from = own.z_done.data() + plane * size_t(z);
                const float* p = from + row * size_t(near(y, by.y));
                const float* q = from + row * size_t(far(y, by.y));
                float* mid = own.y_done.data();
                for (size_t i = 0; i < row; ++i)
                    mid[i] = 0.75f * p[i] + 0.25f * q[i];
                float* to = u + offset_in_brick(glm::uvec3(0, y, z));
                for (int x = 0; x < valid.x; ++x)
                    to[x] += 0.75f * mid[near(x, by.x)] + 0.25f * mid[far(x, by.x)];
            }
    });
}

void Multigrid::solve(size_t level) {
    Level& fine = levels_[level];
    if (level + 1 == levels_.size()) {
        relax(fine, 30);
        return;
    }
    relax(fine, 1);
    Level& coarse = levels_[level + 1];
    restrict_to(fine, coarse);
    for_bricks(coarse.size,
               [&](glm::uvec3 at, size_t) { std::fill_n(coarse.u.find(at), kBrickSamples, 0.0f); });
    solve(level + 1);
    correct(fine, coarse);
    relax(fine, 1);
}

BrickArray<float> Multigrid::weighted(const BrickArray<float>& values) const {
    BrickArray<float> out = whole(values.size());
    for_bricks(values.size(), [&](glm::uvec3 at, size_t) {
        const float *of = values.find(at), *by = weights(levels_[0], at);
        float* to = out.find(at);
        for (size_t k = 0; k < kBrickSamples; ++k)
            to[k] = of[k] * by[k];
    });
    return out;
}

void Multigrid::start(BrickArray<float> u, BrickArray<float> right) {
    levels_[0].u = std::move(u);
    levels_[0].right = std::move(right);
}

void Multigrid::smooth() {
    relax(levels_[0], 1);
}

void Multigrid::cycle() {
    if (levels_.size() == 1)
        coarsen();
    solve(0);
}

double Multigrid::residual() const {
    const Level& fine = levels_[0];
    const glm::uvec3 count = (fine.size + (kBrickSide - 1)) / kBrickSide;
    std::vector<double> squares(size_t{count.x} * count.y * count.z, 0.0);
    for_bricks(fine.size, [&](glm::uvec3 at, size_t n) {
        Scratch& own = scratch();
        const glm::uvec3 valid = valid_of(fine.size, at);
        read_wide(fine.u, at, valid, own.wide.data());
        residual_brick({own.wide.data(), own.made.data(), weights(fine, at), fine.right.find(at),
                        valid, fine.over_square, 0});
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const double r = own.made[offset_in_brick({x, y, z})];
                    squares[n] += r * r;
                }
    });
    double sum = 0;
    for (const double one : squares)
        sum += one;
    return std::sqrt(sum);
}

} // namespace palpate
