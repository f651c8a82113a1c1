#include "engine/io/narrow.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/assert.h"
#include "engine/base/option_name.h"
#include "engine/volume/builder.h"

namespace palpate::io {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Facts about all values of a file, taken together.
struct Survey {
    double min = kInfinity, max = -kInfinity; // of finite values
    double largest_rounding = 0;              // |value - nearest float|, finite in float
    uint64_t not_finite = 0;
    uint64_t padding = 0;
    uint64_t beyond_float = 0; // finite, but beyond the range of float
    bool whole = true;         // every finite value is a whole number
    bool near_whole = true;    // but for the rounding of floats (label_rounding)
    bool grey = true;          // all components of every voxel agree

    void include(const Survey& other) {
        min = std::min(min, other.min);
        max = std::max(max, other.max);
        largest_rounding = std::max(largest_rounding, other.largest_rounding);
        not_finite += other.not_finite;
        padding += other.padding;
        beyond_float += other.beyond_float;
        whole = whole && other.whole;
        near_whole = near_whole && other.near_whole;
        grey = grey && other.grey;
    }
};

// The stored components as T, first component only, with each slice's rescale.
template <class T>
struct Source {
    std::span<const T> stored;
    glm::uvec3 size;
    uint32_t components;
    const std::vector<Rescale>& rescale;
    const std::vector<StoredRange>& padding;

