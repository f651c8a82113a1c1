// What a new transfer function or iso-value costs before the next frame: occupancy of the
// macro-cells and their distances. And what the cells' ranges cost when a volume is loaded or
// edited.

#include <benchmark/benchmark.h>

#include <array>
#include <map>
#include <optional>

#include "engine/render/occupancy.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate {
namespace {

// A ball of tissue with a shell of bone in air: as much of each as in a CT of a head.
const Volume& head(uint32_t samples) {
    static std::map<uint32_t, Volume> made;
    const auto found = made.find(samples);
    if (found != made.end())
        return found->second;
    const double middle = 0.5 * (samples - 1.0);
    const Volume volume = make_volume(make_grid(glm::uvec3(samples), glm::dvec3(0.5)),
                                      ScalarType::i16, [&](glm::uvec3 i) {
                                          const glm::dvec3 p = (glm::dvec3(i) - middle) / middle;
                                          const double r2 = glm::dot(p, p);
                                          return r2 > 0.6 ? -1000.0 : r2 > 0.5 ? 1000.0 : 40.0;
                                      });
    return made.emplace(samples, volume).first->second;
}

void change(benchmark::State& state, const VisibleValues& (*visible)(size_t)) {
    const Volume& volume = head(static_cast<uint32_t>(state.range(0)));
    const CellRanges ranges = make_cell_ranges(volume, static_cast<uint32_t>(state.range(1)));
    const double margin = range_margin(volume);
    size_t turn = 0;
    for (auto _ : state) {
        std::vector<uint8_t> cells = occupied_cells(ranges, visible(turn++), margin, false);
        chebyshev_distances(cells, ranges.count);
        benchmark::DoNotOptimize(cells.data());
    }
}

// Made anew in each turn, as a scene does.
void transfer_function(benchmark::State& state) {
    static std::optional<VisibleValues> made;
    change(state, [](size_t turn) -> const VisibleValues& {
        made.emplace(make_table(window_function(100.0 + static_cast<double>(turn % 8), 900, 0.3)));
        return *made;
    });
}
BENCHMARK(transfer_function)
    ->Name("occupancy/new_transfer_function/samples/side")
    ->Args({256, 4})
    ->Args({512, 8})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void iso_value(benchmark::State& state) {
    static std::optional<VisibleValues> made;
    change(state, [](size_t turn) -> const VisibleValues& {
        const std::array<double, 1> isos{300.0 + static_cast<double>(turn % 8)};
        made.emplace(isos);
        return *made;
    });
}
BENCHMARK(iso_value)
    ->Name("occupancy/new_iso_value/samples/side")
    ->Args({256, 4})
    ->Args({512, 8})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void all_ranges(benchmark::State& state) {
    const Volume& volume = head(static_cast<uint32_t>(state.range(0)));
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
    const Volume& volume = head(static_cast<uint32_t>(state.range(0)));
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
