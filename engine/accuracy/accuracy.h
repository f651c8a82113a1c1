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

// How much of a picture is looked at.
struct AccuracySampling {
    uint32_t side_px = 96;    // of the longer side of the pictures that settings are compared in
    uint32_t truth_side = 16; // about so many pixels each way are compared with grid truth
};

// An upper bound, with a confidence of 0.999, on the mean of `population` values of at least 0 of
// which `values` are a sample: the empirical Bernstein bound (Maurer and Pontil, COLT 2009,
// theorem 4), with the largest value seen for their range: larger ones that are too rare to be in
// the sample are not covered. The mean itself where all were seen.
double upper_mean(std::span<const double> values, double population);

// Estimates the RMSE of colour of a scene's pictures, without stereo.
//
// A picture of fewer rays through the same view is drawn by `exact` at its finest. Some of its
// pixels are compared with grid truth (engine/reference/truth.h), all of them with half the
// sub-steps; the larger of the two errors is its own. What another setting differs by from it over
// all pixels is added to that. Both are bounds, for what was not looked at (upper_mean()).
class AccuracyJudge {
 public:
    // scene.ray_cast is there. All must outlive it.
    static Result<AccuracyJudge> make(Renderer& renderer, const Scene& scene, const SceneData& data,
                                      AccuracySampling sampling = {});

    // Of the scene with another ray-cast layer, which differs in integrator, steps and
    // min_transmittance only.
    Result<double> estimate(const RayCastLayer& layer);

 private:
    AccuracyJudge(Renderer& renderer, const Scene& scene, const SceneData& data,
                  AccuracySampling sampling);
    Result<Image> draw(const RayCastLayer& layer);

    Renderer* renderer_;
    const SceneData* data_;
    Scene scene_;   // of fewer rays
    double pixels_; // of the whole picture
    Image finest_;
    double finest_error_ = 0.0;
};

struct AccuracyChoice {
    RaySetting setting;
    double min_transmittance = 0.0;
    double error_estimate = 0.0; // RMSE of colour
};

// The fastest setting whose estimate is at most `error`. Fails with a sentence that says the best
// that can be had. scene.ray_cast is there.
Result<AccuracyChoice> choose_setting(Renderer& renderer, const Scene& scene, const SceneData& data,
                                      double error, AccuracySampling sampling = {});

} // namespace palpate
