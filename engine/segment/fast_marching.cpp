#include "engine/segment/fast_marching.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/segment/march_tile.h"
#include "engine/volume/extent.h"
#include "engine/volume/grid.h"

namespace palpate {

namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
// A window lasts as long as a front of the harmonic mean cost of the last one takes for this part
// of the smallest spacing. Longer ones relax samples more often, shorter ones take more rounds.
constexpr double kWindow = 0.8;
// Samples on each side of a ball whose arrival is its distance: as many as a stencil and its
// neighbours' reach back.
constexpr double kExactSamples = 3.0;
// How far additive factoring reaches from a ball, as a part of the volume's shortest side. A
// length in mm, and not in samples: then the error of a point is of second order.
constexpr double kNearShare = 0.25;

// Lengths along the index axes, which are at right angles.
glm::dvec3 along_axes(const Grid& grid, glm::dvec3 world_mm) {
    return index_point(grid, world_mm) * spacing_mm(grid);
}

Result<void> check(const Volume& cost, const MarchStart& start) {
    PALPATE_TRY(check_grid(cost.grid()));
    if (cost.type() != ScalarType::f32)
        return fail("fast marching: expected a cost of type f32, found {}", name_of(cost.type()));
    if (!cost.range().empty() && cost.range().min < 0.0f)
        return fail("fast marching: expected a cost of at least 0, found {:g}", cost.range().min);
    const glm::dmat3 axes(cost.grid().world_from_index);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < i; ++k)
            if (std::abs(glm::dot(axes[i], axes[k])) >
                1e-5 * glm::length(axes[i]) * glm::length(axes[k]))
                return fail(
                    "fast marching: expected a grid whose axes are at right angles, found a "
                    "sheared one; resample the volume first");
    if (start.seeds && start.seeds->size() != cost.size())
        return fail("fast marching: the seeds have another size than the volume");
    return {};
}

class March {
 public:
    March(const Volume& cost, const FastMarchingOptions& options)
        : cost_(cost),
          options_(options),
          spacing_(spacing_mm(cost.grid())),
          tiles_(size_t{cost.brick_count().x} * cost.brick_count().y * cost.brick_count().z) {}

    void start_at(const Volume& seeds, uint16_t label);
    void start_at(std::span<const SeedBall> balls);
    bool has_started() const { return started_ > 0; }
    bool run(const Task& task);
    Volume reached(float time) const;
    Result<Volume> result(const Task& task);

 private:
    glm::uvec3 position_of(size_t number) const {
        const glm::uvec3 bricks = cost_.brick_count();
        return {number % bricks.x, number / bricks.x % bricks.y,
                number / (size_t{bricks.x} * bricks.y)};
    }
    size_t number_of(glm::uvec3 position) const {
        const glm::uvec3 bricks = cost_.brick_count();
        return position.x + bricks.x * (position.y + size_t{bricks.y} * position.z);
    }
    MarchTile& tile(size_t number);
    void start(glm::uvec3 index, float time);
    float straight(glm::dvec3 from, glm::dvec3 to) const;
    void exchange(std::vector<size_t>& active);

    const Volume& cost_;
    FastMarchingOptions options_;
    glm::dvec3 spacing_;
    std::vector<std::unique_ptr<MarchTile>> tiles_;
    std::vector<MarchNearField> near_;
    uint64_t started_ = 0;
    double inverse_cost_ = 0.0;
};

MarchTile& March::tile(size_t number) {
    std::unique_ptr<MarchTile>& tile = tiles_[number];
    if (!tile) {
        const glm::uvec3 position = position_of(number);
        std::vector<MarchNearField> near;
        const glm::dvec3 low = glm::dvec3(position * kBrickSide) * spacing_;
        const glm::dvec3 high = low + double(kBrickSide) * spacing_;
        for (const MarchNearField& field : near_)
            if (glm::length(glm::clamp(field.center, low, high) - field.center) < field.reach)
                near.push_back(field);
        tile = std::make_unique<MarchTile>(spacing_, position, cost_.brick(position),
                                           cost_.valid_in_brick(position), std::move(near));
    }
    return *tile;
}

void March::start(glm::uvec3 index, float time) {
    const float cost = cost_.value(index);
    if (!std::isfinite(cost))
        return;
    ++started_;
    inverse_cost_ += 1.0 / std::max(double(cost), 1e-30);
    tile(number_of(index / kBrickSide)).start(index % kBrickSide, time);
}

