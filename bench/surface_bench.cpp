// Surfaces, timed: bench_surface [--repeat N] [--threads N] [--gpu] CASE...
//
// Full extraction of NAME=FILE:TYPE:X,Y,Z:SX,SY,SZ:ISO, raw little-endian samples of TYPE u8, i16
// or f32, x fastest, with their spacing in mm; for ISO labels, of the walls between all labels; of
// gyroid:SIDE or gaussian:SIDE:TRIANGLES. Erosion of a Gaussian of 128^3,
// edits:TRIANGLES:RADIUS:TYPE[:BY], as in table 1 of Vidholm & Agmund (2004): BY is blocks (those
// that read a changed sample made again), gpu (the same on the graphics device, upload of the
// samples included) or tracker (the paper's own extractor on the thresholded volume: its arrays
// updated locally, all triangles made again, as printed). Windows for the hand, local:SIDE. With
// --gpu full extraction on the graphics device as well, from samples that lie there. One line of
// JSON each: the median and the least of N runs in ms, by stage, and what came out.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include "engine/base/timer.h"
#include "engine/surface/block_surface.h"
#include "engine/surface/local_surface.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"
#include "engine/surface/tracker.h"
#include "engine/surface_gpu/gpu_surface.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
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
            part[1] == "f32"  ? read_raw<float>(part[0], grid)
            : part[1] == "u8" ? read_raw<uint8_t>(part[0], grid)
                              : read_raw<int16_t>(part[0], grid),
            part[4] == "labels" ? 0.0f : std::stof(part[4])};
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

void measure_labels(const Subject& s, int repeat) {
    for (const uint32_t passes : {0u, 10u}) {
        std::vector<double> ms;
        Mesh mesh;
        for (int i = 0; i <= repeat; ++i) { // the first is not counted
            mesh = Mesh();
            const Timer timer;
            mesh = surface_nets(s.volume, {.passes = passes});
            if (i > 0)
                ms.push_back(timer.ms());
        }
        fmt::print(
            "{{\"case\": \"{}/{}_passes\", \"median_ms\": {:.3f}, \"min_ms\": {:.3f}, "
            "\"triangles\": {}, \"vertices\": {}}}\n",
            s.name, passes, median(ms), *std::min_element(ms.begin(), ms.end()),
            mesh.triangles.size(), mesh.positions.size());
    }
}

double percentile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, static_cast<size_t>(share * values.size()))];
}

struct Gpu {
    Device device{DeviceOptions{}};
    ExtractPipelines pipelines{device};
};
Gpu& gpu_device() { // made when a case asks for it
    static Gpu gpu;
    return gpu;
}

void measure_gpu(const Subject& s, int repeat) {
    Gpu& gpu = gpu_device();
    Timer timer;
    GpuSurface surface(gpu.pipelines, s.volume, s.iso);
    const double first_ms = timer.ms();
    std::vector<double> ms, mesh_ms;
    std::map<std::string, std::vector<double>> passes;
    for (int i = 0; i <= repeat; ++i) {
        timer = Timer();
        surface.set_iso(s.iso);
        if (i == 0)
            continue;
        ms.push_back(timer.ms());
        for (const PassTime& pass : surface.pass_times())
            passes[pass.name].push_back(pass.gpu_ms);
    }
    size_t vertices = 0;
    for (int i = 0; i < std::min(repeat, 3); ++i) {
        timer = Timer();
        vertices = surface.mesh().positions.size();
        mesh_ms.push_back(timer.ms());
    }
    fmt::print(
        "{{\"case\": \"{}/gpu\", \"device\": \"{}\", \"median_ms\": {:.3f}, "
        "\"min_ms\": {:.3f}, \"triangles\": {}, \"vertices\": {}, \"first_ms\": {:.1f}, "
        "\"cull_ms\": {:.3f}, \"count_ms\": {:.3f}, \"emit_ms\": {:.3f}, "
        "\"read_back_ms\": {:.1f}, \"blocks\": {}}}\n",
        s.name, gpu.device.info().name, median(ms), *std::min_element(ms.begin(), ms.end()),
        surface.triangles(), vertices, first_ms, median(passes["cull"]), median(passes["count"]),
        median(passes["emit"]), median(mesh_ms), surface.blocks().size());
}

