// R18: jittered lattices: no bias, no residue at the ends, the same bits for the same seed.

#include <cmath>

#include "bench/cases/scenes.h"
#include "engine/reference/truth.h"
#include "engine/reference/twin.h"
#include "engine/volume/synthetic.h"

namespace palpate::cases {

namespace {

constexpr int kSeeds = 256;

double depth_of(float opacity) {
    return -std::log1p(-double{opacity});
}

// The mean and its standard error of the optical depths that the seeds gave a pixel.
struct Mean {
    double sum = 0.0, squares = 0.0;

    void add(double value) {
        sum += value;
        squares += value * value;
    }
    double mean() const { return sum / kSeeds; }
    double error() const {
        return std::sqrt(std::max(0.0, squares / kSeeds - mean() * mean()) / (kSeeds - 1));
    }
};

// A blob narrower than the step, faint, and gone where rays enter and leave: the sum over a lattice
// whose phase is uniform has the integral as its mean.
void unbiased(Painter& painter, Findings& findings, Integrator integrator) {
    const double tau = 0.1;
    const SceneData data{synthetic::sample(synthetic::gaussian({8.2, 7.9, 8.1}, 0.8, 1.0),
                                           make_grid({17, 17, 17}, {1, 1, 1}), ScalarType::f32),
                         {}};
    Scene scene = parallel({1, 0.3, -0.2}, glm::dvec3(8.0), 0.25, {16, 16});
    scene.ray_cast->integrator = integrator;
    scene.ray_cast->step_mm = 3.0;
    scene.ray_cast->transfer = linear_extinction(tau);
    findings.in("narrow blob");
    const Image truth = render_truth(scene, data);
    const Image plain = painter.draw(scene, data);
    std::vector<Mean> pixels(size_t{scene.size_px.x} * scene.size_px.y);
    for (uint32_t seed = 0; seed < kSeeds; ++seed) {
        scene.ray_cast->jitter_seed = seed;
        findings.in(fmt::format("narrow blob, seed {}", seed));
        const Image image = painter.draw(scene, data);
        for (size_t i = 0; i < pixels.size(); ++i)
            pixels[i].add(depth_of(image.samples[i * image.channels.size() + 3]));
        if (seed > 3)
            continue;
        findings.part(
            fmt::format("change between two frames of one seed, {}", name_of(integrator)));
        scene.ray_cast->jitter_seed = seed + 1;
        painter.draw(scene, data);
        scene.ray_cast->jitter_seed = seed;
        findings.within(largest_difference(image, painter.draw(scene, data)), 0.0);
        findings.expect(largest_difference(image, plain) > 0.01, "noise");
        findings.part(fmt::format("opacity beside the fp64 twin's, {}", name_of(integrator)));
        // A value takes the neighbouring entry of 4095 at most, along the 8 mm of the blob.
        const Image twin = render_twin(scene, data);
        for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray&) {
            findings.near(image.at(x, y, 3), twin.at(x, y, 3),
                          tau * 8.0 * (1.0 / 4095 + 3.0 * painter.weight_rounding()) + 1e-6);
        });
    }

    double difference = 0.0, variance = 0.0, beyond = 0.0, count = 0.0;
    for (uint32_t y = 0; y < scene.size_px.y; ++y)
        for (uint32_t x = 0; x < scene.size_px.x; ++x) {
            const Mean& pixel = pixels[size_t{y} * scene.size_px.x + x];
            const double expected = depth_of(truth.at(x, y, 3));
            if (expected < 0.02) // there the table's entries are as coarse as the noise
                continue;
            difference += pixel.mean() - expected;
            variance += pixel.error() * pixel.error();
            beyond += std::abs(pixel.mean() - expected) > 3.0 * pixel.error() ? 1.0 : 0.0;
            count += 1.0;
        }
    findings.in(fmt::format("narrow blob, {} pixels", count));
    findings.expect(count > 50.0, "a blob that fills many pixels");
    findings.part(fmt::format("mean of 256 seeds off grid truth, in standard errors, {}",
                              name_of(integrator)));
    findings.within(difference / std::sqrt(variance), 3.0);
    // 0.27 % are expected beyond three standard errors; of some hundred pixels, 3 % hardly ever.
    findings.part(
        fmt::format("share of pixels more than 3 standard errors off, {}", name_of(integrator)));
    findings.within(beyond / count, 0.03);
}

} // namespace

void jitter(Painter& painter, Findings& findings) {
    for (const Integrator integrator : integrators()) {
        if (integrator == Integrator::exact) // has no lattice
            continue;
        unbiased(painter, findings, integrator);
        // The first and last steps are cut as without jitter.
        findings.part(
            fmt::format("opacity of slabs of 0.3 and 7.3 steps, {}", name_of(integrator)));
        const double tau = 0.3;
        for (const double length : {0.3, 7.3})
            for (uint32_t seed = 0; seed < 16; ++seed) {
                Scene scene = through_bar(1.0);
                scene.ray_cast->integrator = integrator;
                scene.ray_cast->transfer = constant(tau);
                scene.ray_cast->jitter_seed = seed;
                findings.in(fmt::format("{} steps, seed {}", length, seed));
                findings.near(painter.draw(scene, bar(length)).at(0, 0, 3),
                              -std::expm1(-tau * length), 1e-6); // as without
            }
    }
}

} // namespace palpate::cases
