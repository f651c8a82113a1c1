#pragma once

#include <future>
#include <memory>
#include <string>

#include "haptics/sound/player.h"

namespace palpate::view {

// The sound of milling in the window: the output is opened, beside everything else, when a hand
// first wants it, and again after it was unwanted.
class MillingSoundOutput {
 public:
    // Each frame; does not wait for an output to open. Not wanted: the output is closed.
    void frame(const haptics::Milling& milling, bool wanted);
    // Returns when an output that is being opened is open or has failed, which the next frame sees.
    void wait_for_opening() const;
    bool is_open() const { return player_ != nullptr; }
    // Why nothing is heard although it is wanted; empty: it is, or is being opened.
    const std::string& why_silent() const { return why_silent_; }

 private:
    using Opened = Result<std::unique_ptr<haptics::SoundPlayer>>;
    std::unique_ptr<haptics::SoundPlayer> player_;
    std::future<Opened> opening_;
    std::string why_silent_;
};

} // namespace palpate::view
