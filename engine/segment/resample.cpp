#include "engine/segment/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/memory_limit.h"
#include "engine/segment/result_memory.h"
#include "engine/segment/separable.h"
#include "engine/volume/box.h"
#include "engine/volume/cubic_weights.h"
#include "engine/volume/extent.h"
#include "engine/volume/nearest_stored.h"

namespace palpate {

namespace {

constexpr int kPrefilter = 12;            // samples to each side
constexpr int64_t kMostRead = 12'000'000; // samples of a block: 48 MB, of which some four are held
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

Kernel prefilter() {
    Kernel kernel{0, std::vector<float>(kPrefilter + 1)};
    for (int k = 1; k <= kPrefilter; ++k)
        kernel.weights[size_t(k)] = float(std::sqrt(3.0) * std::pow(std::sqrt(3.0) - 2.0, k));
    return kernel;
}

// Samples of the input beneath a block. Places in it are counted from its first sample, so that
// they are not negative and truncation is the floor.
struct Source {
    glm::ivec3 first, size;
    std::vector<float> samples;
    bool lacks_data = false;
    Box spline; // cubic: coefficients, kPrefilter fewer on each side

    const float* at(glm::ivec3 i) const {
        return samples.data() + size_t(i.x) +
               size_t(size.x) * (size_t(i.y) + size_t(size.y) * size_t(i.z));
    }
};

float linear_at(const Source& source, glm::dvec3 q) {
    const glm::ivec3 low(q);
    const glm::dvec3 f = q - glm::dvec3(low);
    const float* v = source.at(low);
    const size_t row = size_t(source.size.x), plane = row * size_t(source.size.y);
    const auto between = [](double a, double b, double share) { return a + share * (b - a); };
    const auto along_x = [&](const float* from) {
        return between(double{from[0]}, double{from[1]}, f.x);
    };
    const auto in_plane = [&](const float* from) {
        return between(along_x(from), along_x(from + row), f.y);
    };
    return float(between(in_plane(v), in_plane(v + plane), f.z));
}

// Interpolates between those of the eight samples that have data.
float linear_where_known(const Source& source, glm::dvec3 q) {
    const glm::ivec3 low(q);
    const glm::dvec3 f = q - glm::dvec3(low);
    double sum = 0, total = 0;
    for (int c = 0; c < 8; ++c) {
        const glm::ivec3 d(c & 1, c >> 1 & 1, c >> 2);
        const double w = (d.x ? f.x : 1 - f.x) * (d.y ? f.y : 1 - f.y) * (d.z ? f.z : 1 - f.z);
        const float v = *source.at(low + d);
        if (std::isnan(v))
            continue;
        sum += w * double{v};
        total += w;
    }
    return float(sum / total);
}

float cubic_at(const Source& source, glm::dvec3 q) {
    const glm::ivec3 low(q);
    const glm::dvec3 f = q - glm::dvec3(low);
    const auto wx = cubic_weights(f.x).value, wy = cubic_weights(f.y).value,
               wz = cubic_weights(f.z).value;
    const glm::ivec3 from = low - 1 - kPrefilter;
    const size_t width = size_t(source.spline.size.x), plane = width * size_t(source.spline.size.y);
    const float* corner = source.spline.samples.data() + size_t(from.x) + width * size_t(from.y) +
                          plane * size_t(from.z);
    double sum = 0;
    for (size_t z = 0; z < 4; ++z)
        for (size_t y = 0; y < 4; ++y) {
            const float* row = corner + z * plane + y * width;
            double along = 0;
            for (size_t x = 0; x < 4; ++x)
                along += wx[x] * double{row[x]};
            sum += wz[z] * wy[y] * along;
        }
    return float(sum);
}

struct Resampler {
    Volume volume;
    ResampleOptions options;
    glm::dmat4 source_from_index; // index of the input from index of the result
    Kernel kernel = prefilter();

