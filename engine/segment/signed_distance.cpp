#include "engine/segment/signed_distance.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/segment/envelope.h"
#include "engine/segment/label_samples.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

constexpr double kOffPerpendicular = 1e-4; // cosine of the angle between two axes
constexpr double kWhole = 1e-6;            // of a ratio of squared spacings
constexpr float kNone = std::numeric_limits<float>::infinity();
constexpr size_t kSide = kBrickSide;
static_assert(EnvelopeTile::kLanes == kSide);

// Squared spacings, in squares of the smallest.
struct Metric {
    double unit_mm;
    glm::vec3 weight;
    float limit;
};

Metric metric_of(const Grid& grid, double max_mm) {
    const glm::dvec3 spacing = spacing_mm(grid);
    Metric out{std::min({spacing.x, spacing.y, spacing.z}), {}, kNone};
    for (int axis = 0; axis < 3; ++axis) {
        const double ratio = spacing[axis] / out.unit_mm, squared = ratio * ratio;
        const double whole = std::round(squared);
        out.weight[axis] =
            static_cast<float>(std::abs(squared - whole) <= kWhole * whole ? whole : squared);
    }
    if (max_mm < 1e18 * out.unit_mm)
        out.limit = static_cast<float>(max_mm / out.unit_mm * (max_mm / out.unit_mm));
    return out;
}

class Transform {
 public:
    Transform(const Volume& labels, const SignedDistanceOptions& options)
        : labels_(labels),
          options_(options),
          size_(labels.size()),
          bricks_(labels.brick_count()),
          metric_(metric_of(labels.grid(), options.max_mm)),
          columns_(size_t{bricks_.x} * bricks_.y) {
        for (auto& column : columns_)
            column = std::make_unique_for_overwrite<float[]>(kSide * kSide * size_.z);
    }

    Result<Volume> run(const Task& task) {
        if (!run_all(size_.z, task.part(0.0, 0.5), [&](size_t z) { plane(z, local_.local()); }))
            return stopped();
        VolumeBuilder builder(labels_.grid(), ScalarType::f32);
        if (!run_all(columns_.size(), task.part(0.5, 1.0),
                     [&](size_t c) { column(c, local_.local(), builder); }))
            return stopped();
        return builder.finish();
    }

 private:
    struct Local {
        std::vector<uint16_t> labels;
        std::vector<int32_t> kinds;
        std::vector<float> squared, brick;
        EnvelopeTile tile;
    };

    // Samples of one box, by what is told apart; 0 is outside the object.
    void read_kinds(glm::ivec3 first, glm::ivec3 size, Local& local) const {
        const size_t count = size_t(size.x) * size_t(size.y) * size_t(size.z);
        local.labels.resize(count);
        local.kinds.resize(count);
        read_labels(labels_, first, size, local.labels.data());
        const auto fill = [&](auto kind) {
            std::transform(local.labels.begin(), local.labels.end(), local.kinds.begin(), kind);
        };
        switch (options_.of) {
            case DistanceOf::mask:
                return fill([](uint16_t label) { return int32_t{label != 0}; });
            case DistanceOf::label:
                return fill(
                    [own = options_.label](uint16_t label) { return int32_t{label == own}; });
            case DistanceOf::labels:
                return fill([](uint16_t label) { return int32_t{label}; });
        }
    }

    // Sample (x, y, z) of the column of bricks (x / 32, y / 32).
    float* row_of_column(size_t column, size_t y, size_t z) {
        return columns_[column].get() + (y % kSide * size_.z + z) * kSide;
    }

    // Squared distances along one row: of runs [begin, end) of one kind to their ends.
    void along_x(const int32_t* kinds, float* squared) const {
        for (size_t begin = 0; begin < size_.x;) {
            size_t end = begin + 1;
            while (end < size_.x && kinds[end] == kinds[begin])
                ++end;
            const float low = begin > 0 ? float(begin) - 1.0f : -kNone;
            const float high = end < size_.x ? float(end) : kNone;
            for (size_t x = begin; x < end; ++x) {
                const float steps = std::min(float(int(x)) - low, high - float(int(x)));
                squared[x] = metric_.weight.x * (steps * steps);
            }
            begin = end;
        }
    }

