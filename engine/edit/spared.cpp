#include "engine/edit/spared.h"

#include <algorithm>
#include <vector>

#include "engine/base/assert.h"
#include "engine/edit/label_box.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"

namespace palpate {

Spared sparing(const Volume& before, const Volume& after, std::span<const uint16_t> spared) {
    PALPATE_ASSERT(before.grid() == after.grid());
    Spared made{after, 0};
    if (spared.empty() || after.is_same_as(before))
        return made;
    std::vector<bool> stays(65536);
    for (const uint16_t label : spared)
        stays[label] = label != 0;
    const auto meet = [&](uint16_t label) {
        if (stays[label] && (made.met == 0 || label < made.met))
            made.met = label;
        return stays[label];
    };
    std::vector<uint16_t> was(kBrickSamples), is(kBrickSamples);
    // A map of u8 that took back a label above 255 would not hold it.
    const bool grows = after.type() == ScalarType::u8 && before.range().max > 255.0f;
    VolumeEdit edit(grows ? as_u16_labels(after) : after);
    for (const ChangedBrick& changed : changed_bricks(before, after)) {
        before.brick(changed.position).read(std::span(was));
        after.brick(changed.position).read(std::span(is));
        const glm::uvec3 valid = after.valid_in_brick(changed.position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const uint32_t at = offset_in_brick({x, y, z});
                    if (was[at] == is[at])
                        continue;
                    const bool had = meet(was[at]), gets = meet(is[at]);
                    if (had || gets)
                        edit.set(changed.position * kBrickSide + glm::uvec3(x, y, z), was[at]);
                }
    }
    if (made.met != 0)
        made.labels = edit.commit();
    return made;
}

} // namespace palpate
