#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/accuracy/accuracy.h"
#include "engine/image/compare.h"
#include "engine/reference/truth.h"
#include "engine/scene/presets.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

// Scenes by chance, and whether what choose_setting() grants for them is kept.
namespace palpate {

class RandomScene {
 public:
    explicit RandomScene(uint32_t seed) : random_(seed) {
        const auto side = [&] { return static_cast<uint32_t>(std::lround(between(12, 28))); };
        const glm::uvec3 size(side(), side(), side());
        const double finest_mm = log_between(0.05, 5.0);
        const auto spacing = [&] { return finest_mm * (chance(0.5) ? 1.0 : between(1.0, 4.0)); };
        const glm::dvec3 spacing_mm(spacing(), spacing(), spacing());
        const Grid grid = make_grid(size, spacing_mm, -0.5 * (glm::dvec3(size) - 1.0) * spacing_mm);
        const bool is_float = chance(0.3);
        data.volume =
            make_volume(grid, is_float ? ScalarType::f32 : ScalarType::i16, value_of(grid));

        scene.size_px = {20 + static_cast<uint32_t>(between(0, 12)),
                         20 + static_cast<uint32_t>(between(0, 12))};
        const auto part = [&] { return between(-1.0, 1.0); };
        const glm::dvec3 direction(part(), part(), part() + 0.01);
        scene.camera = frame_volume(grid, direction, {0.1, 0.05, 1}, between(0.4, 1.0));
        if (chance(0.3))
            scene.camera.projection = Projection::orthographic;
        scene.background = {between(0, 1), between(0, 1), between(0, 1)};
        if (chance(0.2))
            scene.clip_planes = {{glm::dvec3(0.0), {part(), part(), part() + 0.01}}};
        RayCastLayer layer;
        layer.transfer = transfer(glm::length(glm::dvec3(size) * spacing_mm));
        if (chance(0.35))
            layer.shading = Shading{};
        if (chance(0.1))
            layer.mode = RayMode::mip;
        else if (chance(0.1))
            layer.mode = RayMode::iso;
        layer.isos = {{between(100, 700), glm::dvec3(between(0, 1), 0.8, 0.5), between(0.3, 1.0)}};
        scene.ray_cast = layer;
        error = log_between(2e-4, 0.1);
        if (chance(0.5)) // a part of the picture has to speak for all of it
            sampling = {16, 128};
    }

    SceneData data{make_volume(make_grid({1, 1, 1}, {1, 1, 1}, {0, 0, 0}), ScalarType::u8,
                               [](glm::uvec3) { return 0.0; }),
                   std::nullopt};
    Scene scene;
    double error; // to ask for
    AccuracySampling sampling;

 private:
    double between(double low, double high) {
        return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0);
    }
    double log_between(double low, double high) {
        return std::exp(between(std::log(low), std::log(high)));
    }
    bool chance(double share) { return between(0, 1) < share; }

    // About 0 .. 1000: noise, steps, waves, and mixtures of them.
    std::function<double(glm::uvec3)> value_of(const Grid& grid) {
        const glm::dvec3 extent_mm = glm::dvec3(grid.size) * spacing_mm(grid);
        const double radius_mm = glm::length(extent_mm) * between(0.15, 0.35);
        const synthetic::Field wave = synthetic::gyroid(radius_mm * between(0.5, 3.0));
        const synthetic::Field ball = synthetic::sphere_distance({0, 0, 0}, radius_mm);
        const uint32_t kind = random_() % 5, noise_seed = random_();
        const double noise = chance(0.5) ? 0.0 : log_between(3.0, 300.0);
        return [=](glm::uvec3 i) {
            const glm::dvec3 p = world_point(grid, glm::dvec3(i));
            std::mt19937 here(noise_seed ^ (i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u));
            here.discard(2);
            const double by_chance = static_cast<double>(here()) / 4294967296.0;
            double value = 0.0;
            if (kind == 0)
                value = 1000.0 * by_chance;
            else if (kind == 1) // a step from sample to sample
                value = ball.value(p) < 0.0 ? 900.0 : 50.0;
            else if (kind == 2)
                value = 500.0 + 330.0 * wave.value(p);
            else if (kind == 3)
                value = (i.x + i.y + i.z) % 2 ? 1000.0 : 0.0;
            else
                value = 500.0 - 500.0 * ball.value(p) / radius_mm;
            return std::clamp(value + noise * (by_chance - 0.5), -1000.0, 2000.0);
        };
    }

