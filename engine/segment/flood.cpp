#include "engine/segment/flood.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/segment/brick_array.h"

namespace palpate {

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr uint64_t kMostBricks = uint64_t{1} << 17; // a place is 32 bits, 15 of them in its brick

uint32_t bucket_of(float height) {
    return std::bit_cast<uint32_t>(height) >> 16; // ascending, as height >= 0
}

// A sample: its brick's number in the upper 17 bits, its offset there in the lower 15.
class Places {
 public:
    explicit Places(const Volume& volume) : size_(volume.size()), bricks_(volume.brick_count()) {}

    uint32_t of(glm::uvec3 index) const {
        const glm::uvec3 brick = index / kBrickSide;
        return (brick.x + bricks_.x * (brick.y + bricks_.y * brick.z)) << 15 |
               offset_in_brick(index % kBrickSide);
    }
    glm::uvec3 index(uint32_t place) const {
        const uint32_t brick = place >> 15;
        return glm::uvec3(brick % bricks_.x, brick / bricks_.x % bricks_.y,
                          brick / (bricks_.x * bricks_.y)) *
                   kBrickSide +
               glm::uvec3(place & 31, place >> 5 & 31, place >> 10 & 31);
    }
    bool holds(glm::uvec3 index) const { // one below 0 is above every size
        return index.x < size_.x && index.y < size_.y && index.z < size_.z;
    }

 private:
    glm::uvec3 size_, bricks_;
};

// The samples of a volume as floats, by place. Pins all bricks.
class Samples {
 public:
    explicit Samples(const Volume& volume) {
        for_each_brick(volume, [&](glm::uvec3 position) {
            bricks_.push_back(&volume.brick(position));
            pinned_.push_back(bricks_.back()->pin());
        });
    }
    float operator[](uint32_t place) const {
        return bricks_[place >> 15]->value(pinned_[place >> 15], place & 32767);
    }

 private:
    std::vector<const Brick*> bricks_;
    std::vector<Brick::Pinned> pinned_;
};

std::vector<glm::uvec3> steps_to(Neighbors neighbors) {
    std::vector<glm::uvec3> steps;
    const int most = neighbors == Neighbors::face_6 ? 1 : neighbors == Neighbors::edge_18 ? 2 : 3;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                if (const int count = std::abs(x) + std::abs(y) + std::abs(z);
                    count > 0 && count <= most)
                    steps.emplace_back(uint32_t(x), uint32_t(y), uint32_t(z));
    return steps;
}

// A field of T by place.
template <class T>
class Field {
 public:
    Field(glm::uvec3 size, T fill) : array_(size, fill) {
        const glm::uvec3 count = array_.brick_count();
        bricks_.resize(size_t{count.x} * count.y * count.z);
    }
    T operator[](uint32_t place) const {
        const T* brick = bricks_[place >> 15];
        return brick ? brick[place & 32767] : array_.fill();
    }
    void set(uint32_t place, T value) {
        T*& brick = bricks_[place >> 15];
        if (!brick) {
            const glm::uvec3 count = array_.brick_count();
            const uint32_t number = place >> 15;
            brick = array_.write(
                {number % count.x, number / count.x % count.y, number / (count.x * count.y)});
        }
        brick[place & 32767] = value;
    }
    BrickArray<T> take() { return std::move(array_); }

