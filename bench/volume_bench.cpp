// Times of the volume store and of space skipping on the CPU: samples, normals, an edit of one
// voxel, the comparison of bricks, the ranges of macro-cells after loading and after an edit, and
// their occupancy and distances after a new transfer function or iso-value.

#include <benchmark/benchmark.h>

#include <array>
#include <map>

#include "engine/render/occupancy.h"
#include "engine/volume/bspline.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"
#include "engine/volume/sample.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

const Volume& phantom(uint32_t side) {
    static std::map<uint32_t, Volume> made;
    const auto found = made.find(side);
    if (found != made.end())
        return found->second;
    const double spacing = 200.0 / side;
    return made
        .emplace(side, synthetic::sample_ct_phantom(
                           make_grid(glm::uvec3(side), glm::dvec3(spacing), glm::dvec3(-100.0))))
        .first->second;
}

// A point that wanders `step` samples at a time about the centre of the volume.
template <class Evaluate>
void wander(benchmark::State& state, double step, const Evaluate& evaluate) {
    glm::dvec3 p(64.0);
    uint32_t i = 0;
    for (auto _ : state) {
        const glm::dvec3 way(synthetic::noise({i, 0, 0}, 1), synthetic::noise({i, 1, 0}, 1),
                             synthetic::noise({i, 2, 0}, 1));
        ++i;
        p = glm::clamp(p + step * way, glm::dvec3(8.0), glm::dvec3(119.0));
        benchmark::DoNotOptimize(evaluate(p));
    }
}

void walk_only(benchmark::State& state) {
    wander(state, 0.1, [](glm::dvec3 p) { return p.x; });
}
BENCHMARK(walk_only)->Name("sample/the_walk_itself");

void trilinear_cursor(benchmark::State& state) {
    SampleCursor cursor(phantom(128));
    wander(state, 0.1, [&](glm::dvec3 p) { return cursor.value(p); });
}
BENCHMARK(trilinear_cursor)->Name("sample/trilinear_cursor/near");

void central_cursor(benchmark::State& state) {
    SampleCursor cursor(phantom(128));
    wander(state, 0.1, [&](glm::dvec3 p) { return cursor.gradient(p); });
}
BENCHMARK(central_cursor)->Name("sample/central_gradient_cursor/near");

void smooth(benchmark::State& state, double step) {
    SmoothCursor cursor(phantom(128));
    wander(state, step, [&](glm::dvec3 p) { return cursor.sample(p); });
}
BENCHMARK_CAPTURE(smooth, near, 0.1)->Name("sample/smooth_cursor/near");
BENCHMARK_CAPTURE(smooth, far, 30.0)->Name("sample/smooth_cursor/far");

void commit_one_voxel(benchmark::State& state) {
    Volume volume = phantom(static_cast<uint32_t>(state.range(0)));
    double value = 0.0;
    for (auto _ : state) {
        VolumeEdit edit(volume);
        edit.set(glm::uvec3(100), value += 1.0);
        volume = edit.commit();
    }
}
BENCHMARK(commit_one_voxel)->Name("edit/commit_one_voxel/i16")->Arg(128)->Arg(512);

void changes_of_one_voxel(benchmark::State& state) {
    const Volume before = phantom(static_cast<uint32_t>(state.range(0)));
    VolumeEdit edit(before);
    edit.set(glm::uvec3(100), 3000.0);
    const Volume after = edit.commit();
    for (auto _ : state)
        benchmark::DoNotOptimize(changed_bricks(before, after));
}
BENCHMARK(changes_of_one_voxel)->Name("edit/changed_bricks_of_one_voxel/i16")->Arg(128)->Arg(512);

void trilinear_anywhere(benchmark::State& state) {
    const Volume& volume = phantom(128);
    wander(state, 30.0, [&](glm::dvec3 p) { return trilinear(volume, p); });
}
BENCHMARK(trilinear_anywhere)->Name("sample/trilinear/far");

// Two bricks that differ in their last sample alone: every block is looked at.
void compare_bricks(benchmark::State& state) {
    const Volume& before = phantom(128);
    VolumeEdit edit(before);
    edit.set(glm::uvec3(63), 3000.0);
    const Volume after = edit.commit();
    const Brick& a = before.brick(glm::uvec3(1));
    const Brick& b = after.brick(glm::uvec3(1));
    for (auto _ : state)
        benchmark::DoNotOptimize(differing_blocks(a, b));
    state.SetBytesProcessed(static_cast<int64_t>(state.iterations()) * 2 * 2 * kBrickSamples);
}
BENCHMARK(compare_bricks)->Name("edit/compare_bricks/i16");

// The work on each brick on its way to the device.
void read_brick_as_floats(benchmark::State& state) {
    const Brick& brick = phantom(128).brick(glm::uvec3(1));
    std::vector<float> samples(kBrickSamples);
    for (auto _ : state) {
        brick.read(std::span(samples));
        benchmark::DoNotOptimize(samples.data());
    }
    state.SetBytesProcessed(static_cast<int64_t>(state.iterations()) * 4 * kBrickSamples);
}
BENCHMARK(read_brick_as_floats)->Name("upload/read_brick/i16_as_f32");

// Visible values are made anew in each turn, as a scene does.
void occupancy(benchmark::State& state, VisibleValues (*visible)(double value)) {
    const Volume& volume = phantom(static_cast<uint32_t>(state.range(0)));
    const CellRanges ranges = make_cell_ranges(volume, static_cast<uint32_t>(state.range(1)));
    const double margin = range_margin(volume);
    size_t turn = 0;
    for (auto _ : state) {
        const double value = 300.0 + static_cast<double>(turn++ % 8);
        std::vector<uint8_t> cells = occupied_cells(ranges, visible(value), margin, false);
        chebyshev_distances(cells, ranges.count);
        benchmark::DoNotOptimize(cells.data());
    }
}
BENCHMARK_CAPTURE(occupancy, new_transfer_function,
                  [](double v) { return VisibleValues(make_table(window_function(v, 900, 0.3))); })
    ->Args({256, 4})
    ->Args({512, 8})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(occupancy, new_iso_value,
                  [](double v) { return VisibleValues(std::array<double, 1>{v}); })
    ->Args({256, 4})
    ->Args({512, 8})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void all_ranges(benchmark::State& state) {
    const Volume& volume = phantom(static_cast<uint32_t>(state.range(0)));
    for (auto _ : state)
        benchmark::DoNotOptimize(make_cell_ranges(volume, static_cast<uint32_t>(state.range(1))));
}
BENCHMARK(all_ranges)
    ->Name("occupancy/cell_ranges/samples/side")
    ->Args({256, 4})
    ->Args({512, 8})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void edited_ranges(benchmark::State& state) {
    const Volume& volume = phantom(static_cast<uint32_t>(state.range(0)));
    VolumeEdit edit(volume);
    for (uint32_t z = 100; z < 110; ++z)
        for (uint32_t y = 100; y < 110; ++y)
            for (uint32_t x = 100; x < 110; ++x)
                edit.set({x, y, z}, 500.0);
    const Volume next = edit.commit();
    const std::vector<ChangedBrick> changed = changed_bricks(volume, next);
    CellRanges ranges = make_cell_ranges(volume, 8);
    for (auto _ : state)
        update_cell_ranges(ranges, next, changed);
}
BENCHMARK(edited_ranges)
    ->Name("occupancy/cell_ranges_of_an_edit_of_10^3/samples")
    ->Arg(256)
    ->Unit(benchmark::kMicrosecond)
    ->UseRealTime();

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
