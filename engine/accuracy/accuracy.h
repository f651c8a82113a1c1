#pragma once

#include <optional>
#include <span>
#include <string>

#include "engine/base/error.h"
#include "engine/scene/scene.h"

// How far a ray-cast picture is from the exact picture of its trilinear field, by what has been
// measured on scenes of its kind: accuracy_table.inc, which palpate_accuracy_table writes.
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

// How much the field changes from sample to sample beside what the transfer function tells apart:
// the root mean square of differences of neighbouring samples per smallest spacing, where anything
// is to be seen between them, over the value in which colour or extinction changes by all of itself
// where it changes fastest. 0 where nothing is seen. Large volumes are sampled.
double sharpness_of(const TransferFunction& function, const Volume& volume);

// Scenes of one kind err alike.
enum class SceneKind { alpha, shaded_alpha, mip, iso };
SceneKind kind_of(const RayCastLayer& layer);

// Scenes of a kind fall into classes by sharpness: class c holds those up to 2^(c - 4), the last
// one all others.
constexpr size_t kSharpnessClasses = 9;
size_t sharpness_class(double sharpness);

// What has been measured: RMSE of colour against grid truth, the largest over the scenes of a kind
// up to a class, and time beside `fast` at one sample a voxel.
struct MeasuredSetting {
    RaySetting setting;
    double cost[4];                    // by kind
    double rmse[4][kSharpnessClasses]; // by kind and class
};
std::span<const MeasuredSetting> measured_settings();

// Few scenes were measured in each class: a scene counts as one class sharper than it is, and as
// erring by this factor more. tests/gpu/accuracy_test.cpp holds that against other scenes.
constexpr size_t kClassesAbove = 1;
constexpr double kAccuracyMargin = 2.0;

struct AccuracyChoice {
    RaySetting setting;
    double min_transmittance = 0.0;
    double error_estimate = 0.0; // RMSE of colour: measured, with its margin, and early termination
};

// The fastest setting whose estimate is at most `error`. Fails with a sentence that says the best
// that can be had. scene.ray_cast is there.
//
// weight_error: how far the device's filter weights are off, 0 where it interpolates in fp32 and
// 2^-9 for 8 fractional bits. Values then err by so much of neighbours' differences, which is
// `sharpness` times that much of what the transfer function tells apart. `exact` does not filter.
Result<AccuracyChoice> choose_setting(const Scene& scene, const SceneData& data, double error,
                                      double weight_error = 0.0);

// What is to be expected of a scene as it stands; nothing where its setting is coarser than all
// that were measured, or was not measured with what the scene holds.
std::optional<double> estimated_error(const Scene& scene, const SceneData& data,
                                      double weight_error = 0.0);

} // namespace palpate