    int reach() const { // samples beside the box of the points
        return options.interpolation == ResampledBy::cubic ? kPrefilter + 3 : 1;
    }
    void read(glm::ivec3 first, glm::ivec3 size, Source& source) const;
    bool block(glm::ivec3 low, glm::ivec3 high, glm::ivec3 origin, float* out) const;
    BrickPtr brick(glm::uvec3 at) const;
};

void Resampler::read(glm::ivec3 first, glm::ivec3 size, Source& source) const {
    if (options.interpolation == ResampledBy::cubic) // rows of coefficients are eights
        size.x = (size.x - 2 * kPrefilter + 7) / 8 * 8 + 2 * kPrefilter;
    source.first = first;
    source.size = size;
    source.samples.resize(size_t(size.x) * size_t(size.y) * size_t(size.z));
    read_box(volume, first, size, packed(glm::uvec3(size)), source.samples.data());
    source.lacks_data =
        volume.no_data_count() > 0 && std::any_of(source.samples.begin(), source.samples.end(),
                                                  [](float v) { return std::isnan(v); });
    if (options.interpolation != ResampledBy::cubic)
        return;
    std::vector<float> known = source.samples;
    if (source.lacks_data) { // along x, then y, then z the sample beside it; at last 0
        for (int axis = 0; axis < 3; ++axis) {
            const size_t step = axis == 0   ? 1
                                : axis == 1 ? size_t(size.x)
                                            : size_t(size.x) * size_t(size.y);
            for (size_t i = step; i < known.size(); ++i)
                if (std::isnan(known[i]))
                    known[i] = known[i - step];
            for (size_t i = known.size() - step; i-- > 0;)
                if (std::isnan(known[i]))
                    known[i] = known[i + step];
        }
        for (float& v : known)
            v = std::isnan(v) ? 0.0f : v;
    }
    Box x, y;
    convolve(size, known.data(), 0, kernel, x);
    convolve(x.size, x.samples.data(), 1, kernel, y);
    convolve(y.size, y.samples.data(), 2, kernel, source.spline);
}

// Samples low .. high - 1 of the result, `out` with the strides of a brick that begins at origin.
// False where they need more of the input than may be read at once.
bool Resampler::block(glm::ivec3 low, glm::ivec3 high, glm::ivec3 origin, float* out) const {
    glm::dvec3 least(1e300), most(-1e300);
    for (int c = 0; c < 8; ++c) {
        const glm::ivec3 corner(c & 1 ? high.x - 1 : low.x, c & 2 ? high.y - 1 : low.y,
                                c & 4 ? high.z - 1 : low.z);
        const glm::dvec3 p(source_from_index * glm::dvec4(glm::dvec3(corner), 1.0));
        least = glm::min(least, p);
        most = glm::max(most, p);
    }
    const glm::dvec3 last(glm::ivec3(volume.size()) - 1);
    constexpr double kSlack = 1e-6; // samples: rounding of the matrices
    const bool apart = glm::any(glm::greaterThan(least, last + 0.5 + kSlack)) ||
                       glm::any(glm::lessThan(most, glm::dvec3(-0.5 - kSlack)));
    const float outside =
        options.interpolation == ResampledBy::nearest ? float(options.outside) : kNone;
    thread_local Source source;
    if (!apart) {
        const glm::ivec3 from(glm::floor(glm::clamp(least, glm::dvec3(-1), last + 1.0)));
        const glm::ivec3 to(glm::floor(glm::clamp(most, glm::dvec3(-1), last + 1.0)));
        const glm::ivec3 size = to - from + 2 + 2 * reach();
        if (int64_t{size.x} * size.y * size.z > kMostRead && high - low != glm::ivec3(1))
            return false;
        read(from - reach(), size, source);
    }
    // From here on places are counted from the first sample of the source.
    const glm::dvec3 first(apart ? glm::ivec3(0) : source.first);
    const glm::dvec3 lowest = -0.5 - kSlack - first, highest = last + 0.5 + kSlack - first;
    const glm::dvec3 step(source_from_index[0]);
    const auto value = [&](glm::dvec3 q) {
        if (options.interpolation == ResampledBy::nearest || source.lacks_data) {
            const glm::dvec3 nearest = glm::clamp(q + 0.5 - kSlack, -first, last - first);
            const float there = *source.at(glm::ivec3(nearest));
            if (options.interpolation == ResampledBy::nearest || std::isnan(there))
                return there;
        }
        if (options.interpolation == ResampledBy::cubic)
            return cubic_at(source, q);
        return source.lacks_data ? linear_where_known(source, q) : linear_at(source, q);
    };
    for (int z = low.z; z < high.z; ++z)
        for (int y = low.y; y < high.y; ++y) {
            const glm::dvec3 start(source_from_index * glm::dvec4(0.0, y, z, 1.0));
            float* row = out + offset_in_brick(glm::uvec3(glm::ivec3(low.x, y, z) - origin));
            for (int x = low.x; x < high.x; ++x, ++row) {
                const glm::dvec3 q = start + double(x) * step - first;
                const bool inside = !apart && q.x >= lowest.x && q.y >= lowest.y &&
                                    q.z >= lowest.z && q.x <= highest.x && q.y <= highest.y &&
                                    q.z <= highest.z;
                *row = inside ? value(q) : outside;
            }
        }
    return true;
}

BrickPtr Resampler::brick(glm::uvec3 at) const {
    thread_local std::vector<float> made(kBrickSamples);
    const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), options.grid.size - at * kBrickSide);
    const glm::ivec3 origin(at * kBrickSide), end = origin + glm::ivec3(valid);
    // Halves of halves, until each reads little enough.
    const auto split = [&](const auto& self, glm::ivec3 low, glm::ivec3 high) -> void {
        if (block(low, high, origin, made.data()))
            return;
        int axis = 0;
        for (int a = 1; a < 3; ++a)
            if (high[a] - low[a] > high[axis] - low[axis])
                axis = a;
        glm::ivec3 middle_high = high, middle_low = low;
        middle_high[axis] = middle_low[axis] = (low[axis] + high[axis]) / 2;
        self(self, low, middle_high);
        self(self, middle_low, high);
    };
    split(split, origin, end);
    if (options.interpolation != ResampledBy::nearest)
        return Brick::make(std::span<const float>(made), valid);
    return visit_scalar(volume.type(), [&](auto t) -> BrickPtr {
        using T = decltype(t);
        thread_local std::vector<T> stored(kBrickSamples);
        std::transform(made.begin(), made.end(), stored.begin(), [](float v) {
            return std::isnan(v) && !std::is_floating_point_v<T> ? T{}
                                                                 : nearest_stored<T>(double{v});
        });
        return Brick::make(std::span<const T>(stored), valid);
    });
}

} // namespace

