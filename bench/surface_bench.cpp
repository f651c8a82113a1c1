// Extraction of surfaces, timed: bench_surface [--repeat N] [--threads N] VOLUME...
//
// VOLUME is NAME=FILE:TYPE:X,Y,Z:SX,SY,SZ:ISO, raw little-endian samples of TYPE i16 or f32, x
// fastest, with their spacing in mm; or gyroid:SIDE or gaussian:SIDE:TRIANGLES. One line of JSON
// each: the median and the least of N runs in ms, by stage, and what came out.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "engine/base/timer.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

struct Subject {
    std::string name;
    Volume volume;
    float iso;
};

std::vector<std::string> parts(const std::string& text, char separator) {
    std::vector<std::string> found;
    std::istringstream in(text);
    for (std::string part; std::getline(in, part, separator);)
        found.push_back(part);
    return found;
}

template <class T>
Volume read_raw(const std::string& file, const Grid& grid) {
    std::vector<T> samples(sample_count(grid));
    std::ifstream in(file, std::ios::binary);
    in.read(reinterpret_cast<char*>(samples.data()),
            static_cast<std::streamsize>(samples.size() * sizeof(T)));
    if (!in)
        throw std::runtime_error(
            fmt::format("{}: expected {} bytes", file, samples.size() * sizeof(T)));
    return make_volume<T>(grid, samples);
}

Subject raw_subject(const std::string& text) {
    const size_t equals = text.find('=');
    const std::vector<std::string> part = parts(text.substr(equals + 1), ':');
    if (equals == std::string::npos || part.size() != 5)
        throw std::runtime_error(
            fmt::format("{}: expected NAME=FILE:TYPE:X,Y,Z:SX,SY,SZ:ISO", text));
    const auto size = parts(part[2], ','), spacing = parts(part[3], ',');
    Grid grid =
        make_grid({std::stoul(size.at(0)), std::stoul(size.at(1)), std::stoul(size.at(2))},
                  {std::stod(spacing.at(0)), std::stod(spacing.at(1)), std::stod(spacing.at(2))});
    return {text.substr(0, equals),
            part[1] == "f32" ? read_raw<float>(part[0], grid) : read_raw<int16_t>(part[0], grid),
            std::stof(part[4])};
}

Subject subject(const std::string& text) {
    const std::vector<std::string> part = parts(text, ':');
    if (part[0] == "gyroid") {
        const auto side = static_cast<uint32_t>(std::stoul(part.at(1)));
        const Grid grid = make_grid(glm::uvec3(side), glm::dvec3(1.0));
        return {text, synthetic::sample(synthetic::gyroid(side / 8.0), grid, ScalarType::f32),
                0.0f};
    }
    if (part[0] == "gaussian") {
        const auto side = static_cast<uint32_t>(std::stoul(part.at(1)));
        const Grid grid = make_grid(glm::uvec3(side), glm::dvec3(1.0));
        const double sigma = 24.0 * side / 128.0;
        const double r = std::sqrt(std::stod(part.at(2)) / (12.0 * std::numbers::pi));
        return {text,
                synthetic::sample(
                    synthetic::gaussian(glm::dvec3((side - 1) / 2.0), sigma, /*peak=*/1.0), grid,
                    ScalarType::f32),
                static_cast<float>(std::exp(-r * r / (2.0 * sigma * sigma)))};
    }
    return raw_subject(text);
}

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
}

void measure(const Subject& s, int repeat, const SurfaceOptions& options, const char* variant) {
    std::vector<double> ms, signs, count, memory, emit;
    Mesh mesh;
    SurfaceStages stages;
    for (int i = 0; i <= repeat; ++i) { // the first is not counted
        mesh = Mesh();
        const Timer timer;
        mesh = marching_cubes(s.volume, s.iso, options, &stages);
        if (i == 0)
            continue;
        ms.push_back(timer.ms());
        signs.push_back(stages.signs_ms);
        count.push_back(stages.count_ms);
        memory.push_back(stages.memory_ms);
        emit.push_back(stages.emit_ms);
    }
    fmt::print(
        "{{\"case\": \"{}/{}\", \"median_ms\": {:.3f}, \"min_ms\": {:.3f}, "
        "\"triangles\": {}, \"vertices\": {}, \"signs_ms\": {:.3f}, \"count_ms\": {:.3f}, "
        "\"memory_ms\": {:.3f}, \"emit_ms\": {:.3f}, \"bricks\": {}, \"bricks_read\": {}, "
        "\"blocks\": {}}}\n",
        s.name, variant, median(ms), *std::min_element(ms.begin(), ms.end()), mesh.triangles.size(),
        mesh.positions.size(), median(signs), median(count), median(memory), median(emit),
        stages.bricks, stages.bricks_read, stages.blocks_crossed);
}

int run(int argc, char** argv) {
    CLI::App app("Times the extraction of surfaces.");
    int repeat = 9, threads = 0;
    std::vector<std::string> volumes;
    app.add_option("--repeat", repeat, "runs of which the median is told")->capture_default_str();
    app.add_option("--threads", threads, "at most so many; 0: as many as there are cores");
    app.add_option("volumes", volumes, "see the head of surface_bench.cpp")->required();
    CLI11_PARSE(app, argc, argv);
    std::unique_ptr<tbb::global_control> limit;
    if (threads > 0)
        limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                      static_cast<size_t>(threads));
    for (const std::string& text : volumes) {
        const Subject s = subject(text);
        measure(s, repeat, {.normals = SurfaceNormals::gradient}, "normals");
        measure(s, repeat, {.normals = SurfaceNormals::none}, "plain");
        measure(s, repeat, {.topology = SurfaceTopology::correct}, "correct");
    }
    return 0;
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    try {
        return palpate::run(argc, argv);
    } catch (const std::exception& e) {
        fmt::print(stderr, "bench_surface: {}\n", e.what());
        return 1;
    }
}
