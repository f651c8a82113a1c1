#include "engine/segment/smooth_labels.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/segment/label_samples.h"

namespace palpate {

namespace {

constexpr double kMostSamples = 8.0; // sigma
constexpr double kCut = 3.0;         // sigmas

using Kernel = std::vector<float>; // weights of offsets 0, 1, ..

Kernel kernel_of(double sigma) {
    Kernel weights;
    double sum = 0.0;
    for (int i = 0; i <= int(std::ceil(kCut * sigma)); ++i) {
        const double w = std::exp(-0.5 * (i / sigma) * (i / sigma));
        weights.push_back(float(w));
        sum += i == 0 ? w : 2.0 * w;
    }
    for (float& w : weights)
        w = float(double{w} / sum);
    return weights;
}

// One axis of a box: out has `count` places along it, each from 2 radius + 1 of `in`.
// before, after: places on the axes that vary faster and slower.
void convolve(const std::vector<float>& in, std::vector<float>& out, size_t before, size_t count,
              size_t after, const Kernel& kernel) {
    const size_t radius = kernel.size() - 1;
    out.assign(before * count * after, 0.0f);
    for (size_t a = 0; a < after; ++a)
        for (size_t i = 0; i < count; ++i) {
            float* to = out.data() + (a * count + i) * before;
            const float* from = in.data() + (a * (count + 2 * radius) + i + radius) * before;
            for (size_t b = 0; b < before; ++b)
                to[b] = kernel[0] * from[b];
            for (size_t k = 1; k <= radius; ++k)
                for (size_t b = 0; b < before; ++b)
                    to[b] += kernel[k] *
                             (from[ptrdiff_t(b) - ptrdiff_t(k * before)] + from[b + k * before]);
        }
}

struct Smoother {
    Volume labels;
    std::array<Kernel, 3> kernel;

    BrickPtr brick(glm::uvec3 position) const {
        const glm::ivec3 radius(kernel[0].size() - 1, kernel[1].size() - 1, kernel[2].size() - 1);
        const glm::uvec3 valid = labels.valid_in_brick(position);
        const glm::ivec3 first = glm::ivec3(position * kBrickSide) - radius;
        const glm::ivec3 size = glm::ivec3(valid) + 2 * radius;
        std::vector<uint16_t> box(size_t(size.x) * size_t(size.y) * size_t(size.z));
        read_labels(labels, first, size, box.data());
        std::vector<uint16_t> present = box;
        std::sort(present.begin(), present.end());
        present.erase(std::unique(present.begin(), present.end()), present.end());
        if (present.size() == 1)
            return make(std::vector<uint16_t>(kBrickSamples, present[0]), valid);
        const size_t inside = size_t{valid.x} * valid.y * valid.z;
        std::vector<float> most(inside, 0.0f), indicator(box.size()), a, b;
        std::vector<uint16_t> best(inside, 0);
        const auto own = [&](size_t i) {
            const glm::ivec3 at(int(i % valid.x), int(i / valid.x % valid.y),
                                int(i / (size_t{valid.x} * valid.y)));
            const glm::ivec3 p = at + radius;
            return box[size_t(p.x) + size_t(size.x) * (size_t(p.y) + size_t(size.y) * size_t(p.z))];
        };
        for (const uint16_t label : present) {
            std::transform(box.begin(), box.end(), indicator.begin(),
                           [&](uint16_t one) { return one == label ? 1.0f : 0.0f; });
            convolve(indicator, a, size_t(size.x) * size_t(size.y), valid.z, 1, kernel[2]);
            convolve(a, b, size_t(size.x), valid.y, valid.z, kernel[1]);
            convolve(b, a, 1, valid.x, size_t{valid.y} * valid.z, kernel[0]);
            for (size_t i = 0; i < inside; ++i)
                if (a[i] > most[i] || (a[i] == most[i] && own(i) == label)) {
                    most[i] = a[i];
                    best[i] = label;
                }
        }
        std::vector<uint16_t> out(kBrickSamples, 0);
        for (uint32_t z = 0, i = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x, ++i)
                    out[offset_in_brick({x, y, z})] = best[i];
        return make(out, valid);
    }

    BrickPtr make(const std::vector<uint16_t>& samples, glm::uvec3 valid) const {
        return visit_scalar(labels.type(), [&]<class T>(T) -> BrickPtr {
            const std::vector<T> typed(samples.begin(), samples.end());
            return Brick::make(std::span<const T>(typed), valid);
        });
    }
};

} // namespace

Result<BrickMaker> smooth_labels_bricks(const Volume& labels, const SmoothLabelsOptions& options) {
    PALPATE_TRY(check_labels(labels, "smoothing of labels"));
    const glm::dvec3 sigma = options.sigma_mm / spacing_mm(labels.grid());
    const double most = std::max({sigma.x, sigma.y, sigma.z});
    if (!(options.sigma_mm > 0.0) || most > kMostSamples)
        return fail(
            "smoothing of labels: expected a sigma above 0 and at most {:g} mm here, found "
            "{:g}",
            kMostSamples * options.sigma_mm / (most > 0.0 ? most : 1.0), options.sigma_mm);
    const Smoother smoother{labels, {kernel_of(sigma.x), kernel_of(sigma.y), kernel_of(sigma.z)}};
    return BrickMaker{labels.grid(), labels.type(),
                      [smoother](glm::uvec3 position) { return smoother.brick(position); }};
}

Result<Volume> smooth_labels(const Volume& labels, const SmoothLabelsOptions& options,
                             const Task& task) {
    PALPATE_TRY(const BrickMaker maker, smooth_labels_bricks(labels, options));
    return make_bricks(maker, task);
}

} // namespace palpate
