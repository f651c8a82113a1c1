#include "engine/segment/filters.h"

#include "engine/segment/bilateral.h"
#include "engine/segment/gaussian.h"
#include "engine/segment/grid_change.h"
#include "engine/segment/label_merge.h"
#include "engine/segment/median.h"
#include "engine/segment/pointwise.h"
#include "engine/segment/resample.h"
#include "engine/segment/result_memory.h"
#include "engine/segment/vector_flow.h"
#include "engine/segment/vesselness.h"

namespace palpate {

namespace {

constexpr double kMostMm = 1000.0, kMostValue = 1e30;
const char* const kBrick = "a brick and its halo for each thread";
const char* const kInterpolations = "nearest|linear|cubic";
const char* const kPlaces = "a brick of each volume for each thread";

FilterParameter sigma(std::optional<double> preset = {}) {
    return {"sigma", "mm", 0.0, kMostMm, preset};
}

Result<BrickMaker> smooth(const Volume& volume, const FilterValues& v, const Task&) {
    return gaussian_bricks(volume, {v.numbers[0]});
}
Result<BrickMaker> derive(const Volume& volume, const FilterValues& v, const Task&) {
    const std::optional<int> second =
        v.numbers[2] > 0 ? std::optional(int(v.numbers[2]) - 1) : std::nullopt;
    return derivative_bricks(volume, {v.numbers[1], int(v.numbers[0]), second});
}
Result<BrickMaker> slope(const Volume& volume, const FilterValues& v, const Task&) {
    return gradient_magnitude_bricks(volume, {v.numbers[0]});
}

Result<BrickMaker> middle(const Volume& volume, const FilterValues& v, const Task&) {
    PALPATE_TRY(const MedianOptions options, median_of_mm(volume.grid(), v.numbers[0]));
    return median_bricks(volume, options);
}
Result<BrickMaker> middle_of_samples(const Volume& volume, const FilterValues& v, const Task&) {
    return median_bricks(volume, {glm::ivec3(v.numbers[0], v.numbers[1], v.numbers[2])});
}
Result<BrickMaker> keep_edges(const Volume& volume, const FilterValues& v, const Task&) {
    return bilateral_bricks(volume, {v.numbers[0], v.numbers[1], v.numbers[2] > 0});
}
Result<BrickMaker> tubes(const Volume& volume, const FilterValues& v, const Task& task) {
    VesselnessOptions o{v.numbers[0], v.numbers[1] > 0.0 ? v.numbers[1] : v.numbers[0],
                        int(v.numbers[2])};
    o.dark = v.numbers[3] > 0;
    if (v.numbers[4] > 0.0)
        o.structure = v.numbers[4];
    o.alpha = v.numbers[5];
    o.beta = v.numbers[6];
    return vesselness_bricks(volume, o, task);
}

Result<BrickMaker> express(const Volume& volume, const FilterValues& v, const Task&) {
    static const std::map<std::string, Volume> kNone;
    return expression_bricks(volume, v.text, v.others ? *v.others : kNone);
}
Result<BrickMaker> within(const Volume& volume, const FilterValues& v, const Task&) {
    return threshold_bricks(volume, v.numbers[0], v.numbers[1]);
}
Result<BrickMaker> limit(const Volume& volume, const FilterValues& v, const Task&) {
    return clamp_bricks(volume, v.numbers[0], v.numbers[1]);
}
Result<BrickMaker> rescale(const Volume& volume, const FilterValues& v, const Task&) {
    return rescale_bricks(volume, v.numbers[0], v.numbers[1], v.numbers[2], v.numbers[3]);
}
Result<BrickMaker> turn_over(const Volume& volume, const FilterValues&, const Task&) {
    return invert_bricks(volume);
}
// "NAME" or "NAME,OUTSIDE".
Result<BrickMaker> mask_by(const Volume& volume, const FilterValues& v, const Task&) {
    const size_t comma = v.text.find(',');
    PALPATE_TRY(const Volume mask, other_volume(v, v.text.substr(0, comma)));
    double outside = 0.0;
    if (comma != std::string::npos) {
        PALPATE_TRY(outside, read_filter_value({"outside", "", -kMostValue, kMostValue},
                                               v.text.substr(comma + 1)));
    }
    return mask_bricks(volume, mask, outside);
}

Result<BrickMaker> crop(const Volume& volume, const FilterValues& v, const Task&) {
    const std::vector<double>& n = v.numbers;
    return crop_bricks(volume, glm::ivec3(n[0], n[1], n[2]), glm::ivec3(n[3], n[4], n[5]));
}
Result<BrickMaker> pad(const Volume& volume, const FilterValues& v, const Task&) {
    const glm::ivec3 each(v.numbers[0], v.numbers[1], v.numbers[2]);
    return pad_bricks(volume, each, each, v.numbers[3]);
}
Result<BrickMaker> flip(const Volume& volume, const FilterValues& v, const Task&) {
    return flip_bricks(volume, int(v.numbers[0]));
}
Result<BrickMaker> reorient(const Volume& volume, const FilterValues& v, const Task&) {
    return reorient_bricks(volume, v.text);
}
Result<BrickMaker> to_spacing(const Volume& volume, const FilterValues& v, const Task&) {
    const double x = v.numbers[0];
    PALPATE_TRY(const Grid grid,
                grid_of_spacing(volume.grid(), {x, v.numbers[2] > 0 ? v.numbers[2] : x,
                                                v.numbers[3] > 0 ? v.numbers[3] : x}));
    return resample_bricks(volume, {grid, ResampledBy(int(v.numbers[1])), 0.0});
}
// "NAME" or "NAME,INTERPOLATION".
Result<BrickMaker> to_grid_of(const Volume& volume, const FilterValues& v, const Task&) {
    const size_t comma = v.text.find(',');
    PALPATE_TRY(const Volume like, other_volume(v, v.text.substr(0, comma)));
    double interpolation = 1.0;
    if (comma != std::string::npos) {
        PALPATE_TRY(interpolation,
                    read_filter_value({"interpolation", "", 0, 2, {}, kInterpolations},
                                      v.text.substr(comma + 1)));
    }
    return resample_bricks(volume, {like.grid(), ResampledBy(int(interpolation)), 0.0});
}
Result<Volume> flow(const Volume& volume, const FilterValues& v, const Task& task) {
    const VectorFlowOptions options{v.numbers[1], v.numbers[2]};
    if (v.numbers[0] < 3)
        return vector_flow(volume, int(v.numbers[0]), options, task);
    return vector_flow_length(volume, options, task);
}

FilterParameter value(const char* name, std::optional<double> preset = {}) {
    return {name, "", -kMostValue, kMostValue, preset};
}

const std::vector<Filter>& table() {
    const char* const kSame = "the type of the input";
    const auto samples = [](const char* name) {
        return FilterParameter{name, "samples", 0, kLargestMedian, {}, "", true};
    };
    const auto index = [](const char* name) {
        return FilterParameter{name, "samples", 0, 65535, {}, "", true};
    };
    static const std::vector<Filter> grey{
        // Smoothing
        {"gaussian", "Smooth with a Gaussian", "", {sigma()}, "f32", kBrick, smooth, nullptr},
        {"median",
         "Median of a box that reaches this far along each axis, a sample at least",
         "",
         {{"radius", "mm", 0.0, kMostMm}},
         kSame,
         kBrick,
         middle,
         nullptr},
        {"median-samples",
         "Median of a box of so many samples to each side",
         "",
         {samples("x"), samples("y"), samples("z")},
         kSame,
         kBrick,
         middle_of_samples,
         nullptr},
        {"bilateral",
         "Smooth and keep edges; separable is faster and less exact",
         "",
         {sigma(),
          {"range", "value units", 0.0, kMostValue},
          {"form", "", 0, 1, 0.0, "exact|separable"}},
         "f32",
         kBrick,
         keep_edges,
         nullptr},
        // Derivatives
        {"derivative",
         "Derivative of the smoothed volume along an axis of the patient, or second derivative",
         "",
         {{"axis", "", 0, 2, {}, "left|posterior|superior"},
          sigma(),
          {"second", "", 0, 3, 0.0, "none|left|posterior|superior"}},
         "f32",
         kBrick,
         derive,
         nullptr},
        {"gradient-magnitude",
         "Length of the gradient of the smoothed volume, per mm",
         "",
         {sigma()},
         "f32",
         kBrick,
         slope,
         nullptr},
        {"vesselness",
         "Likeness to a tube, 0 .. 1 (Frangi), the largest of the scales from .. to; structure 0: "
         "half the largest norm of the Hessian in the volume",
         "",
         {{"from", "mm", 0.0, kMostMm},
          {"to", "mm", 0.0, kMostMm, 0.0},
          {"steps", "", 1, 32, 1.0, "", true},
          {"tubes", "", 0, 1, 0.0, "bright|dark"},
          {"structure", "value units", 0.0, kMostValue, 0.0},
          {"alpha", "", 0.0, 1e3, 0.5},
          {"beta", "", 0.0, 1e3, 0.5}},
         "f32",
         kBrick,
         tubes,
         nullptr},
        {"gvf",
         "A component, or the length, of the gradient vector flow of an edge map (Xu and Prince)",
         "",
         {{"component", "", 0, 3, {}, "left|posterior|superior|length"},
          {"mu", "", 1e-6, 1e6, 0.2},
          {"residual", "", 1e-6, 1.0, 1e-4}},
         "f32",
         "2.5 volumes of floats; 3 where one axis is coarser",
         nullptr,
         flow},
        // Sample by sample
        {"expression",
         "Arithmetic of samples at the same place; V is a, others by --with",
         "EXPRESSION",
         {},
         "u8 of a comparison, else f32",
         kPlaces,
         express,
         nullptr},
        {"threshold",
         "1 where low <= value <= high, else 0",
         "",
         {value("low"), value("high", kMostValue)},
         "u8",
         kPlaces,
         within,
         nullptr},
        {"clamp",
         "Limit values",
         "",
         {value("low"), value("high")},
         kSame,
         kPlaces,
         limit,
         nullptr},
        {"rescale",
         "The straight line that takes low, high to to-low, to-high",
         "",
         {value("low"), value("high"), value("to-low", 0.0), value("to-high", 1.0)},
         "f32",
         kPlaces,
         rescale,
         nullptr},
        {"invert",
         "Exchange the least and the greatest value",
         "",
         {},
         kSame,
         kPlaces,
         turn_over,
         nullptr},
        {"mask",
         "Set samples to outside (default: 0) where a volume of --with is 0",
         "NAME[,OUTSIDE]",
         {},
         kSame,
         kPlaces,
         mask_by,
         nullptr},
        // Other samples
        {"crop",
         "Samples from low to high, both included, by index",
         "",
         {index("x-low"), index("y-low"), index("z-low"), index("x-high"), index("y-high"),
          index("z-high")},
         kSame,
         kBrick,
         crop,
         nullptr},
        {"pad",
         "So many samples more on both sides of each axis",
         "",
         {index("x"), index("y"), index("z"), value("value", 0.0)},
         kSame,
         kBrick,
         pad,
         nullptr},
        {"flip",
         "Reverse the order of samples along an axis of the grid; the patient does not move",
         "",
         {{"axis", "", 0, 2, {}, "x|y|z"}},
         kSame,
         kBrick,
         flip,
         nullptr},
        {"reorient",
         "Exchange and reverse axes so that they rise towards these sides of the patient, such as "
         "LPS or RAS; the patient does not move",
         "LETTERS",
         {},
         kSame,
         kBrick,
         reorient,
         nullptr},
        {"resample",
         "Other spacing on the same axes and box; y, z: 0 is as x",
         "",
         {{"x", "mm", 1e-3, kMostMm},
          {"interpolation", "", 0, 2, 1.0, kInterpolations},
          {"y", "mm", 0, kMostMm, 0.0},
          {"z", "mm", 0, kMostMm, 0.0}},
         "f32; nearest: the type of the input",
         "200 MB for each thread",
         to_spacing,
         nullptr},
        {"resample-like",
         "On the grid of a volume of --with; interpolation: nearest, linear (default), cubic",
         "NAME[,INTERPOLATION]",
         {},
         "f32; nearest: the type of the input",
         "200 MB for each thread",
         to_grid_of,
         nullptr},
    };
    static const std::vector<Filter> all = [] {
        std::vector<Filter> made = grey;
        for (std::vector<Filter> (*more)() : {click_filters, label_filters})
            for (Filter& filter : more())
                made.push_back(std::move(filter));
        return made;
    }();
    return all;
}

} // namespace

std::span<const Filter> filters() {
    return table();
}

Result<void> check_locked(const Filter& filter, const FilterValues& values) {
    if (!values.locked.empty() && !filter.changes_map)
        return fail("expected a filter that changes a label map, where labels are locked");
    return {};
}

Result<Volume> run_filter(const Filter& filter, const Volume& volume, const FilterValues& values,
                          const Task& task) {
    PALPATE_TRY(check_locked(filter, values));
    if (!filter.bricks) {
        if (values.locked.empty())
            return filter.whole(volume, values, task);
        PALPATE_TRY(const Volume made, filter.whole(volume, values, task.part(0.0, 0.9)));
        return with_locked(volume, made, values.locked, task.part(0.9, 1.0));
    }
    PALPATE_TRY(const BrickMaker maker, filter.bricks(volume, values, {task.stop, {}}));
    PALPATE_TRY(expect_result_memory(maker, volume, values.memory_bytes));
    return make_bricks(maker, task);
}

} // namespace palpate
