#include "engine/segment/click_region.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/volume/box.h"
#include "engine/volume/grid.h"

namespace palpate {

namespace {

constexpr size_t kLookEvery = 65536; // samples, for a stop
// A quarter of values that are normally distributed lies within so many deviations of the mean.
constexpr double kQuarter = 0.3186;

// A box of samples with their values.
struct ValueBox {
    glm::ivec3 low{}, size{};
    std::vector<float> values{};

    bool holds(glm::ivec3 at) const { // in the box's own places
        return glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
               glm::all(glm::lessThan(at, size));
    }
    size_t index(glm::ivec3 at) const {
        return size_t(at.x) + size_t(size.x) * (size_t(at.y) + size_t(size.y) * size_t(at.z));
    }
};

// A box of places without values, as far as it lies in the volume.
ValueBox box_within(const Grid& grid, glm::ivec3 low, glm::ivec3 high) {
    ValueBox box{glm::max(low, glm::ivec3(0)), {}, {}};
    box.size = glm::min(high, glm::ivec3(grid.size) - 1) - box.low + 1;
    return box;
}

// The box about a sample that holds all within so many mm.
ValueBox box_about(const Grid& grid, glm::uvec3 at, double reach_mm) {
    const glm::dmat3 rows = glm::transpose(glm::dmat3(index_from_world(grid)));
    const glm::dvec3 reach =
        reach_mm * glm::dvec3(glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2]));
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    const glm::dvec3 middle(at);
    return box_within(grid, glm::ivec3(glm::ceil(glm::max(middle - reach, glm::dvec3(0.0)))),
                      glm::ivec3(glm::floor(glm::min(middle + reach, last))));
}

// Reads a box's values, a layer of bricks after the other. Where it was stopped, some are 0:
// whoever calls looks at the stop before the result leaves.
ValueBox read_values(const Volume& volume, ValueBox box, const Task& task) {
    const size_t layer = size_t(box.size.x) * size_t(box.size.y);
    box.values.resize(layer * size_t(box.size.z));
    constexpr int kSide = int(kBrickSide);
    for (int z = 0, end = 0; z < box.size.z && !task.stop.stop_requested(); z = end) {
        end = std::min(box.size.z, ((box.low.z + z) / kSide + 1) * kSide - box.low.z);
        const glm::ivec3 size(box.size.x, box.size.y, end - z);
        read_box(volume, box.low + glm::ivec3(0, 0, z), size, packed(glm::uvec3(size)),
                 box.values.data() + layer * size_t(z));
    }
    return box;
}

