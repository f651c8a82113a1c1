#include "engine/segment/brick_maker.h"

#include <cmath>

#include "engine/volume/box.h"

namespace palpate {

namespace {

// Calls visit(brick) for each brick that holds samples of the box; ends where it returns false.
template <class Visit>
void for_each_near(const Volume& volume, glm::uvec3 brick, glm::ivec3 halo, const Visit& visit) {
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1, side(kBrickSide);
    const glm::ivec3 first = glm::ivec3(brick) * side - halo;
    const glm::ivec3 low = glm::clamp(first, glm::ivec3(0), last) / side;
    const glm::ivec3 high = glm::clamp(first + side + 2 * halo - 1, glm::ivec3(0), last) / side;
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x)
                if (!visit(volume.brick(glm::uvec3(x, y, z))))
                    return;
}

bool same_value(float a, float b) {
    return a == b || (std::isnan(a) && std::isnan(b));
}

} // namespace

Result<Volume> make_bricks(const BrickMaker& maker, const Task& task) {
    return make_bricks(maker.grid, maker.type, task, maker.brick);
}

std::optional<float> constant_around(const Volume& volume, glm::uvec3 brick, glm::ivec3 halo) {
    if (!volume.brick(brick).is_constant())
        return std::nullopt;
    const float value = volume.brick(brick).value(0);
    bool all = true;
    for_each_near(volume, brick, halo, [&](const Brick& near) {
        return all = near.is_constant() && same_value(near.value(0), value);
    });
    return all ? std::optional(value) : std::nullopt;
}

void read_neighbourhood(const Volume& volume, glm::uvec3 brick, glm::ivec3 halo,
                        Neighbourhood& out) {
    const glm::ivec3 side(kBrickSide);
    out.size = side + 2 * halo;
    out.size.z = int(volume.valid_in_brick(brick).z) + 2 * halo.z;
    out.constant = constant_around(volume, brick, halo);
    out.lacks_data = false;
    if (out.constant) {
        out.samples.clear();
        return;
    }
    if (volume.no_data_count() > 0)
        for_each_near(volume, brick, halo, [&](const Brick& near) {
            out.lacks_data |= near.no_data_count() > 0;
            return !out.lacks_data;
        });
    out.samples.resize(size_t(out.size.x) * size_t(out.size.y) * size_t(out.size.z));
    read_box(volume, glm::ivec3(brick) * side - halo, out.size, packed(glm::uvec3(out.size)),
             out.samples.data());
}

Result<void> check_magnitude(const Volume& volume) {
    const ValueRange range = volume.range();
    if (!range.empty() && (range.min < -kLargestFiltered || range.max > kLargestFiltered))
        return fail(
            "expected values from {:g} to {:g}, found {:g} to {:g}: this filter works in single "
            "precision; divide the values first, or take out those that stand for no data",
            -kLargestFiltered, kLargestFiltered, range.min, range.max);
    return {};
}

BrickPtr constant_brick(ScalarType type, float value) {
    return visit_scalar(type, [&](auto t) {
        t = static_cast<decltype(t)>(value);
        return Brick::make(std::span<const decltype(t)>(&t, 1));
    });
}

} // namespace palpate
