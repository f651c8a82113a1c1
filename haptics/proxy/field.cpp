#include "haptics/proxy/field.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "haptics/proxy/samples.h"

namespace palpate::haptics {

namespace {

// Four floats at once; a row of a spline's 4x4x4 coefficients.
using Four = float __attribute__((vector_size(16)));
Four load(const float* from) {
    Four four;
    std::memcpy(&four, from, sizeof four);
    return four;
}
void store(float* to, Four four) {
    std::memcpy(to, &four, sizeof four);
}
float sum(Four four) {
    return (four[0] + four[1]) + (four[2] + four[3]);
}

int floor_of(double x) { // std::floor is a call on the oldest x86-64
    const int i = static_cast<int>(x);
    return i - (static_cast<double>(i) > x);
}

// Weights of samples floor(x) - 1 .. floor(x) + 2 of the uniform cubic B-spline and their slopes.
struct Weights {
    std::array<float, 4> value, slope;
};
Weights cubic_weights(float f) {
    const float r = 1.0f - f;
    return {{r * r * r / 6.0f, (4.0f - f * f * (6.0f - 3.0f * f)) / 6.0f,
             (4.0f - r * r * (6.0f - 3.0f * r)) / 6.0f, f * f * f / 6.0f},
            {-0.5f * r * r, f * (1.5f * f - 2.0f), r * (2.0f - 1.5f * r), 0.5f * f * f}};
}

// A Gaussian of 0.5 samples. Labels are binary, and where a wall of 1.5 samples is one sample thick
// the spline reaches 0.56 with this in its middle; with 0.6 samples it would reach 0.499.
constexpr std::array<float, 7> kLabelTaps{1.197946e-08f, 0.0002638651f, 0.1064508f,   0.7865707f,
                                          0.1064508f,    0.0002638651f, 1.197946e-08f};
constexpr std::array<float, 3> kSharpen{-1.0f / 6.0f, 4.0f / 3.0f, -1.0f / 6.0f};
// Its moments are those of the spline's inverse up to the fifth, not the third: what straightened
// steps are smooth enough for.
constexpr std::array<float, 5> kSharpenMore{1.0f / 36.0f, -5.0f / 18.0f, 1.5f, -5.0f / 18.0f,
                                            1.0f / 36.0f};

// The sharpened spline stays within its samples' range widened by this share of the range: half of
// (1.2222^3 - 1), where 1.2222 is the greatest sum of absolute weights on one axis (at the middle).
constexpr double kSharpOvershoot = 0.413;
constexpr double kSharpenMoreOvershoot = 0.743; // likewise, from 1.3542
// They read samples within this distance; the wide one, and that of labels, within 5.
constexpr int kSharpReach = 4, kWideReach = 5;

// Convolves kCount outputs with kTaps taps along one axis of a box; slabs of kRun values.
template <int kCount, int kTaps, int kRun>
void convolve(const float* from, float* to, int outer_count, const float* taps) {
    constexpr int kRead = kCount + kTaps - 1;
    for (int outer = 0; outer < outer_count; ++outer)
        for (int i = 0; i < kCount; ++i) {
            const float* source = from + kRun * (i + kRead * outer);
            float* target = to + kRun * (i + kCount * outer);
            int r = 0;
            for (; r + 4 <= kRun; r += 4) {
                Four total = taps[0] * load(source + r);
                for (int k = 1; k < kTaps; ++k)
                    total += taps[k] * load(source + r + k * kRun);
                store(target + r, total);
            }
            for (; r < kRun; ++r) {
                float total = taps[0] * source[r];
                for (int k = 1; k < kTaps; ++k)
                    total += taps[k] * source[r + k * kRun];
                target[r] = total;
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
    convolve<kSide, kTaps, kRead * kRead>(in, z.data(), 1, taps_z);
    convolve<kSide, kTaps, kRead>(z.data(), zy.data(), kSide, taps_y);
    // Along x four neighbours at a time, the last four overlapping.
    for (int row = 0; row < kSide * kSide; ++row)
        for (int x = 0;; x = kSide - 4) {
            const float* source = zy.data() + kRead * row + x;
            Four total = taps_x[0] * load(source);
            for (int k = 1; k < kTaps; ++k)
                total += taps_x[k] * load(source + k);
            store(out + kSide * row + x, total);
            if (x == kSide - 4)
                break;
        }
}

// The normal distribution's quantiles: how many standard deviations from the middle of a blurred
// step a sample of this share of it lies. Shares run from 0 to 1; those below 1/2000 say no more.
struct Quantiles {
    static constexpr int kLast = 2048;
    std::array<float, kLast + 1> of{};

    Quantiles() {
        constexpr double kLeast = 0.0005;
        double x = -3.3;
        for (int i = 0; i <= kLast / 2; ++i) {
            const double share = std::max(kLeast, i / double{kLast});
            for (int step = 0; step < 6; ++step) // Newton, from the one before
                x -= (0.5 * std::erfc(-x / std::sqrt(2.0)) - share) * std::sqrt(2.0 * M_PI) *
                     std::exp(0.5 * x * x);
            of[static_cast<size_t>(i)] = static_cast<float>(x);
            of[static_cast<size_t>(kLast - i)] = static_cast<float>(-x);
        }
    }
    float at(float share) const {
        const float place = std::clamp(share, 0.0f, 1.0f) * kLast;
        const int i = std::min(static_cast<int>(place), kLast - 1);
        const float low = of[static_cast<size_t>(i)], high = of[static_cast<size_t>(i + 1)];
        return low + (place - static_cast<float>(i)) * (high - low);
    }
};
const Quantiles& quantiles() {
    static const Quantiles table;
    return table;
}

// Points this far outside are as free as any; indices stay within int.
constexpr double kFarthest = 1e6;

bool is_far(glm::dvec3 index, glm::uvec3 size) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(index[axis] > -8.0 && index[axis] < double(size[axis]) + 8.0))
            return true;
    return false;
}

bool is_same_grid(const Grid& a, const Grid& b) {
    return a.size == b.size && a.world_from_index == b.world_from_index;
}

} // namespace

Field::Field() {
    quantiles(); // made here, not by the first tick
}

void Field::follow(const Volume& volume, TouchSource source, double iso, double blur,
                   Plateaus plateaus) {
    volume_ = &volume;
    lacked_brick_ = false;
    const bool labels = source == TouchSource::labels;
    if (labels) {
        iso = 0.5;
        blur = 1.0;
    }
    // A step can be straightened where the surface is well within it and noise is not.
    const double width = plateaus.solid - plateaus.free;
    if (labels || blur > 0.0 || !(iso > plateaus.free + 0.1 * width) ||
        !(iso < plateaus.solid - 0.1 * width))
        plateaus = {};
    const bool same_settings =
        settings_ != 0 && source == source_ && blur == blur_ && plateaus == plateaus_;
    if (same_settings && iso == iso_ && volume.version() == version_)
        return;
    const ValueRange range = volume.range();
    const bool plain = labels || range.empty();
    if (!same_settings || (!plain && range.min < lowest_) || lowest_ >= iso ||
        !is_same_grid(volume.grid(), grid_)) {
        ++settings_;
        source_ = source;
        base_ = double{static_cast<float>(iso)};
        blur_ = blur;
        plateaus_ = plateaus;
        lowest_ = plain ? 0.0f : std::min(range.min, static_cast<float>(iso) - 1.0f);
        grid_ = volume.grid();
        derive();
    }
    ++generation_;
    iso_ = iso;
    threshold_ = labels ? 0.0f : stored(static_cast<float>(iso));
    version_ = volume.version();
    contrast_ = plain ? 1.0 : std::max(1e-9, double{range.max} - double{lowest_});
}

// What follows from grid, blur and plateaus.
void Field::derive() {
    index_from_world_ = index_from_world(grid_);
    gradient_to_world_ = glm::transpose(glm::dmat3(index_from_world_));
    const glm::dvec3 spacing = spacing_mm(grid_);
    smallest_mm_ = std::min({spacing.x, spacing.y, spacing.z});
    const double coarsest = std::max({spacing.x, spacing.y, spacing.z});
    is_even_ = coarsest < 1.05 * smallest_mm_;
    is_sharp_wide_ = !is_even_ && blur_ > 0.0;
    // What is left beyond is 4e-6 of the middle at 0.6 samples, 3e-4 at 1.
    smooth_reach_ = blur_ == 0.0 ? 1 : !is_even_ ? kFarReach : blur_ <= 0.6 ? 2 : kReach;
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
        const double sigma = std::min(blur_ * coarsest / spacing[static_cast<int>(axis)], 1.9);
        float sum = 0.0f;
        for (int i = -kFarReach; i <= kFarReach; ++i) {
            const bool counts = std::abs(i) <= smooth_reach_;
            const double weight = sigma > 0.05 ? std::exp(-0.5 * i * i / (sigma * sigma)) : i == 0;
            taps_[axis][static_cast<size_t>(i + kFarReach)] =
                counts ? static_cast<float>(weight) : 0.0f;
            sum += taps_[axis][static_cast<size_t>(i + kFarReach)];
        }
        for (float& tap : taps_[axis])
            tap /= sum;
        if (blur_ == 0.0) { // half way to the sharp view: see the header
            taps_[axis].fill(0.0f);
            taps_[axis][kFarReach - 1] = taps_[axis][kFarReach + 1] = -1.0f / 12.0f;
            taps_[axis][kFarReach] = 7.0f / 6.0f;
        }
    }
    // q(share) steps about the middle, made as steep at the base as the samples are.
    straightened_ = plateaus_.solid > plateaus_.free;
    if (straightened_) {
        overshoot_ = is_even_ ? kSharpenMoreOvershoot : kSharpOvershoot;
        const double width = plateaus_.solid - plateaus_.free;
        share_scale_ = static_cast<float>(1.0 / width);
        const auto at_base =
            double{quantiles().at(static_cast<float>((base_ - plateaus_.free) / width))};
        const double steepness = width * std::exp(-0.5 * at_base * at_base) / std::sqrt(2.0 * M_PI);
        step_scale_ = static_cast<float>(steepness);
        step_at_base_ = static_cast<float>(steepness * at_base);
    }
}

