#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

// Seeds: places that a person says belong to an object, by its label.
//
// A method takes them as a label map on the grid of the volume it works on: 0 is no seed. One of
// the labels may stand for what lies outside all objects (the background of a seed
// file); it is a seed like another, and becomes 0 in a result.
namespace palpate {

// A ball of seeds, or with radius 0 a point: the sample nearest to it.
struct SeedBall {
    uint16_t label = 1; // >= 1
    glm::dvec3 center_mm{0.0};
    double radius_mm = 0.0; // >= 0
};

// A closed curve on the surface of an object: its last point is its first, or within a sample's
// diagonal of it.
struct WireCurve {
    uint16_t label = 1; // >= 1
    std::vector<glm::dvec3> points_mm;
};

// The contents of a file of seeds:
//     {"seeds": 1, "units": "mm", "background": 2,
//      "balls": [{"label": 1, "center_mm": [x, y, z], "radius_mm": 8}, ..],
//      "points": [{"label": 2, "at_mm": [x, y, z]}, ..],
//      "curves": [{"label": 1, "points_mm": [[x, y, z], ..]}, ..],
//      "of": {"size": [x, y, z], "world_from_index": [16 numbers, row by row]}}
// Places are LPS mm. `of` is optional: the grid on which the seeds were placed.
struct SeedFile {
    std::vector<SeedBall> balls; // in the order of the file, points after balls
    uint16_t background = 0;     // 0: none of the labels
    std::optional<Grid> grid;
    std::vector<WireCurve> curves{}; // are no seeds: for methods that take curves
};

// `name` is the file's, for messages. Refused: JSON of another form, neither seed nor curve, labels
// of 0 or above 65535, a background without a seed.
Result<SeedFile> parse_seeds(std::string_view text, const std::string& name);
std::string seeds_text(const SeedFile& seeds);

// The label map of balls on a volume's grid: u8 where all labels are below 256, else u16. A sample
// belongs to a ball where its centre lies within; a ball between samples, and a point, take the
// nearest one. Where balls overlap, the later one counts. Samples without data take no seed.
// Refused, in one sentence: a centre outside the volume (half a sample beyond its outermost sample
// centres), and a ball of which no sample has data.
Result<Volume> seed_map(const Volume& volume, std::span<const SeedBall> balls);

// The same for what a file holds. Refused beside: a file made for another grid.
Result<Volume> seed_map(const Volume& volume, const SeedFile& seeds, const std::string& name);

// Seeds that are a label map already, from a file or painted: the map without seeds on samples that
// have no data. Refused: a map of another grid, of type i8 or i16 or float, without a seed, or with
// all its seeds on samples without data. `name` begins the sentence.
Result<Volume> checked_seeds(const Volume& volume, const Volume& seeds, const std::string& name);

// The labels of a label map and their numbers of samples, in ascending order, 0 left out.
struct LabelCount {
    uint16_t label;
    uint64_t count;
};
std::vector<LabelCount> label_counts(const Volume& labels);

} // namespace palpate
