#include "engine/edit/sample_mask.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace palpate {

namespace {

constexpr double kRounding_mm = 1e-6;

uint32_t bits(int first, int last) { // 0 <= first <= last < 32
    return (~uint32_t{0} >> (31 - last)) & (~uint32_t{0} << first);
}

} // namespace

bool SampleMask::empty() const {
    return std::all_of(rows.begin(), rows.end(), [](uint32_t row) { return row == 0; });
}

uint32_t SampleMask::count() const {
    uint32_t sum = 0;
    for (const uint32_t row : rows)
        sum += static_cast<uint32_t>(std::popcount(row));
    return sum;
}

void SampleMask::keep_new(SampleMask& seen) {
    for (size_t i = 0; i < rows.size(); ++i) {
        rows[i] &= ~seen.rows[i];
        seen.rows[i] |= rows[i];
    }
}

BrickRange bricks_of(const Sweep& sweep, const Grid& grid) {
    const glm::dvec3 low = glm::max(glm::ceil(sweep.low_index()), glm::dvec3(0.0));
    const glm::dvec3 high = glm::min(glm::floor(sweep.high_index()), glm::dvec3(grid.size) - 1.0);
    if (!glm::all(glm::lessThanEqual(low, high)))
        return {};
    const int side = kBrickSide;
    return {glm::ivec3(low) / side, glm::ivec3(high) / side};
}

SampleBox samples_of(const Sweep& sweep, glm::uvec3 brick, glm::uvec3 valid) {
    const glm::dvec3 first = glm::dvec3(brick * kBrickSide);
    const glm::dvec3 low = glm::max(glm::ceil(sweep.low_index() - first), glm::dvec3(0.0));
    const glm::dvec3 high =
        glm::min(glm::floor(sweep.high_index() - first), glm::dvec3(valid) - 1.0);
    if (!glm::all(glm::lessThanEqual(low, high)))
        return {};
    return {glm::ivec3(low), glm::ivec3(high)};
}

void add_samples(SampleMask& mask, const Sweep& sweep, const Grid& grid, glm::uvec3 brick,
                 glm::uvec3 valid, const std::stop_token& stop) {
    const glm::dvec3 first = glm::dvec3(brick * kBrickSide);
    const auto [from, to] = samples_of(sweep, brick, valid);
    const glm::dmat3 mm_from_index(grid.world_from_index);
    const double dx = glm::length(mm_from_index[0]);
    for (int z = from.z; z <= to.z; ++z)
        for (int y = from.y; y <= to.y && !stop.stop_requested(); ++y) {
            uint32_t& row = mask.row(static_cast<uint32_t>(y), static_cast<uint32_t>(z));
            for (int x = from.x; x <= to.x;) {
                const Sweep::Verdict verdict =
                    sweep.at(mm_from_index * (first + glm::dvec3(x, y, z)));
                const double leap = std::floor((verdict.same_within_mm - kRounding_mm) / dx);
                const int last = leap >= to.x - x ? to.x : x + std::max(0, static_cast<int>(leap));
                if (verdict.inside)
                    row |= bits(x, last);
                x = last + 1;
            }
            const auto [a, b] = sweep.marked_in_row(first.y + y, first.z + z);
            const double x0 = std::max(a - first.x, 0.0);
            const double x1 = std::min(b - first.x, static_cast<double>(valid.x) - 1.0);
            if (x0 <= x1)
                row |= bits(static_cast<int>(x0), static_cast<int>(x1));
        }
}

} // namespace palpate
