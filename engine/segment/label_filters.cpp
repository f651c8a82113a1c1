#include <array>
#include <cmath>

#include "engine/base/file.h"
#include "engine/segment/components.h"
#include "engine/segment/filters.h"
#include "engine/segment/interpolate_slices.h"
#include "engine/segment/label_logic.h"
#include "engine/segment/label_median.h"
#include "engine/segment/margin.h"
#include "engine/segment/morphology.h"
#include "engine/segment/scissors.h"
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
    if (!v.locked.empty() && !o.label)
        return fail("expected a label that changes, where others are locked; found all as a mask");
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
Result<Volume> keep_piece_at(const Volume& volume, const FilterValues& v, const Task& task) {
    const glm::dvec4 place(v.numbers[0], v.numbers[1], v.numbers[2], 1.0);
    const glm::ivec3 at(glm::round(glm::dvec3(index_from_world(volume.grid()) * place)));
    if (glm::any(glm::lessThan(at, glm::ivec3(0))) ||
        glm::any(glm::greaterThanEqual(at, glm::ivec3(volume.size()))))
        return fail("expected a place in the volume, found sample {}, {}, {}", at.x, at.y, at.z);
    return keep_piece(volume, {.at = glm::uvec3(at), .neighbours = neighbours_of(v.numbers[3])},
                      task);
}
Result<Volume> split_label(const Volume& volume, const FilterValues& v, const Task& task) {
    return split_pieces(volume,
                        {.label = uint16_t(v.numbers[0]),
                         .neighbours = neighbours_of(v.numbers[1]),
                         .least_ml = v.numbers[2],
                         .locked = v.locked},
                        task);
}
Result<BrickMaker> smooth_walls(const Volume& volume, const FilterValues& v, const Task& task) {
    return smooth_labels_bricks(volume, {.sigma_mm = v.numbers[0], .locked = v.locked}, task);
}
Result<BrickMaker> vote(const Volume& volume, const FilterValues& v, const Task&) {
    return label_median_bricks(volume, {v.numbers[0], v.locked});
}

// A label and whether it grows over others, the last two of a filter's numbers.
ChangedLabels changed_labels(const FilterValues& v) {
    const size_t last = v.numbers.size() - 1;
    return {label_of(v.numbers[last - 1]), v.numbers[last] > 0.0, v.locked};
}
Result<Volume> move_walls(const Volume& volume, const FilterValues& v, const Task& task) {
    return margin(volume, v.numbers[0], changed_labels(v), task);
}
Result<Volume> hollow_out(const Volume& volume, const FilterValues& v, const Task& task) {
    return hollow(volume, v.numbers[0], Wall(int(v.numbers[1])), changed_labels(v), task);
}

Result<Volume> between_slices(const Volume& volume, const FilterValues& v, const Task& task) {
    BetweenSlicesOptions o{.label = label_of(v.numbers[1]), .locked = v.locked};
    if (v.numbers[0] > 0.0)
        o.axis = int(v.numbers[0]) - 1;
    return interpolate_slices(volume, o, task);
}

// "LOGIC,LABEL[,OF[,NAME]]".
Result<Volume> combine(const Volume& volume, const FilterValues& v, const Task& task) {
    std::vector<std::string> parts{""};
    for (const char c : v.text)
        if (c == ',')
            parts.emplace_back();
        else
            parts.back() += c;
    if (parts.size() < 2 || parts.size() > 4)
        return fail("expected LOGIC,LABEL[,OF[,NAME]], found '{}'", v.text);
    PALPATE_TRY(
        const double logic,
        read_filter_value({"logic", "", 0, 4, {}, "copy|add|subtract|intersect|invert"}, parts[0]));
    PALPATE_TRY(const double one,
                read_filter_value({"label", "", 1, 65535, {}, "", true}, parts[1]));
    LabelLogicOptions o{.logic = LabelLogic(int(logic)), .label = uint16_t(one)};
    o.locked = v.locked;
    if (parts.size() > 2) {
        PALPATE_TRY(const double of,
                    read_filter_value({"of", "", 0, 65535, {}, "", true}, parts[2]));
        o.of = uint16_t(of);
    }
    std::optional<Volume> other;
    if (parts.size() > 3) {
        PALPATE_TRY(other, other_volume(v, parts[3]));
        o.other = &*other;
    }
    const bool needs_set = o.logic != LabelLogic::invert;
    if (needs_set && o.of == 0 && !o.other)
        return fail("expected the label OF that is combined with {}, found none", o.label);
    return label_logic(volume, o, task);
}

// A file of scissors, or its text.
Result<Volume> cut_by_outline(const Volume& volume, const FilterValues& v, const Task& task) {
    const bool is_text = v.text.find('{') != std::string::npos;
    PALPATE_TRY(const std::string text, is_text ? v.text : load_text(v.text));
    PALPATE_TRY(const Scissors scissors, parse_scissors(text, is_text ? "scissors" : v.text));
    return cut_labels(volume, scissors, v.locked, task);
}

