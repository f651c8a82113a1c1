#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "engine/base/error.h"
#include "engine/base/tool_pose.h"
#include "engine/edit/shape.h"
#include "engine/volume/grid.h"

namespace palpate {

// Smooth walls end at this distance from a tool's surface to either side, in samples.
constexpr double kWallReach = 2.0;

// The cutting part of a tool: a shape, the sample at the origin, or both.
struct Tool {
    ShapePtr shape; // null for a point
    // Affects every sample whose cell (half a sample to each side in index space) the tool's origin
    // lies in or passes through, so that a tool smaller than a sample still leaves a trace.
    bool marks_origin = false;
};

// The pose of the hand's tool at a moment of a stroke.
struct StrokePose {
    double time_s = 0.0; // never falls along a stroke
    ToolPose tool;

    friend bool operator==(const StrokePose&, const StrokePose&) = default;
};

constexpr double kFarthest_mm = 1e8, kLongest_s = 1e9; // of poses, to each side of 0

// A turn of exactly unit length where it was so to a thousandth, else what was found. One that is
// so but for rounding keeps its bits, so that what is written and read again stays the same.
Result<glm::dquat> unit_turn(glm::dquat turn);

// A pose from a device or a program as a stroke may hold it: its turn of unit length, and no number
// that is not finite or too far.
Result<StrokePose> checked_pose(const StrokePose& pose);

// The space a tool passes through from one pose to the next.
//
// The tip moves on a straight line and the turn along normalised linear interpolation, by the
// shorter way. Work is done in millimetres from the grid's origin, so that far offsets cost no
// digits, and without library functions, so that bits are the same on every machine.
//
// Balls: the capsule, in closed form. Other shapes that move: poses are looked at one after the
// other, each as far on as the shape's function allows (it cannot change faster than the tool's
// fastest point moves), but at least tolerance_mm of that motion apart; a point is inside if the
// function is at most tolerance_mm at one of them. Therefore
//     swept shape  is within  this  is within  swept {function <= tolerance_mm and within
//                                              tolerance_mm of the shape's bounds}
// at any speed: no gap, and for the shapes marked exact an excess of at most tolerance_mm. A tool
// that does not move is its shape, without the tolerance.
class Sweep {
 public:
    // `wider`: low_index() and high_index() hold all samples with near().samples() < wider, too.
    Sweep(const Tool& tool, const Grid& grid, const StrokePose& from, const StrokePose& to,
          double wider = 0.0);

    // Whether a point is inside, and how far all points say the same as it. p_mm: from the grid's
    // origin, along the world's axes.
    struct Verdict {
        bool inside = false;
        double same_within_mm = 0.0; // points nearer than this
    };
    Verdict at(glm::dvec3 p_mm) const;

    // How far a point is from the swept tool by the shape's function, negative inside; and the most
    // that the function changes there from a sample to the next along an axis of the grid. Their
    // quotient is a distance in samples that is good to first order at the surface, for any
    // spacing, and for functions that are less steep than a distance. A point that lies
    // kWallReach samples away or more is only known to be so, and on which side. Of shapes that
    // move, other than balls, mm is up to tolerance_mm() too large. Without a shape it is infinite.
    struct Near {
        double mm, sample_mm;
        double samples() const { return mm / sample_mm; }
    };
    Near near(glm::dvec3 p_mm) const;
    // Points that are farther than this from the tool by its function are kWallReach samples away.
    double far_mm() const { return kWallReach * longest_mm_; }

    // A box in index space that holds all samples inside; empty (low > high) where none can be.
    glm::dvec3 low_index() const { return low_; }
    glm::dvec3 high_index() const { return high_; }

    // Samples x of the row (y, z) that marks_origin affects: first .. second, none if first >
    // second.
    std::pair<double, double> marked_in_row(double y, double z) const;

    double tolerance_mm() const { return tolerance_; }

    // One sixteenth of the smallest spacing.
    static double tolerance_for(const Grid& grid);

 private:
    double value(double t, glm::dvec3 p_mm) const;

    const Shape* shape_; // may be null; the tool must outlive this
    bool marks_ = false;
    double ball_ = -1.0; // its radius, or -1
    BoxMm box_;
    double reach_ = 0.0;
    glm::dvec3 from_{0.0}, to_{0.0}; // mm from the grid's origin
    glm::dvec3 from_index_{0.0}, to_index_{0.0};
    glm::dquat from_turn_{1, 0, 0, 0}, to_turn_{1, 0, 0, 0}; // in one hemisphere
    glm::dmat3 turn_{1.0};                                   // where it does not change
    double speed_ = 0.0; // mm of the fastest point from t = 0 to 1
    double tolerance_ = 0.0;
    glm::dmat3 axes_{1.0};    // mm from a sample to the next
    double longest_mm_ = 0.0; // of them
    glm::dvec3 low_{0.0}, high_{0.0};
};

// The pose between two, as a sweep takes it; t from 0 to 1.
StrokePose pose_between(const StrokePose& from, const StrokePose& to, double t);

// The most that any point of a tool of this reach moves from one pose to the next, mm.
double travel_mm(const StrokePose& from, const StrokePose& to, double reach_mm);

} // namespace palpate
