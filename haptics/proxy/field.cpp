#include "haptics/proxy/field.h"

#include <algorithm>
#include <cmath>

#include "haptics/proxy/samples.h"

namespace palpate::haptics {

namespace {

// Weights of samples floor(x) - 1 .. floor(x) + 2 of the uniform cubic B-spline and their slopes.
struct Weights {
    std::array<double, 4> value, slope;
};
Weights cubic_weights(double f) {
    const double r = 1.0 - f;
    return {{r * r * r / 6.0, (4.0 - f * f * (6.0 - 3.0 * f)) / 6.0,
             (4.0 - r * r * (6.0 - 3.0 * r)) / 6.0, f * f * f / 6.0},
            {-0.5 * r * r, f * (1.5 * f - 2.0), r * (2.0 - 1.5 * r), 0.5 * f * f}};
}

// A Gaussian of 0.6 samples: labels are binary, and this is as much as leaves walls of 1.5 samples.
constexpr std::array<float, 7> kLabelTaps{2.4738e-6f, 2.566256e-3f, 0.1655237f, 0.6638150f,
                                          0.1655237f, 2.566256e-3f, 2.4738e-6f};

// The sharpened spline stays within its samples' range widened by this share of the range: half of
// (1.2222^3 - 1), where 1.2222 is the greatest sum of absolute weights on one axis (at the middle).
constexpr double kSharpOvershoot = 0.413;
// It reads samples within this distance; the wide one, and that of labels, within 5.
constexpr int kSharpReach = 3, kWideReach = 5;

// Convolves kCount outputs with kTaps taps along one axis of a box; slabs of `run` values.
template <int kTaps>
void convolve(const float* from, float* to, int outer_count, int count, int run,
              const float* taps) {
    const int read = count + kTaps - 1;
    for (int outer = 0; outer < outer_count; ++outer)
        for (int i = 0; i < count; ++i) {
            const float* source = from + run * (i + read * outer);
            float* target = to + run * (i + count * outer);
            for (int r = 0; r < run; ++r) {
                float sum = taps[0] * source[r];
                for (int k = 1; k < kTaps; ++k)
                    sum += taps[k] * source[r + k * run];
                target[r] = sum;
            }
        }
}

// A box of kSide + kTaps - 1 samples on each axis becomes one of kSide.
template <int kSide, int kTaps>
void filter_box(const float* in, const float* taps_x, const float* taps_y, const float* taps_z,
                float* out) {
    constexpr int kRead = kSide + kTaps - 1;
    std::array<float, kSide * kRead * kRead> z;
    std::array<float, kSide * kSide * kRead> zy;
    convolve<kTaps>(in, z.data(), 1, kSide, kRead * kRead, taps_z);
    convolve<kTaps>(z.data(), zy.data(), kSide, kSide, kRead, taps_y);
    convolve<kTaps>(zy.data(), out, kSide * kSide, kSide, 1, taps_x);
}

} // namespace

void Field::follow(const Volume& volume, TouchSource source, double iso, double blur) {
    volume_ = &volume;
    lacked_brick_ = false;
    if (source == TouchSource::labels) {
        iso = 0.5;
        blur = 1.0;
    }
    iso_ = iso;
    if (epoch_ != 0 && volume.version() == version_ && source == source_ && blur == blur_)
        return;
    if (++epoch_ == 0) { // after 2^32 snapshots: no block may seem to belong to the first
        for (Block& block : blocks_)
            block.epoch = 0;
        epoch_ = 1;
    }
    version_ = volume.version();
    source_ = source;
    index_from_world_ = index_from_world(volume.grid());
    gradient_to_world_ = glm::transpose(glm::dmat3(index_from_world_));
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    smallest_mm_ = std::min({spacing.x, spacing.y, spacing.z});
    const ValueRange range = volume.range();
    const bool labels = source == TouchSource::labels;
    lowest_ = labels || range.empty() ? 0.0f : std::min(range.min, static_cast<float>(iso) - 1.0f);
    contrast_ = labels || range.empty() ? 1.0 : std::max(1e-9, double{range.max} - double{lowest_});
    const double coarsest = std::max({spacing.x, spacing.y, spacing.z});
    is_even_ = coarsest < 1.05 * smallest_mm_;
    blur_ = blur;
    is_sharp_wide_ = !is_even_ && blur > 0.0;
    overshoot_ = 1.0;
    for (size_t axis = 0; axis < 3; ++axis) {
        // G(k) (a + b k^2) with sum 1 and second moment -1/3, which cancels the spline's.
        const double ratio = coarsest / spacing[static_cast<int>(axis)];
        const double width = ratio > 1.5 ? std::min(0.4 * ratio, 1.3) : 0.0;
        double m0 = 0.0, m2 = 0.0, m4 = 0.0;
        std::array<double, 2 * kReach + 1> g{};
        for (int k = -kReach; k <= kReach; ++k) {
            const double weight = width > 0.0 ? std::exp(-0.5 * k * k / (width * width))
                                              : (std::abs(k) <= 1 ? 1.0 : 0.0);
            g[static_cast<size_t>(k + kReach)] = weight;
            m0 += weight;
            m2 += weight * k * k;
            m4 += weight * k * k * k * k;
        }
        const double det = m0 * m4 - m2 * m2;
        const double a = (m4 + m2 / 3.0) / det, b = (-m0 / 3.0 - m2) / det;
        double size = 0.0;
        for (int k = -kReach; k <= kReach; ++k) {
            const double tap = g[static_cast<size_t>(k + kReach)] * (a + b * k * k);
            sharp_taps_[axis][static_cast<size_t>(k + kReach)] = static_cast<float>(tap);
            size += std::abs(tap);
        }
        overshoot_ *= size;
    }
    overshoot_ = is_sharp_wide_ ? 0.5 * (overshoot_ - 1.0) : kSharpOvershoot;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double sigma = std::min(blur * coarsest / spacing[static_cast<int>(axis)], 1.9);
        float sum = 0.0f;
        for (int i = -kFarReach; i <= kFarReach; ++i) {
            const bool counts = std::abs(i) <= (is_even_ ? kReach : kFarReach);
            const double weight = sigma > 0.05 ? std::exp(-0.5 * i * i / (sigma * sigma)) : i == 0;
            taps_[axis][static_cast<size_t>(i + kFarReach)] =
                counts ? static_cast<float>(weight) : 0.0f;
            sum += taps_[axis][static_cast<size_t>(i + kFarReach)];
        }
        for (float& tap : taps_[axis])
            tap /= sum;
        if (blur == 0.0) { // half way to the sharp view: see the header
            taps_[axis].fill(0.0f);
            taps_[axis][kFarReach - 1] = taps_[axis][kFarReach + 1] = -1.0f / 12.0f;
            taps_[axis][kFarReach] = 7.0f / 6.0f;
        }
    }
}