void March::start_at(const Volume& seeds, uint16_t label) {
    for_each_brick(seeds, [&](glm::uvec3 position) {
        const Brick& brick = seeds.brick(position);
        if (!(brick.range().max > 0.0f))
            return;
        const Brick::Pinned pinned = brick.pin();
        const glm::uvec3 valid = seeds.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const float found = brick.value(pinned, offset_in_brick({x, y, z}));
                    if (label == 0 ? found > 0.0f : found == float(label))
                        start(position * kBrickSide + glm::uvec3(x, y, z), 0.0f);
                }
    });
}

// The mean cost of a straight way in index space; infinite where there is a wall in it.
float March::straight(glm::dvec3 from, glm::dvec3 to) const {
    const glm::dvec3 last = glm::dvec3(cost_.size()) - 1.0;
    const glm::dvec3 way = to - from;
    const double longest = std::max({std::abs(way.x), std::abs(way.y), std::abs(way.z)});
    const int steps = 1 + int(std::ceil(2.0 * longest));
    double sum = 0.0;
    for (int i = 0; i <= steps; ++i) {
        const glm::dvec3 at = glm::clamp(from + way * (double(i) / steps), glm::dvec3(0.0), last);
        const float cost = cost_.value(glm::uvec3(glm::round(at)));
        if (!std::isfinite(cost))
            return kNever;
        sum += (i == 0 || i == steps ? 0.5 : 1.0) * cost;
    }
    return float(sum / steps);
}

void March::start_at(std::span<const SeedBall> balls) {
    const Grid& grid = cost_.grid();
    double side = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k)
        if (grid.size[k] > 1)
            side = std::min(side, spacing_[k] * double(grid.size[k] - 1));
    for (const SeedBall& ball : balls) {
        MarchNearField field{along_axes(grid, ball.center_mm), ball.radius_mm,
                             ball.radius_mm + kNearShare * side, 0.0};
        for (const SeedBall& other : balls) { // the fields of two balls are apart
            const double apart = glm::length(other.center_mm - ball.center_mm);
            if (&other != &ball)
                field.reach = std::min(field.reach, apart / 2.0);
        }
        const glm::dvec3 center = field.center / spacing_, last = glm::dvec3(grid.size) - 1.0;
        const glm::dvec3 reach = ball.radius_mm / spacing_ + kExactSamples;
        field.cost = cost_.value(glm::uvec3(glm::clamp(glm::round(center), glm::dvec3(0), last)));
        if (std::isfinite(field.cost) && field.reach > ball.radius_mm)
            near_.push_back(field);
        const glm::uvec3 low(glm::clamp(glm::ceil(center - reach), glm::dvec3(0.0), last));
        const glm::uvec3 high(glm::clamp(glm::floor(center + reach), glm::dvec3(0.0), last));
        for (uint32_t z = low.z; z <= high.z; ++z)
            for (uint32_t y = low.y; y <= high.y; ++y)
                for (uint32_t x = low.x; x <= high.x; ++x) {
                    const glm::dvec3 way = glm::dvec3(x, y, z) * spacing_ - field.center;
                    const double distance = glm::length(way);
                    if (distance <= ball.radius_mm) {
                        start({x, y, z}, 0.0f);
                        continue;
                    }
                    const glm::dvec3 beyond = way * (1.0 - ball.radius_mm / distance) / spacing_;
                    if (std::max({std::abs(beyond.x), std::abs(beyond.y), std::abs(beyond.z)}) >
                        kExactSamples)
                        continue;
                    const float cost = straight(glm::dvec3(x, y, z) - beyond, {x, y, z});
                    if (std::isfinite(cost))
                        start({x, y, z}, float(cost * (distance - ball.radius_mm)));
                }
    }
}

// Hands what tiles told to the tiles beside them; those that were told something are active next.
void March::exchange(std::vector<size_t>& active) {
    const glm::uvec3 bricks = cost_.brick_count();
    std::vector<size_t> told;
    for (const size_t number : active) {
        const glm::uvec3 position = position_of(number);
        for (int face = 0; face < 6; ++face) {
            std::vector<MarchTile::Told>& out = tiles_[number]->outbox[size_t(face)];
            if (out.empty())
                continue;
            glm::uvec3 to = position;
            to[face / 2] += face % 2 == 0 ? ~0u : 1u;
            if (to[face / 2] < bricks[face / 2]) {
                const size_t receiver = number_of(to);
                tile(receiver).inbox[size_t(face ^ 1)].swap(out);
                told.push_back(receiver);
            }
            out.clear();
        }
    }
    std::ranges::sort(told);
    told.erase(std::ranges::unique(told).begin(), told.end());
    active = std::move(told);
}

