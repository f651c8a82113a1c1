#include "engine/segment/random_walker.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/segment/seeds.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

constexpr int kSide = int(kBrickSide) + 2, kPlane = kSide * kSide;
constexpr std::array<int, 3> kStrides{1, kSide, kPlane};
constexpr int kSteps = 256, kReach = 6; // of the table: a standard deviation, and its end in them
constexpr float kLeastWeight = 1e-6f;

size_t place(int x, int y, int z) {
    return size_t(x + 1 + kSide * (y + 1) + kPlane * (z + 1));
}

// A brick of the volume with a layer of samples around it.
struct Tile {
    std::vector<float> values;        // no data is NaN
    std::vector<float> probabilities; // of the margin: as the neighbours had them last
    std::vector<uint8_t> fixed;       // seeds, and what has no data or lies outside
};

class Walk {
 public:
    Walk(const Volume& volume, const Volume& seeds, uint16_t label, double sd);
    float sweep(float omega); // the largest change
    std::vector<float> brick(size_t number) const;

 private:
    glm::ivec3 position_of(size_t number) const {
        return {number % bricks_.x, number / bricks_.x % bricks_.y,
                number / (size_t(bricks_.x) * bricks_.y)};
    }
    size_t number_of(glm::ivec3 at) const {
        return size_t(at.x) + bricks_.x * (at.y + size_t(bricks_.y) * at.z);
    }
    void fill(Tile& tile, const Volume& volume, const Volume& seeds, uint16_t label,
              glm::ivec3 at) const;
    float relax(Tile& tile, int color, float omega) const;
    void exchange(size_t number);

    glm::uvec3 bricks_;
    std::array<float, 3> per_area_; // 1 / h^2, of the smallest h 1
    float steps_per_value_;
    std::array<float, kSteps * kReach + 1> table_;
    std::vector<Tile> tiles_;
};

Walk::Walk(const Volume& volume, const Volume& seeds, uint16_t label, double sd)
    : bricks_(volume.brick_count()),
      steps_per_value_(float(kSteps / sd)),
      tiles_(size_t(bricks_.x) * bricks_.y * bricks_.z) {
    const glm::dvec3 h = spacing_mm(volume.grid());
    const double least = std::min({h.x, h.y, h.z});
    for (int k = 0; k < 3; ++k)
        per_area_[size_t(k)] = float(least * least / (h[k] * h[k]));
    for (size_t i = 0; i < table_.size(); ++i) {
        const double d = double(i) / kSteps;
        table_[i] = std::max(kLeastWeight, float(std::exp(-0.5 * d * d)));
    }
    tbb::parallel_for(size_t{0}, tiles_.size(), [&](size_t number) {
        fill(tiles_[number], volume, seeds, label, position_of(number));
    });
    tbb::parallel_for(size_t{0}, tiles_.size(), [&](size_t number) { exchange(number); });
}

void Walk::fill(Tile& tile, const Volume& volume, const Volume& seeds, uint16_t label,
                glm::ivec3 at) const {
    const size_t count = size_t(kSide) * kPlane;
    tile.values.resize(count);
    tile.probabilities.assign(count, 0.0f);
    tile.fixed.assign(count, 1);
    const glm::ivec3 first = at * int(kBrickSide), size(volume.size());
    read_box(volume, first - 1, glm::ivec3(kSide), packed(glm::uvec3(kSide)), tile.values.data());
    const Brick& labels = seeds.brick(glm::uvec3(at));
    const Brick::Pinned pinned = labels.pin();
    for (int z = -1; z <= int(kBrickSide); ++z)
        for (int y = -1; y <= int(kBrickSide); ++y)
            for (int x = -1; x <= int(kBrickSide); ++x) {
                const glm::ivec3 index = first + glm::ivec3(x, y, z);
                const size_t here = place(x, y, z);
                if (glm::any(glm::lessThan(index, glm::ivec3(0))) ||
                    glm::any(glm::greaterThanEqual(index, size))) {
                    tile.values[here] = NAN;
                    continue;
                }
                const glm::ivec3 local = index - first;
                if (std::min({local.x, local.y, local.z}) < 0 ||
                    std::max({local.x, local.y, local.z}) >= int(kBrickSide))
                    continue; // a neighbour's
                const float seed = labels.value(pinned, offset_in_brick(glm::uvec3(local)));
                if (seed > 0.0f)
                    tile.probabilities[here] = seed == float(label) ? 1.0f : 0.0f;
                else if (!std::isnan(tile.values[here]))
                    tile.fixed[here] = 0;
            }
}