void Field::fill_raw(Block& block) {
    lacked_brick_ |= copy_resident(*volume_, kBlock * block.position, glm::ivec3(kRaw), lowest_,
                                   block.raw.data());
    if (source_ == TouchSource::labels)
        for (float& sample : block.raw)
            sample = sample > 0.0f ? 1.0f : 0.0f;
    block.parts |= kRawPart;
}

void Field::fill(Block& block, Part part) {
    const bool labels = source_ == TouchSource::labels;
    const int reach = part == kSmoothPart        ? (is_even_ ? kReach : kFarReach)
                      : labels || is_sharp_wide_ ? kReach
                                                 : 1;
    const int side = kBlock + 2 * reach;
    constexpr int kMostRead = kBlock + 2 * kFarReach;
    std::array<float, kMostRead * kMostRead * kMostRead> samples;
    lacked_brick_ |= copy_resident(*volume_, kBlock * block.position - reach, glm::ivec3(side),
                                   lowest_, samples.data());
    if (labels)
        for (int i = 0; i < side * side * side; ++i)
            samples[static_cast<size_t>(i)] = samples[static_cast<size_t>(i)] > 0.0f ? 1.0f : 0.0f;
    const float* in = samples.data();
    const auto axis_taps = [&](size_t axis) { return &taps_[axis][size_t(kFarReach - reach)]; };
    if (part == kSmoothPart && is_even_) {
        filter_box<kBlock, 2 * kReach + 1>(in, axis_taps(0), axis_taps(1), axis_taps(2),
                                           block.smooth.data());
    } else if (part == kSmoothPart) {
        filter_box<kBlock, 2 * kFarReach + 1>(in, axis_taps(0), axis_taps(1), axis_taps(2),
                                              block.smooth.data());
    } else if (labels) {
        const float* taps = kLabelTaps.data();
        filter_box<kBlock, 2 * kReach + 1>(in, taps, taps, taps, block.sharp.data());
    } else if (is_sharp_wide_) {
        filter_box<kBlock, 2 * kReach + 1>(in, sharp_taps_[0].data(), sharp_taps_[1].data(),
                                           sharp_taps_[2].data(), block.sharp.data());
    } else {
        constexpr std::array<float, 3> kSharpen{-1.0f / 6.0f, 4.0f / 3.0f, -1.0f / 6.0f};
        const float* taps = kSharpen.data();
        filter_box<kBlock, 3>(in, taps, taps, taps, block.sharp.data());
    }
    block.parts |= part;
}