float Field::stored(float sample) const {
    if (source_ == TouchSource::labels)
        return sample > 0.0f ? 0.5f : -0.5f;
    if (!straightened_)
        return sample - static_cast<float>(base_);
    const float share = (sample - static_cast<float>(plateaus_.free)) * share_scale_;
    return step_scale_ * quantiles().at(share) - step_at_base_;
}

void Field::make_stored(std::span<float> samples) const {
    if (source_ != TouchSource::labels && !straightened_) { // the common case, four at a time
        const auto base = static_cast<float>(base_);
        for (float& sample : samples)
            sample -= base;
    } else {
        for (float& sample : samples)
            sample = stored(sample);
    }
}

// How far a part reads beyond the box of its own numbers.
int Field::reach_of(Part part) const {
    if (straightened_)
        return is_even_ ? 2 : 1;
    if (part == kSmoothPart)
        return smooth_reach_;
    return source_ == TouchSource::labels || is_sharp_wide_ ? kReach : 1;
}

// The samples that a part is made of: their first, and how many on each axis.
Field::Box Field::box_of(glm::ivec3 position, Part part) const {
    if (part != kRawPart || source_ == TouchSource::labels) {
        // Of labels, raw stands for whatever a cell's or its neighbours' blurred values come from.
        const int reach = part == kRawPart ? reach_of(kSharpPart) + 1 : reach_of(part);
        return {kBlock * position - 1 - reach, kSpline + 2 * reach};
    }
    return {kBlock * position - 1, kSpline};
}

