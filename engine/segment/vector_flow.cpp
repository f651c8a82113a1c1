#include "engine/segment/vector_flow.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/segment/multigrid.h"
#include "engine/segment/packed_floats.h"
#include "engine/segment/pointwise.h"
#include "engine/segment/signed_distance.h"

namespace palpate {

namespace {

// Samples of the bricks, scaled, as an array that holds every brick; no data is 0.
BrickArray<float> array_of(const BrickMaker& maker, float scale, const Task& task) {
    BrickArray<float> array(maker.grid.size, 0.0f);
    const glm::uvec3 count = array.brick_count();
    run_all(size_t{count.x} * count.y * count.z, task, [&](size_t i) {
        const glm::uvec3 at(i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y));
        float* to = array.write(at);
        maker.brick(at)->read(std::span<float>(to, kBrickSamples));
        for (size_t k = 0; k < kBrickSamples; ++k)
            to[k] = std::isnan(to[k]) ? 0.0f : scale * to[k];
    });
    return array;
}

// A copy, every brick of it written.
BrickArray<float> copy_of(const BrickArray<float>& from) {
    BrickArray<float> array(from.size(), 0.0f);
    const glm::uvec3 count = array.brick_count();
    run_all(size_t{count.x} * count.y * count.z, {}, [&](size_t i) {
        const glm::uvec3 at(i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y));
        std::copy_n(from.find(at), kBrickSamples, array.write(at));
    });
    return array;
}

// Takes from every value what packed_float() would.
void round_off(BrickArray<float>& a) {
    const glm::uvec3 count = a.brick_count();
    run_all(size_t{count.x} * count.y * count.z, {}, [&](size_t i) {
        float* to = a.find({i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y)});
        for (size_t k = 0; k < kBrickSamples; ++k)
            to[k] = unpacked_float(packed_float(to[k]));
    });
}

// a[i] *= b[i] over all bricks; the root of the sum of squares of the results within the volume.
double multiply(BrickArray<float>& a, const BrickArray<float>& b) {
    const glm::uvec3 count = a.brick_count();
    std::vector<double> squares(size_t{count.x} * count.y * count.z, 0.0);
    run_all(squares.size(), {}, [&](size_t i) {
        const glm::uvec3 at(i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y));
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), a.size() - at * kBrickSide);
        float* to = a.find(at);
        const float* by = b.find(at);
        for (size_t k = 0; k < kBrickSamples; ++k)
            to[k] *= by[k];
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const double v = to[offset_in_brick({x, y, z})];
                    squares[i] += v * v;
                }
    });
    double sum = 0;
    for (const double one : squares)
        sum += one;
    return std::sqrt(sum);
}

// The result where the mask, an edge map, has data.
Result<Volume> made_of(BrickArray<float> u, const Grid& grid, const std::optional<Volume>& mask,
                       const Task& task) {
    PALPATE_TRY(Volume made, take_volume(std::move(u), grid, task));
    if (!mask)
        return made;
    PALPATE_TRY(const BrickMaker maker, expression_bricks(made, "a + 0*b", {{"b", *mask}}));
    return make_bricks(maker, task);
}

// The same as packed floats; a brick of `u` is freed once it is packed.
Result<Volume> packed_of(BrickArray<float> u, const Grid& grid, const Task& task) {
    return make_bricks(grid, ScalarType::u16, task, [&](glm::uvec3 at) {
        std::vector<uint16_t> samples(kBrickSamples);
        std::transform(u.find(at), u.find(at) + kBrickSamples, samples.begin(), packed_float);
        u.clear(at);
        return Brick::make(std::span<const uint16_t>(samples),
                           glm::min(glm::uvec3(kBrickSide), grid.size - at * kBrickSide));
    });
}

} // namespace

Result<Volume> vector_flow(Volume given, int axis, const VectorFlowOptions& o, const Task& task,
                           VectorFlowReport* report) {
    std::optional<Volume> edges(std::move(given)); // until it is read
    const Grid grid = edges->grid();
    PALPATE_TRY(check_perpendicular(grid, "the edge map"));
    if (!(o.mu > 0.0) || !std::isfinite(o.mu))
        return fail("mu: expected a number above 0, found {:g}", o.mu);
    if (!(o.residual >= 1e-6 && o.residual <= 1.0))
        return fail("residual: expected 1e-06 .. 1, found {:g}", o.residual);
    const ValueRange range = edges->range();
    const float scale =
        range.empty() || range.max == range.min ? 0.0f : 1.0f / (range.max - range.min);
    std::optional<Volume> mask;
    if (!o.packed && edges->no_data_count() > 0)
        mask = edges;
    const auto read = [&](Result<BrickMaker> maker, const Task& part) -> Result<BrickArray<float>> {
        if (!maker)
            return pass_on(maker);
        return array_of(*maker, scale, part);
    };
    PALPATE_TRY(BrickArray<float> weight,
                read(gradient_magnitude_bricks(*edges, {0.0}), task.part(0.0, 0.1)));
    multiply(weight, weight);
    if (o.packed)
        round_off(weight);
    PALPATE_TRY(BrickArray<float> u,
                read(derivative_bricks(*edges, {0.0, axis, {}}), task.part(0.1, 0.2)));
    edges.reset();
    if (task.stop.stop_requested())
        return stopped();
    BrickArray<float> right = copy_of(u);
    const double whole = multiply(right, weight);
    const auto made = [&](BrickArray<float> field, const Task& part) {
        return o.packed ? packed_of(std::move(field), grid, part)
                        : made_of(std::move(field), grid, mask, part);
    };
    if (whole == 0.0) { // no edge along this axis: nothing drives the flow
        if (report)
            *report = {};
        return made(std::move(u), task.part(0.2, 1.0));
    }
    Multigrid grids(spacing_mm(grid), o.mu, std::move(u), std::move(weight), std::move(right),
                    o.packed);
    const double first = std::max(grids.residual() / whole, o.residual);
    double share = first;
    int cycles = 0;
    while (share > o.residual) {
        if (task.stop.stop_requested())
            return stopped();
        if (cycles == o.most_cycles)
            return fail("expected a residual of {:g} within {} cycles, found {:g}", o.residual,
                        o.most_cycles, share);
        grids.cycle();
        ++cycles;
        share = grids.residual() / whole;
        if (task.progress && first > o.residual)
            task.progress(0.2 + 0.7 * std::clamp(std::log(first / std::max(share, 1e-30)) /
                                                     std::log(first / o.residual),
                                                 0.0, 1.0));
    }
    if (report)
        *report = {share, cycles};
    return made(grids.take(), task.part(0.9, 1.0));
}

Result<VectorField> vector_flow(const Volume& edges, const VectorFlowOptions& options,
                                const Task& task) {
    std::vector<Volume> parts;
    for (int axis = 0; axis < 3; ++axis) {
        PALPATE_TRY(Volume part,
                    vector_flow(edges, axis, options, task.part(axis / 3.0, (axis + 1) / 3.0)));
        parts.push_back(std::move(part));
    }
    return VectorField{parts[0], parts[1], parts[2]};
}

Result<Volume> length(const VectorField& field, const Task& task) {
    PALPATE_TRY(const BrickMaker maker, expression_bricks(field[0], "sqrt(a*a + b*b + c*c)",
                                                          {{"b", field[1]}, {"c", field[2]}}));
    return make_bricks(maker, task);
}

} // namespace palpate