const Field::Block& Field::block(glm::ivec3 position, Part part) {
    const glm::ivec3 slot = position & (kTable - 1);
    Block& block = blocks_[static_cast<size_t>(slot.x + kTable * (slot.y + kTable * slot.z))];
    if (block.epoch != epoch_ || block.position != position) {
        block.position = position;
        block.epoch = epoch_;
        block.parts = 0;
    }
    if (!(block.parts & part)) {
        if (part == kRawPart)
            fill_raw(block);
        else
            fill(block, part);
    }
    return block;
}

namespace {

// Points this far outside are as free as any; indices stay within int.
constexpr double kFarthest = 1e6;

bool is_far(glm::dvec3 index, glm::uvec3 size) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(index[axis] > -8.0 && index[axis] < double(size[axis]) + 8.0))
            return true;
    return false;
}

} // namespace

template <bool kGradient>
FieldSample Field::evaluate(glm::dvec3 world_mm, Part part) {
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index, volume_->size()))
        return {lowest_, {}};
    const glm::dvec3 low = glm::floor(index);
    const glm::ivec3 first = glm::ivec3(low) - 1;
    const glm::dvec3 f = index - low;
    const Weights wx = cubic_weights(f.x), wy = cubic_weights(f.y), wz = cubic_weights(f.z);
    const glm::ivec3 from = first >> 2, to = (first + 3) >> 2; // blocks of 4

    // The 4x4x4 coefficients, gathered from up to eight blocks.
    std::array<float, 64> c;
    for (int bz = from.z; bz <= to.z; ++bz)
        for (int by = from.y; by <= to.y; ++by)
            for (int bx = from.x; bx <= to.x; ++bx) {
                const glm::ivec3 position(bx, by, bz);
                const Block& b = block(position, part);
                const float* data = part == kSharpPart ? b.sharp.data() : b.smooth.data();
                const glm::ivec3 begin = glm::max(first, position * kBlock);
                const glm::ivec3 end = glm::min(first + 4, (position + 1) * kBlock);
                for (int z = begin.z; z < end.z; ++z)
                    for (int y = begin.y; y < end.y; ++y)
                        for (int x = begin.x; x < end.x; ++x)
                            c[static_cast<size_t>((x - first.x) + 4 * (y - first.y) +
                                                  16 * (z - first.z))] =
                                data[(x & 3) + 4 * (y & 3) + 16 * (z & 3)];
            }

    FieldSample sample;
    glm::dvec3 slope{0.0};
    for (size_t z = 0; z < 4; ++z) {
        double plane = 0.0, plane_dx = 0.0, plane_dy = 0.0;
        for (size_t y = 0; y < 4; ++y) {
            const float* row = &c[4 * y + 16 * z];
            const double value = wx.value[0] * row[0] + wx.value[1] * row[1] +
                                 wx.value[2] * row[2] + wx.value[3] * row[3];
            plane += wy.value[y] * value;
            if constexpr (kGradient) {
                plane_dx += wy.value[y] * (wx.slope[0] * row[0] + wx.slope[1] * row[1] +
                                           wx.slope[2] * row[2] + wx.slope[3] * row[3]);
                plane_dy += wy.slope[y] * value;
            }
        }
        sample.value += wz.value[z] * plane;
        if constexpr (kGradient)
            slope +=
                glm::dvec3(wz.value[z] * plane_dx, wz.value[z] * plane_dy, wz.slope[z] * plane);
    }
    if constexpr (kGradient)
        sample.gradient = gradient_to_world_ * slope;
    return sample;
}

