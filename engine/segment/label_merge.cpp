#include "engine/segment/label_merge.h"

#include <atomic>
#include <vector>

#include "engine/segment/label_samples.h"
#include "engine/volume/brick.h"

namespace palpate {

namespace {

bool is_label_type(ScalarType type) {
    return type == ScalarType::u8 || type == ScalarType::u16;
}

std::vector<bool> table_of(std::span<const uint16_t> labels) {
    std::vector<bool> table(65536);
    for (const uint16_t label : labels)
        table[label] = true;
    return table;
}

} // namespace

Result<Volume> with_labels(const Volume& map, const Volume& found, std::span<const uint16_t> of,
                           const Task& task) {
    if (map.grid() != found.grid())
        return fail(
            "expected a label map on the grid of the volume that is segmented, found another "
            "grid");
    for (const Volume* volume : {&map, &found})
        if (!is_label_type(volume->type()))
            return fail("expected labels of type u8 or u16, found {}", name_of(volume->type()));
    const std::vector<bool> goes = table_of(of);
    const ScalarType type = found.range().max > 255.0f ? ScalarType::u16 : map.type();
    std::atomic<bool> any = type != map.type();
    Result<Volume> made = make_bricks(map.grid(), type, task, [&](glm::uvec3 at) {
        std::vector<uint16_t> before(kBrickSamples), after(kBrickSamples);
        map.brick(at).read(std::span(before));
        found.brick(at).read(std::span(after));
        bool changed = type != map.type();
        for (uint32_t i = 0; i < kBrickSamples; ++i) {
            const uint16_t had = before[i], gets = after[i];
            const uint16_t label = gets != 0 ? gets : goes[had] ? 0 : had;
            changed |= label != had;
            after[i] = label;
        }
        if (!changed)
            return map.brick_ptr(at);
        any = true;
        const glm::uvec3 valid = map.valid_in_brick(at);
        if (type == ScalarType::u16)
            return Brick::make(std::span<const uint16_t>(after), valid);
        const std::vector<uint8_t> bytes(after.begin(), after.end());
        return Brick::make(std::span<const uint8_t>(bytes), valid);
    });
    return made && !any ? Result<Volume>(map) : made;
}

Result<Volume> with_locked(const Volume& before, const Volume& after,
                           std::span<const uint16_t> locked, const Task& task) {
    std::vector<bool> stays = table_of(locked);
    stays[0] = false;
    return make_bricks(after.grid(), after.type(), task, [&](glm::uvec3 at) -> BrickPtr {
        const glm::ivec3 first(at * kBrickSide);
        std::vector<uint16_t> had(kBrickSamples), gets(kBrickSamples);
        read_labels(before, first, glm::ivec3(kBrickSide), had.data());
        read_labels(after, first, glm::ivec3(kBrickSide), gets.data());
        bool any = false;
        for (uint32_t i = 0; i < kBrickSamples; ++i)
            if (had[i] != gets[i] && (stays[had[i]] || stays[gets[i]])) {
                gets[i] = had[i];
                any = true;
            }
        if (!any)
            return after.brick_ptr(at);
        return visit_scalar(after.type(), [&]<class T>(T) -> BrickPtr {
            const std::vector<T> typed(gets.begin(), gets.end());
            return Brick::make(std::span<const T>(typed), after.valid_in_brick(at));
        });
    });
}

} // namespace palpate