    Rescale rescale_of(uint32_t z) const {
        return rescale.empty() ? Rescale{} : rescale[rescale.size() == 1 ? 0 : z];
    }
    StoredRange padding_of(uint32_t z) const {
        return padding.empty() ? StoredRange{} : padding[z];
    }
    const T* row(uint32_t y, uint32_t z) const {
        return &stored[(y + size_t{size.y} * z) * size.x * components];
    }
};

// 64-bit integers pass 2^53, where double rounds; long double (64-bit mantissa) holds them all.
template <class T>
using Wide = std::conditional_t<std::is_integral_v<T> && sizeof(T) == 8, long double, double>;

// How far a label may lie from a whole number, where floats held it or what it was computed from.
// Each rounding to float moves a number by 2^-24 of it at the most: that of the slope, of the
// stored value and of their product move the product, that of the intercept the intercept, and that
// of the sum the value. Labels count in ones, so that those near 0 are off by the rounding of a 1.
double label_rounding(const Rescale& rescale, double stored, double value) {
    return 0x1p-24 * (3 * std::max(std::abs(rescale.slope * stored), 1.0) +
                      std::abs(rescale.intercept) + std::abs(value));
}

template <class T>
void survey_whole(const Rescale& rescale, T stored, double value, bool is_whole, Survey& survey) {
    if (is_whole)
        return;
    survey.whole = false;
    survey.near_whole =
        survey.near_whole && std::abs(value - std::round(value)) <=
                                 label_rounding(rescale, static_cast<double>(stored), value);
}

template <class T>
void survey_row(const Source<T>& source, uint32_t y, uint32_t z, Survey& survey) {
    const Rescale rescale = source.rescale_of(z);
    const bool plain = rescale == Rescale{};
    const StoredRange padding = source.padding_of(z);
    const bool pads = padding != StoredRange{};
    const T* voxel = source.row(y, z);
    for (uint32_t x = 0; x < source.size.x; ++x, voxel += source.components) {
        for (uint32_t c = 1; c < source.components; ++c)
            survey.grey = survey.grey && voxel[c] == voxel[0];
        if (pads && padding.holds(static_cast<double>(*voxel))) {
            ++survey.padding;
            continue;
        }
        const Wide<T> value =
            plain ? static_cast<Wide<T>>(*voxel)
                  : static_cast<Wide<T>>(rescale.slope * static_cast<double>(*voxel) +
                                         rescale.intercept);
        if (!std::isfinite(value)) {
            ++survey.not_finite;
            continue;
        }
        survey.min = std::min(survey.min, static_cast<double>(value));
        survey.max = std::max(survey.max, static_cast<double>(value));
        if constexpr (!std::is_integral_v<T> || sizeof(T) > 2) {
            const auto nearest = static_cast<float>(value);
            if (std::isfinite(nearest))
                survey.largest_rounding =
                    std::max(survey.largest_rounding,
                             static_cast<double>(std::abs(value - static_cast<Wide<T>>(nearest))));
            else
                ++survey.beyond_float;
            survey_whole(rescale, *voxel, static_cast<double>(value), std::trunc(value) == value,
                         survey);
        } else if (!plain) {
            survey.largest_rounding =
                std::max(survey.largest_rounding,
                         static_cast<double>(std::abs(value - static_cast<float>(value))));
            survey_whole(rescale, *voxel, static_cast<double>(value), std::trunc(value) == value,
                         survey);
        }
    }
}

template <class T>
Survey survey_of(const Source<T>& source) {
    return tbb::parallel_reduce(
        tbb::blocked_range<uint32_t>(0, source.size.z), Survey{},
        [&](const tbb::blocked_range<uint32_t>& slices, Survey survey) {
            for (uint32_t z = slices.begin(); z < slices.end(); ++z)
                for (uint32_t y = 0; y < source.size.y; ++y)
                    survey_row(source, y, z, survey);
            return survey;
        },
        [](Survey a, const Survey& b) {
            a.include(b);
            return a;
        });
}

ScalarType smallest_type(const Survey& survey) {
    const auto holds = [&](auto t) {
        return survey.min >= std::numeric_limits<decltype(t)>::min() &&
               survey.max <= std::numeric_limits<decltype(t)>::max();
    };
    if (!survey.whole || survey.not_finite > 0 || survey.padding > 0)
        return ScalarType::f32;
    if (holds(uint8_t{}))
        return ScalarType::u8;
    if (holds(int8_t{}))
        return ScalarType::i8;
    if (holds(uint16_t{}))
        return ScalarType::u16;
    if (holds(int16_t{}))
        return ScalarType::i16;
    return ScalarType::f32;
}

// `round`: to the nearest whole number, which To holds.
template <class To, class T>
Volume build(const Grid& grid, const Source<T>& source, bool round) {
    VolumeBuilder builder(grid, scalar_type_of<To>);
    const glm::uvec3 count = builder.brick_count();
    tbb::parallel_for(size_t{0}, size_t{count.x} * count.y * count.z, [&](size_t i) {
        const glm::uvec3 position(i % count.x, i / count.x % count.y,
                                  i / (size_t{count.x} * count.y));
        const glm::uvec3 start = position * kBrickSide;
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), grid.size - start);
        std::vector<To> staged(kBrickSamples);
        for (uint32_t z = 0; z < valid.z; ++z) {
            const Rescale rescale = source.rescale_of(start.z + z);
            const bool plain = rescale == Rescale{};
            const StoredRange padding = source.padding_of(start.z + z);
            const bool pads = std::is_floating_point_v<To> && padding != StoredRange{};
            for (uint32_t y = 0; y < valid.y; ++y) {
                const T* voxel =
                    source.row(start.y + y, start.z + z) + size_t{start.x} * source.components;
                To* to = &staged[offset_in_brick({0, y, z})];
                for (uint32_t x = 0; x < valid.x; ++x, voxel += source.components)
                    if (round)
                        to[x] = static_cast<To>(std::round(
                            rescale.slope * static_cast<double>(*voxel) + rescale.intercept));
                    else if (pads && padding.holds(static_cast<double>(*voxel)))
                        to[x] = std::numeric_limits<To>::quiet_NaN();
                    else
                        to[x] = plain
                                    ? static_cast<To>(*voxel)
                                    : static_cast<To>(rescale.slope * static_cast<double>(*voxel) +
                                                      rescale.intercept);
            }
        }
        builder.set_brick(position, Brick::make(std::span<const To>(staged), valid));
    });
    return builder.finish();
}

