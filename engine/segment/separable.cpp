#include "engine/segment/separable.h"

#include <cstring>

#include "engine/base/assert.h"
#include "engine/base/clones.h"

namespace palpate {

namespace {

// Eight floats at once: two registers, or one with AVX2 (clones.h).
using Eight = float __attribute__((vector_size(32)));

struct Pass {
    const float* in;
    float* out;
    size_t rows;   // of `width` outputs each
    size_t in_row; // from row to row, in elements
    size_t width;
    size_t step; // from sample to sample along the axis
    const float* weights;
    int radius;
};

// kRun * 8 outputs from `in`, whose first neighbour is `radius` steps before.
template <int kOrder, int kRun>
[[gnu::always_inline]] inline void run_of(const float* in, float* out, const Pass& pass) {
    Eight total[kRun], centre[kRun];
    for (int i = 0; i < kRun; ++i) {
        std::memcpy(&centre[i], in + 8 * i, sizeof(Eight));
        total[i] = kOrder == 0 ? centre[i] : Eight{};
    }
    for (int k = 1; k <= pass.radius; ++k) {
        const float* after = in + size_t(k) * pass.step;
        const float* before = in - size_t(k) * pass.step;
        const float w = pass.weights[k];
        for (int i = 0; i < kRun; ++i) {
            Eight a, b;
            std::memcpy(&a, after + 8 * i, sizeof a);
            std::memcpy(&b, before + 8 * i, sizeof b);
            if (kOrder == 1)
                total[i] += w * (a - b);
            else // differences first: they are exact where values are large and alike
                total[i] += w * ((a - centre[i]) + (b - centre[i]));
        }
    }
    for (int i = 0; i < kRun; ++i)
        std::memcpy(out + 8 * i, &total[i], sizeof(Eight));
}

// The same for one output.
template <int kOrder>
[[gnu::always_inline]] inline float one_of(const float* in, const Pass& pass) {
    const float centre = *in;
    float total = kOrder == 0 ? centre : 0.0f;
    for (int k = 1; k <= pass.radius; ++k) {
        const float a = in[size_t(k) * pass.step];
        const float b = *(in - size_t(k) * pass.step);
        total += pass.weights[k] * (kOrder == 1 ? a - b : (a - centre) + (b - centre));
    }
    return total;
}

template <int kOrder>
[[gnu::always_inline]] inline void run_all_rows(const Pass& pass) {
    for (size_t row = 0; row < pass.rows; ++row) {
        const float* in = pass.in + row * pass.in_row;
        float* out = pass.out + row * pass.width;
        size_t x = 0;
        for (; x + 32 <= pass.width; x += 32)
            run_of<kOrder, 4>(in + x, out + x, pass);
        for (; x + 8 <= pass.width; x += 8)
            run_of<kOrder, 1>(in + x, out + x, pass);
        for (; x < pass.width; ++x)
            out[x] = one_of<kOrder>(in + x, pass);
    }
}

PALPATE_CLONES void smooth(const Pass& pass) {
    run_all_rows<0>(pass);
}
PALPATE_CLONES void first_derivative(const Pass& pass) {
    run_all_rows<1>(pass);
}
PALPATE_CLONES void second_derivative(const Pass& pass) {
    run_all_rows<2>(pass);
}

} // namespace

void convolve(const glm::ivec3& size, const float* in, int axis, const Kernel& kernel, Box& out) {
    out.size = size;
    out.size[axis] -= 2 * kernel.radius();
    PALPATE_ASSERT(out.size[axis] > 0);
    const glm::uvec3 n(out.size);
    out.samples.resize(size_t{n.x} * n.y * n.z);
    const auto radius = size_t(kernel.radius());
    Pass pass{in, out.samples.data(), 0, 0, 0, 0, kernel.weights.data(), kernel.radius()};
    if (axis == 0) {
        pass.rows = size_t{n.y} * n.z;
        pass.in_row = size_t(size.x);
        pass.width = n.x;
        pass.step = 1;
    } else if (axis == 1) { // planes as rows
        pass.rows = n.z;
        pass.width = size_t{n.x} * n.y;
        pass.in_row = size_t{n.x} * size_t(size.y);
        pass.step = n.x;
    } else {
        pass.rows = 1;
        pass.width = size_t{n.x} * n.y * n.z;
        pass.in_row = 0;
        pass.step = size_t{n.x} * n.y;
    }
    pass.in += radius * pass.step;
    (kernel.order == 0 ? smooth : kernel.order == 1 ? first_derivative : second_derivative)(pass);
}

} // namespace palpate
