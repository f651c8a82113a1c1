#pragma once

#include <filesystem>
#include <span>

#include "engine/base/error.h"

namespace palpate::haptics {

// Writes samples of -1 .. 1 as one channel of 16-bit PCM at kSoundRate_hz. At most 4 GiB - 36 B.
Result<void> save_wav(const std::filesystem::path& path, std::span<const float> samples);

} // namespace palpate::haptics
