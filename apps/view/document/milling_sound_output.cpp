#include "apps/view/document/milling_sound_output.h"

#include <chrono>

namespace palpate::view {

void MillingSoundOutput::frame(const haptics::Milling& milling, bool wanted) {
    if (opening_.valid() &&
        opening_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
        Opened opened = opening_.get();
        if (opened)
            player_ = std::move(*opened);
        else
            why_silent_ = opened.error().message;
    }
    if (!wanted) {
        player_.reset();
        why_silent_.clear();
        return;
    }
    if (player_)
        player_->set(milling);
    else if (!opening_.valid() && why_silent_.empty())
        opening_ = std::async(std::launch::async, haptics::SoundPlayer::open);
}

void MillingSoundOutput::wait_for_opening() const {
    if (opening_.valid())
        opening_.wait();
}

} // namespace palpate::view
