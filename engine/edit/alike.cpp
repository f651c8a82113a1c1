#include "engine/edit/alike.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/volume/extent.h"

namespace palpate {

namespace {

constexpr double kDeviationOfMedian = 1.4826;

// The sample in whose cell a point lies.
std::optional<glm::ivec3> sample_at(const Grid& grid, glm::dvec3 point_mm) {
    const glm::dvec3 index(glm::inverse(grid.world_from_index) * glm::dvec4(point_mm, 1.0));
    const glm::dvec3 nearest = glm::floor(index + 0.5);
    if (!glm::all(glm::greaterThanEqual(nearest, glm::dvec3(0.0))) ||
        !glm::all(glm::lessThan(nearest, glm::dvec3(grid.size))))
        return std::nullopt;
    return glm::ivec3(nearest);
}

double median(std::vector<double>& values) {
    const size_t n = values.size();
    const auto middle = values.begin() + static_cast<ptrdiff_t>(n / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (n % 2 == 1)
        return *middle;
    return 0.5 * (*std::max_element(values.begin(), middle) + *middle);
}

// A search from the tool's origin over the bricks that the tool may touch.
class Flood {
 public:
    Flood(const Volume& greys, const Tool& tool, const StrokePose& pose, const AlikeRange& range)
        : greys_(greys),
          range_(range),
          sweep_(tool, greys.grid(), pose, pose),
          bricks_(bricks_of(sweep_, greys.grid())),
          mm_from_index_(greys.grid().world_from_index) {}

    std::vector<BrickSamplesHeld> from(glm::ivec3 origin, const std::stop_token& stop) {
        const glm::ivec3 of_origin = origin / int(kBrickSide);
        bricks_ = bricks_.empty() ? BrickRange{of_origin, of_origin}
                                  : BrickRange{glm::min(bricks_.low, of_origin),
                                               glm::max(bricks_.high, of_origin)};
        const glm::ivec3 count = bricks_.high - bricks_.low + 1;
        looked_at_.resize(size_t(count.x) * size_t(count.y) * size_t(count.z));
        if (!range_.has(value(origin)))
            return {};
        take(origin);
        const glm::ivec3 last = glm::ivec3(greys_.size()) - 1;
        while (!waiting_.empty() && !stop.stop_requested()) {
            const glm::ivec3 at = waiting_.back();
            waiting_.pop_back();
            for (int axis = 0; axis < 3; ++axis)
                for (const int step : {-1, 1}) {
                    glm::ivec3 next = at;
                    next[axis] += step;
                    if (next[axis] >= 0 && next[axis] <= last[axis])
                        look(next);
                }
        }
        std::vector<BrickSamplesHeld> held;
        for (const std::unique_ptr<Looked>& one : looked_at_)
            if (one && !one->held.empty())
                held.push_back({one->brick, one->held});
        return held;
    }

 private:
    struct Looked { // at a brick
        glm::uvec3 brick;
        Brick::Pinned pinned;
        SampleMask seen, held;
    };

    // Null: the tool touches no sample of the brick.
    Looked* looked(glm::ivec3 index) {
        const glm::ivec3 brick = index / int(kBrickSide);
        if (glm::any(glm::lessThan(brick, bricks_.low)) ||
            glm::any(glm::greaterThan(brick, bricks_.high)))
            return nullptr;
        const glm::ivec3 at = brick - bricks_.low, count = bricks_.high - bricks_.low + 1;
        std::unique_ptr<Looked>& one =
            looked_at_[static_cast<size_t>(at.x + count.x * (at.y + ptrdiff_t{count.y} * at.z))];
        if (!one)
            one = std::make_unique<Looked>(
                Looked{glm::uvec3(brick), greys_.brick(glm::uvec3(brick)).pin(), {}, {}});
        return one.get();
    }
    double value(glm::ivec3 index) {
        const Looked& in = *looked(index);
        return greys_.brick(in.brick).value(in.pinned,
                                            offset_in_brick(glm::uvec3(index) % kBrickSide));
    }
    void take(glm::ivec3 index) {
        const glm::uvec3 local = glm::uvec3(index) % kBrickSide;
        Looked& in = *looked(index);
        in.seen.row(local.y, local.z) |= uint32_t{1} << local.x;
        in.held.row(local.y, local.z) |= uint32_t{1} << local.x;
        waiting_.push_back(index);
    }
    void look(glm::ivec3 index) {
        Looked* const in = looked(index);
        if (!in)
            return;
        const glm::uvec3 local = glm::uvec3(index) % kBrickSide;
        uint32_t& seen = in->seen.row(local.y, local.z);
        if (seen >> local.x & 1)
            return;
        seen |= uint32_t{1} << local.x;
        if (range_.has(value(index)) && is_inside(index))
            take(index);
    }
    bool is_inside(glm::ivec3 index) const {
        if (sweep_.at(mm_from_index_ * glm::dvec3(index)).inside)
            return true;
        const auto [first, last] = sweep_.marked_in_row(index.y, index.z);
        return first <= index.x && index.x <= last;
    }

    const Volume& greys_;
    const AlikeRange range_;
    const Sweep sweep_;
    BrickRange bricks_;
    const glm::dmat3 mm_from_index_;
    std::vector<std::unique_ptr<Looked>> looked_at_; // by brick, x fastest
    std::vector<glm::ivec3> waiting_;
};

} // namespace

AlikeRange alike_range(std::vector<double> values, double deviations) {
    const double middle = median(values);
    for (double& value : values)
        value = std::abs(value - middle);
    const double reach = deviations * kDeviationOfMedian * median(values);
    return {middle - reach, middle + reach};
}

std::optional<AlikeRange> alike_around(const Volume& greys, glm::dvec3 point_mm,
                                       double deviations) {
    const auto sample = sample_at(greys.grid(), point_mm);
    if (!sample)
        return std::nullopt;
    const glm::ivec3 low = glm::max(glm::ivec3(*sample) - kAlikeReach, glm::ivec3(0)),
                     high =
                         glm::min(glm::ivec3(*sample) + kAlikeReach, glm::ivec3(greys.size()) - 1);
    std::vector<double> values;
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x)
                if (const double v = greys.value({x, y, z}); !std::isnan(v))
                    values.push_back(v);
    if (values.empty())
        return std::nullopt;
    return alike_range(std::move(values), deviations);
}

std::vector<BrickSamplesHeld> alike_and_connected(const Volume& greys, const Tool& tool,
                                                  const StrokePose& pose, const AlikeRange& range,
                                                  const std::stop_token& stop) {
    const auto origin = sample_at(greys.grid(), pose.tool.position_mm);
    if (!origin)
        return {};
    return Flood(greys, tool, pose, range).from(glm::ivec3(*origin), stop);
}

std::vector<StrokePose> dabs_between(const Tool& tool, const Grid& grid, const StrokePose& from,
                                     const StrokePose& to) {
    const double reach_mm = tool.shape ? tool.shape->bounds().reach_mm() : 0.0;
    const double parts =
        std::max(1.0, std::ceil(travel_mm(from, to, reach_mm) / smallest_spacing_mm(grid)));
    // The origin moves on a line: only parts of it within the volume's cells count, and one more to
    // each side for rounding.
    const glm::dmat4 index_from_world = glm::inverse(grid.world_from_index);
    const glm::dvec3 a(index_from_world * glm::dvec4(from.tool.position_mm, 1.0)),
        b(index_from_world * glm::dvec4(to.tool.position_mm, 1.0));
    double first = 0.0, last = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = -0.5, high = grid.size[axis] - 0.5, way = b[axis] - a[axis];
        if (way == 0.0 && (a[axis] < low - 1.0 || a[axis] > high + 1.0))
            return {};
        if (way == 0.0)
            continue;
        const double s = (low - a[axis]) / way, t = (high - a[axis]) / way;
        first = std::max(first, std::min(s, t));
        last = std::min(last, std::max(s, t));
    }
    std::vector<StrokePose> dabs;
    for (double k = std::max(1.0, std::floor(first * parts) - 1.0);
         k <= std::min(parts, std::ceil(last * parts) + 1.0); ++k) {
        const StrokePose pose = k == parts ? to : pose_between(from, to, k / parts);
        if (sample_at(grid, pose.tool.position_mm))
            dabs.push_back(pose);
    }
    return dabs;
}

} // namespace palpate