float median_of(std::vector<float>& values) { // not empty; the lower one of an even number
    const auto middle = values.begin() + static_cast<ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// The values like those near a sample; nothing where it was stopped.
std::optional<std::pair<double, double>> values_like(const Volume& volume,
                                                     const LocalThreshold& click, float own,
                                                     const Task& task) {
    const glm::ivec3 at(click.at);
    const glm::dmat3 mm_from_index(volume.grid().world_from_index);
    std::vector<float> near;
    const auto take = [&](const ValueBox& box, bool in_block) {
        for (int z = 0; z < box.size.z && !task.stop.stop_requested(); ++z)
            for (int y = 0; y < box.size.y; ++y)
                for (int x = 0; x < box.size.x; ++x) {
                    const glm::ivec3 by = box.low + glm::ivec3(x, y, z) - at;
                    const bool is_of_block =
                        glm::all(glm::lessThanEqual(glm::abs(by), glm::ivec3(1)));
                    const float value = box.values[box.index({x, y, z})];
                    if (is_of_block == in_block && !std::isnan(value) &&
                        (in_block || glm::length(mm_from_index * glm::dvec3(by)) <= click.near_mm))
                        near.push_back(value);
                }
    };
    const Grid& grid = volume.grid();
    take(read_values(volume, box_within(grid, at - 1, at + 1), task), true);
    take(read_values(volume, box_about(grid, click.at, click.near_mm), task), false);
    if (task.stop.stop_requested())
        return std::nullopt;
    std::vector<float>& alike = near; // the quarter of them
    const auto count = static_cast<ptrdiff_t>((near.size() + 3) / 4);
    // Of two that differ as much, the lower one first: the order of samples has no effect.
    std::nth_element(near.begin(), near.begin() + (count - 1), near.end(), [&](float a, float b) {
        return std::pair(std::abs(a - own), a) < std::pair(std::abs(b - own), b);
    });
    const double farthest = double{std::abs(near[size_t(count - 1)] - own)};
    alike.resize(size_t(count));
    const double middle = double{median_of(alike)};
    const ValueRange range = volume.range();
    const double spread =
        std::max(farthest / kQuarter, 1e-3 * (double{range.max} - double{range.min}));
    return std::pair(std::min(double{own}, middle - click.times * spread),
                     std::max(double{own}, middle + click.times * spread));
}

// The least box about what is taken in a box.
Result<ClickRegion> cropped(const ValueBox& box, const std::vector<uint8_t>& taken,
                            const Task& task) {
    glm::ivec3 low(box.size), high(-1);
    for (int z = 0; z < box.size.z && !task.stop.stop_requested(); ++z)
        for (int y = 0; y < box.size.y; ++y)
            for (int x = 0; x < box.size.x; ++x)
                if (taken[box.index({x, y, z})]) {
                    low = glm::min(low, glm::ivec3(x, y, z));
                    high = glm::max(high, glm::ivec3(x, y, z));
                }
    if (task.stop.stop_requested())
        return stopped();
    ClickRegion region;
    region.low = glm::uvec3(box.low + low);
    region.size = glm::uvec3(high - low + 1);
    for (int z = low.z; z <= high.z && !task.stop.stop_requested(); ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                region.taken.push_back(taken[box.index({x, y, z})] ? 1 : 0);
                region.count += region.taken.back();
            }
    if (task.stop.stop_requested())
        return stopped();
    return region;
}

bool is_sample(const Volume& volume, glm::uvec3 at) {
    return glm::all(glm::lessThan(at, volume.size()));
}

// A layer of samples with a rim of one more, which is below every value.
class Layer {
 public:
    Layer(const ValueBox& box, int across, int down)
        : size_(box.size[across] + 2, box.size[down] + 2) {
        values_.assign(size_t(size_.x) * size_t(size_.y), -std::numeric_limits<float>::infinity());
        for (int y = 0; y < box.size[down]; ++y)
            for (int x = 0; x < box.size[across]; ++x) {
                const float value = box.values[size_t(x) + size_t(box.size[across]) * size_t(y)];
                if (!std::isnan(value))
                    values_[index({x + 1, y + 1})] = value;
            }
    }

    using Set = std::vector<uint8_t>;

    float at(glm::ivec2 place) const { return values_[index(place)]; }
    size_t index(glm::ivec2 at) const { return size_t(at.x) + size_t(size_.x) * size_t(at.y); }

    // The piece of what is_of(index) holds that a place belongs to; joined over corners, too.
    template <class IsOf>
    Set piece(glm::ivec2 from, bool over_corners, const IsOf& is_of) const {
        Set piece(values_.size());
        std::vector<glm::ivec2> front{from};
        piece[index(from)] = 1;
        while (!front.empty()) {
            const glm::ivec2 at = front.back();
            front.pop_back();
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    const glm::ivec2 next = at + glm::ivec2(dx, dy);
                    if ((dx != 0 && dy != 0 && !over_corners) || next.x < 0 || next.y < 0 ||
                        next.x >= size_.x || next.y >= size_.y)
                        continue;
                    const size_t i = index(next);
                    if (!piece[i] && is_of(i))
                        piece[i] = 1, front.push_back(next);
                }
        }
        return piece;
    }
    // All that a piece does not surround, from the rim on.
    Set outside(const Set& piece_of, bool over_corners) const {
        return piece({0, 0}, over_corners, [&](size_t i) { return !piece_of[i]; });
    }
    Set pieces_at_or_above(float level, glm::ivec2 from) const {
        return piece(from, false, [&](size_t i) { return values_[i] >= level; });
    }
    Set pieces_below(float level, glm::ivec2 from) const {
        return piece(from, true, [&](size_t i) { return values_[i] < level; });
    }

 private:
    glm::ivec2 size_;
    std::vector<float> values_;
};

