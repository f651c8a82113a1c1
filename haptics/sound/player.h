#pragma once

#include <memory>

#include "engine/base/error.h"
#include "haptics/sound/milling.h"

namespace palpate::haptics {

// Plays MillingSound on the default sound output, through OpenAL Soft, from a thread of its own.
//
//     auto player = SoundPlayer::open();       // once
//     (*player)->set(session.milling());       // each frame; never waits
//
// The buffers hold 46 ms of sound; what OpenAL and the output add comes on top. Where set() is not
// called for kForget_s it falls silent.
class SoundPlayer {
 public:
    static constexpr int kBuffers = 4;
    static constexpr double kForget_s = 0.25;

    // An error: this build has no OpenAL, or the machine no sound output.
    static Result<std::unique_ptr<SoundPlayer>> open();
    virtual ~SoundPlayer() = default; // ends the thread
    // From any one thread.
    virtual void set(const Milling& milling) noexcept = 0;
    virtual uint64_t buffers_played() const noexcept = 0;
    // Returns when at least that many buffers have been played; never where the output stands
    // still.
    virtual void wait_until_played(uint64_t buffers) const noexcept = 0;
};

} // namespace palpate::haptics
