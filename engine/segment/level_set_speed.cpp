#include "engine/segment/level_set_speed.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/segment/gaussian.h"
#include "engine/segment/map_values.h"

namespace palpate {

Result<Volume> threshold_speed(const Volume& volume, const ValueInterval& interval,
                               const Task& task) {
    if (!std::isfinite(interval.low) || !std::isfinite(interval.high) ||
        !(interval.low < interval.high))
        return fail("expected values from a lower to a higher one, found {:g} .. {:g}",
                    interval.low, interval.high);
    const double half = 0.5 * (interval.high - interval.low), middle = interval.low + half;
    return map_values<float>(std::array{&volume}, task, [=](auto v) {
        return std::isnan(v[0]) ? v[0]
                                : float(std::max(-1.0, 1.0 - std::abs(v[0] - middle) / half));
    });
}

Result<Volume> edge_speed(const Volume& volume, const EdgeSpeedOptions& o, const Task& task) {
    if (!(o.edge > 0.0))
        return fail("edge: expected a number above 0, found {:g}", o.edge);
    PALPATE_TRY(const Volume slopes, gradient_magnitude(volume, {o.sigma_mm}, task.part(0.0, 0.9)));
    return map_values<float>(std::array{&slopes}, task.part(0.9, 1.0), [=](auto v) {
        return std::isnan(v[0]) ? v[0] : float(1.0 / (1.0 + std::pow(v[0] / o.edge, o.exponent)));
    });
}

Result<Volume> region_speed(const Volume& volume, const SeedValues& inside,
                            const SeedValues& outside, const Task& task) {
    const double in = spread_of(inside, volume), out = spread_of(outside, volume);
    return map_values<float>(std::array{&volume}, task, [=](auto v) {
        if (std::isnan(v[0]))
            return v[0];
        const double a = (v[0] - inside.mean) / in, b = (v[0] - outside.mean) / out;
        // (p_in - p_out) / (p_in + p_out) without quotients of two numbers near 0.
        return float(std::tanh(0.5 * (0.5 * (b * b - a * a) + std::log(out / in))));
    });
}

} // namespace palpate
