#include "haptics/device/hand_path.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/base/file.h"
#include "haptics/device/csv.h"

namespace palpate::haptics {

HandPath::HandPath(std::vector<HandPose> poses) : poses_(std::move(poses)) {
    PALPATE_ASSERT(!poses_.empty());
    for (size_t i = 1; i < poses_.size(); ++i)
        PALPATE_ASSERT_CMP(poses_[i - 1].time_s, <, poses_[i].time_s);
}

size_t HandPath::segment(double time_s) const noexcept {
    const auto after =
        std::upper_bound(poses_.begin(), poses_.end(), time_s,
                         [](double t, const HandPose& pose) { return t < pose.time_s; });
    return after == poses_.begin() ? 0 : static_cast<size_t>(after - poses_.begin()) - 1;
}

HandPose HandPath::at(double time_s) const noexcept {
    const size_t i = segment(time_s);
    HandPose pose = poses_[i];
    pose.time_s = time_s;
    if (time_s <= poses_[i].time_s || i + 1 == poses_.size())
        return pose;
    const HandPose& next = poses_[i + 1];
    const double share = (time_s - poses_[i].time_s) / (next.time_s - poses_[i].time_s);
    pose.tool.position_mm += share * (next.tool.position_mm - pose.tool.position_mm);
    const glm::dquat a = pose.tool.rotation;
    const glm::dquat b =
        glm::dot(a, next.tool.rotation) < 0.0 ? -next.tool.rotation : next.tool.rotation;
    const glm::dquat blend = a * (1.0 - share) + b * share;
    if (a != b && glm::dot(blend, blend) > 0.0)
        pose.tool.rotation = glm::normalize(blend);
    return pose;
}

glm::dvec3 HandPath::velocity_mm_per_s(double time_s) const noexcept {
    const size_t i = segment(time_s);
    if (time_s < poses_[i].time_s || i + 1 == poses_.size())
        return glm::dvec3(0.0);
    return (poses_[i + 1].tool.position_mm - poses_[i].tool.position_mm) /
           (poses_[i + 1].time_s - poses_[i].time_s);
}

Result<HandPath> make_hand_path(std::vector<HandPose> poses) {
    if (poses.empty())
        return fail("a path: expected at least one pose, found none");
    for (size_t i = 0; i < poses.size(); ++i) {
        const auto& [time_s, tool, buttons] = poses[i];
        const glm::dvec3 p = tool.position_mm;
        if (!std::isfinite(time_s) || (i > 0 && !(poses[i - 1].time_s < time_s)))
            return fail("a path: expected times that rise, found {} s at pose {}", time_s, i);
        if (!glm::all(glm::lessThanEqual(glm::abs(p), glm::dvec3(kFarthestHand_mm)))) // nor NaN
            return fail("a path: expected places within {:g} mm, found {}, {}, {} at pose {}",
                        kFarthestHand_mm, p.x, p.y, p.z, i);
        if (!(std::abs(glm::dot(tool.rotation, tool.rotation) - 1.0) < 1e-6))
            return fail("a path: expected rotations of unit length, found {} at pose {}",
                        glm::length(tool.rotation), i);
    }
    return HandPath(std::move(poses));
}

Result<HandPath> parse_hand_path(const std::string& text, const std::string& name) {
    constexpr CsvColumn kColumns[] = {{"time_s"},    {"x_mm"},           {"y_mm"},
                                      {"z_mm"},      {"qw", false, 1.0}, {"qx", false},
                                      {"qy", false}, {"qz", false},      {"button", false}};
    std::vector<HandPose> poses;
    const auto add = [&](std::span<const double> v, size_t line) -> Result<void> {
        const glm::dquat turn(v[4], v[5], v[6], v[7]);
        const double length = std::sqrt(glm::dot(turn, turn));
        if (!(length > 1e-6) || !std::isfinite(length))
            return fail("{}:{}: qw, qx, qy, qz: expected a rotation, found length {}", name, line,
                        length);
        if (!(std::max({std::abs(v[1]), std::abs(v[2]), std::abs(v[3])}) <= kFarthestHand_mm))
            return fail(
                "{}:{}: x_mm, y_mm, z_mm: expected a place within {:g} mm, found {}, {}, {}", name,
                line, kFarthestHand_mm, v[1], v[2], v[3]);
        if (!(v[8] >= 0.0 && v[8] <= 4294967295.0) || v[8] != std::floor(v[8]))
            return fail("{}:{}: button: expected a whole number from 0 to 4294967295, found {}",
                        name, line, v[8]);
        if (!poses.empty() && !(v[0] > poses.back().time_s))
            return fail("{}:{}: time_s: expected more than {}, found {}", name, line,
                        poses.back().time_s, v[0]);
        poses.push_back({v[0],
                         {{v[1], v[2], v[3]}, length == 1.0 ? turn : turn / length},
                         static_cast<uint32_t>(v[8])});
        return {};
    };
    PALPATE_TRY(read_csv(text, name, kColumns, add));
    if (poses.empty())
        return fail("{}: expected at least one pose, found none", name);
    return HandPath(std::move(poses));
}

Workspace workspace_around(const HandPath& path, const DeviceCapabilities& device, double scale) {
    glm::dvec3 low = path.poses().front().tool.position_mm, high = low;
    for (const HandPose& pose : path.poses()) {
        low = glm::min(low, pose.tool.position_mm);
        high = glm::max(high, pose.tool.position_mm);
    }
    if (scale == 0.0) {
        const glm::dvec3 need = 1.1 * (high - low) / (2e3 * device.workspace_m);
        scale = std::max({1.0, need.x, need.y, need.z});
    }
    return Workspace(0.5 * (low + high), scale);
}

Result<HandPath> load_hand_path(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string text, load_text(path, uint64_t{4} << 30));
    return parse_hand_path(text, path.string());
}

} // namespace palpate::haptics
