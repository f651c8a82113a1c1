#include "haptics/sound/wav.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "engine/base/file.h"
#include "haptics/sound/milling_sound.h"

namespace palpate::haptics {

Result<void> save_wav(const std::filesystem::path& path, std::span<const float> samples) {
    constexpr uint64_t kHeader = 44, kMost = 0xffffffffu - kHeader;
    const uint64_t data_bytes = 2 * uint64_t{samples.size()};
    if (data_bytes > kMost)
        return fail("{}: expected at most {} bytes of sound, as WAV holds, found {}", path.string(),
                    kMost, data_bytes);
    std::vector<std::byte> bytes;
    bytes.reserve(kHeader + data_bytes);
    const auto text = [&](std::string_view letters) {
        for (const char letter : letters)
            bytes.push_back(std::byte(letter));
    };
    const auto number = [&](uint64_t value, int size) { // little-endian
        for (int i = 0; i < size; ++i)
            bytes.push_back(std::byte(value >> 8 * i & 0xff));
    };
    constexpr auto kRate = static_cast<uint32_t>(kSoundRate_hz);
    text("RIFF");
    number(kHeader - 8 + data_bytes, 4);
    text("WAVEfmt ");
    number(16, 4);        // bytes of the format
    number(1, 2);         // PCM
    number(1, 2);         // channels
    number(kRate, 4);     // frames a second
    number(2 * kRate, 4); // bytes a second
    number(2, 2);         // bytes a frame
    number(16, 2);        // bits a sample
    text("data");
    number(data_bytes, 4);
    for (const float sample : samples) {
        const float whole = std::round(32767.0f * std::clamp(sample, -1.0f, 1.0f));
        number(static_cast<uint16_t>(static_cast<int16_t>(whole)), 2);
    }
    return save_bytes(path, bytes);
}

} // namespace palpate::haptics
