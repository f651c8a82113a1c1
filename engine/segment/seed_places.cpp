#include "engine/segment/seed_places.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/segment/label_samples.h"
#include "engine/segment/seed_values.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/grid.h"

namespace palpate {

namespace {

constexpr int kLongestWay = 16; // samples of an edge
// The gradient of smoothed white noise has a standard deviation of 0.148 along each axis: the root
// of 10 / 64 * (6 / 16)^2, the squares of (1 2 0 -2 -1) / 8 and twice (1 2 1) / 4. 99 % of vectors
// of three are shorter than 3.37 of them.
constexpr double kNoiseSlope = 0.5;
// A value is nearer to one side of an edge than to the other, where it lies so many standard
// deviations of noise beside their middle: 98 of 100 are right.
constexpr double kNearer = 2.0;

class Slopes {
 public:
    explicit Slopes(const Volume& smooth) : smooth_(smooth), last_(glm::ivec3(smooth.size()) - 1) {}

    double value(glm::ivec3 at) const {
        return smooth_.value(glm::uvec3(glm::clamp(at, glm::ivec3(0), last_)));
    }
    bool is_inside(glm::ivec3 at) const { return at == glm::clamp(at, glm::ivec3(0), last_); }

    glm::dvec3 gradient(glm::ivec3 at) const {
        glm::dvec3 g;
        for (int k = 0; k < 3; ++k)
            g[k] = 0.5 * (value(at + along(k)) - value(at - along(k)));
        return g;
    }
    double length(glm::ivec3 at) const { return glm::length(gradient(at)); }

    // Above 0 on the upper side of an edge.
    double side(glm::ivec3 at) const {
        const glm::dvec3 g = gradient(at);
        glm::dmat3 h;
        const double here = value(at);
        for (int i = 0; i < 3; ++i) {
            h[i][i] = value(at + along(i)) - 2.0 * here + value(at - along(i));
            for (int k = 0; k < i; ++k)
                h[i][k] = h[k][i] =
                    0.25 * (value(at + along(i) + along(k)) + value(at - along(i) - along(k)) -
                            value(at + along(i) - along(k)) - value(at - along(i) + along(k)));
        }
        return -(glm::dot(g, h * g) / glm::dot(g, g) + h[0][0] + h[1][1] + h[2][2]);
    }

 private:
    static glm::ivec3 along(int axis) {
        glm::ivec3 step(0);
        step[axis] = 1;
        return step;
    }