Result<ScalarType> label_type(const std::string& name, const Survey& survey) {
    if (survey.not_finite > 0)
        return fail(
            "{}: a label map may hold whole numbers only, found {} values that are not "
            "finite",
            name, survey.not_finite);
    if (!survey.near_whole)
        return fail(
            "{}: a label map may hold whole numbers only, found fractions between {} and "
            "{}",
            name, survey.min, survey.max);
    if (std::round(survey.min) < 0 || std::round(survey.max) > 65535)
        return fail("{}: labels must lie in 0 .. 65535, found values from {} to {}", name,
                    survey.min, survey.max);
    return std::round(survey.max) <= 255 ? ScalarType::u8 : ScalarType::u16;
}

void add_warnings(const std::string& name, const Survey& survey, ScalarType type,
                  uint32_t components, uint64_t samples, std::vector<std::string>& warnings) {
    if (components > 1)
        warnings.push_back(fmt::format("{}: the {} components of every voxel agree; one is read",
                                       name, components));
    if (survey.not_finite > 0)
        warnings.push_back(fmt::format("{}: {} of {} values are NaN or infinite: no data", name,
                                       survey.not_finite, samples));
    if (survey.beyond_float > 0)
        warnings.push_back(fmt::format("{}: {} values are beyond the range of f32: no data", name,
                                       survey.beyond_float));
    if (type == ScalarType::f32 && survey.largest_rounding > 0)
        warnings.push_back(
            fmt::format("{}: no type holds every value exactly; f32 rounds by at most {:.3g}", name,
                        survey.largest_rounding));
}

} // namespace

Result<LoadedVolume> narrow(const std::string& name, const Decoded& decoded,
                            const VoxelClaim& claim, std::span<const std::byte> bytes,
                            VolumeKind kind, uint64_t max_memory_bytes) {
    PALPATE_ASSERT_CMP(bytes.size(), ==, claimed_bytes(claim).value_or(0));
    // The numbers of a label map are labels, also that of its background.
    const std::vector<StoredRange> padding =
        kind == VolumeKind::labels ? std::vector<StoredRange>() : decoded.padding;
    return visit_component(claim.type, [&](auto t) -> Result<LoadedVolume> {
        using T = decltype(t);
        const Source<T> source{{reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)},
                               claim.size,
                               claim.components,
                               decoded.rescale,
                               padding};
        const Survey survey = survey_of(source);
        if (!survey.grey)
            return fail(
                "{}: has {} components a voxel, which differ (colours, RGB, or vectors); expected "
                "one grey value; convert it to grey first",
                name, claim.components);
        ScalarType type = smallest_type(survey);
        if (kind == VolumeKind::labels) {
            PALPATE_TRY(type, label_type(name, survey));
        }
        const uint64_t samples = sample_count(decoded.grid);
        const uint64_t needed = bytes.size() + samples * bytes_per_sample(type);
        if (needed > max_memory_bytes)
            return fail(
                "{}: its voxels and the volume made of them need {} bytes of memory, more "
                "than the limit of {} ({})",
                name, needed, max_memory_bytes, Option{"max-memory"});
        const bool round = kind == VolumeKind::labels && !survey.whole;
        Volume volume = visit_scalar(
            type, [&](auto to) { return build<decltype(to)>(decoded.grid, source, round); });
        LoadedVolume loaded{
            std::move(volume), decoded.warnings, decoded.notes,  decoded.modality,          {},
            decoded.labels,    decoded.inverted, decoded.series, decoded.frame_of_reference};
        add_warnings(name, survey, type, claim.components, samples, loaded.warnings);
        if (survey.padding > 0)
            loaded.notes.push_back(fmt::format("{}: {} of {} samples are padding: no data", name,
                                               survey.padding, samples));
        return loaded;
    });
}

} // namespace palpate::io
