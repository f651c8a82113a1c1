#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/tool_pose.h"
#include "haptics/core/workspace.h"

namespace palpate::haptics {

struct HandPose {
    double time_s = 0.0;
    ToolPose tool;
    uint32_t buttons = 0;
};

// The intended positions of a hand over time, in world millimetres: poses of rising time.
//
// Between two poses the tool lies on the straight line between them and turns evenly enough (the
// quaternions are blended and made unit length again); buttons are those of the earlier one. Before
// the first and after the last it rests there.
class HandPath {
 public:
    // At least one pose; times rise; everything finite; rotations of unit length. For poses from
    // elsewhere there is make_hand_path().
    explicit HandPath(std::vector<HandPose> poses);

    HandPose at(double time_s) const noexcept;
    // The velocity of the straight line at hand; at a pose, of the line that begins there.
    glm::dvec3 velocity_mm_per_s(double time_s) const noexcept;

    double end_s() const noexcept { return poses_.back().time_s; }
    const std::vector<HandPose>& poses() const noexcept { return poses_; }

 private:
    size_t segment(double time_s) const noexcept; // whose first pose is the last at or before
    std::vector<HandPose> poses_;
};

// The middle of the path in the middle of the device, and as much world for each of its millimetres
// as the path needs with a tenth to spare; at least 1. `scale` above 0: so much instead.
Workspace workspace_around(const HandPath& path, const DeviceCapabilities& device, double scale);

constexpr double kFarthestHand_mm = 1e8; // from 0 along an axis, as of strokes

// A path of poses from elsewhere. Refused: what the constructor takes for granted, and places
// farther than kFarthestHand_mm.
Result<HandPath> make_hand_path(std::vector<HandPose> poses);

// Comma-separated text (csv.h) with the columns time_s, x_mm, y_mm, z_mm, and optionally qw, qx,
// qy, qz (scaled to unit length; default: no rotation) and button (a whole number, bit b for button
// b). Refused, with the line: times that do not rise, quaternions near 0, places farther than
// kFarthestHand_mm.
Result<HandPath> parse_hand_path(const std::string& text, const std::string& name);
Result<HandPath> load_hand_path(const std::filesystem::path& path);

// Parameters of the named trajectories.
struct TrajectoryShape {
    glm::dvec3 at_mm{0.0};                // the point that is approached
    glm::dvec3 direction{0.0, 0.0, -1.0}; // of approach, into the material; any length but 0
    double depth_mm = 5.0;                // how far beyond at_mm
    double distance_mm = 20.0;            // from where it comes; radius or half length of slides
    double speed_mm_per_s = 40.0;         // mean, of straight motion
    double frequency_hz = 1.0;            // of what goes round or to and fro
    double duration_s = 3.0;              // of what has no end of its own; the hold of a press
    uint64_t seed = 1;                    // of what is random
};

struct TrajectoryEntry {
    const char* name;
    const char* purpose;
    HandPath (*make)(const TrajectoryShape&);
};
// press, touch, sine, cross, slide, circle, reach, walk.
const std::vector<TrajectoryEntry>& trajectories();
const TrajectoryEntry* find_trajectory(const std::string& name);

} // namespace palpate::haptics