// The nearest corners of a square on either side of the value at a place in it.
struct Sides {
    float level;
    glm::ivec2 above, below;
};

Result<Sides> sides_at(const Layer& layer, glm::dvec2 place) {
    const glm::ivec2 first(glm::floor(place));
    const glm::dvec2 share = place - glm::dvec2(first);
    constexpr std::array<glm::ivec2, 4> kCorners{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
    double sum = 0.0;
    for (const glm::ivec2 corner : kCorners) {
        const glm::dvec2 weight = glm::mix(1.0 - share, share, glm::dvec2(corner));
        if (weight.x * weight.y > 0.0)
            sum += weight.x * weight.y * double{layer.at(first + corner)};
    }
    Sides found{static_cast<float>(sum), {}, {}};
    double above = std::numeric_limits<double>::infinity(), below = above;
    for (const glm::ivec2 corner : kCorners) {
        const glm::dvec2 by = share - glm::dvec2(corner);
        const bool is_above = layer.at(first + corner) >= found.level;
        double& nearest = is_above ? above : below;
        if (const double far = glm::dot(by, by); far < nearest) {
            nearest = far;
            (is_above ? found.above : found.below) = first + corner;
        }
    }
    if (!std::isfinite(found.level))
        return fail("level trace: expected a place with data, found none");
    if (!std::isfinite(above) || !std::isfinite(below))
        return fail(
            "level trace: expected grey values that differ about the place, found {:g} alone",
            found.level);
    return found;
}

} // namespace

bool ClickRegion::has(glm::uvec3 sample) const {
    const glm::uvec3 at = sample - low; // wraps below
    return glm::all(glm::lessThan(at, size)) &&
           taken[at.x + size_t{size.x} * (at.y + size_t{size.y} * at.z)] != 0;
}

uint64_t samples_in_reach(const Grid& grid, glm::uvec3 at, double reach_mm) {
    const glm::uvec3 size(box_about(grid, at, reach_mm).size);
    return uint64_t{size.x} * size.y * size.z;
}

Result<ClickRegion> local_region(const Volume& volume, const LocalThreshold& click,
                                 const Task& task) {
    if (!is_sample(volume, click.at))
        return fail("local threshold: expected a sample of the volume, found {}, {}, {}",
                    click.at.x, click.at.y, click.at.z);
    const float own = volume.value(click.at);
    if (std::isnan(own))
        return fail("local threshold: expected a sample with data, found none");
    const auto like = values_like(volume, click, own, task);
    if (!like)
        return stopped();
    const double least = like->first, most = like->second;
    const ValueBox box =
        read_values(volume, box_about(volume.grid(), click.at, click.reach_mm), task);
    const glm::dmat3 mm_from_index(volume.grid().world_from_index);
    const glm::ivec3 middle = glm::ivec3(click.at) - box.low;
    const auto is_alike = [&](glm::ivec3 at) {
        const float value = box.values[box.index(at)];
        return value >= least && value <= most &&
               glm::length(mm_from_index * glm::dvec3(at - middle)) <= click.reach_mm;
    };
    std::vector<uint8_t> taken(box.values.size());
    std::vector<glm::ivec3> front{middle};
    taken[box.index(middle)] = 1;
    for (size_t served = 0; !front.empty(); ++served) {
        if (served % kLookEvery == 0 && task.stop.stop_requested())
            return stopped();
        const glm::ivec3 at = front.back();
        front.pop_back();
        for (int axis = 0; axis < 3; ++axis)
            for (const int by : {-1, 1}) {
                glm::ivec3 next = at;
                next[axis] += by;
                if (box.holds(next) && !taken[box.index(next)] && is_alike(next)) {
                    taken[box.index(next)] = 1;
                    front.push_back(next);
                }
            }
    }
    PALPATE_TRY(ClickRegion region, cropped(box, taken, task));
    region.least = least;
    region.most = most;
    return region;
}

