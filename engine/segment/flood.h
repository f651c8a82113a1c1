#pragma once

#include <functional>
#include <optional>
#include <span>

#include "engine/segment/task.h"
#include "engine/segment/threshold.h"
#include "engine/volume/volume.h"

// Paths that avoid high passes. The height of a path is that of its highest pass; each sample takes
// the lowest path from a seed, and its label. Region growing, watersheds and fuzzy connectedness
// are this with different heights. One thread; samples are served in order of height by buckets of
// the upper 16 bits of their height, first come first served within one, until none changes: the
// heights are exact, and the result is always the same.
namespace palpate {

// Which samples are neighbours: those that share a face, or an edge too, or a corner too.
enum class Neighbors { face_6 = 6, edge_18 = 18, corner_26 = 26 };
std::optional<Neighbors> neighbors_of(int count); // 6, 18 or 26

struct LabelInterval {
    uint16_t label = 1;
    ValueInterval values;
};

// All samples that a path of neighbours joins to a seed, on which every value, the seed's too, lies
// in the interval of the seed's label. Where labels meet, the one of fewer steps has a sample.
// Labels without an interval do not grow. The result is of the type of the seeds. Memory: 5 to 6
// bytes a sample of reached bricks and the queue, beside volume and result.
Result<Volume> region_growing(const Volume& volume, const Volume& seeds,
                              std::span<const LabelInterval> intervals, Neighbors neighbors,
                              const Task& task);

// Every sample gets the label whose seeds reach it over the lowest pass of `heights`, such as
// edge_strength() of a volume (flooding from markers: Meyer 1991). heights >= 0, lower ones count
// as 0; no data is a wall. Memory as above.
Result<Volume> watershed(const Volume& heights, const Volume& seeds, Neighbors neighbors,
                         const Task& task);

// Heights of the lowest paths from the seeds of one label (0: of all) where the pass between two
// neighbouring samples is pass(a, b) >= 0 of their values, closed above `highest`. f32; 0 at seeds,
// no data where none reaches.
Result<Volume> lowest_paths(const Volume& volume, const Volume& seeds, uint16_t label,
                            const std::function<float(float a, float b)>& pass, float highest,
                            const Task& task);

} // namespace palpate