 private:
    BrickArray<T> array_;
    std::vector<T*> bricks_;
};

struct Flooded {
    Volume height; // f32, no data where no seed reaches
    Volume labels; // of the type of the seeds; 0 where no seed reaches
};

struct FloodOptions {
    Neighbors neighbors = Neighbors::face_6;
    float highest = std::numeric_limits<float>::max(); // higher passes are closed
    uint16_t label = 0;                                // seeds of this label alone; 0: of all
};

// first(value, label) is the height at a seed, pass(a, b, label) the one between neighbours; NaN is
// closed.
template <class Label, class First, class Pass>
Result<Flooded> flood_as(const Volume& values, const Volume& seeds, const First& first,
                         const Pass& pass, const FloodOptions& options, const Task& task) {
    const Places places(values);
    const Samples samples(values);
    Field<float> heights(values.size(), kNone);
    Field<Label> labels(values.size(), 0);
    std::vector<std::vector<uint32_t>> buckets(bucket_of(options.highest) + 1);
    for_each_brick(seeds, [&](glm::uvec3 position) {
        const Brick& brick = seeds.brick(position);
        if (!(brick.range().max > 0.0f))
            return;
        const Brick::Pinned pinned = brick.pin();
        const glm::uvec3 valid = seeds.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const float label = brick.value(pinned, offset_in_brick({x, y, z}));
                    if (!(options.label == 0 ? label > 0.0f : label == float(options.label)))
                        continue;
                    const uint32_t place = places.of(position * kBrickSide + glm::uvec3(x, y, z));
                    const float value = samples[place];
                    const float height =
                        std::isnan(value) ? kNone : first(value, static_cast<Label>(label));
                    if (!(height <= options.highest))
                        continue;
                    heights.set(place, height);
                    labels.set(place, static_cast<Label>(label));
                    buckets[bucket_of(height)].push_back(place);
                }
    });
    const std::vector<glm::uvec3> steps = steps_to(options.neighbors);
    const uint64_t total = sample_count(values.grid());
    uint64_t served = 0;
    for (uint32_t now = 0; now < buckets.size(); ++now) {
        std::vector<uint32_t> bucket;
        bucket.swap(buckets[now]);
        for (size_t next = 0; next < bucket.size(); ++next) {
            if (++served % 65536 == 0) {
                if (task.stop.stop_requested())
                    return stopped();
                if (task.progress)
                    task.progress(std::min(0.95, 0.95 * double(served) / double(total)));
            }
            const uint32_t place = bucket[next];
            const float height = heights[place];
            if (bucket_of(height) != now)
                continue; // a lower way was found, and served
            const glm::uvec3 index = places.index(place);
            const float value = samples[place];
            const Label label = labels[place];
            for (const glm::uvec3 step : steps) {
                const glm::uvec3 to = index + step;
                if (!places.holds(to))
                    continue;
                const uint32_t there = places.of(to);
                const float known = heights[there];
                if (known <= height)
                    continue;
                const float beyond = samples[there];
                if (std::isnan(beyond))
                    continue;
                const float between = pass(value, beyond, label);
                const float way = std::max(height, between);
                if (!(between <= options.highest) || known <= way)
                    continue;
                heights.set(there, way);
                labels.set(there, label);
                if (bucket_of(way) == now)
                    bucket.push_back(there);
                else
                    buckets[bucket_of(way)].push_back(there);
            }
        }
    }
    PALPATE_TRY(Volume height, take_volume(heights.take(), values.grid(), {task.stop, {}}));
    PALPATE_TRY(Volume label, take_volume(labels.take(), values.grid(), {task.stop, {}}));
    return Flooded{std::move(height), std::move(label)};
}

template <class First, class Pass>
Result<Flooded> flood(const Volume& values, const Volume& seeds, const First& first,
                      const Pass& pass, const FloodOptions& options, const Task& task) {
    const glm::uvec3 bricks = values.brick_count();
    if (uint64_t{bricks.x} * bricks.y * bricks.z > kMostBricks)
        return fail("expected a volume of at most {} bricks of 32 x 32 x 32 samples, found {}",
                    kMostBricks, uint64_t{bricks.x} * bricks.y * bricks.z);
    if (seeds.size() != values.size())
        return fail("the seeds have another size than the volume");
    return seeds.type() == ScalarType::u8
               ? flood_as<uint8_t>(values, seeds, first, pass, options, task)
               : flood_as<uint16_t>(values, seeds, first, pass, options, task);
}

} // namespace

std::optional<Neighbors> neighbors_of(int count) {
    for (const Neighbors neighbors : {Neighbors::face_6, Neighbors::edge_18, Neighbors::corner_26})
        if (count == static_cast<int>(neighbors))
            return neighbors;
    return {};
}

Result<Volume> region_growing(const Volume& volume, const Volume& seeds,
                              std::span<const LabelInterval> intervals, Neighbors neighbors,
                              const Task& task) {
    std::vector<ValueInterval> of(65536, {1.0, 0.0});
    for (const LabelInterval& interval : intervals)
        of[interval.label] = interval.values;
    const auto first = [&](float value, uint16_t label) {
        return value >= of[label].low && value <= of[label].high ? 0.0f : kNone;
    };
    const auto pass = [&](float, float beyond, uint16_t label) { return first(beyond, label); };
    PALPATE_TRY(Flooded flooded,
                flood(volume, seeds, first, pass, {.neighbors = neighbors, .highest = 0.0f}, task));
    return std::move(flooded.labels);
}

Result<Volume> watershed(const Volume& heights, const Volume& seeds, Neighbors neighbors,
                         const Task& task) {
    const auto first = [](float value, uint16_t) { return std::max(value, 0.0f); };
    const auto pass = [](float, float beyond, uint16_t) { return std::max(beyond, 0.0f); };
    PALPATE_TRY(Flooded flooded,
                flood(heights, seeds, first, pass, {.neighbors = neighbors}, task));
    return std::move(flooded.labels);
}

Result<Volume> lowest_paths(const Volume& volume, const Volume& seeds, uint16_t label,
                            const std::function<float(float a, float b)>& pass, float highest,
                            const Task& task) {
    PALPATE_TRY(Flooded flooded, flood(
                                     volume, seeds, [](float, uint16_t) { return 0.0f; },
                                     [&](float a, float b, uint16_t) { return pass(a, b); },
                                     {.highest = highest, .label = label}, task));
    return std::move(flooded.height);
}

} // namespace palpate
