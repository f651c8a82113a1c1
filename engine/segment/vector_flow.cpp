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

// The first guess, the gradient, is off mostly between neighbours, which one relaxation mends. To
// residuals from here on it is tried before a cycle.
constexpr double kCoarse = 0.1;

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

glm::uvec3 brick_at(const BrickArray<float>& a, size_t i) {
    const glm::uvec3 count = a.brick_count();
    return {i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y)};
}

// Calls work(samples of a brick, number of the brick), all at once.
template <class Work>
void for_bricks(BrickArray<float>& a, const Work& work) {
    const glm::uvec3 count = a.brick_count();
    run_all(size_t{count.x} * count.y * count.z, {},
            [&](size_t i) { work(a.find(brick_at(a, i)), i); });
}

PackedWeights code_of(BrickArray<float>& weight) {
    const glm::uvec3 count = weight.brick_count();
    std::vector<float> largest(size_t{count.x} * count.y * count.z);
    for_bricks(weight, [&](const float* of, size_t i) {
        largest[i] = *std::max_element(of, of + kBrickSamples);
    });
    return PackedWeights(*std::max_element(largest.begin(), largest.end()));
}

// The root of the sum of squares within the volume.
double norm(const BrickArray<float>& a) {
    const glm::uvec3 count = a.brick_count();
    std::vector<double> squares(size_t{count.x} * count.y * count.z, 0.0);
    run_all(squares.size(), {}, [&](size_t i) {
        const glm::uvec3 at = brick_at(a, i);
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), a.size() - at * kBrickSide);
        const float* of = a.find(at);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const double v = of[offset_in_brick({x, y, z})];
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

Result<void> check(const Volume& edges, const VectorFlowOptions& o) {
    PALPATE_TRY(check_perpendicular(edges.grid(), "the edge map"));
    if (!(o.mu > 0.0) || !std::isfinite(o.mu))
        return fail("mu: expected a number above 0, found {:g}", o.mu);
    if (!(o.residual >= 1e-6 && o.residual <= 1.0))
        return fail("residual: expected 1e-06 .. 1, found {:g}", o.residual);
    return {};
}

// Derivatives of the edge map that is rescaled to 0 .. 1.
Result<BrickArray<float>> read(const Volume& edges, Result<BrickMaker> maker, const Task& task) {
    if (!maker)
        return pass_on(maker);
    const ValueRange range = edges.range();
    const float scale =
        range.empty() || range.max == range.min ? 0.0f : 1.0f / (range.max - range.min);
    BrickArray<float> array = array_of(*maker, scale, task);
    if (task.stop.stop_requested())
        return stopped();
    return array;
}

// Solves for the flow of a component that begins as u.
Result<BrickArray<float>> solved(Multigrid& grids, BrickArray<float> u, const VectorFlowOptions& o,
                                 const Task& task, VectorFlowReport* report) {
    BrickArray<float> right = grids.weighted(u);
    const double whole = norm(right);
    if (whole == 0.0) { // no edge along this axis: nothing drives the flow
        if (report)
            *report = {};
        return u;
    }
    grids.start(std::move(u), std::move(right));
    const double first = std::max(grids.residual() / whole, o.residual);
    double share = first;
    int cycles = 0;
    if (share > o.residual && o.residual >= kCoarse) {
        grids.smooth();
        share = grids.residual() / whole;
    }
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
            task.progress(std::clamp(
                std::log(first / std::max(share, 1e-30)) / std::log(first / o.residual), 0.0, 1.0));
    }
    if (report)
        *report = {share, cycles};
    return grids.take();
}

// One component alone. `edges` is freed once it is read; `packed`: |g|^2 is kept in 16 bits.
Result<BrickArray<float>> component(std::optional<Volume>& edges, int axis,
                                    const VectorFlowOptions& o, bool packed, const Task& task,
                                    VectorFlowReport* report) {
    PALPATE_TRY(check(*edges, o));
    const Grid grid = edges->grid();
    PALPATE_TRY(BrickArray<float> weight,
                read(*edges, gradient_magnitude_bricks(*edges, {0.0}), task.part(0.0, 0.1)));
    for_bricks(weight, [](float* of, size_t) {
        for (size_t k = 0; k < kBrickSamples; ++k)
            of[k] *= of[k];
    });
    std::optional<PackedWeights> code;
    if (packed)
        code = code_of(weight);
    PALPATE_TRY(BrickArray<float> u,
                read(*edges, derivative_bricks(*edges, {0.0, axis, {}}), task.part(0.1, 0.2)));
    edges.reset();
    Multigrid grids(spacing_mm(grid), o.mu, std::move(weight), code);
    return solved(grids, std::move(u), o, task.part(0.2, 0.9), report);
}