    const Volume& smooth_;
    glm::ivec3 last_;
};

// The standard deviation of noise by the median of second differences beside the seeds.
double noise_beside(const Volume& volume, const std::vector<glm::ivec3>& places) {
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    std::vector<double> bends;
    const size_t step = 1 + places.size() / 1000; // enough of many
    for (size_t n = 0; n < places.size(); n += step)
        for (int i = 0; i < 27; ++i) {
            const glm::ivec3 at = places[n] + glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1;
            for (int k = 0; k < 3; ++k) {
                glm::ivec3 low = at, high = at;
                --low[k], ++high[k];
                if (low != glm::clamp(low, glm::ivec3(0), last) ||
                    high != glm::clamp(high, glm::ivec3(0), last) ||
                    at != glm::clamp(at, glm::ivec3(0), last))
                    continue;
                const double bend = double{volume.value(glm::uvec3(low))} -
                                    2.0 * double{volume.value(glm::uvec3(at))} +
                                    double{volume.value(glm::uvec3(high))};
                if (!std::isnan(bend))
                    bends.push_back(std::abs(bend));
            }
        }
    if (bends.empty())
        return 0.0;
    const auto middle = bends.begin() + ptrdiff_t(bends.size() / 2);
    std::ranges::nth_element(bends, middle);
    return *middle / (0.6745 * std::sqrt(6.0)); // a normal distribution's median
}

// The end of the steepest way up (1) or down (-1) an edge.
glm::ivec3 end_of_way(const Slopes& slopes, glm::ivec3 at, double way, double least) {
    double length = slopes.length(at);
    for (int n = 0; n < kLongestWay && length > least; ++n) {
        glm::ivec3 to = at;
        double steepest = 0.0;
        for (int i = 0; i < 27; ++i) {
            const glm::ivec3 step = glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1;
            if (step == glm::ivec3(0) || !slopes.is_inside(at + step))
                continue;
            const double rise =
                way * (slopes.value(at + step) - slopes.value(at)) / glm::length(glm::dvec3(step));
            if (rise > steepest)
                steepest = rise, to = at + step;
        }
        const double next = slopes.length(to);
        // Its first step may cross the steepest place, which smoothing has moved.
        if (to == at || !(next < length || n == 0))
            break;
        at = to, length = next;
    }
    return at;
}

// value: of the volume before it was smoothed.
glm::ivec3 settled(const Slopes& slopes, glm::ivec3 at, double value, double least, double noise) {
    if (!(slopes.length(at) > least))
        return at;
    const glm::ivec3 up = end_of_way(slopes, at, 1.0, least),
                     down = end_of_way(slopes, at, -1.0, least);
    const double above = slopes.value(up) - value, below = value - slopes.value(down);
    if (std::abs(above - below) > 2.0 * kNearer * noise) // twice as far as from the middle
        return above < below ? up : down;
    const double side = slopes.side(at);
    return side > 0.0 ? up : side < 0.0 ? down : at;
}

} // namespace

namespace {

// The seeds of one ball, or those that lie in none.
struct Group {
    std::vector<size_t> seeds;
    std::optional<glm::ivec3> center;
};

std::vector<Group> groups_of(const Grid& grid, std::span<const glm::ivec3> places, uint16_t label,
                             std::span<const SeedBall> balls) {
    std::vector<Group> groups(1);
    std::vector<bool> is_in_ball(places.size(), false);
    for (const SeedBall& ball : balls) {
        if (ball.label != label)
            continue;
        Group& of = groups.emplace_back();
        of.center = glm::ivec3(glm::round(index_point(grid, ball.center_mm)));
        for (size_t i = 0; i < places.size(); ++i)
            if (glm::distance(world_point(grid, glm::dvec3(places[i])), ball.center_mm) <=
                ball.radius_mm)
                of.seeds.push_back(i), is_in_ball[i] = true;
    }
    for (size_t i = 0; i < places.size(); ++i)
        if (!is_in_ball[i])
            groups[0].seeds.push_back(i);
    return groups;
}

} // namespace

Volume settled_seeds(const Volume& volume, const Volume& smooth, const Volume& seeds,
                     uint16_t label, std::span<const SeedBall> balls) {
    std::vector<glm::ivec3> places;
    for_each_of_label(seeds, label, [&](glm::ivec3 at) { places.push_back(at); });
    const Slopes slopes(smooth);
    const double noise = noise_beside(volume, places), least = kNoiseSlope * noise;
    const auto settle = [&](glm::ivec3 at) {
        return settled(slopes, at, double{volume.value(glm::uvec3(at))}, least, noise);
    };
    const std::vector<Group> groups = groups_of(volume.grid(), places, label, balls);
    std::vector<float> values;
    for (glm::ivec3& at : places) {
        at = settle(at);
        values.push_back(float(slopes.value(at)));
    }
    VolumeEdit edit(make_volume(seeds.grid(), seeds.type(), [](glm::uvec3) { return 0.0; }));
    for (const Group& group : groups) {
        std::vector<float> ascending;
        for (const size_t i : group.seeds)
            ascending.push_back(values[i]);
        std::ranges::sort(ascending);
        const std::optional<float> upper = upper_kind(ascending);
        const auto is_upper = [&](double v) { return upper && v >= double{*upper}; };
        const bool keeps_upper =
            group.center ? is_upper(slopes.value(settle(*group.center)))
                         : 2 * std::ranges::count_if(ascending, is_upper) > std::ssize(ascending);
        for (const size_t i : group.seeds)
            if (!upper || is_upper(values[i]) == keeps_upper)
                edit.set(glm::uvec3(places[i]), label);
    }
    return edit.commit();
}

} // namespace palpate
