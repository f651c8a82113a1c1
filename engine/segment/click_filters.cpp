// Filters that make a label map of what a click on a place takes.

#include <cmath>

#include "engine/segment/click_region.h"
#include "engine/segment/filters.h"
#include "engine/volume/grid.h"

namespace palpate {

namespace {

glm::dvec3 place_of(const Volume& volume, const FilterValues& v) { // in samples
    return index_point(volume.grid(), {v.numbers[0], v.numbers[1], v.numbers[2]});
}

Result<Volume> like_a_place(const Volume& volume, const FilterValues& v, const Task& task) {
    const glm::dvec3 at = glm::round(place_of(volume, v));
    if (glm::any(glm::lessThan(at, glm::dvec3(0.0))) ||
        glm::any(glm::greaterThanEqual(at, glm::dvec3(volume.size()))))
        return fail("expected a place in the volume, found sample {:g}, {:g}, {:g}", at.x, at.y,
                    at.z);
    PALPATE_TRY(const ClickRegion region, local_region(volume,
                                                       {.at = glm::uvec3(at),
                                                        .reach_mm = v.numbers[3],
                                                        .near_mm = v.numbers[5],
                                                        .times = v.numbers[4]},
                                                       task.part(0.0, 0.7)));
    return volume_of(region, volume.grid(), 1, task.part(0.7, 1.0));
}

Result<Volume> within_contour(const Volume& volume, const FilterValues& v, const Task& task) {
    const LevelTrace click{.at = place_of(volume, v), .axis = static_cast<int>(v.numbers[3])};
    PALPATE_TRY(const ClickRegion region, level_region(volume, click, task.part(0.0, 0.7)));
    return volume_of(region, volume.grid(), 1, task.part(0.7, 1.0));
}

FilterParameter coordinate(const char* name) {
    return {name, "mm", -1e9, 1e9};
}

} // namespace

std::vector<Filter> click_filters() {
    return {
        {"local-threshold",
         "1 where samples are joined to a place (LPS) and have values like its own and those near "
         "it: so many robust standard deviations about them",
         "",
         {coordinate("x"),
          coordinate("y"),
          coordinate("z"),
          {"reach", "mm", 0.0, 500.0, 30.0},
          {"times", "", 0.0, 1000.0, 3.0},
          {"near", "mm", 0.0, 50.0, 3.0}},
         "u8",
         "10 bytes a sample of the box within reach",
         nullptr,
         like_a_place},
        {"level-trace",
         "1 within the closed contour of the value at a place (LPS), in its layer across an axis",
         "",
         {coordinate("x"), coordinate("y"), coordinate("z"), {"axis", "", 0, 2, 2.0, "x|y|z"}},
         "u8",
         "8 bytes a sample of the layer",
         nullptr,
         within_contour},
    };
}

} // namespace palpate
