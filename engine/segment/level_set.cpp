#include "engine/segment/level_set.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "engine/segment/level_set_band.h"
#include "engine/segment/level_set_rates.h"
#include "engine/segment/packed_floats.h"

namespace palpate {

namespace {

Result<void> check(const LevelSetStart& start, const LevelSetForces& forces,
                   const LevelSetOptions& o) {
    const Volume& first = start.distance ? *start.distance : *start.labels;
    const auto fits = [&](const Volume* volume, const char* name,
                          bool may_be_packed = false) -> Result<void> {
        if (volume && volume->size() != first.size())
            return fail("level set: the {} has another size than the start", name);
        if (volume && volume->type() != ScalarType::f32 &&
            !(may_be_packed && volume->type() == ScalarType::u16))
            return fail("level set: expected a {} of type f32, found {}", name,
                        name_of(volume->type()));
        return {};
    };
    PALPATE_TRY(fits(start.distance, "distance"));
    PALPATE_TRY(fits(forces.speed, "speed"));
    PALPATE_TRY(fits(forces.edge, "edge"));
    for (size_t k = 0; forces.flow && k < 3; ++k)
        PALPATE_TRY(fits(&(*forces.flow)[k], "flow", true));
    const auto above = [](double value, const char* name) -> Result<void> {
        if (!(value >= 0.0) || !std::isfinite(value))
            return fail("level set: {}: expected a number of at least 0, found {:g}", name, value);
        return {};
    };
    PALPATE_TRY(above(o.curvature_mm, "curvature"));
    PALPATE_TRY(above(o.advection_mm, "advection"));
    PALPATE_TRY(above(o.tolerance_mm, "tolerance"));
    if (!std::isfinite(o.propagation) || !std::isfinite(o.flow))
        return fail("level set: expected numbers for propagation and flow, found {:g} and {:g}",
                    o.propagation, o.flow);
    if (o.most_iterations < 0)
        return fail("level set: expected 0 iterations or more, found {}", o.most_iterations);
    if (o.advection_mm > 0.0 && !forces.edge)
        return fail("level set: advection: expected an edge");
    return {};
}

// Bits of a brick's samples that pass(value).
template <class Pass>
void mark(const Brick& brick, LevelSetBand::Bits& bits, const Pass& pass) {
    thread_local std::vector<float> samples(kBrickSamples);
    brick.read(std::span<float>(samples));
    for (uint32_t i = 0; i < kBrickSamples; ++i)
        bits[i / kBrickSide] |= uint32_t(pass(samples[i])) << i % kBrickSide;
}

bool begin(LevelSetBand& band, const LevelSetStart& start, const LevelSetForces& forces) {
    std::vector<uint8_t> has_inside(band.brick_total());
    tbb::parallel_for(size_t{0}, band.brick_total(), [&](size_t n) {
        const glm::uvec3 at = band.position_of(n);
        const auto bar = [&](const Volume& volume) {
            if (volume.brick(at).no_data_count() > 0)
                mark(volume.brick(at), band.walls(n), [](float v) { return std::isnan(v); });
        };
        for (const Volume* volume : {start.distance, forces.speed, forces.edge})
            if (volume)
                bar(*volume);
        for (size_t k = 0; forces.flow && k < 3; ++k) {
            const Volume& flow = (*forces.flow)[k];
            bar(flow);
            if (flow.type() == ScalarType::u16)
                mark(flow.brick(at), band.walls(n),
                     [](float v) { return std::isnan(unpacked_float(uint16_t(v))); });
        }
        if (start.distance)
            mark(start.distance->brick(at), band.inside(n), [](float v) { return v < 0.0f; });
        else if (start.labels->brick(at).range().max > 0.0f)
            mark(start.labels->brick(at), band.inside(n),
                 [&](float v) { return start.label == 0 ? v > 0.0f : v == float(start.label); });
        for (uint32_t row = 0; row < kBrickRows; ++row) {
            band.inside(n)[row] &= ~band.walls(n)[row];
            has_inside[n] |= uint8_t(band.inside(n)[row] != 0);
        }
    });
    band.begin(start.distance ? [&](glm::uvec3 at) { return start.distance->value(at); }
                              : std::function<float(glm::uvec3)>());
    return std::ranges::any_of(has_inside, [](uint8_t has) { return has != 0; });
}

Volume labels_of(const LevelSetBand& band, const Grid& grid) {
    return make_bricks(grid, ScalarType::u8, {},
                       [&](glm::uvec3 at) {
                           const glm::uvec3 count = band.brick_count();
                           const LevelSetBand::Bits& inside =
                               band.inside(at.x + count.x * (at.y + size_t{count.y} * at.z));
                           std::vector<uint8_t> samples(kBrickSamples);
                           for_each_bit(inside, [&](uint32_t row, int x) {
                               samples[row * kBrickSide + uint32_t(x)] = 1;
                           });
                           return Brick::make(
                               std::span<const uint8_t>(samples),
                               glm::min(glm::uvec3(kBrickSide), grid.size - at * kBrickSide));
                       })
        .value();
}

Volume distance_of(LevelSetBand& band, const Grid& grid) {
    band.complete();
    return make_bricks(grid, ScalarType::f32, {},
                       [&](glm::uvec3 at) {
                           const glm::uvec3 count = band.brick_count();
                           const size_t n = at.x + count.x * (at.y + size_t{count.y} * at.z);
                           std::vector<float> samples(kBrickSamples);
                           for (uint32_t i = 0; i < kBrickSamples; ++i)
                               samples[i] = band.distance(n, i);
                           for_each_bit(band.walls(n), [&](uint32_t row, int x) {
                               samples[row * kBrickSide + uint32_t(x)] =
                                   std::numeric_limits<float>::quiet_NaN();
                           });
                           return Brick::make(
                               std::span<const float>(samples),
                               glm::min(glm::uvec3(kBrickSide), grid.size - at * kBrickSide));
                       })
        .value();
}

// The rates of all active samples by brick, and their bounds.
LevelSetRates::Bounds find_rates(const LevelSetBand& band, const LevelSetRates& rates,
                                 std::vector<std::vector<float>>& found) {
    const std::vector<size_t>& bricks = band.near_bricks();
    std::vector<LevelSetRates::Bounds> bounds(bricks.size());
    found.resize(bricks.size());
    tbb::parallel_for(size_t{0}, bricks.size(),
                      [&](size_t i) { bounds[i] = rates.of(band, bricks[i], found[i]); });
    LevelSetRates::Bounds all;
    for (const LevelSetRates::Bounds& brick : bounds) {
        all.steps = std::max(all.steps, brick.steps);
        all.fastest = std::max(all.fastest, brick.fastest);
    }
    return all;
}

// The second half of Heun's method, after a step of Euler's: moves the band by half of what the
// rates at its end differ from those that it was moved by, which samples that came into the active
// layer have from their neighbours.
void correct(LevelSetBand& band, const LevelSetRates& rates, double step) {
    std::vector<std::vector<float>> found;
    find_rates(band, rates, found);
    std::vector<float> fastest(found.size());
    tbb::parallel_for(size_t{0}, found.size(), [&](size_t i) {
        const size_t brick = band.near_bricks()[i];
        const float* change = band.changes().find(band.position_of(brick));
        float* rate = found[i].data();
        for_each_bit(band.active(brick), [&](uint32_t row, int x) {
            *rate = 0.5f * (*rate - change[row * kBrickSide + uint32_t(x)] / float(step));
            fastest[i] = std::max(fastest[i], std::abs(*rate++));
        });
    });
    const double most = double(*std::ranges::max_element(fastest));
    band.move(found, step * most > band.most_step_mm() ? band.most_step_mm() / most : step);
}

// Moves the band by the largest stable time step, of at most `most`; returns it, and in `squares`
// those of all changes.
double advance(LevelSetBand& band, const LevelSetRates& rates, double most, bool second_order,
               double& squares) {
    std::vector<std::vector<float>> found;
    const LevelSetRates::Bounds bounds = find_rates(band, rates, found);
    // The explicit step is monotone where the weight of a sample's own distance stays at least 0:
    // 1 - dt (3/2 sum of the speeds along the axes, as a one-sided difference has at most 3/2 of
    // it, + 2 b Z sum |M_ij|). LevelSetRates asks for 2 instead of 3/2.
    double step = std::min(bounds.steps > 0.0f ? 1.0 / double(bounds.steps) : 1.0, most);
    if (step * double(bounds.fastest) > band.most_step_mm())
        step = band.most_step_mm() / double(bounds.fastest);
    squares = band.move(found, step);
    if (second_order && !band.near_bricks().empty())
        correct(band, rates, step);
    return step;
}

} // namespace

Result<LevelSetResult> level_set(const LevelSetStart& start, const LevelSetForces& forces,
                                 const LevelSetOptions& options, const Task& task) {
    PALPATE_TRY(check(start, forces, options));
    const Grid& grid = (start.distance ? start.distance : start.labels)->grid();
    LevelSetBand band(grid);
    if (!begin(band, start, forces))
        return fail("level set: no sample to start from");
    const LevelSetRates rates(grid, forces, options);
    const bool second_order = forces.flow && options.flow != 0.0;
    LevelSetReport report;
    using End = LevelSetReport::End;
    for (;;) {
        const size_t active = band.active_count();
        if (active == 0)
            report.end = End::vanished;
        else if (report.iterations > 0 && report.change_mm <= options.tolerance_mm)
            report.end = End::settled;
        else if (!(report.time < options.last_time))
            report.end = End::time;
        else if (report.iterations < options.most_iterations) {
            if (task.stop.stop_requested())
                return stopped();
            double squares = 0.0;
            const double most = options.last_time - report.time;
            const double step = advance(band, rates, most, second_order, squares);
            ++report.iterations;
            report.time = step == most ? options.last_time : report.time + step;
            report.change_mm = std::sqrt(squares / double(active));
            if (task.progress)
                task.progress(double(report.iterations) / double(options.most_iterations));
            if (task.look)
                task.look([&] { return labels_of(band, grid); });
            if (options.moved && options.every > 0 && report.iterations % options.every == 0)
                options.moved(labels_of(band, grid), report);
            continue;
        }
        break;
    }
    LevelSetResult made{labels_of(band, grid), {}, report};
    if (options.with_distance)
        made.distance = distance_of(band, grid);
    return made;
}

std::string text_of(const LevelSetReport& r) {
    using End = LevelSetReport::End;
    const std::string after = fmt::format("after {} iterations", r.iterations);
    switch (r.end) {
        case End::vanished:
            return "no surface is left " + after;
        case End::settled:
            return fmt::format("settled {}, at a change of {:.3g} mm", after, r.change_mm);
        case End::time:
            return fmt::format("stopped at time {:g} {}", r.time, after);
        case End::iterations:
            break;
    }
    return fmt::format("stopped {}, at a change of {:.3g} mm: not settled", after, r.change_mm);
}

} // namespace palpate