bool March::run(const Task& task) {
    const double step = std::min({spacing_.x, spacing_.y, spacing_.z}) * kWindow;
    double length = step * double(started_) / inverse_cost_;
    const uint64_t total = sample_count(cost_.grid()) - cost_.no_data_count();
    uint64_t known = 0, shown = 0;
    std::vector<size_t> active;
    for (;;) {
        if (task.stop.stop_requested())
            return false;
        float begin = kNever;
        for (const auto& tile : tiles_)
            if (tile)
                begin = std::min(begin, tile->earliest_waiting());
        if (!(begin <= options_.last_time) || begin == kNever)
            return true;
        // Above begin, even where a step is lost in the rounding of the time.
        const float end =
            std::max(float(double(begin) + length), begin * (1.0f + 0x1p-20f) + 1e-37f);
        active.clear();
        for (size_t i = 0; i < tiles_.size(); ++i)
            if (tiles_[i] && tiles_[i]->earliest_waiting() < end)
                active.push_back(i);
        uint64_t count = 0;
        double inverse = 0.0;
        while (!active.empty()) {
            tbb::parallel_for(size_t{0}, active.size(), [&](size_t i) {
                MarchTile& tile = *tiles_[active[i]];
                tile.run({begin, end}, options_.order, cost_.brick(position_of(active[i])));
            });
            for (const size_t number : active) {
                count += tiles_[number]->known();
                inverse += tiles_[number]->inverse_cost();
            }
            exchange(active);
        }
        if (count > 0)
            length = step * double(count) / inverse;
        known += count;
        if (task.look)
            task.look([&] { return reached(end); });
        if (task.progress && known * 100 / total != shown) {
            shown = known * 100 / total;
            task.progress(std::min(1.0, double(known) / double(total)));
        }
    }
}

// The samples that the front has passed at a time.
Volume March::reached(float time) const {
    const uint8_t outside = 0;
    const BrickPtr unreached = Brick::make(std::span<const uint8_t>(&outside, 1));
    return *make_bricks(cost_.grid(), ScalarType::u8, {}, [&](glm::uvec3 position) {
        const std::unique_ptr<MarchTile>& tile = tiles_[number_of(position)];
        if (!tile)
            return unreached;
        std::vector<float> times(kBrickSamples);
        tile->copy_out(std::min(options_.last_time, time), times.data());
        std::vector<uint8_t> labels(kBrickSamples);
        for (size_t i = 0; i < labels.size(); ++i)
            labels[i] = !std::isnan(times[i]);
        return Brick::make(std::span<const uint8_t>(labels), cost_.valid_in_brick(position));
    });
}

Result<Volume> March::result(const Task& task) {
    const float none = std::numeric_limits<float>::quiet_NaN();
    const BrickPtr unreached = Brick::make(std::span<const float>(&none, 1));
    return make_bricks(cost_.grid(), ScalarType::f32, {task.stop, {}}, [&](glm::uvec3 position) {
        std::unique_ptr<MarchTile>& tile = tiles_[number_of(position)];
        if (!tile)
            return unreached;
        std::vector<float> times(kBrickSamples);
        tile->copy_out(std::min(options_.last_time, std::numeric_limits<float>::max()),
                       times.data());
        tile.reset();
        return Brick::make(std::span<const float>(times), cost_.valid_in_brick(position));
    });
}

} // namespace

Result<Volume> fast_marching(const Volume& cost, const MarchStart& start,
                             const FastMarchingOptions& options, const Task& task) {
    PALPATE_TRY(check(cost, start));
    if (options.order != 1 && options.order != 2)
        return fail("fast marching: expected an order of 1 or 2, found {}", options.order);
    March march(cost, options);
    if (start.seeds)
        march.start_at(*start.seeds, start.label);
    march.start_at(start.balls);
    if (!march.has_started())
        return fail("fast marching: no seed lies where the cost is finite");
    if (!march.run(task))
        return stopped();
    return march.result(task);
}

} // namespace palpate