// Calls visit(brick, block) for the blocks of 8x8x8 samples that a box has a part in.
template <class Visit>
void Field::for_blocks(Box box, const Visit& visit) const {
    const glm::ivec3 low = glm::max(box.start, glm::ivec3(0));
    const glm::ivec3 high = glm::min(box.start + box.side, glm::ivec3(volume_->size())) - 1;
    for (int z = low.z >> 3; z <= high.z >> 3; ++z)
        for (int y = low.y >> 3; y <= high.y >> 3; ++y)
            for (int x = low.x >> 3; x <= high.x >> 3; ++x) {
                const glm::uvec3 at = glm::uvec3(x, y, z) * kBlockSide;
                visit(volume_->brick(at / kBrickSide), block_of(at % kBrickSide));
            }
}

// A hash of the stamps of everything in a box; never 0. Two sets of stamps share it once in 2^64.
uint64_t Field::stamps_of(Box box) const {
    uint64_t hash = 1;
    for_blocks(box, [&](const Brick& brick, uint32_t block) {
        hash = (hash ^ brick.block_stamp(block)) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 29;
    });
    return hash ? hash : 1;
}

void Field::renew(Block& block, glm::ivec3 position, Part part) {
    if (block.position != position || block.settings != settings_) {
        block.position = position;
        block.settings = settings_;
        block.made = {};
    }
    Made& made = block.made[part];
    const Box box = box_of(position, part);
    const uint64_t stamps = stamps_of(box);
    if (made.stamps != stamps) {
        made.lacks = false;
        if (part == kRawPart)
            bound(block, box);
        else
            fill(block, box, part);
        made.stamps = stamps;
    }
    made.generation = generation_;
}