FilterParameter label() {
    return {"label", "(0: all)", 0, 65535, 0.0, "", true};
}

FilterParameter over() {
    return {"over", "", 0, 1, 0.0, "background|all"};
}

Filter morphology_filter(const char* name, const char* purpose,
                         Result<Volume> (*run)(const Volume&, const FilterValues&, const Task&)) {
    return {name,
            purpose,
            "",
            {{"element", "", 0, 3, {}, kElements},
             {"by", "times, or mm of a ball", 0.0, 1000.0, 1.0},
             label(),
             over()},
            "u8; of a label the type of the input",
            "2 bits a sample; a ball of more than 10 samples: 9 bytes a sample",
            nullptr,
            run,
            true,
            true};
}

const char* const kSame = "the type of the input";
const char* const kBox = "8 bytes a sample of the largest label's box and of bricks that change";

std::vector<Filter> piece_filters() {
    return {
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
         true,
         true},
        {"largest",
         "Set all but the largest connected piece of each label to 0",
         "",
         {{"neighbours", "", 0, 2, {}, kNeighbours}, label()},
         kSame,
         kRuns,
         nullptr,
         keep_largest,
         true,
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
         true,
         true},
        {"piece",
         "Keep of the label at a place (LPS) the connected piece there, and set its others to 0",
         "",
         {{"x", "mm", -1e9, 1e9},
          {"y", "mm", -1e9, 1e9},
          {"z", "mm", -1e9, 1e9},
          {"neighbours", "", 0, 2, 2.0, kNeighbours}},
         kSame,
         kRuns,
         nullptr,
         keep_piece_at,
         true,
         true},
        {"split",
         "Give connected pieces of a label, but for the largest, free labels of their own, larger "
         "ones first; least: smaller ones stay",
         "",
         {{"label", "", 1, 65535, 1.0, "", true},
          {"neighbours", "", 0, 2, 2.0, kNeighbours},
          {"least", "ml", 0.0, 1e9, 0.0}},
         "the type of the input; u16 where it does not hold a label",
         kRuns,
         nullptr,
         split_label,
         true,
         true},
    };
}

std::vector<Filter> wall_filters() {
    return {
        {"margin",
         "Grow labels by MM, or shrink them where it is negative; each free sample goes to the "
         "nearest",
         "",
         {{"mm", "mm", -1000.0, 1000.0}, label(), over()},
         kSame,
         kBox,
         nullptr,
         move_walls,
         true,
         true},
        {"hollow",
         "Leave of labels a wall of so many mm: within them, on both sides of their border, or "
         "around them",
         "",
         {{"mm", "mm", 0.0, 1000.0},
          {"wall", "", 0, 2, 0.0, "inside|middle|outside"},
          label(),
          over()},
         kSame,
         kBox,
         nullptr,
         hollow_out,
         true,
         true},
        {"between-slices",
         "Fill the slices between those drawn across an axis of the grid; auto: across which each "
         "label has most gaps",
         "",
         {{"axis", "", 0, 3, 0.0, "auto|x|y|z"}, label()},
         kSame,
         "6 bytes a sample",
         nullptr,
         between_slices,
         true,
         true},
        {"logic",
         "Combine a label with the samples of label OF (0: of all), here or in a map of --with: "
         "copy, add, subtract, intersect, or invert; a sample that joins leaves its own label",
         "LOGIC,LABEL[,OF[,NAME]]",
         {},
         "the type of the input; u16 where it does not hold the label",
         "a brick of each map for each thread",
         nullptr,
         combine,
         true,
         true},
        {"scissors",
         "Erase a label within or without an outline as it is seen in a slice or in 3D, or fill "
         "it: "
         "through all depths, between two, or what is seen first; a JSON file, or its text "
         "(docs/reference/filters.md)",
         "CUT",
         {},
         "the type of the input; u16 where it does not hold the label",
         "a brick for each thread; of what is seen first two bits a sample",
         nullptr,
         cut_by_outline,
         true,
         true},
    };
}

} // namespace

std::vector<Filter> label_filters() {
    std::vector<Filter> all{
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
        {"smooth-joint",
         "Smooth the walls between all labels, without gaps and overlaps; each keeps its volume",
         "",
         {{"sigma", "mm", 0.0, 1000.0}},
         kSame,
         "a brick and its halo for each thread",
         smooth_walls,
         nullptr,
         true,
         true},
        {"smooth-median",
         "The label that most samples of the ball carry, without gaps and overlaps",
         "",
         {{"radius", "mm", 0.0, 1000.0}},
         kSame,
         "a brick and its halo for each thread",
         vote,
         nullptr,
         true,
         true},
    };
    for (std::vector<Filter> (*more)() : {piece_filters, wall_filters})
        for (Filter& filter : more())
            all.push_back(std::move(filter));
    return all;
}

} // namespace palpate
