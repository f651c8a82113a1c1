#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json_value.h"
#include "engine/measure/statistics.h"
#include "engine/volume/volume.h"

namespace palpate {

enum class MeasureKind { ruler, angle, polygon, sphere }; // of a Measure
const char* name_of(MeasureKind kind);

// A thing that is measured in the patient, in world millimetres. A value.
struct Measure {
    MeasureKind kind = MeasureKind::ruler;
    // ruler: both ends. angle: its vertex is the second of three. polygon: three or more corners in
    // their order, in one plane. sphere: its centre, and a point of its surface.
    std::vector<glm::dvec3> points_mm;
    std::string name{}; // by a person; may be empty

    friend bool operator==(const Measure&, const Measure&) = default;
};
// The name in a list of measures, of which it is in row 0, 1, ..: its own, or "ruler 1" in row 0.
std::string listed_name(const Measure& measure, size_t row);
// How many points complete one; 0: a person says when (polygon).
size_t points_needed(MeasureKind kind);

// Refused: another number of points; numbers that are not finite or beyond 1e7 mm; corners of a
// polygon off its plane by more than 1e-4 of its extent.
Result<void> check(const Measure& measure);

// Absent figures are not defined; `note` says why, in a sentence.
struct Measured {
    std::optional<double> length_mm;  // ruler; polygon: once round it
    std::optional<double> angle_deg;  // 0 .. 180
    std::optional<double> radius_mm;  // sphere
    std::optional<double> area_mm2;   // polygon
    std::optional<double> volume_mm3; // sphere: its own, not that of the samples in it
    std::optional<ValueStatistics> values;
    std::string note;
};

// Takes a measure that check() accepts. Values are those of samples, never interpolated.
//
// sphere: of the samples whose centres are at most its radius away from its centre.
// polygon: the volume's axis that its plane cuts most steeply is `a` (of equal ones the first).
// From each line of samples along `a` the one nearest to the plane is taken (of two the upper), if
// its foot on the plane lies inside. So in a slice along the samples these are the pixels whose
// centres lie inside.
//
// Not defined: an angle with two points in one place, a polygon that crosses itself or turns about
// a part twice, and its values where all corners are on a line. Nothing where `stop` was asked.
std::optional<Measured> measure(const Measure& measure, const Volume& volume,
                                const std::stop_token& stop = {});

// The normal of a polygon's plane, of unit length, its corners counter-clockwise about it; 0 where
// all are on a line.
glm::dvec3 plane_normal(const std::vector<glm::dvec3>& polygon);

// {"kind": "ruler", "points_mm": [[..], [..]], "name": "a"}
Json measure_json(const Measure& measure);
Measure read_measure(const JsonValue& in); // an error also where check() fails

} // namespace palpate
