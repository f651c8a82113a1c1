#include "engine/accuracy/accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/assert.h"
#include "engine/reference/truth.h"
#include "engine/scene/scene_names.h"

namespace palpate {

namespace {

constexpr RayCost kCosts[] = {
#include "engine/accuracy/ray_costs.inc"
};

// Of every pixel of `few`, which lie `pixels` apart in `picture`.
std::vector<double> squared_errors(const Image& picture, const Image& few, PixelStride pixels) {
    std::vector<double> squares;
    for (uint32_t y = 0; y < few.size_px.y; ++y)
        for (uint32_t x = 0; x < few.size_px.x; ++x) {
            const glm::uvec2 at = pixels.offset + pixels.step * glm::uvec2(x, y);
            double sum = 0.0;
            for (size_t c = 0; c < 3; ++c) {
                const double off = double{picture.at(at.x, at.y, c)} - double{few.at(x, y, c)};
                sum += off * off / 3.0;
            }
            squares.push_back(sum);
        }
    return squares;
}

// The picture's size with at most `side` pixels on its longer side.
glm::uvec2 smaller(glm::uvec2 size_px, uint32_t side) {
    const double scale = std::min(1.0, double{1} * side / std::max(size_px.x, size_px.y));
    return glm::max(glm::uvec2(glm::round(glm::dvec2(size_px) * scale)), glm::uvec2(1));
}

} // namespace

std::string text_of(const RaySetting& setting) {
    for (const auto& [name, value] : Names<Integrator>::list)
        if (value == setting.integrator)
            return value == Integrator::exact
                       ? fmt::format("{}, {} sub-steps", name, setting.sub_steps)
                       : fmt::format("{}, steps of {} voxels", name, setting.step_voxels);
    return "";
}

void apply(const RaySetting& setting, const Grid& grid, RayCastLayer& layer) {
    layer.integrator = setting.integrator;
    if (setting.integrator == Integrator::exact) {
        layer.sub_steps = setting.sub_steps;
    } else {
        layer.step_mm = 0.0;
        layer.step_mm = setting.step_voxels * step_mm_of(layer, grid);
    }
}

SceneKind kind_of(const RayCastLayer& layer) {
    switch (layer.mode) {
        case RayMode::mip:
            return SceneKind::mip;
        case RayMode::iso:
            return SceneKind::iso;
        case RayMode::alpha:
            break;
    }
    return layer.shading ? SceneKind::shaded_alpha : SceneKind::alpha;
}

std::span<const RayCost> ray_costs() {
    return kCosts;
}

double upper_mean(std::span<const double> values, double population) {
    const double n = static_cast<double>(values.size());
    double sum = 0.0, largest = 0.0;
    for (const double value : values) {
        sum += value;
        largest = std::max(largest, value);
    }
    const double mean = sum / n;
    if (n >= population)
        return mean;
    if (n < 2.0)
        return std::numeric_limits<double>::infinity();
    double variance = 0.0;
    for (const double value : values)
        variance += (value - mean) * (value - mean) / (n - 1.0);
    const double t = std::log(2.0 / 0.001);
    return mean + std::sqrt(2.0 * variance * t / n) + 7.0 * t * largest / (3.0 * (n - 1.0));
}

AccuracyJudge::AccuracyJudge(Renderer& renderer, const Scene& scene, const SceneData& data,
                             AccuracySampling sampling)
    : renderer_(&renderer),
      data_(&data),
      scene_(scene),
      pixels_(static_cast<double>(scene.size_px.x) * scene.size_px.y) {
    PALPATE_ASSERT(scene.ray_cast.has_value());
    scene_.stereo.reset();
    scene_.value_and_depth = false;
    scene_.size_px = smaller(scene.size_px, sampling.side_px);
}

Result<Image> AccuracyJudge::draw(const RayCastLayer& layer) {
    scene_.ray_cast = layer;
    Result<Frame> frame = renderer_->render(scene_, *data_);
    if (!frame)
        return tl::unexpected(frame.error());
    return std::move(frame->eyes.front());
}

Result<AccuracyJudge> AccuracyJudge::make(Renderer& renderer, const Scene& scene,
                                          const SceneData& data, AccuracySampling sampling) {
    AccuracyJudge judge(renderer, scene, data, sampling);
    RayCastLayer layer = *scene.ray_cast;
    layer.integrator = Integrator::exact;
    layer.min_transmittance = 0.0;
    layer.sub_steps = kMaxSubSteps;
    Result<Image> finest = judge.draw(layer);
    if (!finest)
        return tl::unexpected(finest.error());
    judge.finest_ = std::move(*finest);
    const glm::uvec2 size = judge.scene_.size_px;
    PixelStride some;
    some.step = std::max(1u, std::max(size.x, size.y) / sampling.truth_side);
    some.offset = glm::min(glm::uvec2(some.step / 2), size - 1u);
    const std::vector<double> squares =
        squared_errors(judge.finest_, render_truth(judge.scene_, data, 0, some), some);
    judge.finest_error_ = std::sqrt(upper_mean(squares, judge.pixels_));
    layer.sub_steps = kMaxSubSteps / 2;
    const Result<double> halved = judge.estimate(layer);
    if (!halved)
        return tl::unexpected(halved.error());
    judge.finest_error_ = std::max(judge.finest_error_, *halved - judge.finest_error_);
    return judge;
}

Result<double> AccuracyJudge::estimate(const RayCastLayer& layer) {
    const Result<Image> picture = draw(layer);
    if (!picture)
        return tl::unexpected(picture.error());
    return std::sqrt(upper_mean(squared_errors(*picture, finest_, {}), pixels_)) + finest_error_;
}

Result<AccuracyChoice> choose_setting(Renderer& renderer, const Scene& scene, const SceneData& data,
                                      double error, AccuracySampling sampling) {
    Result<AccuracyJudge> judge = AccuracyJudge::make(renderer, scene, data, sampling);
    if (!judge)
        return tl::unexpected(judge.error());
    const size_t kind = static_cast<size_t>(kind_of(*scene.ray_cast));
    std::vector<RayCost> settings(std::begin(kCosts), std::end(kCosts));
    std::stable_sort(settings.begin(), settings.end(), [&](const RayCost& a, const RayCost& b) {
        return a.cost[kind] < b.cost[kind];
    });
    RayCastLayer layer = *scene.ray_cast;
    layer.min_transmittance = std::min(layer.min_transmittance, 0.25 * error);
    double least = std::numeric_limits<double>::infinity();
    RaySetting finest;
    for (const auto& [setting, cost] : settings) {
        // Maxima and surfaces have no sub-steps.
        if (layer.mode != RayMode::alpha && setting.sub_steps > 1)
            continue;
        apply(setting, data.volume.grid(), layer);
        const Result<double> estimate = judge->estimate(layer);
        if (!estimate)
            return tl::unexpected(estimate.error());
        if (*estimate <= error)
            return AccuracyChoice{setting, layer.min_transmittance, *estimate};
        if (*estimate < least) {
            least = *estimate;
            finest = setting;
        }
    }
    // A quarter of what is asked for may go to early termination.
    const double unit = std::pow(10.0, std::floor(std::log10(least / 0.75)) - 1.0);
    return fail(
        "--error: expected at least {:.1e}, the best that can be had for this scene (by {}), "
        "found {:g}",
        std::ceil(least / 0.75 / unit) * unit, text_of(finest), error);
}

} // namespace palpate
