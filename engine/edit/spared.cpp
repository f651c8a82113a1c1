#include "engine/edit/spared.h"

#include <algorithm>
#include <vector>

#include "engine/base/assert.h"
#include "engine/edit/label_box.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"

namespace palpate {

Spared sparing(const Volume& before, const Volume& after, const EditLimits& limits) {
    PALPATE_ASSERT(before.grid() == after.grid());
    const auto& [spared, mask, values] = limits;
    Spared made{after};
    if (limits.are_none() || after.is_same_as(before))
        return made;
    std::vector<bool> stays(65536);
    for (const uint16_t label : spared)
        stays[label] = label != 0;
    const auto meet = [&](uint16_t label) {
        if (stays[label] && (made.met == 0 || label < made.met))
            made.met = label;
        return stays[label];
    };
    const std::vector<bool> area = mask.area.table();
    std::vector<bool> free(65536, !mask.over);
    if (mask.over)
        for (const uint16_t label : *mask.over)
            free[label] = true;
    const bool has_values = values && values->size() == before.size();
    const auto is_open = [&](uint16_t from, uint16_t to, const auto& value) {
        if (!area[from] || (to != 0 && !free[from]))
            return false;
        if (!mask.values)
            return true;
        if (!has_values)
            return false;
        const double v = value();
        return v >= mask.values->first && v <= mask.values->second;
    };
    std::vector<uint16_t> was(kBrickSamples), is(kBrickSamples);
    // A map of u8 that took back a label above 255 would not hold it.
    const bool grows = after.type() == ScalarType::u8 && before.range().max > 255.0f;
    VolumeEdit edit(grows ? as_u16_labels(after) : after);
    for (const ChangedBrick& changed : changed_bricks(before, after)) {
        before.brick(changed.position).read(std::span(was));
        after.brick(changed.position).read(std::span(is));
        const Brick* const grey =
            mask.values && has_values ? &values->brick(changed.position) : nullptr;
        const std::optional<Brick::Pinned> pinned =
            grey ? std::optional(grey->pin()) : std::nullopt;
        const glm::uvec3 valid = after.valid_in_brick(changed.position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const uint32_t at = offset_in_brick({x, y, z});
                    if (was[at] == is[at])
                        continue;
                    const bool had = meet(was[at]), gets = meet(is[at]);
                    const bool closed =
                        !is_open(was[at], is[at], [&] { return double{grey->value(*pinned, at)}; });
                    made.met_mask = made.met_mask || closed;
                    if (had || gets || closed)
                        edit.set(changed.position * kBrickSide + glm::uvec3(x, y, z), was[at]);
                }
    }
    if (made.met != 0 || made.met_mask)
        made.labels = edit.commit();
    if (changed_bricks(before, made.labels).empty())
        made.labels = before;
    return made;
}

} // namespace palpate
