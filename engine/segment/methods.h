#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/segment/seeds.h"
#include "engine/segment/task.h"

// The segmentation methods that the program offers, in one table: its command line, its help and
// its lists are made from it. To add a method, add a function and a row.
namespace palpate {

struct MethodParameter {
    const char* name;
    const char* unit; // "" for a plain number
    double least, most;
    double fallback;
    const char* fallback_text; // where the fallback is found from the data; else null
    const char* purpose;
};

using ParameterValues = std::map<std::string, double, std::less<>>;

// State that a run keeps for one that follows; each method has its own kind.
class KeptRun {
 public:
    virtual ~KeptRun() = default;
};

struct SegmentInput {
    const Volume& volume;
    std::optional<Volume> seeds; // a label map on the volume's grid
    std::vector<SeedBall> balls; // where the seeds come from, if known; they are in `seeds`, too
    uint16_t background = 0;     // a label of the seeds that becomes 0 in the result; 0: none
    std::vector<WireCurve> curves{}; // for methods that take curves
    // A front that meets no boundary is no failure: see Segmented::unbounded.
    bool keeps_unbounded = false;
    // For runs that follow each other, while seeds change: a method that can leaves here what it
    // has come to, and goes on from there if volume and parameters are the same snapshot and
    // values. Results are those of a run from the start, to the bit. Null: nothing is kept.
    std::shared_ptr<KeptRun>* kept = nullptr;
};

// An object whose front met no boundary, and why a person must choose a bound, in words.
struct Unbounded {
    uint16_t label;
    std::string why;
};

struct Segmented {
    Volume labels;              // u8 or u16, 0 outside of all objects
    std::optional<Volume> cost; // f32; of fast marching the first object's
    // f32: arrival times, connectedness or probability; no data where the background has won.
    std::optional<Volume> strength;
    std::vector<std::string> notes; // what was found from the data, for people
    // f32, mm, negative inside: of level sets, the least of all objects. See LevelSetResult.
    std::optional<Volume> distance{};
    std::vector<WireCurve> curves{}; // as they follow edges: of methods that take curves
    // With a strength, u16: the label that each sample has, if its strength is within the bound;
    // where the background has won, its label.
    std::optional<Volume> owner{};
    // Their labels have no sample. With SegmentInput::keeps_unbounded alone; else it is an error.
    std::vector<Unbounded> unbounded{};
    // The values of parameters that may be found from the data; those of the first object.
    ParameterValues found{};
};

// The meaning of Segmented::strength.
struct StrengthMeaning {
    const char* text;
    bool is_object_below = false; // objects are where it is at most a bound; else at least
};

struct SegmentMethod {
    const char* name;
    const char* purpose;
    bool takes_seeds;
    std::optional<StrengthMeaning> strength; // where there is one
    std::vector<MethodParameter> parameters;
    Result<Segmented> (*run)(const SegmentInput& input, const ParameterValues& values,
                             const Task& task);
    bool takes_curves = false;
    bool has_distance = false; // makes Segmented::distance
    bool keeps_runs = false;   // takes and leaves SegmentInput::kept; others clear it
};

std::span<const SegmentMethod> segment_methods(); // the table, in the order of menus
const SegmentMethod* find_segment_method(std::string_view name);

// Whether the objects of a method with a strength are where that is at most a bound, as of arrival
// times; else where it is at least the bound.
bool is_object_below(const SegmentMethod& method);

// Objects by another bound of their strength, without running the method again: samples of `owner`
// (Segmented) whose strength, on the same grid, is at most the bound (`below`), or at least. u16.
Result<Volume> bounded_labels(const Volume& strength, const Volume& owner, bool below, double bound,
                              const Task& task);

// Runs a method with the values that were given; others take their fallback. Refused: seeds that
// are missing, a parameter of another method, or beyond its range.
Result<Segmented> segment(const SegmentMethod& method, const SegmentInput& input,
                          const ParameterValues& given, const Task& task);

} // namespace palpate