// A ball taken out of a volume: values fall to iso at its surface, as of a distance.
Volume eroded(const Volume& volume, glm::dvec3 centre, double radius, double iso, double slope) {
    VolumeEdit edit(volume);
    const glm::ivec3 low(glm::ceil(centre - radius)), high(glm::floor(centre + radius));
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                const double distance = glm::length(glm::dvec3(x, y, z) - centre);
                if (distance < radius)
                    edit.set(glm::uvec3(x, y, z), std::min(double{edit.value(glm::uvec3(x, y, z))},
                                                           iso + slope * (distance - radius)));
            }
    return edit.commit();
}

struct Remade {
    double blocks = 0.0, triangles = 0.0;
};

// What keeps a surface in step with a volume.
struct KeptSurface {
    // Outside the time: what an edit of `low` .. `high` needs besides the volume itself.
    std::function<void(const Volume& after, glm::uvec3 low, glm::uvec3 high)> prepare;
    std::function<Remade(const Volume& after, std::span<const ChangedBrick>)> update;
    std::function<uint64_t()> triangles;
};

template <class Surface>
KeptSurface kept_in_blocks(std::shared_ptr<Surface> surface) {
    return {[](const Volume&, glm::uvec3, glm::uvec3) {},
            [=](const Volume& after, std::span<const ChangedBrick> changed) {
                const auto update = surface->update(after, changed);
                return Remade{static_cast<double>(update.blocks.size()),
                              static_cast<double>(update.triangles)};
            },
            [=] { return surface->triangles(); }};
}

// The tracker reads a segmentation, which follows the grey values outside the time.
KeptSurface kept_by_tracker(const Volume& base, float iso) {
    struct Kept {
        Volume mask;
        SurfaceTracker tracker;
        glm::uvec3 low{}, high{};
        uint64_t triangles = 0;
    };
    const Volume mask = make_volume(base.grid(), ScalarType::u8,
                                    [&](glm::uvec3 i) { return base.value(i) >= iso ? 1.0 : 0.0; });
    auto kept = std::make_shared<Kept>(Kept{mask, SurfaceTracker(mask, 1)});
    kept->tracker.find_all();
    kept->triangles = kept->tracker.triangulate().triangles.size();
    return {[=](const Volume& after, glm::uvec3 low, glm::uvec3 high) {
                VolumeEdit edit(kept->mask);
                for (uint32_t z = low.z; z <= high.z; ++z)
                    for (uint32_t y = low.y; y <= high.y; ++y)
                        for (uint32_t x = low.x; x <= high.x; ++x)
                            edit.set({x, y, z}, after.value({x, y, z}) >= iso ? 1.0 : 0.0);
                kept->mask = edit.commit();
                kept->low = low;
                kept->high = high;
            },
            [=](const Volume&, std::span<const ChangedBrick>) {
                kept->tracker.update(kept->mask, kept->low, kept->high);
                kept->triangles = kept->tracker.triangulate().triangles.size();
                return Remade{0.0, static_cast<double>(kept->triangles)};
            },
            [=] { return kept->triangles; }};
}

// Erosion at points of the surface drawn by chance: each edit starts from the whole Gaussian, so
// that the number of triangles stays.
void measure_edits(const std::string& name, double triangles, double radius, ScalarType type,
                   const std::string& by, int repeat) {
    const double sigma = 24.0, middle = 63.5, peak = type == ScalarType::f32 ? 1.0 : 20000.0;
    const double r = std::sqrt(triangles / (12.0 * std::numbers::pi));
    const auto iso = static_cast<float>(peak * std::exp(-r * r / (2.0 * sigma * sigma)));
    const Volume base = synthetic::sample(synthetic::gaussian(glm::dvec3(middle), sigma, peak),
                                          make_grid(glm::uvec3(128), glm::dvec3(1.0)), type);
    const KeptSurface surface =
        by == "gpu"
            ? kept_in_blocks(std::make_shared<GpuSurface>(gpu_device().pipelines, base, iso))
        : by == "tracker" ? kept_by_tracker(base, iso)
                          : kept_in_blocks(std::make_shared<BlockSurface>(base, iso));
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<double> edit_ms, changes_ms, update_ms, total_ms;
    double blocks = 0.0, remade = 0.0;
    for (int i = 0; i < 20 * repeat; ++i) {
        const glm::dvec3 out =
            glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
        const glm::dvec3 centre = middle + r * out;
        const glm::uvec3 low(glm::max(glm::floor(centre - radius), glm::dvec3(0.0)));
        const glm::uvec3 high(glm::min(glm::ceil(centre + radius), glm::dvec3(127.0)));
        Timer timer;
        const Volume after = eroded(base, centre, radius, iso, 0.02 * iso);
        edit_ms.push_back(timer.ms());
        surface.prepare(after, low, high);
        timer = Timer();
        const std::vector<ChangedBrick> changed = changed_bricks(base, after);
        changes_ms.push_back(timer.ms());
        const Remade done = surface.update(after, changed);
        total_ms.push_back(timer.ms());
        update_ms.push_back(total_ms.back() - changes_ms.back());
        blocks += done.blocks;
        remade += done.triangles;
        surface.prepare(base, low, high);
        surface.update(base, changed_bricks(after, base));
    }
    fmt::print(
        "{{\"case\": \"{}\", \"triangles\": {}, \"median_ms\": {:.4f}, \"p95_ms\": {:.4f}, "
        "\"changes_ms\": {:.4f}, \"update_ms\": {:.4f}, \"edit_ms\": {:.4f}, "
        "\"blocks\": {:.1f}, \"triangles_remade\": {:.0f}}}\n",
        name, surface.triangles(), median(total_ms), percentile(total_ms, 0.95), median(changes_ms),
        median(update_ms), median(edit_ms), blocks / (20 * repeat), remade / (20 * repeat));
}

