#pragma once

#include "bench/touch/scenes.h"

// Cases of the plan beyond bodies at rest.
namespace palpate::touch {

// A12: what must not be felt, and values at the end of their type.
//   constant/free, constant/solid   one value everywhere: no surface, no force
//   no-data/all, no-data/half       NaN: never felt, nor where material would be
//   no-data/holes                   a plane with 2 % of its samples NaN or infinite: numbers out
//   extremes/plane                  a plane between the least and the most of 16 bits
//   spacing/zero                    no such grid: nobody is asked, see why_not
//   size/none, size/1               no volume; a single free sample
//   size/1-solid                    a single solid one: matter, of which only numbers are asked
std::vector<TouchCase> cases_of_no_surface(const Storage& storage);

// A13: a plane that changes under the hand. Erosion takes 1.5 mm away in twelve steps of 15 ms,
// growth adds as much; undo cuts 1.5 mm off at once and gives the first snapshot back; removal
// leaves nothing; flicker puts a layer of 0.5 mm on and off 200 times a second. Place and direction
// are judged where a snapshot stays for 0.1 s, jumps always.
std::vector<TouchCase> cases_of_edits();

// A14: forces along fields, each in closed form: uniform, a vortex, a saddle, the vortex about its
// zero line, a transfer function's step on the way, and a potential.
std::vector<TouchCase> cases_of_fields(const Storage& storage);

// All of them, in this order.
std::vector<TouchCase> special_cases(const Storage& storage);

// A11: a patient's own samples about a place, in their own storage. There is no truth but what the
// samples say: depth is (value - iso) / slope of the trilinear field, to first order; where labels
// are felt, of what is labelled. The volume is moved so that the place is the world's origin.
// `name` is the case's; the approach is from `outside`, a unit vector out of the material.
Scene patient_scene(const std::string& name, const Volume& volume, bool labels, double iso,
                    glm::dvec3 place_mm, glm::dvec3 outside);

// The places at which rays from outside to the volume's middle first meet material, spread evenly
// over all directions from above the equator; nothing for rays that meet none.
struct Place {
    glm::dvec3 mm, outside;
};
std::vector<Place> places_on(const Volume& volume, double iso, uint32_t count);

} // namespace palpate::touch
