#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/segment/task.h"

// Filters and methods of engine/segment beside ITK's on the same samples: a table of cases, to
// which a filter adds a line in cases.cpp and, where ITK has its like, a function in
// itk_filters.cpp.
namespace palpate::bench {

struct SegmentInput {
    Volume grey;    // CT, HU
    Volume bone;    // u8: 1 where grey >= 300
    Volume tissues; // u8: 0 air, 1 from -300 HU, 2 from 300 HU
    Volume edges;   // f32: gradient magnitude of 1.5 mm, 0 .. 1, on samples 1 mm apart
    Volume one;     // f32: 1 everywhere
    // The residual of gradient vector flow: that of ITK, where it has run.
    double flow_residual = 0.5;
};
Result<SegmentInput> segment_input(const Volume& grey);

constexpr double kFlowMu = 0.2;
constexpr double kBall_mm = 3.0;

// A grid of the same size and middle, turned by 0.3 about two axes.
Grid turned_grid(const Grid& grid);

// The start of fronts, and their cost by the likeness to 40 HU.
Volume middle_seed(const Volume& grey);
Result<Volume> soft_tissue_cost(const Volume& grey, const Task& task);

// For the level set: the skin of all that is not air, evened by curvature, by as many steps.
constexpr double kSkinCurvature_mm = 0.5;
constexpr int kSkinSteps = 50;

// The result of ours and of the peer, in x-fastest order.
using Samples = std::vector<float>;

struct SegmentCase {
    const char* name;
    const char* setting; // with units
    const char* peer;    // of itk_filter(); empty: none
    double wanted;       // times faster than ITK that are aimed at; 0: no aim
    int rounds;          // of the long form; a third of it, one at least, of the short one
    std::function<Result<Volume>(const SegmentInput&, const Task&)> ours;
    // The exact result at a sample, in double, NaN where there is none; null where the case has its
    // truth in a test.
    std::function<double(const SegmentInput&, glm::ivec3)> exact;
    // The residual of the whole result instead.
    std::function<double(const SegmentInput&, const Samples&)> residual = nullptr;
    // How far ours and theirs are apart in mm, where neither is the truth.
    std::function<double(const SegmentInput&, const Samples& ours, const Samples& theirs)> apart =
        nullptr;
};
std::span<const SegmentCase> segment_cases();

// One of ITK's filters, on a copy of the input that is made before. run() is what is timed.
struct ItkRun {
    std::function<void()> run;
    std::function<Samples()> result;
};
// Absent: ITK has no filter of that name here, or was not found at configure time.
std::optional<ItkRun> itk_filter(const std::string& name, const SegmentInput& input);

} // namespace palpate::bench