// Windows about points of a phantom's skull and skin, where there is most to extract.
void measure_local(const std::string& name, uint32_t side, int repeat) {
    const Volume volume = synthetic::sample_ct_phantom(
        make_grid(glm::uvec3(192), glm::dvec3(1.0), glm::dvec3(-95.5)));
    LocalSurface local(side);
    std::mt19937 random(1);
    std::vector<glm::dvec3> points;
    const Mesh mesh = marching_cubes(volume, 300.0f);
    for (int i = 0; i < 2000; ++i)
        points.emplace_back(mesh.positions[random() % mesh.positions.size()]);
    std::vector<double> us;
    size_t triangles = 0;
    for (int i = 0; i < repeat; ++i)
        for (const glm::dvec3& p : points) {
            const Timer timer;
            const LocalSurface::Patch patch = local.extract(volume, p, 300.0f);
            us.push_back(timer.ms() * 1e3);
            triangles += patch.triangles.size();
        }
    fmt::print(
        "{{\"case\": \"{}\", \"p50_us\": {:.2f}, \"p99_us\": {:.2f}, \"worst_us\": {:.2f}, "
        "\"runs\": {}, \"triangles\": {:.0f}}}\n",
        name, percentile(us, 0.5), percentile(us, 0.99), *std::max_element(us.begin(), us.end()),
        us.size(), static_cast<double>(triangles) / static_cast<double>(us.size()));
}

int run(int argc, char** argv) {
    CLI::App app("Times the extraction of surfaces.");
    int repeat = 9, threads = 0;
    bool gpu = false;
    std::vector<std::string> volumes;
    app.add_option("--repeat", repeat, "runs of which the median is told")->capture_default_str();
    app.add_option("--threads", threads, "at most so many; 0: as many as there are cores");
    app.add_flag("--gpu", gpu, "full extraction on the graphics device too");
    app.add_option("cases", volumes, "see the head of surface_bench.cpp")->required();
    CLI11_PARSE(app, argc, argv);
    std::unique_ptr<tbb::global_control> limit;
    if (threads > 0)
        limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                      static_cast<size_t>(threads));
    for (const std::string& text : volumes) {
        const std::vector<std::string> part = parts(text, ':');
        if (part[0] == "edits") {
            measure_edits(text, std::stod(part.at(1)), std::stod(part.at(2)),
                          part.at(3) == "f32" ? ScalarType::f32 : ScalarType::i16,
                          part.size() > 4 ? part[4] : "blocks", repeat);
            continue;
        }
        if (part[0] == "local") {
            measure_local(text, static_cast<uint32_t>(std::stoul(part.at(1))), repeat);
            continue;
        }
        const Subject s = subject(text);
        if (part.back() == "labels") {
            measure_labels(s, repeat);
            continue;
        }
        measure(s, repeat, {.normals = SurfaceNormals::gradient}, "normals");
        measure(s, repeat, {.normals = SurfaceNormals::none}, "plain");
        measure(s, repeat, {.topology = SurfaceTopology::correct}, "correct");
        if (gpu)
            measure_gpu(s, repeat);
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