// Of samples no more is made than a bound, until they are needed.
void Field::bound(Block& block, Box box) {
    ValueRange range;
    for_blocks(box, [&](const Brick& brick, uint32_t b) {
        range.include(brick.is_constant() ? brick.range() : brick.block_range(b));
    });
    block.highest = range.empty() ? -INFINITY : stored(range.max);
    block.has_raw = block.has_near = false;
}

void Field::fill_raw(Block& block) {
    const bool lacks = copy_resident(*volume_, kBlock * block.position - 1, glm::ivec3(kSpline),
                                     lowest_, block.raw.data());
    block.made[kRawPart].lacks = lacks;
    lacked_brick_ |= lacks;
    make_stored(block.raw);
    block.has_raw = true;
}

const Field::Block& Field::raw_block(glm::ivec3 position) {
    Block& b = block(position, kRawPart);
    if (!b.has_raw)
        fill_raw(b);
    return b;
}

// The cells of a block that may be solid, they or their neighbours.
uint64_t Field::near(glm::ivec3 position) {
    Block& b = block(position, kRawPart);
    if (b.has_near && b.near_threshold == threshold_)
        return b.near;
    b.has_near = true;
    b.near_threshold = threshold_;
    if (b.highest < threshold_)
        return b.near = 0;
    if (source_ == TouchSource::labels)
        return b.near = ~uint64_t{0};
    if (!b.has_raw)
        fill_raw(b);
    // A cell's and its neighbours' corners are the four samples on each axis that begin with its
    // place in the block. Rows of bits, or-ed four at a time along x, y and z.
    b.near = 0;
    std::array<uint32_t, kSpline * kSpline> rows{};
    for (int row = 0; row < kSpline * kSpline; ++row) {
        uint32_t bits = 0;
        for (int x = 0; x < kSpline; ++x)
            bits |= uint32_t{b.raw[static_cast<size_t>(x + kSpline * row)] >= threshold_} << x;
        rows[static_cast<size_t>(row)] = (bits | bits >> 1 | bits >> 2 | bits >> 3) & 15u;
    }
    for (size_t z = 0; z < size_t{kBlock}; ++z)
        for (size_t y = 0; y < size_t{kBlock}; ++y) {
            uint64_t bits = 0;
            for (size_t i = 0; i < 16; ++i)
                bits |= rows[y + i % 4 + size_t{kSpline} * (z + i / 4)];
            b.near |= bits << (4 * (y + 4 * z));
        }
    return b.near;
}

