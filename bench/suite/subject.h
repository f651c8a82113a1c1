#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/scene.h"

// Subjects of measurement: volumes, and pictures of them.
namespace palpate::bench {

namespace fs = std::filesystem;

// A volume whose axes are the world's and whose first sample is the origin, so that peers without
// a notion of orientation draw the same scene.
struct Sample {
    std::string name;  // "head_ct", a key
    std::string title; // for people
    Volume volume;
};

// The head CT of Debian's invesalius-examples, 256 x 256 x 108, or whatever volume in HU `path` is.
Result<Sample> head_ct(const fs::path& path);
inline const char* const kHeadCt = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";

// The same resampled, trilinearly, first and last samples in place and rounded to i16.
Sample resampled(const Sample& sample, glm::uvec3 size, std::string name);

// The CT phantom in HU, and the test signal of Marschner and Lobb with values 0 .. 1 as f32, each
// with `side` samples an axis; spacing in ratio `spacing`.
Sample phantom(uint32_t side, glm::dvec3 spacing = glm::dvec3(1.0));
Sample marschner_lobb(uint32_t side);

// A small ball of 1000 HU, for tests.
Sample ball(uint32_t side);

// The quantity of an error.
enum class Metric {
    color,   // alpha: colour 0 .. 1, over R, G and B
    value,   // MIP: the value itself, HU
    surface, // iso: see errors.h, in samples
};

// One thing to draw: a volume, a layer without integrator and step, a camera. `peers` is how VTK
// calls the mode, empty where it is not asked.
struct Subject {
    std::string name; // "head_ct/alpha"
    std::string title;
    const Sample* sample;
    RayCastLayer layer;
    Camera camera;
    Metric metric;
    std::string peers;
    bool judged = true; // the default must lie on the front; no for scenes made to defeat it

    SceneData data() const { return {sample->volume, std::nullopt}; }
};

// The camera of the comparison with VTK: from +y, 30 degrees up, so near that 0.8 of the sphere
// round the volume fills the picture.
Camera peer_camera(const Volume& volume);

Subject alpha_subject(const Sample& sample, const TransferFunction& transfer, std::string suffix);
Subject shaded_subject(const Sample& sample, const TransferFunction& transfer);
Subject mip_subject(const Sample& sample, double low, double high);
Subject iso_subject(const Sample& sample, double value);

// Opaque within a narrow peak about `center`, clear beside it: the transfer function that point
// sampling misses. `width` is the whole width of the peak at its foot.
TransferFunction peak(double center, double width, double height, double unit_mm);

// The scene of a subject drawn by one setting.
Scene scene_of(const Subject& subject, uint32_t size_px);

// How a subject is drawn.
struct Setting {
    std::string integrator = "fast";
    double step_samples = 1.0; // in the smallest spacing; not used by `exact`
    uint32_t sub_steps = 0;    // `exact`; 0 elsewhere

    std::string name() const; // "fast, step 0.5", "exact, 8 sub-steps"
};

// integrator must be known.
void apply(const Setting& setting, const Volume& volume, RayCastLayer& layer);

// The program's default settings.
Setting default_setting();

// The settings that make up a front: every integrator that differs in this mode, at steps of 2 to
// 1/8 samples (`full`) or 2 to 1/4.
std::vector<Setting> settings_of(RayMode mode, bool full);

} // namespace palpate::bench