double Field::value(glm::dvec3 world_mm) {
    return evaluate<false>(world_mm, kSharpPart).value;
}

FieldSample Field::sharp(glm::dvec3 world_mm) {
    return evaluate<true>(world_mm, kSharpPart);
}

FieldSample Field::smooth(glm::dvec3 world_mm) {
    return evaluate<true>(world_mm, kSmoothPart);
}

double Field::trilinear(glm::dvec3 world_mm) {
    if (source_ == TouchSource::labels) // binary samples have no surface between them
        return value(world_mm);
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index, volume_->size()))
        return lowest_;
    const glm::dvec3 low = glm::floor(index), f = index - low;
    const glm::ivec3 cell(low);
    const Block& b = block(cell >> 2, kRawPart);
    const glm::ivec3 at = cell & 3;
    const float* c = &b.raw[static_cast<size_t>(at.x + kRaw * (at.y + kRaw * at.z))];
    const auto lerp = [](double a, double e, double t) { return a + t * (e - a); };
    const auto face = [&](const float* p) {
        return lerp(lerp(p[0], p[1], f.x), lerp(p[kRaw], p[kRaw + 1], f.x), f.y);
    };
    return lerp(face(c), face(c + kRaw * kRaw), f.z);
}

bool Field::is_clear(glm::dvec3 from_mm, glm::dvec3 to_mm, double margin_samples) const {
    if (!volume_)
        return true;
    const glm::dvec3 a = index_of(from_mm), b = index_of(to_mm);
    const bool labels = source_ == TouchSource::labels;
    const double margin = margin_samples + (labels || is_sharp_wide_ ? kWideReach : kSharpReach);
    const glm::dvec3 low = glm::clamp(glm::min(a, b) - margin, -kFarthest, kFarthest);
    const glm::dvec3 high = glm::clamp(glm::max(a, b) + margin, -kFarthest, kFarthest);
    // A blurred label reaches 0.5 only where some sample is one.
    return !may_reach(*volume_, glm::ivec3(glm::floor(low)), glm::ivec3(glm::ceil(high)),
                      labels ? 1.0 : iso_, labels ? 0.0 : overshoot_, lowest_);
}

double normal_blur_for(const Volume& volume, double iso) {
    // Differences of samples two apart, scaled to a standard deviation by the median of |x| of a
    // normal distribution; edges are few, so the median does not see them.
    std::vector<float> differences;
    const glm::uvec3 size = volume.size();
    const uint32_t stride = std::max(1u, std::max({size.x, size.y, size.z}) / 48u);
    double low = 0.0, high = 0.0;
    uint64_t low_count = 0, high_count = 0;
    for (uint32_t z = 0; z < size.z; z += stride)
        for (uint32_t y = 0; y < size.y; y += stride)
            for (uint32_t x = 0; x + 2 < size.x; x += stride) {
                const float a = volume.value({x, y, z}), b = volume.value({x + 2, y, z});
                if (!(a == a && b == b))
                    continue;
                differences.push_back(std::abs(a - b));
                (double{a} < iso ? low : high) += a;
                ++(double{a} < iso ? low_count : high_count);
            }
    if (differences.empty() || !low_count || !high_count)
        return 1.0;
    const auto middle = differences.begin() + static_cast<long>(differences.size() / 2);
    std::nth_element(differences.begin(), middle, differences.end());
    const double sigma = double{*middle} / (0.6745 * std::sqrt(2.0));
    const double contrast =
        high / static_cast<double>(high_count) - low / static_cast<double>(low_count);
    const double share = sigma / contrast;
    return share < 0.01 ? 0.0 : share < 0.04 ? 0.6 : 1.0;
}

} // namespace palpate::haptics