float Walk::relax(Tile& tile, int color, float omega) const {
    // Bricks have an even side, so that the colour of a sample is that of its place in the brick.
    float largest = 0.0f;
    for (int z = 0; z < int(kBrickSide); ++z)
        for (int y = 0; y < int(kBrickSide); ++y)
            for (int x = (y + z + color) % 2; x < int(kBrickSide); x += 2) {
                const size_t here = place(x, y, z);
                if (tile.fixed[here])
                    continue;
                float sum = 0.0f, weights = 0.0f;
                for (size_t k = 0; k < 3; ++k)
                    for (const int step : {-kStrides[k], kStrides[k]}) {
                        const size_t there = size_t(int(here) + step);
                        const float off =
                            std::abs(tile.values[there] - tile.values[here]) * steps_per_value_;
                        if (std::isnan(off))
                            continue;
                        const auto entry = size_t(std::min(off, float(kSteps * kReach)));
                        const float weight = table_[entry] * per_area_[k];
                        weights += weight;
                        sum += weight * tile.probabilities[there];
                    }
                if (weights == 0.0f)
                    continue;
                const float before = tile.probabilities[here];
                const float change = omega * (sum / weights - before);
                tile.probabilities[here] = before + change;
                largest = std::max(largest, std::abs(change));
            }
    return largest;
}

// Brings the margin of a tile up to what its neighbours have.
void Walk::exchange(size_t number) {
    const glm::ivec3 at = position_of(number);
    Tile& tile = tiles_[number];
    for (int k = 0; k < 3; ++k)
        for (const int side : {-1, 1}) {
            glm::ivec3 beside = at;
            beside[k] += side;
            if (beside[k] < 0 || beside[k] >= int(bricks_[k]))
                continue;
            const Tile& other = tiles_[number_of(beside)];
            const int to = side < 0 ? -1 : int(kBrickSide),
                      from = side < 0 ? int(kBrickSide) - 1 : 0;
            for (int b = 0; b < int(kBrickSide); ++b)
                for (int a = 0; a < int(kBrickSide); ++a) {
                    glm::ivec3 mine, theirs;
                    mine[k] = to, theirs[k] = from;
                    mine[(k + 1) % 3] = theirs[(k + 1) % 3] = a;
                    mine[(k + 2) % 3] = theirs[(k + 2) % 3] = b;
                    tile.probabilities[place(mine.x, mine.y, mine.z)] =
                        other.probabilities[place(theirs.x, theirs.y, theirs.z)];
                }
        }
}

float Walk::sweep(float omega) {
    std::vector<float> changes(tiles_.size());
    for (int color = 0; color < 2; ++color) {
        tbb::parallel_for(size_t{0}, tiles_.size(), [&](size_t number) {
            changes[number] = std::max(changes[number], relax(tiles_[number], color, omega));
        });
        tbb::parallel_for(size_t{0}, tiles_.size(), [&](size_t number) { exchange(number); });
    }
    return *std::ranges::max_element(changes);
}

std::vector<float> Walk::brick(size_t number) const {
    const Tile& tile = tiles_[number];
    std::vector<float> samples(kBrickSamples);
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y)
            for (uint32_t x = 0; x < kBrickSide; ++x) {
                const size_t here = place(int(x), int(y), int(z));
                samples[offset_in_brick({x, y, z})] =
                    std::isnan(tile.values[here])
                        ? NAN
                        : std::clamp(tile.probabilities[here], 0.0f, 1.0f);
            }
    return samples;
}

} // namespace

Result<Volume> random_walker(const Volume& volume, const Volume& seeds, uint16_t label,
                             const RandomWalkerOptions& options, const Task& task) {
    PALPATE_TRY(check_perpendicular(volume.grid(), "random walker"));
    if (seeds.size() != volume.size())
        return fail("random walker: the seeds have another size than the volume");
    const std::vector<LabelCount> labels = label_counts(seeds);
    if (labels.size() < 2)
        return fail(
            "random walker: expected seeds of at least two labels, such as inside and outside, "
            "found {}",
            labels.size());
    if (std::ranges::find(labels, label, &LabelCount::label) == labels.end())
        return fail("random walker: no seed has label {}", label);
    Walk walk(volume, seeds, label, options.sd);
    // The best factor for a cube of constant weights with one seeded face.
    const uint32_t across = std::max({volume.size().x, volume.size().y, volume.size().z});
    const auto omega = float(2.0 / (1.0 + std::sin(std::numbers::pi / (2.0 * across))));
    const double least = std::log(options.tolerance);
    double shown = 0.0;
    for (int sweep = 0; sweep < options.most_sweeps; ++sweep) {
        if (task.stop.stop_requested())
            return stopped();
        const float change = walk.sweep(omega);
        if (double(change) <= options.tolerance)
            break;
        // Changes fall by equal ratios, from about 1.
        shown = std::max(shown, std::clamp(std::log(double(change)) / least, 0.0, 0.99));
        if (task.progress)
            task.progress(shown);
    }
    const glm::uvec3 bricks = volume.brick_count();
    return make_bricks(volume.grid(), ScalarType::f32, {task.stop, {}}, [&](glm::uvec3 at) {
        const std::vector<float> samples =
            walk.brick(at.x + bricks.x * (at.y + size_t{bricks.y} * at.z));
        return Brick::make(std::span<const float>(samples), volume.valid_in_brick(at));
    });
}

} // namespace palpate
