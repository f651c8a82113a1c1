#include "engine/accuracy/accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "engine/base/option_name.h"
#include "engine/reference/truth.h"
#include "engine/scene/scene_names.h"

namespace palpate {

namespace {

constexpr RayCost kCosts[] = {
#include "engine/accuracy/ray_costs.inc"
};

glm::dvec3 color(const Image& picture, glm::uvec2 at) {
    return {picture.at(at.x, at.y, 0), picture.at(at.x, at.y, 1), picture.at(at.x, at.y, 2)};
}

double squared_error(const Image& picture, glm::uvec2 at, glm::dvec3 expected) {
    const glm::dvec3 off = color(picture, at) - expected;
    return glm::dot(off, off) / 3.0;
}

// The scene seen a hundredth of a pixel aside, values moved by half an entry of the transfer table:
// a few times what rounding does. side is 1 or -1.
Scene moved(Scene scene, double side) {
    Camera& camera = scene.camera;
    const View view = make_view(camera, scene.size_px);
    const double depth_mm = camera.projection == Projection::orthographic
                                ? 1.0
                                : glm::distance(camera.eye_mm, camera.target_mm);
    const double pixel_mm = (view.top - view.bottom) * depth_mm / scene.size_px.y;
    const glm::dvec3 by = side * 0.01 * pixel_mm * (view.right + 0.6 * view.up);
    camera.eye_mm += by;
    camera.target_mm += by;
    TransferFunction& transfer = scene.ray_cast->transfer;
    if (!transfer.colors.empty()) {
        const TransferTable table = make_table(transfer, 2);
        const double entry = (table.high - table.low) / double{kTransferTableSize};
        for (auto& point : transfer.colors)
            point.value += 0.5 * side * entry;
        for (auto& point : transfer.opacities)
            point.value += 0.5 * side * entry;
    }
    return scene;
}

// How far a pixel is from the middle of two others.
double doubt(const Image& picture, const Image& to, const Image& fro, glm::uvec2 at) {
    const glm::dvec3 middle = 0.5 * (color(to, at) + color(fro, at));
    return squared_error(picture, at, middle);
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

double upper_mean(std::span<const double> values, double population, double most) {
    const double n = static_cast<double>(values.size());
    double sum = 0.0;
    for (const double value : values)
        sum += value;
    const double mean = sum / n;
    if (n >= population)
        return mean;
    if (n < 2.0)
        return most;
    double variance = 0.0;
    for (const double value : values)
        variance += (value - mean) * (value - mean) / (n - 1.0);
    const double t = std::log(2.0 / 0.001);
    return std::min(most,
                    mean + std::sqrt(2.0 * variance * t / n) + 7.0 * t * most / (3.0 * (n - 1.0)));
}

AccuracyJudge::AccuracyJudge(Renderer& renderer, const Scene& scene, const SceneData& data,
                             uint32_t side_px)
    : renderer_(&renderer),
      data_(&data),
      scene_(scene),
      pixels_(static_cast<double>(scene.size_px.x) * scene.size_px.y) {
    scene_.stereo.reset();
    scene_.value_and_depth = false;
    scene_.size_px = smaller(scene.size_px, side_px);
}

Result<Image> AccuracyJudge::draw(const Scene& scene) {
    PALPATE_TRY(Frame frame, renderer_->render(scene, *data_));
    return std::move(frame.eyes.front());
}

Result<AccuracyJudge> AccuracyJudge::make(Renderer& renderer, const Scene& scene,
                                          const SceneData& data, AccuracySampling sampling) {
    if (!scene.ray_cast)
        return fail("the error of a picture: expected a scene with a ray cast, found none");
    AccuracyJudge judge(renderer, scene, data, sampling.side_px);
    Scene finest = judge.scene_;
    finest.ray_cast->integrator = Integrator::exact;
    finest.ray_cast->min_transmittance = 0.0;
    finest.ray_cast->sub_steps = kMaxSubSteps;
    PALPATE_TRY(Image picture, judge.draw(finest));
    PALPATE_TRY(const Image to, judge.draw(moved(finest, 1.0)));
    PALPATE_TRY(const Image fro, judge.draw(moved(finest, -1.0)));

    const glm::uvec2 size = judge.scene_.size_px;
    std::vector<std::pair<double, glm::uvec2>> pixels;
    for (uint32_t y = 0; y < size.y; ++y)
        for (uint32_t x = 0; x < size.x; ++x)
            pixels.push_back({doubt(picture, to, fro, {x, y}), {x, y}});
    std::stable_sort(pixels.begin(), pixels.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<glm::uvec2> seen;
    const size_t worst = std::min(pixels.size(), size_t{sampling.truth_pixels} / 2);
    const size_t rest = pixels.size() - worst;
    const size_t spread = std::min(rest, size_t{sampling.truth_pixels} - worst);
    for (size_t i = 0; i < worst; ++i)
        seen.push_back(pixels[i].second);
    for (size_t i = 0; i < spread; ++i)
        seen.push_back(pixels[worst + (2 * i + 1) * rest / (2 * spread)].second);

    const std::vector<PixelSample> truth = truth_pixels(judge.scene_, data, seen);
    std::vector<double> squares;
    for (size_t i = 0; i < seen.size(); ++i)
        squares.push_back(squared_error(picture, seen[i], glm::dvec3(truth[i].rgba)));
    double sum = 0.0, most = 0.0;
    for (size_t i = 0; i < worst; ++i)
        sum += squares[i];
    // None of the rest errs more than the less doubtful half of the doubtful, and the spread ones.
    for (size_t i = worst / 2; i < squares.size(); ++i)
        most = std::max(most, squares[i]);
    if (rest > 0)
        sum += static_cast<double>(rest) *
               upper_mean(std::span(squares).subspan(worst), static_cast<double>(rest), most);
    judge.finest_error_ = std::sqrt(sum / static_cast<double>(pixels.size()));
    judge.finest_ = std::move(picture);
    return judge;
}

Result<double> AccuracyJudge::estimate(const RayCastLayer& layer) {
    scene_.ray_cast = layer;
    PALPATE_TRY(const Image picture, draw(scene_));
    std::vector<double> squares;
    for (uint32_t y = 0; y < finest_.size_px.y; ++y)
        for (uint32_t x = 0; x < finest_.size_px.x; ++x)
            squares.push_back(squared_error(picture, {x, y}, color(finest_, {x, y})));
    const double most = *std::max_element(squares.begin(), squares.end());
    return std::sqrt(upper_mean(squares, pixels_, most)) + finest_error_;
}

Result<AccuracyChoice> choose_setting(Renderer& renderer, const Scene& scene, const SceneData& data,
                                      double error, AccuracySampling sampling) {
    PALPATE_TRY(AccuracyJudge few, AccuracyJudge::make(renderer, scene, data, sampling));
    const bool is_whole = smaller(scene.size_px, sampling.side_px) == scene.size_px;
    std::optional<Result<AccuracyJudge>> whole; // of all pixels, made when it is needed
    const auto estimate_all = [&](const RayCastLayer& layer) -> Result<double> {
        sampling.side_px = std::max(scene.size_px.x, scene.size_px.y);
        if (!whole)
            whole = AccuracyJudge::make(renderer, scene, data, sampling);
        return *whole ? (*whole)->estimate(layer) : pass_on(*whole);
    };
    const size_t kind = static_cast<size_t>(kind_of(*scene.ray_cast));
    std::vector<RayCost> settings;
    for (const RayCost& cost : kCosts) // maxima and surfaces have no sub-steps
        if (scene.ray_cast->mode == RayMode::alpha || cost.setting.sub_steps <= 1)
            settings.push_back(cost);
    std::stable_sort(settings.begin(), settings.end(), [&](const RayCost& a, const RayCost& b) {
        return a.cost[kind] < b.cost[kind];
    });
    if (scene.ray_cast->mode == RayMode::alpha) // the best there is, whatever it takes
        settings.push_back({{Integrator::exact, 0.0, kMaxSubSteps}, {}});
    RayCastLayer layer = *scene.ray_cast;
    layer.min_transmittance = std::min(layer.min_transmittance, 0.25 * error);
    double least = std::numeric_limits<double>::infinity();
    RaySetting finest;
    const auto found = [&](const RaySetting& setting, double estimate) {
        if (estimate < least) {
            least = estimate;
            finest = setting;
        }
        return estimate <= error;
    };
    for (const auto& [setting, cost] : settings) {
        apply(setting, data.volume.grid(), layer);
        Result<double> estimate = few.estimate(layer);
        if (estimate && *estimate <= error && !is_whole)
            estimate = estimate_all(layer);
        if (!estimate)
            return pass_on(estimate);
        if (found(setting, *estimate))
            return AccuracyChoice{setting, layer.min_transmittance, *estimate};
    }
    if (!is_whole) { // the smaller picture may err more
        least = std::numeric_limits<double>::infinity();
        apply(finest, data.volume.grid(), layer);
        PALPATE_TRY(const double estimate, estimate_all(layer));
        if (found(finest, estimate))
            return AccuracyChoice{finest, layer.min_transmittance, estimate};
    }
    // A quarter of what is asked for may go to early termination.
    const double unit = std::pow(10.0, std::floor(std::log10(least / 0.75)) - 1.0);
    return fail(
        "{}: expected at least {:.1e}, the best that can be had for this scene (by {}), "
        "found {:g}",
        Option{"error"}, std::ceil(least / 0.75 / unit) * unit, text_of(finest), error);
}

} // namespace palpate
