#include "engine/render/texel_storage.h"

#include <type_traits>

namespace palpate {

namespace {

// The first code of a type, which unorm16 stores as 0.
int32_t code_bias(ScalarType type) {
    return type == ScalarType::i16 ? -32768 : type == ScalarType::i8 ? -128 : 0;
}

template <class Texel, class Sample>
void store(const Brick& brick, int32_t bias, glm::uvec3 low, glm::uvec3 high, size_t row_texels,
           size_t plane_rows, std::byte* out) {
    const auto held = brick.samples<Sample>();
    const Sample* in = held.data();
    for (uint32_t z = low.z; z < high.z; ++z)
        for (uint32_t y = low.y; y < high.y; ++y) {
            auto* row = reinterpret_cast<Texel*>(out) +
                        row_texels * ((y - low.y) + plane_rows * (z - low.z));
            const uint32_t from = offset_in_brick({low.x, y, z});
            for (uint32_t x = 0; x < high.x - low.x; ++x) {
                const Sample sample = in[brick.stride() * (from + x)];
                if constexpr (std::is_floating_point_v<Texel> || std::is_floating_point_v<Sample>)
                    row[x] = static_cast<Texel>(sample);
                else
                    row[x] = static_cast<Texel>(static_cast<int32_t>(sample) - bias);
            }
        }
}

} // namespace

TexelStorage texel_storage(const GpuDevice& device, ScalarType type, TexelFormat wanted) {
    if (wanted == TexelFormat::label)
        return {type == ScalarType::u8 ? VK_FORMAT_R8_UINT : VK_FORMAT_R16_UINT};
    if (wanted == TexelFormat::automatic)
        wanted = device.info().is_cpu() ? TexelFormat::f32 : TexelFormat::unorm16;
    if (type == ScalarType::f32 || wanted == TexelFormat::f32)
        return {VK_FORMAT_R32_SFLOAT};
    return {VK_FORMAT_R16_UNORM, 65535.0f, static_cast<float>(code_bias(type))};
}

size_t texel_bytes(VkFormat format) {
    switch (format) {
        case VK_FORMAT_R8_UINT:
            return 1;
        case VK_FORMAT_R16_UINT:
        case VK_FORMAT_R16_UNORM:
            return 2;
        default:
            return 4;
    }
}

void store_texels(const Brick& brick, VkFormat format, glm::uvec3 low, glm::uvec3 high,
                  size_t row_texels, size_t plane_rows, std::byte* out) {
    visit_scalar(brick.type(), [&](auto t) {
        using Sample = decltype(t);
        switch (format) {
            case VK_FORMAT_R8_UINT:
                return store<uint8_t, Sample>(brick, 0, low, high, row_texels, plane_rows, out);
            case VK_FORMAT_R16_UINT:
                return store<uint16_t, Sample>(brick, 0, low, high, row_texels, plane_rows, out);
            case VK_FORMAT_R16_UNORM:
                return store<uint16_t, Sample>(brick, code_bias(brick.type()), low, high,
                                               row_texels, plane_rows, out);
            default:
                return store<float, Sample>(brick, 0, low, high, row_texels, plane_rows, out);
        }
    });
}

} // namespace palpate
