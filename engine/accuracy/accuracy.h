#pragma once

#include <array>
#include <span>
#include <string>

#include "engine/render/renderer.h"

// How far a ray-cast picture is from the exact picture of its trilinear field, measured on the
// scene itself.
namespace palpate {

// One way to integrate a ray. Steps are in voxels of the volume's smallest spacing; `exact` has
// sub-steps instead.
struct RaySetting {
    Integrator integrator = Integrator::fast;
    double step_voxels = 0.0;
    uint32_t sub_steps = 0;

    friend bool operator==(const RaySetting&, const RaySetting&) = default;
};
std::string text_of(const RaySetting& setting); // "fast, steps of 0.5 voxels"
void apply(const RaySetting& setting, const Grid& grid, RayCastLayer& layer);

// Scenes of one kind have the same costs.
enum class SceneKind { alpha, shaded_alpha, mip, iso };
SceneKind kind_of(const RayCastLayer& layer);

// The settings to choose from. Costs are GPU times beside `fast` at one sample a voxel, by kind:
// ray_costs.inc, which palpate_ray_costs writes.
struct RayCost {
    RaySetting setting;
    std::array<double, 4> cost;
};
std::span<const RayCost> ray_costs();

// Sizes of the samples that an estimate is based on.
struct AccuracySampling {
    uint32_t side_px = 96; // of the longer side of the pictures by which settings are passed by
    uint32_t truth_pixels = 512; // of a picture by `exact`, compared with grid truth
};

// An upper bound, with a confidence of 0.999, on the mean of `population` values in 0 .. `most` of
// which `values` are a sample: the empirical Bernstein bound (Maurer and Pontil, COLT 2009,
// theorem 4). The mean itself where all were seen.
double upper_mean(std::span<const double> values, double population, double most);

// Estimates the RMSE of colour of a scene's pictures, without stereo.
//
// The picture of a setting is compared, pixel by pixel, with that of `exact` at its finest; where
// it has fewer pixels than the scene's, no pixel between is taken to err more than the worst. To
// this the error of `exact` itself is added. It is rounding of rays and of table places, which few
// pixels may show much: those at edges. So `exact` draws two more pictures, with the view and the
// transfer function moved to and fro by a little more than rounding does. Pixels whose mean is not
// what was drawn between are doubtful. Half of the pixels that are compared with grid truth
// (engine/reference/truth.h) are the most doubtful ones, half are spread over the rest in order of
// doubt and bound the mean of the rest (upper_mean()), none of which is taken to err more than
// those and the less doubtful half of the doubtful.
class AccuracyJudge {
 public:
    // Pictures are of at most sampling.side_px pixels on the longer side. scene.ray_cast is there.
    // All must outlive it.
    static Result<AccuracyJudge> make(Renderer& renderer, const Scene& scene, const SceneData& data,
                                      AccuracySampling sampling = {});

    // The error of the scene with another ray-cast layer, which differs in integrator, steps and
    // min_transmittance only.
    Result<double> estimate(const RayCastLayer& layer);

 private:
    AccuracyJudge(Renderer& renderer, const Scene& scene, const SceneData& data, uint32_t side_px);
    Result<Image> draw(const Scene& scene);

    Renderer* renderer_;
    const SceneData* data_;
    Scene scene_;   // of no more rays than asked for
    double pixels_; // of the whole picture
    Image finest_;
    double finest_error_ = 0.0;
};

struct AccuracyChoice {
    RaySetting setting;
    double min_transmittance = 0.0;
    double error_estimate = 0.0; // RMSE of colour
};

// The fastest setting whose estimate, of the whole picture, is at most `error`. Settings that miss
// it in a smaller picture (sampling.side_px) are passed by. Fails with a sentence that states the
// smallest error available. scene.ray_cast is there.
Result<AccuracyChoice> choose_setting(Renderer& renderer, const Scene& scene, const SceneData& data,
                                      double error, AccuracySampling sampling = {});

} // namespace palpate
