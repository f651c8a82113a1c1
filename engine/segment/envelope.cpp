#include "engine/segment/envelope.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/clones.h"

namespace palpate {

namespace {

constexpr size_t kLanes = EnvelopeTile::kLanes;
constexpr size_t kBlock = 16; // rows
constexpr float kNone = std::numeric_limits<float>::infinity();
// Bounds of squared distances are raised by more than the roundings of three operations.
constexpr float kRoundedUp = 1.0f + 0x1p-20f;

// Comparisons written so that compilers take them for the minimum instruction.
float smaller(float a, float b) {
    return a < b ? a : b;
}

struct Tile : EnvelopeTile::Lines {
    float *result, *least; // least: of blocks; then of lines
    float weight, limit;

    const float* squared_row(size_t i) const { return squared + i * squared_stride; }
    const int32_t* labels_row(size_t i) const { return labels + i * labels_stride; }
};

// The ends of runs, seen from both sides.
PALPATE_CLONES void scan_runs(const Tile& in) {
    float steps[kLanes];
    std::fill(steps, steps + kLanes, kNone);
    for (size_t i = 0; i < in.n; ++i) {
        const int32_t* own = in.labels_row(i);
        const int32_t* before = in.labels_row(i > 0 ? i - 1 : i);
        const float* squared = in.squared_row(i);
        float* result = in.result + i * kLanes;
        for (size_t l = 0; l < kLanes; ++l) {
            steps[l] = own[l] == before[l] ? steps[l] + 1.0f : 1.0f;
            result[l] = smaller(smaller(squared[l], in.weight * (steps[l] * steps[l])), in.limit);
        }
    }
    std::fill(steps, steps + kLanes, kNone);
    for (size_t i = in.n; i-- > 0;) {
        const int32_t* own = in.labels_row(i);
        const int32_t* after = in.labels_row(i + 1 < in.n ? i + 1 : i);
        float* result = in.result + i * kLanes;
        for (size_t l = 0; l < kLanes; ++l) {
            steps[l] = own[l] == after[l] ? steps[l] + 1.0f : 1.0f;
            result[l] = smaller(in.weight * (steps[l] * steps[l]), result[l]);
        }
    }
}

PALPATE_CLONES void least_of_blocks(const Tile& in) {
    const size_t blocks = (in.n + kBlock - 1) / kBlock;
    std::fill(in.least, in.least + (blocks + 1) * kLanes, kNone);
    float* whole = in.least + blocks * kLanes;
    for (size_t i = 0; i < in.n; ++i) {
        float* block = in.least + i / kBlock * kLanes;
        const float* squared = in.squared_row(i);
        for (size_t l = 0; l < kLanes; ++l) {
            block[l] = smaller(squared[l], block[l]);
            whole[l] = smaller(squared[l], whole[l]);
        }
    }
}

// A parabola from another run never lowers a sample: it rises to the sample's squared distance to
// the end of its own run, or beyond. So runs need not be told apart here.
PALPATE_CLONES void search(const Tile& in) {
    const size_t blocks = (in.n + kBlock - 1) / kBlock;
    const float* least_of_lines = in.least + blocks * kLanes;
    const float step = std::sqrt(in.weight);
    float lowest[kLanes], bound[kLanes];
    for (size_t i = 0; i < in.n; ++i) {
        float* result = in.result + i * kLanes;
        const float* before = i > 0 ? result - kLanes : result;
        const int32_t* own = in.labels_row(i);
        const int32_t* last = in.labels_row(i > 0 ? i - 1 : i);
        for (size_t l = 0; l < kLanes; ++l) {
            lowest[l] = result[l];
            const float root = std::sqrt(before[l]) + step;
            const float allowed = own[l] == last[l] ? root * root * kRoundedUp : kNone;
            bound[l] = smaller(allowed, lowest[l]);
        }
        const auto may_lower = [&](const float* least, float rise) {
            int any = 0;
            for (size_t l = 0; l < kLanes; ++l)
                any |= least[l] + rise < bound[l];
            return any != 0;
        };
        const auto take = [&](size_t block) {
            const size_t end = std::min((block + 1) * kBlock, in.n);
            for (size_t j = block * kBlock; j < end; ++j) {
                const float apart = i > j ? float(i - j) : float(j - i);
                const float rise = in.weight * (apart * apart);
                const float* squared = in.squared_row(j);
                for (size_t l = 0; l < kLanes; ++l)
                    lowest[l] = smaller(squared[l] + rise, lowest[l]);
            }
            for (size_t l = 0; l < kLanes; ++l)
                bound[l] = smaller(lowest[l], bound[l]);
        };
        const size_t home = i / kBlock;
        if (may_lower(in.least + home * kLanes, 0.0f))
            take(home);
        for (size_t away = 1; away < blocks; ++away) {
            // Rows to the nearer of both blocks, then to each.
            const size_t down = i - home * kBlock + (away - 1) * kBlock + 1;
            const size_t up = (home + away) * kBlock - i;
            const float nearer = float(std::min(down, up));
            if (!may_lower(least_of_lines, in.weight * (nearer * nearer)))
                break;
            if (away <= home) {
                const float* least = in.least + (home - away) * kLanes;
                if (may_lower(least, in.weight * (float(down) * float(down))))
                    take(home - away);
            }
            if (home + away < blocks) {
                const float* least = in.least + (home + away) * kLanes;
                if (may_lower(least, in.weight * (float(up) * float(up))))
                    take(home + away);
            }
        }
        std::copy(lowest, lowest + kLanes, result);
    }
}

} // namespace

void EnvelopeTile::lower(const Lines& lines, float weight, float limit) {
    result_.resize(lines.n * kLanes);
    least_.resize(((lines.n + kBlock - 1) / kBlock + 1) * kLanes);
    const Tile tile{{lines}, result_.data(), least_.data(), weight, limit};
    scan_runs(tile);
    least_of_blocks(tile);
    search(tile);
}

} // namespace palpate
