// A11 of the plan: real volumes; declared in special_cases.h.

#include <cmath>

#include "bench/touch/special_cases.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"
#include "engine/volume/sample.h"

namespace palpate::touch {

namespace {

using glm::dvec3;

// Depth by what the samples say, to first order, within 3 mm.
Solid solid_of(const Volume& volume, double iso) {
    // A slope below this is no edge: a tenth of the range over four samples.
    const ValueRange range = volume.range();
    const double flat =
        0.1 * (double{range.max} - double{range.min}) / (4.0 * largest_spacing_mm(volume.grid()));
    Solid solid;
    solid.distance_mm = [=](dvec3 mm) {
        const dvec3 index = index_point(volume.grid(), mm);
        const double value = trilinear(volume, index);
        const dvec3 gradient = world_gradient(volume.grid(), central_gradient(volume, index));
        if (!std::isfinite(value))
            return 3.0;
        const double slope = glm::length(gradient);
        return std::clamp((iso - value) / std::max(std::isfinite(slope) ? slope : 0.0, flat), -3.0,
                          3.0);
    };
    return solid;
}

} // namespace

Scene patient_scene(const std::string& name, const Volume& volume, bool labels, double iso,
                    dvec3 place_mm, dvec3 outside) {
    Grid grid = volume.grid();
    grid.world_from_index[3] -= glm::dvec4(place_mm, 0.0);
    const Volume moved = with_grid(volume, grid);
    Scene scene;
    scene.body.id = "A11";
    scene.body.name = name;
    scene.body.normal = outside;
    scene.body.along = glm::normalize(
        glm::cross(outside, std::abs(outside.x) < 0.6 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
    scene.body.judge_jumps = false; // edges and hollows of any kind
    scene.storage.spacing_mm = spacing_mm(grid);
    scene.storage.form = labels ? Form::labels : Form::grey_i16;
    scene.iso = labels ? 0.5 : iso;
    scene.touch.version = 1;
    if (labels) {
        scene.touch.labels = moved;
        scene.body.solid = solid_of(
            make_volume(grid, ScalarType::u8,
                        [&](glm::uvec3 at) { return volume.value(at) > 0.5f ? 1.0 : 0.0; }),
            0.5);
    } else {
        scene.touch.grey = moved;
        scene.body.solid = solid_of(moved, iso);
    }
    return scene;
}

std::vector<Place> places_on(const Volume& volume, double iso, uint32_t count) {
    const dvec3 middle = center_mm(volume.grid()), spacing = spacing_mm(volume.grid());
    const double reach = glm::length(dvec3(volume.size()) * spacing) / 2.0;
    const double step = 0.25 * smallest_spacing_mm(volume.grid());
    std::vector<Place> places;
    for (uint32_t i = 0; i < count; ++i) {
        const double z = 0.9 - 0.9 * i / count, turn = 2.399963 * i; // a spiral of golden angles
        const double r = std::sqrt(1.0 - z * z);
        const dvec3 outside(r * std::cos(turn), r * std::sin(turn), z);
        for (double t = reach; t > 0.0; t -= step) {
            const dvec3 at = middle + t * outside;
            if (trilinear(volume, index_point(volume.grid(), at)) >= iso) {
                places.push_back({at, outside});
                break;
            }
        }
    }
    return places;
}

} // namespace palpate::touch
