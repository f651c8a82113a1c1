#pragma once

#include <functional>
#include <map>
#include <stop_token>

#include "bench/suite/errors.h"
#include "bench/suite/statistics.h"
#include "engine/base/timer.h"
#include "engine/reference/twin.h"
#include "engine/render/renderer.h"

namespace palpate::bench {

// Options of a suite.
struct Options {
    fs::path out;                  // a folder: results, page, pictures, cached truth
    bool full = false;             // the long form
    std::string device;            // as for palpate render
    fs::path head_ct = kHeadCt;    // or another volume in HU
    bool peers = true;             // time VTK where it is installed
    bool tiny = false;             // everything as small as it can be: for tests
    std::vector<std::string> only; // parts of a suite; empty: the usual ones
    fs::path labels =
        "/usr/share/mricron/templates/aal.nii.gz"; // of the suite `surface`; here 116 regions
    bool scores_organs = false;                    // suite `segment`: those of `labels` in head_ct
    std::stop_token stop;
};

// The size of a picture, and which of its pixels are held against truth: every stride-th one of
// every stride-th row, the first of them at (stride / 2, stride / 2).
struct Sampling {
    uint32_t size_px = 512, stride = 1;

    PixelStride pixels() const { return {stride, glm::uvec2(stride / 2)}; }
    uint32_t rays() const { return pixels().size(glm::uvec2(size_px)).x; } // on each side
    Image of(const Image& picture) const;                                  // those pixels alone
};

// Frames of one setting: wall clock about a fence, GPU time by timestamps, processor time of all
// threads; ms.
struct Frames {
    std::vector<double> wall_ms, gpu_ms, cpu_ms;

    Json json() const;
};

// Draws settings of a subject and holds them against truth.
class Bench {
 public:
    Bench(GpuDevice& device, const Options& options);

    // Grid truth of some pixels of a subject's picture; kept in OUT/truth under a hash of scene,
    // pixels and voxels, and read from there the next time.
    Result<Image> truth(const Subject& subject, Sampling sampling);

    struct Drawn {
        Setting setting;
        Frames frames;
        Errors errors;
        Image picture; // the pixels that were scored
    };
    // Draws every setting: for the error one picture, of which `sampling` says what is scored, for
    // the time `rounds` times three frames of its size, turning one degree a frame. Rounds go
    // through all settings in turn, so that a machine that grows slower grows slower for all; a
    // frame that is not counted comes first. `after_round` is for peers.
    Result<std::vector<Drawn>> draw(const Subject& subject, const std::vector<Setting>& settings,
                                    Sampling sampling, int rounds,
                                    const std::function<void()>& after_round = {});

    // From a volume in memory to its first picture, with a renderer of its own: upload, pipelines
    // and one frame; ms. Cold where the driver's shader cache is off.
    Result<double> first_frame_ms(const Subject& subject, const Setting& setting, uint32_t size_px);

    // The short form should end within ten minutes: true once `share` of them have passed. Then
    // draw() draws no rounds beyond the first, and experiments stop growing. Never in the long
    // form.
    bool late(double share) const;

    const Options& options() const { return options_; }
    GpuDevice& device() { return device_; }

 private:
    GpuDevice& device_;
    Options options_;
    Timer since_;
};

} // namespace palpate::bench
