#include "apps/palpate/touch_path.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "engine/program/option_checks.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

constexpr double kLongestPath_s = 3600.0;

using haptics::HandPath;
using haptics::HandPose;
using haptics::TrajectoryShape;

// The options that make the shape of a trajectory, each with a change of its value.
struct ShapeOption {
    const char* name;
    void (*change)(TrajectoryShape&);
};
constexpr ShapeOption kShapeOptions[] = {
    {"--at", [](TrajectoryShape& s) { s.at_mm += 1.0; }},
    {"--direction",
     [](TrajectoryShape& s) {
         s.direction = {s.direction.y, s.direction.z, s.direction.x};
         s.direction.x += 0.5 * glm::length(s.direction);
     }},
    {"--depth", [](TrajectoryShape& s) { s.depth_mm += 1.0; }},
    {"--distance", [](TrajectoryShape& s) { s.distance_mm *= 2.0; }},
    {"--speed", [](TrajectoryShape& s) { s.speed_mm_per_s *= 2.0; }},
    {"--frequency", [](TrajectoryShape& s) { s.frequency_hz *= 1.5; }},
    {"--duration", [](TrajectoryShape& s) { s.duration_s *= 0.75; }},
    {"--seed", [](TrajectoryShape& s) { ++s.seed; }}};

WorldBox box_of(const HandPath& path) {
    WorldBox box{path.poses().front().tool.position_mm, path.poses().front().tool.position_mm};
    for (const HandPose& pose : path.poses()) {
        box.low = glm::min(box.low, pose.tool.position_mm);
        box.high = glm::max(box.high, pose.tool.position_mm);
    }
    return box;
}

bool is_same_way(const HandPath& a, const HandPath& b) {
    return std::equal(a.poses().begin(), a.poses().end(), b.poses().begin(), b.poses().end(),
                      [](const HandPose& p, const HandPose& q) {
                          return p.time_s == q.time_s && p.tool.position_mm == q.tool.position_mm;
                      });
}

// Options of a shape have no effect beside a file, nor where another value gives the same path.
void warn_of_idle_shape(const CLI::App& app, const PathOptions& o, const TrajectoryShape& shape,
                        const HandPath& path) {
    std::vector<IdleOptions> idle;
    const std::string why = o.path.empty() ? "not of " + o.trajectory : "without --trajectory";
    for (const ShapeOption& option : kShapeOptions) {
        if (app.get_option(option.name)->count() == 0)
            continue;
        TrajectoryShape other = shape;
        option.change(other);
        if (!o.path.empty() ||
            is_same_way(haptics::find_trajectory(o.trajectory)->make(other), path))
            idle.push_back({true, {option.name}, why.c_str()});
    }
    warn_of_idle(app, idle);
}

} // namespace

void add_path_options(CLI::App& app, PathOptions& o) {
    std::vector<std::string> names;
    for (const haptics::TrajectoryEntry& entry : haptics::trajectories())
        names.emplace_back(entry.name);
    auto* motion = app.add_option_group("motion", "Intended positions of the hand");
    motion->require_option(1);
    motion->add_option(
        "--path", o.path,
        "CSV with the columns time_s,x_mm,y_mm,z_mm (LPS) and optionally qw,qx,qy,qz,button");
    motion
        ->add_option("--trajectory", o.trajectory,
                     fmt::format("A motion by name: {}", fmt::join(names, ", ")))
        ->check(one_of(names));
    motion
        ->add_option("--write-path", o.write,
                     "Write a path to begin with, onto the surface at --iso and back, as a file "
                     "for --path, and touch nothing")
        ->type_name("FILE.csv");
    motion->add_flag("--live", o.live, "A person moves the device; Enter switches force on");
    const CLI::Validator place = within(-haptics::kFarthestHand_mm, haptics::kFarthestHand_mm);
    app.add_option(
           "--at", o.at,
           "Target point of a trajectory, or middle of the reach of --live, mm (LPS; default: the "
           "centre)")
        ->delimiter(',')
        ->expected(3)
        ->check(place);
    app.add_option("--direction", o.direction,
                   "Trajectory: direction into the material (LPS; default 0,0,-1)")
        ->delimiter(',')
        ->expected(3);
    app.add_option("--depth", o.shape.depth_mm, "Trajectory: depth beyond the point, mm")
        ->check(place)
        ->capture_default_str();
    app.add_option("--distance", o.shape.distance_mm,
                   "Trajectory: distance of approach, or width, mm")
        ->check(positive())
        ->check(place)
        ->capture_default_str();
    app.add_option("--speed", o.shape.speed_mm_per_s, "Trajectory: speed, mm/s")
        ->check(positive())
        ->capture_default_str();
    app.add_option("--frequency", o.shape.frequency_hz, "Trajectory: frequency, Hz")
        ->check(positive())
        ->capture_default_str();
    app.add_option("--duration", o.shape.duration_s,
                   "Duration of a trajectory, or of --live (default there: 60), s")
        ->check(CLI::Range(0.001, kLongestPath_s))
        ->capture_default_str();
    app.add_option("--seed", o.shape.seed, "Trajectory: seed of random motion")
        ->capture_default_str();
}

std::string place_text(const HandPath& path, const Grid& grid) {
    return fmt::format("it stays within {}, and the volume within {}", text_of(box_of(path)),
                       text_of(world_box(grid)));
}

Result<void> check_together(const PathOptions& o) {
    if (o.direction.empty())
        return {};
    const double length = glm::length(glm::dvec3(o.direction[0], o.direction[1], o.direction[2]));
    if (!(length > 0.0 && std::isfinite(length)))
        return fail("--direction: expected a direction, found a length of {:g}", length);
    return {};
}

Result<HandPath> hand_path(const CLI::App& app, const PathOptions& o, const Grid& grid) {
    TrajectoryShape shape = o.shape;
    shape.at_mm = o.at.empty() ? center_mm(grid) : glm::dvec3(o.at[0], o.at[1], o.at[2]);
    if (!o.direction.empty())
        shape.direction = {o.direction[0], o.direction[1], o.direction[2]};
    if (o.live) {
        const IdleOptions idle[] = {
            {true,
             {"--direction", "--depth", "--distance", "--speed", "--frequency", "--seed"},
             "with --live"}};
        warn_of_idle(app, idle);
        return HandPath({{.tool = {shape.at_mm}}});
    }
    Result<HandPath> path = o.path.empty() ? haptics::find_trajectory(o.trajectory)->make(shape)
                                           : haptics::load_hand_path(o.path);
    if (path && path->end_s() - path->poses().front().time_s > kLongestPath_s)
        return fail("{}: expected a path of at most {:g} s, found {:g} s; its times are in seconds",
                    o.path.empty() ? "--trajectory " + o.trajectory : o.path, kLongestPath_s,
                    path->end_s() - path->poses().front().time_s);
    if (path)
        warn_of_idle_shape(app, o, shape, *path);
    return path;
}

} // namespace palpate
