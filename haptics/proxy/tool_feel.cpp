// The tool's contacts: their values, and whether these are known; declared in tool_contacts.h.

#include "haptics/proxy/tool_contacts.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

// A contact presses whose clearance is less, in samples; and so many samples in material tell what
// is felt where none does.
constexpr double kPressing = 0.5;
constexpr uint32_t kMostFelt = 8;

} // namespace

std::optional<Feel> ToolContacts::feel_at(dvec3 at, dvec3 push, const TouchParameters& q) {
    FeelMean mean(q);
    if (mean.is_plain())
        return mean.feel();
    const Volume& labels = *field_.volume();
    const double voxel_mm = field_.voxel_mm();
    // Those that touch; where work ended on the way there are none, and those ahead tell.
    for (const double near_mm : {kPressing * voxel_mm, 4.0 * voxel_mm}) {
        for (const Hold& hold : holds()) {
            const double share = glm::dot(hold.normal, push);
            if (share > 0.0 && left_mm(hold, at) < near_mm)
                mean.add(labels, field_.index_of(at + arm_of(hold.touch)),
                         dvec3(field_.offset_of(-0.5 * voxel_mm * hold.normal)), share);
        }
        if (const std::optional<Feel> feel = mean.feel())
            return feel;
    }
    const uint32_t count = solid_points(at), step = count / kMostFelt + 1;
    for (uint32_t i = 0; i < count; i += step)
        mean.add(labels, field_.index_of(at + points_[inside_[i].point]), dvec3(0.0));
    return mean.feel();
}

bool ToolContacts::lacks_data(dvec3 at, dvec3 push, std::span<const Touch> held) const {
    if (!field_.may_lack_data())
        return false;
    bool is_pushed = false;
    for (const Hold& hold : holds())
        if (glm::dot(hold.normal, push) > 0.0 &&
            left_mm(hold, at) < kPressing * field_.voxel_mm()) {
            if (field_.lacks_data(at + arm_of(hold.touch)))
                return true;
            is_pushed = true;
        }
    if (is_pushed)
        return false;
    for (const Touch& touch : held)
        if (has(touch) && field_.lacks_data(at + arm_of(touch)))
            return true;
    const uint32_t step = point_count_ / kMostFelt + 1;
    for (uint32_t i = 0; i < point_count_; i += step)
        if (field_.lacks_data(at + points_[i]))
            return true;
    return field_.lacks_data(at);
}

} // namespace palpate::haptics
