#include "engine/volume/box.h"

#include "engine/volume/builder.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

bool fits(glm::uvec3 size, BoxStrides strides, size_t count) {
    size_t rows = 0, planes = 0, end = 0;
    return !__builtin_mul_overflow(strides.row, size_t{size.y} - 1, &rows) &&
           !__builtin_mul_overflow(strides.plane, size_t{size.z} - 1, &planes) &&
           !__builtin_add_overflow(rows, planes, &end) &&
           !__builtin_add_overflow(end, size_t{size.x}, &end) && end <= count;
}

template <class T>
Result<void> check(const Grid& grid, ScalarType type, glm::uvec3 first, glm::uvec3 size,
                   BoxStrides strides, size_t count) {
    if (type != scalar_type_of<T>)
        return fail("expected samples of the volume's type {}, found {}", name_of(type),
                    name_of(scalar_type_of<T>));
    for (int a = 0; a < 3; ++a)
        if (size[a] == 0 || first[a] >= grid.size[a] || size[a] > grid.size[a] - first[a])
            return fail("expected a box within 0 .. {} on axis {}, found {} samples from {}",
                        grid.size[a] - 1, a, size[a], first[a]);
    if (!fits(size, strides, count))
        return fail(
            "expected an array that holds {} x {} x {} samples with {} from row to row and {} from "
            "plane to plane, found {} elements",
            size.x, size.y, size.z, strides.row, strides.plane, count);
    return {};
}

template <class T>
void write_box(VolumeEdit& edit, glm::uvec3 first, glm::uvec3 size, BoxStrides strides,
               const T* samples) {
    const glm::uvec3 end = first + size, last_brick = (end - 1u) / kBrickSide;
    for (uint32_t bz = first.z / kBrickSide; bz <= last_brick.z; ++bz)
        for (uint32_t by = first.y / kBrickSide; by <= last_brick.y; ++by)
            for (uint32_t bx = first.x / kBrickSide; bx <= last_brick.x; ++bx) {
                const glm::uvec3 origin = glm::uvec3(bx, by, bz) * kBrickSide;
                const glm::uvec3 from = glm::max(first, origin);
                const glm::uvec3 to = glm::min(end, origin + kBrickSide);
                const std::span<T> brick = edit.write_brick<T>({bx, by, bz});
                for (uint32_t z = from.z; z < to.z; ++z)
                    for (uint32_t y = from.y; y < to.y; ++y)
                        std::copy_n(samples + (from.x - first.x) + strides.row * (y - first.y) +
                                        strides.plane * (z - first.z),
                                    to.x - from.x,
                                    &brick[offset_in_brick(glm::uvec3(from.x, y, z) - origin)]);
            }
}

} // namespace

template <class T>
Result<void> copy_out(const Volume& volume, glm::uvec3 first, glm::uvec3 size, BoxStrides strides,
                      std::span<T> samples) {
    Result<void> checked =
        check<T>(volume.grid(), volume.type(), first, size, strides, samples.size());
    if (checked)
        read_box(volume, glm::ivec3(first), glm::ivec3(size), strides, samples.data());
    return checked;
}

template <class T>
Result<void> copy_in(VolumeEdit& edit, glm::uvec3 first, glm::uvec3 size, BoxStrides strides,
                     std::span<const T> samples) {
    const Volume& volume = edit.base();
    Result<void> checked =
        check<T>(volume.grid(), volume.type(), first, size, strides, samples.size());
    if (checked)
        write_box(edit, first, size, strides, samples.data());
    return checked;
}

template <class T>
Result<Volume> volume_of_array(const Grid& grid, BoxStrides strides, std::span<const T> samples) {
    PALPATE_TRY(check_grid(grid));
    PALPATE_TRY(
        check<T>(grid, scalar_type_of<T>, glm::uvec3(0), grid.size, strides, samples.size()));
    VolumeEdit edit(VolumeBuilder(grid, scalar_type_of<T>).finish());
    write_box(edit, glm::uvec3(0), grid.size, strides, samples.data());
    return edit.commit();
}

#define PALPATE_BOX(T)                                                                \
    template Result<void> copy_out(const Volume&, glm::uvec3, glm::uvec3, BoxStrides, \
                                   std::span<T>);                                     \
    template Result<void> copy_in(VolumeEdit&, glm::uvec3, glm::uvec3, BoxStrides,    \
                                  std::span<const T>);                                \
    template Result<Volume> volume_of_array(const Grid&, BoxStrides, std::span<const T>);
PALPATE_BOX(uint8_t)
PALPATE_BOX(int8_t)
PALPATE_BOX(uint16_t)
PALPATE_BOX(int16_t)
PALPATE_BOX(float)
#undef PALPATE_BOX

} // namespace palpate