void Field::fill(Block& block, Box box, Part part) {
    constexpr int kMostRead = kSpline + 2 * kFarReach;
    std::array<float, kMostRead * kMostRead * kMostRead> samples;
    block.made[part].lacks =
        copy_resident(*volume_, box.start, glm::ivec3(box.side), lowest_, samples.data());
    make_stored({samples.data(), static_cast<size_t>(box.side * box.side * box.side)});
    const bool smooth = part == kSmoothPart;
    const int reach = reach_of(part);
    std::array<const float*, 3> taps;
    for (size_t axis = 0; axis < 3; ++axis)
        taps[axis] = straightened_              ? (is_even_ ? kSharpenMore.data() : kSharpen.data())
                     : smooth && !straightened_ ? &taps_[axis][size_t(kFarReach - reach)]
                     : source_ == TouchSource::labels ? kLabelTaps.data()
                     : is_sharp_wide_                 ? sharp_taps_[axis].data()
                                                      : kSharpen.data();
    float* out = smooth ? block.smooth.data() : block.sharp.data();
    if (reach == 1)
        filter_box<kSpline, 3>(samples.data(), taps[0], taps[1], taps[2], out);
    else if (reach == 2)
        filter_box<kSpline, 5>(samples.data(), taps[0], taps[1], taps[2], out);
    else if (reach == kReach)
        filter_box<kSpline, 2 * kReach + 1>(samples.data(), taps[0], taps[1], taps[2], out);
    else
        filter_box<kSpline, 2 * kFarReach + 1>(samples.data(), taps[0], taps[1], taps[2], out);
}

inline Field::Block& Field::block(glm::ivec3 position, Part part) {
    const glm::ivec3 slot = position & (kTable - 1);
    Block& block = blocks_[static_cast<size_t>(slot.x + kTable * (slot.y + kTable * slot.z))];
    if (block.made[part].generation != generation_ || block.position != position)
        renew(block, position, part);
    lacked_brick_ |= block.made[part].lacks;
    return block;
}

// The value and slope of a spline at a place, from the numbers of its block.
struct Field::Place {
    glm::ivec3 block{}, cell{}; // the cell within the block
    Weights x, y, z;

    explicit Place(glm::dvec3 index) {
        const glm::ivec3 low(floor_of(index.x), floor_of(index.y), floor_of(index.z));
        block = low >> 2;
        cell = low & 3;
        x = cubic_weights(static_cast<float>(index.x - low.x));
        y = cubic_weights(static_cast<float>(index.y - low.y));
        z = cubic_weights(static_cast<float>(index.z - low.z));
    }
    const float* first(const float* numbers) const {
        return numbers + cell.x + kSpline * (cell.y + kSpline * cell.z);
    }
    float value(const float* numbers) const {
        const float* at = first(numbers);
        Four total{};
        for (int k = 0; k < 4; ++k) {
            Four plane{};
            for (int j = 0; j < 4; ++j)
                plane += y.value[size_t(j)] * load(at + kSpline * (j + kSpline * k));
            total += z.value[size_t(k)] * plane;
        }
        return sum(total * load(x.value.data()));
    }
    std::pair<float, glm::vec3> value_and_slope(const float* numbers) const {
        const float* at = first(numbers);
        Four total{}, dy{}, dz{};
        for (int k = 0; k < 4; ++k) {
            Four plane{}, plane_dy{};
            for (int j = 0; j < 4; ++j) {
                const Four row = load(at + kSpline * (j + kSpline * k));
                plane += y.value[size_t(j)] * row;
                plane_dy += y.slope[size_t(j)] * row;
            }
            total += z.value[size_t(k)] * plane;
            dy += z.value[size_t(k)] * plane_dy;
            dz += z.slope[size_t(k)] * plane;
        }
        const Four wx = load(x.value.data());
        return {sum(total * wx), {sum(total * load(x.slope.data())), sum(dy * wx), sum(dz * wx)}};
    }
};

