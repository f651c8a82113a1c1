#include "haptics/device/spacemouse/codec.h"

#include <algorithm>

namespace palpate::haptics::spacemouse {

namespace {

uint8_t byte_at(std::span<const std::byte> bytes, size_t at) {
    return std::to_integer<uint8_t>(bytes[at]);
}

void read_axes(std::span<const std::byte> numbers, int range, std::span<int16_t> axes) {
    for (size_t axis = 0; axis < axes.size(); ++axis) {
        const auto raw =
            static_cast<int16_t>(byte_at(numbers, 2 * axis) | byte_at(numbers, 2 * axis + 1) << 8);
        axes[axis] = static_cast<int16_t>(std::clamp<int>(raw, -range, range));
    }
}

} // namespace

Told decode(std::span<const std::byte> report, int range, State& state) noexcept {
    if (report.empty())
        return Told::nothing;
    const std::span<const std::byte> content = report.subspan(1);
    const std::span<int16_t> axes(state.axes);
    switch (byte_at(report, 0)) {
        case 1:
            if (content.size() < 6)
                return Told::nothing;
            read_axes(content, range, content.size() >= 12 ? axes : axes.first(3));
            return Told::axes;
        case 2:
            if (content.size() < 6)
                return Told::nothing;
            read_axes(content, range, axes.last(3));
            return Told::axes;
        case 3: {
            if (content.empty())
                return Told::nothing;
            uint32_t buttons = 0;
            for (size_t at = 0; at < std::min<size_t>(content.size(), 4); ++at)
                buttons |= static_cast<uint32_t>(byte_at(content, at)) << (8 * at);
            state.buttons = buttons;
            return Told::buttons;
        }
        case 0x17:
            if (content.size() < 2 || byte_at(content, 0) > 100)
                return Told::nothing;
            state.battery_percent = byte_at(content, 0);
            state.is_charging = (byte_at(content, 1) & 1) != 0;
            return Told::battery;
        default:
            return Told::nothing;
    }
}

Description describe(std::span<const std::byte> descriptor) noexcept {
    Description found;
    uint32_t page = 0, usage = 0;
    int32_t logical_max = 0;
    int range = 0;
    bool has_usage = false, has_axis = false, is_first = true;
    for (size_t at = 0; at < descriptor.size();) {
        const unsigned prefix = byte_at(descriptor, at);
        const size_t size = (prefix & 3u) == 3 ? 4 : prefix & 3u;
        if (prefix == 0xFE) { // a long item
            at += 3 + (at + 1 < descriptor.size() ? byte_at(descriptor, at + 1) : 0);
            continue;
        }
        if (at + 1 + size > descriptor.size())
            break;
        uint32_t value = 0;
        for (size_t i = 0; i < size; ++i)
            value |= static_cast<uint32_t>(byte_at(descriptor, at + 1 + i)) << (8 * i);
        switch (prefix & 0xFCu) {
            case 0x04: // usage page
                page = value;
                break;
            case 0x24: // logical maximum, signed
                logical_max = size == 1   ? static_cast<int8_t>(value)
                              : size == 2 ? static_cast<int16_t>(value)
                                          : static_cast<int32_t>(value);
                break;
            case 0x08: // usage
                usage = has_usage ? usage : value;
                has_usage = true;
                has_axis = has_axis || (page == 1 && value >= 0x30 && value <= 0x35);
                break;
            case 0xA0: // collection: the first says what the device is
                found.is_six_axis = found.is_six_axis || (is_first && page == 1 && usage == 8);
                is_first = false;
                has_usage = has_axis = false;
                break;
            case 0x80: // input
                if (has_axis)
                    range = std::max(range, std::clamp<int>(logical_max, 0, 32767));
                has_usage = has_axis = false;
                break;
            case 0x90: // output
            case 0xB0: // feature
                has_usage = has_axis = false;
                break;
            default:
                break;
        }
        at += 1 + size;
    }
    if (range > 0)
        found.range = range;
    return found;
}

} // namespace palpate::haptics::spacemouse
