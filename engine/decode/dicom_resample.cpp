#include "engine/decode/dicom_resample.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/base/assert.h"

namespace palpate::io {

namespace {

constexpr double kNoData = std::numeric_limits<double>::quiet_NaN();
// Positions are decimal strings: this far beyond an image, in samples, still belongs to it.
constexpr double kRounding = 1e-3;

// The place of a sample between two neighbours of a row of `count`.
struct Between {
    size_t low = 0, high = 0;
    double share = 0; // of the higher
};

std::optional<Between> between(double at, uint32_t count) {
    if (at < -kRounding || at > count - 1 + kRounding)
        return {};
    if (count == 1)
        return Between{};
    const double low = std::clamp(std::floor(at), 0.0, count - 2.0);
    return Between{static_cast<size_t>(low), static_cast<size_t>(low) + 1, at - low};
}

double mixed(double a, double b, double share) {
    return (1 - share) * a + share * b;
}

// The values of one image at the samples of a slice of the grid, whose first sample lies at `first`
// in the image's samples.
std::vector<double> on_grid(const std::vector<double>& image, glm::uvec2 image_size,
                            glm::dvec2 first, glm::uvec2 size) {
    std::vector<double> values(size_t{size.x} * size.y, kNoData);
    for (uint32_t j = 0; j < size.y; ++j) {
        const std::optional<Between> y = between(first.y + j, image_size.y);
        if (!y)
            continue;
        const double* low = &image[y->low * image_size.x];
        const double* high = &image[y->high * image_size.x];
        for (uint32_t i = 0; i < size.x; ++i)
            if (const std::optional<Between> x = between(first.x + i, image_size.x))
                values[i + size_t{j} * size.x] =
                    mixed(mixed(low[x->low], low[x->high], x->share),
                          mixed(high[x->low], high[x->high], x->share), y->share);
    }
    return values;
}

} // namespace

Result<void> resample_stack(const DicomStack& stack, const DicomValues& values_of,
                            std::span<float> out) {
    const Grid& grid = stack.grid;
    const glm::uvec2 size(grid.size);
    const size_t samples = size_t{size.x} * size.y;
    PALPATE_ASSERT_CMP(out.size(), ==, samples * grid.size.z);
    const glm::dvec3 normal = glm::normalize(glm::dvec3(grid.world_from_index[2]));
    const glm::dmat4 index_from_world = glm::inverse(grid.world_from_index);
    const glm::dvec3 origin(grid.world_from_index[3]);

    // Images s - 1 and s: where they lie in slices of the grid, and their values on it.
    double before_at = 0;
    std::vector<double> before;
    uint32_t k = 0;
    for (size_t s = 0; s < stack.frames.size(); ++s) {
        const DicomFrame& frame = stack.frames[s];
        PALPATE_TRY(const std::vector<double> values, values_of(frame));
        const glm::dvec3 first(index_from_world * glm::dvec4(*frame.position, 1.0));
        std::vector<double> here = on_grid(values, frame.size, -glm::dvec2(first), size);
        const double here_at =
            glm::dot(*frame.position - origin, normal) / glm::length(grid.world_from_index[2]);
        const bool last = s + 1 == stack.frames.size();
        for (; k < grid.size.z && (k <= here_at + kRounding || last); ++k) {
            const double share = s == 0 ? 1.0 : (k - before_at) / (here_at - before_at);
            float* to = &out[k * samples];
            for (size_t i = 0; i < samples; ++i) {
                double value = s == 0 ? here[i] : mixed(before[i], here[i], share);
                if (std::isnan(value) && std::abs(share - 1) < kRounding)
                    value = here[i]; // on this image: where the one before ends is no matter
                to[i] = static_cast<float>(value);
            }
        }
        before = std::move(here);
        before_at = here_at;
    }
    return {};
}

} // namespace palpate::io