FieldSample Field::evaluate(const Place& place, Part part) {
    const Block& b = block(place.block, part);
    const auto [value, slope] =
        place.value_and_slope(part == kSharpPart ? b.sharp.data() : b.smooth.data());
    return {base_ + double{value}, gradient_to_world_ * glm::dvec3(slope)};
}

double Field::value(glm::dvec3 world_mm) {
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index, volume_->size()))
        return base_ + double{stored(lowest_)};
    const Place place(index);
    return base_ + double{place.value(block(place.block, kSharpPart).sharp.data())};
}

FieldSample Field::sharp(glm::dvec3 world_mm) {
    return both(world_mm, true, false).sharp;
}

FieldSample Field::smooth(glm::dvec3 world_mm) {
    return both(world_mm, false, true).smooth;
}

Field::Both Field::both(glm::dvec3 world_mm, bool sharp, bool smooth) {
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index, volume_->size()))
        return {{base_ + double{stored(lowest_)}, {}}, {base_ + double{stored(lowest_)}, {}}};
    const Place place(index);
    Both found;
    if (straightened_) { // one view is both
        found.sharp = found.smooth = evaluate(place, kSharpPart);
        return found;
    }
    if (sharp)
        found.sharp = evaluate(place, kSharpPart);
    if (smooth)
        found.smooth = evaluate(place, kSmoothPart);
    return found;
}

namespace {

// Of the numbers of a block, in one of its cells.
template <int kSide>
float trilinear_in(const float* numbers, glm::ivec3 cell, glm::vec3 f) {
    const float* c = numbers + (cell.x + 1) + kSide * ((cell.y + 1) + kSide * (cell.z + 1));
    const auto lerp = [](float a, float b, float t) { return a + t * (b - a); };
    const auto face = [&](const float* p) {
        return lerp(lerp(p[0], p[1], f.x), lerp(p[kSide], p[kSide + 1], f.x), f.y);
    };
    return lerp(face(c), face(c + kSide * kSide), f.z);
}

} // namespace

double Field::trilinear(glm::dvec3 world_mm) {
    if (source_ == TouchSource::labels) // binary samples have no surface between them
        return value(world_mm);
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index, volume_->size()))
        return base_ + double{stored(lowest_)};
    const glm::ivec3 cell(floor_of(index.x), floor_of(index.y), floor_of(index.z));
    return base_ + double{trilinear_in<kSpline>(raw_block(cell >> 2).raw.data(), cell & 3,
                                                glm::vec3(index - glm::dvec3(cell)))};
}

// Where a tool's points lie: counted from the corner of a block that is lower than all of them, so
// that places are positive, and small enough for floats where the tool is.
struct Field::Around {
    glm::ivec3 corner;
    glm::vec3 from;

    Around(glm::dvec3 at, double reach)
        : corner(floor_of((at.x - reach) / kBlock) - 1, floor_of((at.y - reach) / kBlock) - 1,
                 floor_of((at.z - reach) / kBlock) - 1),
          from(at - glm::dvec3(kBlock * corner)) {}
};

// What was found out about the blocks around a tool, each on its first visit; where they are too
// many for that, on each.
template <class Found, class LookUp>
class Field::Known {
 public:
    Known(const Around& around, double reach, const LookUp& look_up)
        : corner_(around.corner),
          few_(2.0 * reach + 2.0 * kBlock + 1.0 <= kBlock * kTable),
          look_up_(look_up) {}
    Found at(glm::ivec3 block) {
        if (!few_)
            return look_up_(corner_ + block);
        const auto n = static_cast<size_t>(block.x + kTable * (block.y + kTable * block.z));
        if (!(is_known_[n / 64] >> (n % 64) & 1)) {
            found_[n] = look_up_(corner_ + block);
            is_known_[n / 64] |= uint64_t{1} << (n % 64);
        }
        return found_[n];
    }