Result<ClickRegion> level_region(const Volume& volume, const LevelTrace& click, const Task& task) {
    const int axis = click.axis, across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
    const glm::dvec3 last = glm::dvec3(volume.size()) - 1.0;
    if (!glm::all(glm::greaterThanEqual(click.at, glm::dvec3(-0.5))) ||
        !glm::all(glm::lessThanEqual(click.at, last + 0.5)))
        return fail("level trace: expected a place in the volume, found sample {:g}, {:g}, {:g}",
                    click.at.x, click.at.y, click.at.z);
    if (volume.size()[across] < 2 || volume.size()[down] < 2)
        return fail("level trace: expected a layer of at least 2 x 2 samples, found {} x {}",
                    volume.size()[across], volume.size()[down]);
    glm::ivec3 low(0), high(last);
    low[axis] = high[axis] =
        static_cast<int>(std::clamp(std::round(click.at[axis]), 0.0, last[axis]));
    const ValueBox box = read_values(volume, box_within(volume.grid(), low, high), task);
    if (task.stop.stop_requested())
        return stopped();
    const Layer layer(box, across, down);
    const glm::dvec2 most = glm::dvec2(last[across], last[down]);
    // In the layer with its rim, within the squares of samples.
    const glm::dvec2 place = glm::clamp(glm::dvec2(click.at[across], click.at[down]),
                                        glm::dvec2(0.0), most - 1e-9 * (1.0 + most)) +
                             1.0;
    PALPATE_TRY(const Sides sides, sides_at(layer, place));
    if (task.stop.stop_requested())
        return stopped();
    const Layer::Set above = layer.pieces_at_or_above(sides.level, sides.above);
    Layer::Set outside = layer.outside(above, true);
    if (!outside[layer.index(sides.below)]) // the lower side lies in a hole of the higher one
        outside = layer.outside(layer.pieces_below(sides.level, sides.below), false);
    if (task.stop.stop_requested())
        return stopped();
    std::vector<uint8_t> taken;
    for (int y = 0; y < box.size[down]; ++y)
        for (int x = 0; x < box.size[across]; ++x)
            taken.push_back(!outside[layer.index({x + 1, y + 1})]);
    PALPATE_TRY(ClickRegion region, cropped(box, taken, task));
    region.least = region.most = sides.level;
    return region;
}

Result<ClickRegion> region_of(const Volume& volume, const RegionClick& click, const Task& task) {
    if (const auto* local = std::get_if<LocalThreshold>(&click))
        return local_region(volume, *local, task);
    return level_region(volume, std::get<LevelTrace>(click), task);
}

Result<Volume> volume_of(const ClickRegion& region, const Grid& grid, uint16_t label,
                         const Task& task) {
    const ScalarType type = label > 255 ? ScalarType::u16 : ScalarType::u8;
    return make_bricks(grid, type, task, [&](glm::uvec3 position) {
        const glm::uvec3 first = position * kBrickSide;
        const glm::uvec3 valid = glm::min(grid.size - first, glm::uvec3(kBrickSide));
        const bool meets = glm::all(glm::lessThan(first, region.low + region.size)) &&
                           glm::all(glm::lessThan(region.low, first + valid));
        return visit_scalar(type, [&]<class T>(T) -> BrickPtr {
            if (!meets) {
                const T zero{0};
                return Brick::make(std::span<const T>(&zero, 1), valid);
            }
            std::vector<T> samples(kBrickSamples);
            for (uint32_t z = 0; z < valid.z; ++z)
                for (uint32_t y = 0; y < valid.y; ++y)
                    for (uint32_t x = 0; x < valid.x; ++x)
                        if (region.has(first + glm::uvec3(x, y, z)))
                            samples[offset_in_brick({x, y, z})] = static_cast<T>(label);
            return Brick::make(std::span<const T>(samples), valid);
        });
    });
}

} // namespace palpate
