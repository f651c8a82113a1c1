#include "engine/segment/vesselness.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/segment/derivatives.h"

namespace palpate {

namespace {

const std::array<glm::ivec3, 6> kOrders{glm::ivec3{2, 0, 0}, {0, 2, 0}, {0, 0, 2},
                                        {1, 1, 0},           {1, 0, 1}, {0, 1, 1}};

// The Hessian matrix in the world, times s^2, of a sample.
glm::dmat3 hessian(const std::vector<std::vector<float>>& of, size_t i, const glm::dmat3& world) {
    const auto at = [&](size_t n) { return double{of[n][i]}; };
    const glm::dmat3 h(at(0), at(3), at(4), at(3), at(1), at(5), at(4), at(5), at(2));
    return world * h * glm::transpose(world);
}

glm::dvec3 eigenvalues_of(const glm::dmat3& h) {
    return eigenvalues(h[0][0], h[1][1], h[2][2], h[1][0], h[2][0], h[2][1]);
}

struct Scales {
    std::vector<Derivatives> all;
    std::vector<glm::dmat3> world; // of each, times its s
    VesselnessOptions options;
    double structure = 0;

    double measure(glm::dvec3 by_value) const {
        std::array<double, 3> e{by_value.x, by_value.y, by_value.z};
        std::sort(e.begin(), e.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
        const double sign = options.dark ? 1.0 : -1.0;
        if (!(sign * e[1] > 0.0 && sign * e[2] > 0.0))
            return 0.0;
        const double plate = e[1] / e[2], bc = e[1] * e[2];
        const double norm = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
        const auto gauss = [](double square, double width) {
            return std::exp(-0.5 * square / (width * width));
        };
        return (1.0 - gauss(plate * plate, options.alpha)) * gauss(e[0] * e[0] / bc, options.beta) *
               (1.0 - gauss(norm, structure));
    }

    BrickPtr brick(glm::uvec3 at) const {
        thread_local std::vector<std::vector<float>> parts;
        thread_local std::vector<float> made(kBrickSamples);
        const Volume& volume = all[0].volume();
        std::fill(made.begin(), made.end(), 0.0f);
        const glm::uvec3 valid = volume.valid_in_brick(at);
        for (size_t n = 0; n < all.size(); ++n) {
            if (!all[n].compute(at, kOrders, parts)) // flat at this scale: 0
                continue;
            for (uint32_t z = 0; z < valid.z; ++z)
                for (uint32_t y = 0; y < valid.y; ++y)
                    for (uint32_t x = 0; x < valid.x; ++x) {
                        const uint32_t i = offset_in_brick({x, y, z});
                        const glm::dmat3 h = hessian(parts, i, world[n]);
                        made[i] = std::isnan(h[0][0])
                                      ? NAN
                                      : std::max(made[i], float(measure(eigenvalues_of(h))));
                    }
        }
        if (volume.brick(at).is_constant() && std::isnan(volume.brick(at).value(0)))
            return constant_brick(ScalarType::f32, NAN);
        return Brick::make(std::span<const float>(made), valid);
    }

    // The largest |H| over the volume.
    Result<double> largest_norm(const Task& task) const {
        const Volume& volume = all[0].volume();
        const glm::uvec3 count = volume.brick_count();
        std::vector<double> largest(size_t{count.x} * count.y * count.z, 0.0);
        const bool whole = run_all(largest.size(), task, [&](size_t b) {
            thread_local std::vector<std::vector<float>> parts;
            const glm::uvec3 at(b % count.x, b / count.x % count.y,
                                b / (size_t{count.x} * count.y));
            const glm::uvec3 valid = volume.valid_in_brick(at);
            for (size_t n = 0; n < all.size(); ++n) {
                if (!all[n].compute(at, kOrders, parts))
                    continue;
                for (uint32_t z = 0; z < valid.z; ++z)
                    for (uint32_t y = 0; y < valid.y; ++y)
                        for (uint32_t x = 0; x < valid.x; ++x) {
                            const glm::dmat3 h =
                                hessian(parts, offset_in_brick({x, y, z}), world[n]);
                            double squares = 0;
                            for (int c = 0; c < 3; ++c)
                                squares += glm::dot(h[c], h[c]);
                            largest[b] = std::max(largest[b], std::sqrt(squares)); // NaN: kept out
                        }
            }
        });
        if (!whole)
            return stopped();
        return *std::max_element(largest.begin(), largest.end());
    }
};

Result<void> check(const VesselnessOptions& o, const Volume& volume) {
    if (!(o.from_mm > 0.0 && o.to_mm >= o.from_mm))
        return fail("scales: expected 0 < from <= to, found {:g} .. {:g} mm", o.from_mm, o.to_mm);
    if (o.steps < 1 || o.steps > 32)
        return fail("steps: expected 1 .. 32, found {}", o.steps);
    if (!(o.alpha > 0.0 && o.beta > 0.0 && o.structure.value_or(1.0) > 0.0))
        return fail("expected alpha, beta and structure above 0, found {:g}, {:g} and {:g}",
                    o.alpha, o.beta, o.structure.value_or(1.0));
    return Derivatives::check(volume, o.to_mm);
}

} // namespace

glm::dvec3 eigenvalues(double xx, double yy, double zz, double xy, double xz, double yz) {
    const double mean = (xx + yy + zz) / 3.0;
    const double a = xx - mean, b = yy - mean, c = zz - mean;
    const double off = xy * xy + xz * xz + yz * yz;
    const double p = std::sqrt((a * a + b * b + c * c + 2.0 * off) / 6.0);
    if (p == 0.0)
        return glm::dvec3(mean);
    const double determinant =
        a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    const double r = std::clamp(0.5 * determinant / (p * p * p), -1.0, 1.0);
    const double angle = std::acos(r) / 3.0;
    const double high = mean + 2.0 * p * std::cos(angle);
    const double low = mean + 2.0 * p * std::cos(angle + 2.0 * M_PI / 3.0);
    return {low, 3.0 * mean - low - high, high};
}

Result<BrickMaker> vesselness_bricks(const Volume& volume, const VesselnessOptions& o,
                                     const Task& task) {
    PALPATE_TRY(check(o, volume));
    auto scales = std::make_shared<Scales>();
    scales->options = o;
    const glm::dmat3 gradient =
        glm::transpose(glm::inverse(glm::dmat3(volume.grid().world_from_index)));
    for (int i = 0; i < o.steps; ++i) {
        const double s = o.steps == 1
                             ? o.from_mm
                             : o.from_mm * std::pow(o.to_mm / o.from_mm, double(i) / (o.steps - 1));
        scales->all.emplace_back(volume, s);
        scales->world.push_back(gradient * s);
    }
    if (o.structure) {
        scales->structure = *o.structure;
    } else {
        PALPATE_TRY(const double largest, scales->largest_norm(task));
        scales->structure = largest > 0.0 ? 0.5 * largest : 1.0;
    }
    return BrickMaker{volume.grid(), ScalarType::f32,
                      [scales](glm::uvec3 at) { return scales->brick(at); }};
}

Result<Volume> vesselness(const Volume& volume, const VesselnessOptions& options,
                          const Task& task) {
    PALPATE_TRY(const BrickMaker maker, vesselness_bricks(volume, options, task.part(0.0, 0.5)));
    return make_bricks(maker, task.part(options.structure ? 0.0 : 0.5, 1.0));
}

} // namespace palpate
