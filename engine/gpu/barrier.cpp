#include "engine/gpu/barrier.h"

namespace palpate {

Access access_of(Use use) {
    constexpr auto compute = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
    switch (use) {
        case Use::none:
            return {};
        case Use::sampled:
            return {compute, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT,
                    VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL, false};
        case Use::uniform:
            return {compute, VK_ACCESS_2_UNIFORM_READ_BIT, VK_IMAGE_LAYOUT_UNDEFINED, false};
        case Use::storage_read:
            return {compute, VK_ACCESS_2_SHADER_STORAGE_READ_BIT, VK_IMAGE_LAYOUT_GENERAL, false};
        case Use::storage_write:
            return {compute,
                    VK_ACCESS_2_SHADER_STORAGE_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT,
                    VK_IMAGE_LAYOUT_GENERAL, true};
        case Use::indirect:
            return {VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT,
                    VK_IMAGE_LAYOUT_GENERAL, false};
        case Use::copy_source:
            return {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_READ_BIT,
                    VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, false};
        case Use::copy_target:
            return {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                    VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, true};
        case Use::clear_target:
            return {VK_PIPELINE_STAGE_2_CLEAR_BIT | VK_PIPELINE_STAGE_2_COPY_BIT,
                    VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, true};
        case Use::color_attachment:
            return {VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
                    VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT,
                    VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, true};
        case Use::present: // which the semaphore that is signalled makes visible
            return {VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_NONE,
                    VK_IMAGE_LAYOUT_PRESENT_SRC_KHR, false};
        case Use::host_read:
            return {VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT,
                    VK_IMAGE_LAYOUT_GENERAL, false};
    }
    return {};
}

void UseTracker::forget() {
    last_ = {VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_NONE, VK_IMAGE_LAYOUT_UNDEFINED,
             true};
}

std::optional<Dependency> UseTracker::advance(Use next) {
    const Access after = access_of(next);
    const Access before = last_;
    if (!before.writes && !after.writes && before.layout == after.layout &&
        before.stages != VK_PIPELINE_STAGE_2_NONE) {
        // A reader that an earlier barrier did not cover still waits for the last writer; since
        // that barrier made the write available to all stages it named, name this one too.
        const bool covered = (before.stages & after.stages) == after.stages &&
                             (before.access & after.access) == after.access;
        last_.stages |= after.stages;
        last_.access |= after.access;
        if (covered)
            return std::nullopt;
        return Dependency{before, after};
    }
    last_ = after;
    if (before.stages == VK_PIPELINE_STAGE_2_NONE && before.layout == after.layout)
        return std::nullopt; // first use of a buffer
    return Dependency{before, after};
}

} // namespace palpate
