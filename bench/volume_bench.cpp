// What the volume store costs on one thread: samples, normals, and an edit of one voxel.

#include <benchmark/benchmark.h>

#include "engine/volume/bspline.h"
#include "engine/volume/builder.h"
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

void smooth_near(benchmark::State& state) {
    SmoothCursor cursor(phantom(128));
    wander(state, 0.1, [&](glm::dvec3 p) { return cursor.sample(p); });
}
BENCHMARK(smooth_near)->Name("sample/smooth_cursor/near");

void smooth_far(benchmark::State& state) {
    SmoothCursor cursor(phantom(128));
    wander(state, 30.0, [&](glm::dvec3 p) { return cursor.sample(p); });
}
BENCHMARK(smooth_far)->Name("sample/smooth_cursor/far");

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

} // namespace
} // namespace palpate

BENCHMARK_MAIN();