Result<void> expect_result_memory(const BrickMaker& maker, const Volume& from,
                                  uint64_t limit_bytes) {
    const glm::uvec3 size = maker.grid.size;
    const auto samples = [](glm::dvec3 of) { return of.x * of.y * of.z; };
    if (samples(glm::dvec3(size)) <= samples(glm::dvec3(from.size())))
        return {};
    return expect_memory(
        fmt::format("a result of {} x {} x {} samples of {}", size.x, size.y, size.z,
                    name_of(maker.type)),
        samples(glm::dvec3(size)) * static_cast<double>(bytes_per_sample(maker.type)) +
            static_cast<double>(from.bytes()),
        limit_bytes);
}

Result<Grid> grid_of_spacing(const Grid& grid, glm::dvec3 wanted_mm) {
    const glm::dvec3 spacing = spacing_mm(grid);
    Grid made = grid;
    for (int a = 0; a < 3; ++a) {
        if (!(wanted_mm[a] > 0.0) || !std::isfinite(wanted_mm[a]))
            return fail("spacing: expected a length above 0 mm, found {:g}", wanted_mm[a]);
        const double count = std::ceil(grid.size[a] * spacing[a] / wanted_mm[a] - 1e-6);
        if (count > 65536.0)
            return fail(
                "spacing: expected at most 65536 samples on an axis, found {:.0f} of {:g} mm",
                count, wanted_mm[a]);
        made.size[a] = uint32_t(std::max(1.0, count));
        made.world_from_index[a] = grid.world_from_index[a] * (wanted_mm[a] / spacing[a]);
    }
    const glm::dvec3 shift = center_mm(grid) - center_mm(made);
    made.world_from_index[3] += glm::dvec4(shift, 0.0);
    return made;
}

Result<BrickMaker> resample_bricks(const Volume& volume, const ResampleOptions& options) {
    PALPATE_TRY(check_grid(options.grid));
    if (const std::string apart = apart_text("the grid", options.grid, volume.grid());
        !apart.empty())
        return fail("{}", apart);
    if (options.interpolation == ResampledBy::cubic)
        PALPATE_TRY(check_magnitude(volume));
    auto resampler = std::make_shared<Resampler>(Resampler{
        volume, options, index_from_world(volume.grid()) * options.grid.world_from_index});
    return BrickMaker{
        options.grid,
        options.interpolation == ResampledBy::nearest ? volume.type() : ScalarType::f32,
        [resampler](glm::uvec3 at) { return resampler->brick(at); }};
}

Result<Volume> resample(const Volume& volume, const ResampleOptions& options, const Task& task) {
    PALPATE_TRY(const BrickMaker maker, resample_bricks(volume, options));
    PALPATE_TRY(expect_result_memory(maker, volume, 0));
    return make_bricks(maker, task);
}

} // namespace palpate