    void plane(size_t z, Local& local) {
        const size_t width = bricks_.x * kSide;
        read_kinds({0, 0, int(z)}, {int(width), int(size_.y), 1}, local);
        local.squared.resize(width * size_.y);
        for (size_t y = 0; y < size_.y; ++y) {
            float* row = local.squared.data() + y * width;
            along_x(local.kinds.data() + y * width, row);
            std::fill(row + size_.x, row + width, row[size_.x - 1]);
        }
        for (size_t bx = 0; bx < bricks_.x; ++bx) {
            local.tile.lower({local.squared.data() + bx * kSide, width,
                              local.kinds.data() + bx * kSide, width, size_.y},
                             metric_.weight.y, metric_.limit);
            for (size_t y = 0; y < size_.y; ++y)
                std::copy_n(local.tile.result(y), kSide,
                            row_of_column(bx + bricks_.x * (y / kSide), y, z));
        }
    }

    void column(size_t c, Local& local, VolumeBuilder& builder) {
        const glm::uvec2 at(c % bricks_.x, c / bricks_.x);
        const size_t rows = std::min<size_t>(kSide, size_.y - at.y * kSide);
        read_kinds({at.x * kSide, at.y * kSide, 0}, {kSide, int(rows), int(size_.z)}, local);
        local.brick.resize(bricks_.z * kBrickSamples);
        for (size_t y = 0; y < rows; ++y) {
            const int32_t* kinds = local.kinds.data() + y * kSide;
            local.tile.lower({row_of_column(c, y, 0), kSide, kinds, rows * kSide, size_.z},
                             metric_.weight.z, metric_.limit);
            for (size_t z = 0; z < size_.z; ++z)
                finish(local.tile.result(z), kinds + z * rows * kSide,
                       local.brick.data() + (z * kSide + y) * kSide);
        }
        columns_[c].reset();
        for (uint32_t bz = 0; bz < bricks_.z; ++bz) {
            const glm::uvec3 position(at, bz);
            builder.set_brick(
                position, Brick::make(std::span<const float>(
                                          local.brick.data() + bz * kBrickSamples, kBrickSamples),
                                      labels_.valid_in_brick(position)));
        }
    }

    void finish(const float* squared, const int32_t* kinds, float* out) const {
        const auto unit = static_cast<float>(metric_.unit_mm);
        const auto most = static_cast<float>(options_.max_mm);
        for (size_t l = 0; l < kSide; ++l) {
            const float mm = squared[l] >= metric_.limit ? most : unit * std::sqrt(squared[l]);
            out[l] = kinds[l] == 0 ? mm : -mm; // infinite: no data in a brick
        }
    }

    const Volume& labels_;
    SignedDistanceOptions options_;
    glm::uvec3 size_, bricks_;
    Metric metric_;
    std::vector<std::unique_ptr<float[]>> columns_; // squared distances within planes
    tbb::enumerable_thread_specific<Local> local_;
};

} // namespace

Result<void> check_perpendicular(const Grid& grid, const char* name) {
    const glm::dmat3 axes(grid.world_from_index);
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3;
        const double cosine = glm::dot(glm::normalize(axes[a]), glm::normalize(axes[b]));
        if (!(std::abs(cosine) <= kOffPerpendicular))
            return fail(
                "{}: expected a grid with perpendicular axes, found {:.3f} degrees between "
                "two of them: resample it to an upright grid first",
                name, glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0))));
    }
    return {};
}

Result<Volume> signed_distance(const Volume& labels, const SignedDistanceOptions& options,
                               const Task& task) {
    PALPATE_TRY(check_labels(labels, "signed distance"));
    PALPATE_TRY(check_perpendicular(labels.grid(), "signed distance"));
    if (!(options.max_mm > 0.0))
        return fail("signed distance: expected a largest distance above 0 mm, found {:g}",
                    options.max_mm);
    return Transform(labels, options).run(task);
}

} // namespace palpate
