#include "bench/suite/measure.h"

#include <algorithm>

#include "engine/base/log.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/image/exr.h"
#include "engine/reference/truth.h"
#include "engine/scene/scene_file.h"
#include "engine/volume/extent.h"

namespace palpate::bench {

namespace {

constexpr int kFramesPerRound = 3;
constexpr double kTurnDeg = 1.0;

// FNV-1a over 64 bits.
class Hash {
 public:
    void add(std::string_view bytes) {
        for (const char c : bytes)
            state_ = (state_ ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    }
    std::string text() const { return fmt::format("{:016x}", state_); }

 private:
    uint64_t state_ = 0xcbf29ce484222325ULL;
};

void add_voxels(Hash& hash, const Volume& volume) {
    std::vector<float> samples(kBrickSamples);
    for_each_brick(volume, [&](glm::uvec3 position) {
        volume.brick(position).read(std::span(samples));
        hash.add({reinterpret_cast<const char*>(samples.data()), samples.size() * sizeof(float)});
    });
}

// The part of a layer that truth depends on: neither integrator nor step nor where a ray may stop.
RayCastLayer without_settings(RayCastLayer layer) {
    RayCastLayer plain;
    plain.mode = layer.mode;
    plain.transfer = std::move(layer.transfer);
    plain.isos = std::move(layer.isos);
    plain.shading = layer.shading;
    return plain;
}

double total_ms(const std::vector<PassTime>& passes) {
    double sum = 0;
    for (const PassTime& pass : passes)
        sum += pass.gpu_ms;
    return sum;
}

Json spread_json(const std::vector<double>& values) {
    const Spread s = spread(values);
    return {{"median", s.median}, {"p95", s.p95}, {"low", s.low}, {"high", s.high}};
}

} // namespace

Image Sampling::of(const Image& picture) const {
    const PixelStride some = pixels();
    Image image = make_image(some.size(picture.size_px), picture.channels);
    for (uint32_t y = 0; y < image.size_px.y; ++y)
        for (uint32_t x = 0; x < image.size_px.x; ++x)
            for (size_t c = 0; c < image.channels.size(); ++c)
                image.at(x, y, c) =
                    picture.at(some.offset.x + x * stride, some.offset.y + y * stride, c);
    return image;
}

Json Frames::json() const {
    Json v;
    v["wall_ms"] = spread_json(wall_ms);
    v["gpu_ms"] = spread_json(gpu_ms);
    v["cpu_ms"] = spread_json(cpu_ms);
    v["frames"] = wall_ms.size();
    v["noise"] = spread(wall_ms).noise();
    const double gpu = spread(gpu_ms).median, wall = spread(wall_ms).median;
    v["clocks_agree"] = std::abs(gpu - wall) <= 0.1 * wall;
    v["all_wall_ms"] = wall_ms;
    return v;
}

Bench::Bench(GpuDevice& device, const Options& options) : device_(device), options_(options) {}

Result<Image> Bench::truth(const Subject& subject, Sampling sampling) {
    const profile::Scope scope("grid truth");
    Scene scene = scene_of(subject, sampling.size_px);
    scene.ray_cast = without_settings(subject.layer);
    scene.value_and_depth = true;
    Hash hash;
    hash.add(fmt::format("grid truth 1, every {};", sampling.stride)); // count up when it changes
    hash.add(write_scene({.scene = scene}));
    const Grid& grid = subject.sample->volume.grid();
    hash.add({reinterpret_cast<const char*>(&grid.size), sizeof grid.size});
    hash.add({reinterpret_cast<const char*>(&grid.world_from_index), sizeof grid.world_from_index});
    add_voxels(hash, subject.sample->volume);
    const fs::path path = options_.out / "truth" / (hash.text() + ".exr");
    if (fs::exists(path)) {
        PALPATE_TRY(ExrFile kept, load_exr(path));
        return std::move(kept.image);
    }
    const Timer timer;
    Image image = render_truth(scene, subject.data(), 0, sampling.pixels());
    if (timer.ms() > 1000.0)
        log::info("{}: grid truth of {}x{} rays in {:.1f} s", subject.name, sampling.rays(),
                  sampling.rays(), timer.ms() / 1000.0);
    std::error_code ignored;
    fs::create_directories(path.parent_path(), ignored);
    PALPATE_TRY(save_exr(path, image, ExrPrecision::full_float,
                         {{"palpate:renderer", "grid truth"}, {"palpate:subject", subject.name}}));
    return image;
}

Result<std::vector<Bench::Drawn>> Bench::draw(const Subject& subject,
                                              const std::vector<Setting>& settings,
                                              Sampling sampling, int rounds,
                                              const std::function<void()>& after_round) {
    PALPATE_TRY(const Image true_picture, truth(subject, sampling));
    const SceneData data = subject.data();
    Renderer renderer(device_, {.stored_gradients = device_.info().is_cpu()}); // as many frames do
    std::vector<Drawn> all;
    std::vector<Scene> scenes;
    for (const Setting& setting : settings) {
        Drawn drawn{.setting = setting};
        Scene scene = scene_of(subject, sampling.size_px);
        apply(setting, subject.sample->volume, *scene.ray_cast);
        scene.value_and_depth = subject.metric != Metric::color;
        Result<Frame> frame = renderer.render(scene, data);
        if (!frame)
            return fail("{}, {}: {}", subject.name, setting.name(), frame.error().message);
        drawn.picture = sampling.of(frame->eyes[0]);
        drawn.errors = errors_of(drawn.picture, true_picture, subject.metric,
                                 smallest_spacing_mm(subject.sample->volume.grid()));
        all.push_back(std::move(drawn));
        scene.value_and_depth = false;
        scenes.push_back(std::move(scene));
    }
    for (int round = 0; round < rounds && !(round > 0 && late(0.8)); ++round) {
        for (size_t i = 0; i < settings.size(); ++i) {
            if (options_.stop.stop_requested())
                return fail("interrupted at {}, {}", subject.name, settings[i].name());
            Scene scene = scenes[i];
            for (int frame = -1; frame < kFramesPerRound; ++frame) {
                const double cpu_ms = process_cpu_ms();
                const Result<FrameStats> stats = renderer.draw(scene, data);
                if (!stats)
                    return fail("{}, {}: {}", subject.name, settings[i].name(),
                                stats.error().message);
                if (frame >= 0) {
                    all[i].frames.wall_ms.push_back(stats->wall_ms);
                    all[i].frames.gpu_ms.push_back(total_ms(stats->passes));
                    all[i].frames.cpu_ms.push_back(process_cpu_ms() - cpu_ms);
                }
                scene.camera = orbit(scene.camera, kTurnDeg);
            }
        }
        if (after_round)
            after_round();
    }
    return all;
}

bool Bench::late(double share) const {
    constexpr double kShortMs = 10 * 60 * 1000.0;
    return !options_.full && since_.ms() > share * kShortMs;
}

Result<double> Bench::first_frame_ms(const Subject& subject, const Setting& setting,
                                     uint32_t size_px) {
    Scene scene = scene_of(subject, size_px);
    apply(setting, subject.sample->volume, *scene.ray_cast);
    const Timer timer;
    Renderer renderer(device_);
    const Result<FrameStats> stats = renderer.draw(scene, subject.data());
    if (!stats)
        return fail("{}: {}", subject.name, stats.error().message);
    return timer.ms();
}

} // namespace palpate::bench