    TransferFunction transfer(double extent_mm) {
        if (chance(0.25)) {
            const auto& names = preset_names();
            return *preset(names[random_() % names.size()]);
        }
        TransferFunction function;
        function.opacity_unit_mm = chance(0.5) ? 1.0 : extent_mm * between(0.01, 0.1);
        constexpr double kMost[] = {0.02, 0.2, 0.7, 0.99, 0.9999};
        const double most = kMost[random_() % 5];
        const auto places = [&] {
            std::vector<double> list{between(-200, 300), between(600, 1200)};
            for (uint32_t more = random_() % 5; more > 0; --more)
                list.push_back(between(0, 1000));
            if (chance(0.3)) // a step
                list.push_back(list.back());
            if (chance(0.3)) // a narrow peak's foot
                list.push_back(list.back() + between(1, 20));
            std::sort(list.begin(), list.end());
            return list;
        };
        for (const double at : places())
            function.colors.push_back({at, {between(0, 1), between(0, 1), between(0, 1)}});
        for (const double at : places())
            function.opacities.push_back({at, chance(0.3) ? 0.0 : most * between(0, 1)});
        return function;
    }

    std::mt19937 random_;
};

struct Promise {
    bool granted = false;
    double estimate = 0.0, found = 0.0; // RMSE of colour; refused: of `exact` at its finest
};

// Asks for the scene's error, draws it as granted, and compares all pixels with grid truth.
inline Result<Promise> ask(Renderer& renderer, const RandomScene& random) {
    const auto& [scene, data] = std::tie(random.scene, random.data);
    Result<AccuracyChoice> choice =
        choose_setting(renderer, scene, data, random.error, random.sampling);
    Promise promise;
    Scene chosen = scene;
    if (choice) {
        promise.granted = true;
        promise.estimate = choice->error_estimate;
        apply(choice->setting, data.volume.grid(), *chosen.ray_cast);
        chosen.ray_cast->min_transmittance = choice->min_transmittance;
    } else {
        if (choice.error().message.find("the best that can be had") == std::string::npos)
            return pass_on(choice);
        chosen.ray_cast->integrator = Integrator::exact;
        chosen.ray_cast->sub_steps = kMaxSubSteps;
        chosen.ray_cast->min_transmittance = 0.0;
    }
    PALPATE_TRY(const Frame frame, renderer.render(chosen, data));
    promise.found = color_rmse(frame.eyes[0], render_truth(scene, data));
    return promise;
}

// Seeds [first, first + count): no picture errs by more than was expected of it, and what is
// refused could not be had with room to spare.
inline void expect_promises_kept(GpuDevice& device, uint32_t first, uint32_t count) {
    Renderer renderer(device);
    uint32_t granted = 0, refused = 0, wrongly = 0;
    double tightest = 0.0;
    for (uint32_t seed = first; seed < first + count; ++seed) {
        const RandomScene random(seed);
        const Result<Promise> promise = ask(renderer, random);
        ASSERT_TRUE(promise) << "seed " << seed << ": " << promise.error().message;
        if (promise->granted) {
            ++granted;
            EXPECT_LE(promise->estimate, random.error) << "seed " << seed;
            // Grid truth was rounded to float when its picture was made.
            EXPECT_LE(promise->found, promise->estimate + 0x1p-25) << "seed " << seed;
            tightest = std::max(tightest, promise->found / promise->estimate);
        } else {
            ++refused;
            // The bound from a sample is a few times the mean.
            wrongly += promise->found < 0.1 * random.error;
        }
    }
    std::printf(
        "    %u granted, at most %.2f of the estimate, %u refused, %u with ten times less "
        "at hand\n",
        granted, tightest, refused, wrongly);
    EXPECT_GE(granted, count / 2);
    EXPECT_LE(wrongly, count / 25);
}

} // namespace palpate
