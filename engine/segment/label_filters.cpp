#include <array>
#include <cmath>

#include "engine/segment/components.h"
#include "engine/segment/filters.h"
#include "engine/segment/morphology.h"
#include "engine/segment/signed_distance.h"
#include "engine/segment/smooth_labels.h"

namespace palpate {

namespace {

const char* const kElements = "6|18|26|ball";
const char* const kNeighbours = "6|18|26";
const char* const kRuns = "16 bytes a run of equal labels along x";

// Reads a word of kElements or kNeighbours.
Neighbours neighbours_of(double word) {
    return std::array{Neighbours::faces, Neighbours::edges, Neighbours::corners}[size_t(word)];
}
std::optional<uint16_t> label_of(double number) {
    return number > 0.0 ? std::optional(uint16_t(number)) : std::nullopt;
}

Result<Volume> distance(const Volume& volume, const FilterValues& v, const Task& task) {
    SignedDistanceOptions o{.of = DistanceOf(int(v.numbers[0])), .label = uint16_t(v.numbers[1])};
    if (v.numbers[2] > 0.0)
        o.max_mm = v.numbers[2];
    return signed_distance(volume, o, task);
}

template <MorphologyStep kStep>
Result<Volume> morph(const Volume& volume, const FilterValues& v, const Task& task) {
    MorphologyOptions o{.step = kStep, .label = label_of(v.numbers[2])};
    o.overwrite = v.numbers[3] > 0.0;
    if (v.numbers[0] == 3.0) {
        o.radius_mm = v.numbers[1];
    } else {
        if (v.numbers[1] != std::floor(v.numbers[1]))
            return fail("by: expected a whole number of times, found {:g}", v.numbers[1]);
        o.neighbours = neighbours_of(v.numbers[0]);
        o.times = uint32_t(v.numbers[1]);
    }
    return morphology(volume, o, task);
}

Result<Volume> number_pieces(const Volume& volume, const FilterValues& v, const Task& task) {
    PALPATE_TRY(Components found, connected_components(volume,
                                                       {.neighbours = neighbours_of(v.numbers[0]),
                                                        .label = label_of(v.numbers[1]),
                                                        .as_mask = v.numbers[2] > 0.0,
                                                        .least_count = uint64_t(v.numbers[3])},
                                                       task));
    return std::move(found.numbers);
}
Result<Volume> drop_islands(const Volume& volume, const FilterValues& v, const Task& task) {
    return remove_islands(volume,
                          {.neighbours = neighbours_of(v.numbers[1]),
                           .label = label_of(v.numbers[2]),
                           .least_ml = v.numbers[0]},
                          task);
}
Result<Volume> keep_largest(const Volume& volume, const FilterValues& v, const Task& task) {
    return remove_islands(volume,
                          {.neighbours = neighbours_of(v.numbers[0]),
                           .label = label_of(v.numbers[1]),
                           .largest_alone = true},
                          task);
}
Result<Volume> close_holes(const Volume& volume, const FilterValues& v, const Task& task) {
    return fill_holes(
        volume, {.background = neighbours_of(v.numbers[0]), .label = label_of(v.numbers[1])}, task);
}
Result<BrickMaker> smooth_walls(const Volume& volume, const FilterValues& v, const Task& task) {
    return smooth_labels_bricks(volume, {v.numbers[0]}, task);
}

FilterParameter label() {
    return {"label", "(0: all)", 0, 65535, 0.0, "", true};
}

Filter morphology_filter(const char* name, const char* purpose,
                         Result<Volume> (*run)(const Volume&, const FilterValues&, const Task&)) {
    return {name,
            purpose,
            "",
            {{"element", "", 0, 3, {}, kElements},
             {"by", "times, or mm of a ball", 0.0, 1000.0, 1.0},
             label(),
             {"over", "", 0, 1, 0.0, "background|all"}},
            "u8; of a label the type of the input",
            "2 bits a sample; a ball of more than 10 samples: 9 bytes a sample",
            nullptr,
            run,
            true};
}

} // namespace

std::vector<Filter> label_filters() {
    const char* const kSame = "the type of the input";
    return {
        {"signed-distance",
         "Distance in mm to the nearest sample of another kind, negative in the object; max 0: "
         "without limit",
         "",
         {{"of", "", 0, 2, {}, "mask|label|labels"},
          {"label", "", 1, 65535, 1.0, "", true},
          {"max", "mm", 0.0, 1e6, 0.0}},
         "f32",
         "4 bytes a sample",
         nullptr,
         distance,
         true},
        morphology_filter("erode",
                          "Take away samples that have a neighbour outside, or something outside "
                          "within the ball",
                          morph<MorphologyStep::erode>),
        morphology_filter("dilate", "Add the neighbours of samples, or all within the ball",
                          morph<MorphologyStep::dilate>),
        morphology_filter("open", "Erode, then dilate: takes thin parts away",
                          morph<MorphologyStep::open>),
        morphology_filter("close", "Dilate, then erode: fills narrow gaps",
                          morph<MorphologyStep::close>),
        {"components",
         "Number connected pieces by size, the largest 1; those with fewer than least samples "
         "become 0",
         "",
         {{"neighbours", "", 0, 2, {}, kNeighbours},
          label(),
          {"of", "", 0, 1, 0.0, "labels|mask"},
          {"least", "samples", 1, 1e15, 1.0, "", true}},
         "u16",
         kRuns,
         nullptr,
         number_pieces,
         true},
        {"islands",
         "Set connected pieces of a label below a volume to 0",
         "",
         {{"least", "ml", 0.0, 1e9}, {"neighbours", "", 0, 2, 2.0, kNeighbours}, label()},
         kSame,
         kRuns,
         nullptr,
         drop_islands,
         true},
        {"largest",
         "Set all but the largest connected piece of each label to 0",
         "",
         {{"neighbours", "", 0, 2, {}, kNeighbours}, label()},
         kSame,
         kRuns,
         nullptr,
         keep_largest,
         true},
        {"holes",
         "Fill pieces of 0, joined by neighbours, that do not reach the border, with the label "
         "around them",
         "",
         {{"neighbours", "", 0, 2, {}, kNeighbours}, label()},
         kSame,
         kRuns,
         nullptr,
         close_holes,
         true},
        {"smooth-labels",
         "Smooth the walls between all labels, without gaps and overlaps",
         "",
         {{"sigma", "mm", 0.0, 1000.0}},
         kSame,
         "a brick and its halo for each thread",
         smooth_walls,
         nullptr,
         true},
    };
}

} // namespace palpate