// An edge map, where it has places without data.
std::optional<Volume> mask_of(const Volume& edges) {
    return edges.no_data_count() > 0 ? std::optional(edges) : std::nullopt;
}

} // namespace

Result<Volume> vector_flow(Volume given, int axis, const VectorFlowOptions& o, const Task& task,
                           VectorFlowReport* report) {
    const Grid grid = given.grid();
    const std::optional<Volume> mask = o.packed ? std::nullopt : mask_of(given);
    std::optional<Volume> edges(std::move(given));
    PALPATE_TRY(BrickArray<float> u, component(edges, axis, o, o.packed, task, report));
    return o.packed ? packed_of(std::move(u), grid, task.part(0.9, 1.0))
                    : made_of(std::move(u), grid, mask, task.part(0.9, 1.0));
}

Result<VectorField> vector_flow(const Volume& edges, const VectorFlowOptions& o, const Task& task) {
    if (o.packed) { // one at a time, as little memory as that needs
        std::vector<Volume> parts;
        for (int axis = 0; axis < 3; ++axis) {
            PALPATE_TRY(Volume part,
                        vector_flow(edges, axis, o, task.part(axis / 3.0, (axis + 1) / 3.0)));
            parts.push_back(std::move(part));
        }
        return VectorField{parts[0], parts[1], parts[2]};
    }
    PALPATE_TRY(check(edges, o));
    std::vector<BrickArray<float>> fields;
    for (int axis = 0; axis < 3; ++axis) {
        PALPATE_TRY(BrickArray<float> g,
                    read(edges, derivative_bricks(edges, {0.0, axis, {}}), {task.stop, {}}));
        fields.push_back(std::move(g));
    }
    BrickArray<float> weight(edges.size());
    for_bricks(weight, [&](float*, size_t i) {
        const glm::uvec3 at = brick_at(weight, i);
        const float *x = fields[0].find(at), *y = fields[1].find(at), *z = fields[2].find(at);
        float* to = weight.write(at);
        for (size_t k = 0; k < kBrickSamples; ++k)
            to[k] = x[k] * x[k] + y[k] * y[k] + z[k] * z[k];
    });
    Multigrid grids(spacing_mm(edges.grid()), o.mu, std::move(weight));
    const std::optional<Volume> mask = mask_of(edges);
    std::vector<Volume> parts;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double from = 0.1 + 0.3 * double(axis);
        PALPATE_TRY(BrickArray<float> v, solved(grids, std::move(fields[axis]), o,
                                                task.part(from, from + 0.25), nullptr));
        PALPATE_TRY(Volume part,
                    made_of(std::move(v), edges.grid(), mask, task.part(from + 0.25, from + 0.3)));
        parts.push_back(std::move(part));
    }
    return VectorField{parts[0], parts[1], parts[2]};
}

Result<Volume> vector_flow_length(const Volume& edges, const VectorFlowOptions& options,
                                  const Task& task) {
    // The edge map is in 0 .. 1, so that none of its gradients, and no flow, is longer than this.
    const double longest = glm::length(1.0 / spacing_mm(edges.grid()));
    const PackedWeights code(2.0f * float(longest));
    BrickArray<uint16_t> before(edges.size()); // the length of the components before
    for (int axis = 0;; ++axis) {
        std::optional<Volume> read(edges);
        PALPATE_TRY(
            BrickArray<float> v,
            component(read, axis, options, true, task.part(0.3 * axis, 0.3 * (axis + 1)), nullptr));
        for_bricks(v, [&](float* of, size_t i) {
            if (const uint16_t* so_far = before.find(brick_at(v, i)))
                for (size_t k = 0; k < kBrickSamples; ++k) {
                    const float length = code.unpack(so_far[k]);
                    of[k] = std::sqrt(length * length + of[k] * of[k]);
                }
            else // the first
                for (size_t k = 0; k < kBrickSamples; ++k)
                    of[k] = std::abs(of[k]);
        });
        if (axis == 2)
            return made_of(std::move(v), edges.grid(), mask_of(edges), task.part(0.9, 1.0));
        for_bricks(v, [&](float* of, size_t i) {
            std::transform(of, of + kBrickSamples, before.write(brick_at(v, i)),
                           [&](float length) { return code.pack(length); });
            v.clear(brick_at(v, i));
        });
    }
}

} // namespace palpate