 private:
    static constexpr size_t kCount = size_t(kTable * kTable * kTable);
    glm::ivec3 corner_;
    bool few_;
    const LookUp& look_up_;
    std::array<uint64_t, kCount / 64> is_known_{};
    std::array<Found, kCount> found_;
};

uint32_t Field::near_points(glm::dvec3 at_mm, std::span<const glm::vec3> offsets,
                            double reach_samples, uint16_t* found) {
    const glm::dvec3 at = index_of(at_mm);
    if (!volume_ || !(glm::length(at) < kFarthest))
        return 0;
    const Around around(at, reach_samples);
    const glm::ivec3 last = glm::ivec3(volume_->size()) / kBlock + 1;
    const auto look_up = [&](glm::ivec3 position) {
        return glm::any(glm::lessThan(position, glm::ivec3(-2))) ||
                       glm::any(glm::greaterThan(position, last))
                   ? 0
                   : near(position);
    };
    Known<uint64_t, decltype(look_up)> known(around, reach_samples, look_up);
    uint32_t count = 0;
    for (uint32_t i = 0; i < offsets.size(); ++i) {
        const glm::ivec3 cell(around.from + offsets[i]);
        const glm::ivec3 in = cell & 3;
        found[count] = static_cast<uint16_t>(i);
        count += known.at(cell >> 2) >> (in.x + 4 * (in.y + 4 * in.z)) & 1;
    }
    return count;
}

uint32_t Field::solid_points(glm::dvec3 at_mm, std::span<const glm::vec3> offsets,
                             double reach_samples, std::span<const uint16_t> named, Inside* found) {
    const glm::dvec3 at = index_of(at_mm);
    if (!volume_ || !(glm::length(at) < kFarthest))
        return 0;
    const Around around(at, reach_samples);
    const bool labels = source_ == TouchSource::labels;
    const auto look_up = [&](glm::ivec3 position) {
        return labels ? block(position, kSharpPart).sharp.data() : raw_block(position).raw.data();
    };
    Known<const float*, decltype(look_up)> known(around, reach_samples, look_up);
    uint32_t count = 0;
    for (const uint16_t i : named) {
        const glm::vec3 p = around.from + offsets[i];
        const glm::ivec3 cell(p);
        const float* numbers = known.at(cell >> 2);
        const float value = labels ? Place(glm::dvec3(p)).value(numbers)
                                   : trilinear_in<kSpline>(numbers, cell & 3, p - glm::vec3(cell));
        found[count] = {value - threshold_, i};
        count += value >= threshold_;
    }
    return count;
}

bool Field::is_clear(glm::dvec3 from_mm, glm::dvec3 to_mm, double margin_samples) const {
    if (!volume_)
        return true;
    const glm::dvec3 a = index_of(from_mm), b = index_of(to_mm);
    const bool labels = source_ == TouchSource::labels;
    const double margin = margin_samples + (labels || is_sharp_wide_ ? kWideReach : kSharpReach);
    const glm::dvec3 low = glm::clamp(glm::min(a, b) - margin, -kFarthest, kFarthest);
    const glm::dvec3 high = glm::clamp(glm::max(a, b) + margin, -kFarthest, kFarthest);
    bool lacks_some = false;
    const ValueRange range =
        range_about(*volume_, glm::ivec3(glm::floor(low)), glm::ivec3(glm::ceil(high)), lacks_some);
    if (range.empty())
        return true;
    const auto highest = double{stored(range.max)};
    const auto lowest = double{stored(lacks_some ? std::min(range.min, lowest_) : range.min)};
    // A blurred label reaches 0.5 only where some sample is one.
    return highest + (labels ? 0.0 : overshoot_ * (highest - lowest)) < double{threshold_};
}

} // namespace palpate::haptics
