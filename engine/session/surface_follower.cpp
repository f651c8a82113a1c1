#include "engine/session/surface_follower.h"

#include <chrono>
#include <cmath>
#include <exception>
#include <string>

#include "engine/base/profile.h"

namespace palpate {

SurfaceFollower::SurfaceFollower(const Parts& parts, std::optional<float> iso, bool threaded)
    : parts_(parts),
      states_(parts.editor.add_reader()),
      sources_(parts.sources.add_reader()),
      iso_(iso.value_or(NAN)),
      edits_(parts.editor.followers().add(wake_)),
      choices_(parts.choices.add(wake_)) {
    if (threaded && iso)
        thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

SurfaceFollower::~SurfaceFollower() {
    if (thread_.joinable()) {
        thread_.request_stop();
        thread_.join();
    }
}

void SurfaceFollower::set_iso(float iso) {
    if (std::isnan(iso_.load()))
        return;
    iso_.store(iso);
    wake_.wake();
}

// A surface of which some blocks were made again, and others were not, is of no snapshot.
void SurfaceFollower::follow(const Volume& volume) {
    try {
        surface_->update(volume);
    } catch (const std::exception&) {
        surface_.reset();
        throw;
    }
}

bool SurfaceFollower::update() {
    const float iso = iso_;
    if (std::isnan(iso))
        return false;
    uint64_t sources = 0; // the epoch, of this name or an earlier one
    const std::string grey = [&] {
        const auto pin = sources_.pin();
        sources = pin.epoch();
        return pin->grey;
    }();
    const EditState state = *states_.pin();
    if (sources_epoch_ == sources && snapshot_ == state.snapshot && meshed_iso_ == iso)
        return false;
    const std::optional<Volume> volume = volume_of(state.document, grey);
    {
        const std::scoped_lock held(mutex_);
        const bool goes_on = volume && surface_ && surface_->iso() == iso &&
                             surface_->volume().grid() == volume->grid() &&
                             surface_->volume().type() == volume->type();
        if (!volume)
            surface_.reset();
        else if (!goes_on)
            surface_.emplace(*volume, iso);
        else if (!surface_->volume().is_same_as(*volume))
            follow(*volume);
    }
    parts_.lag.reached(EditLag::Reader::mesh, state, profile::now_ns());
    meshed_iso_ = iso;
    sources_epoch_ = sources;
    snapshot_ = state.snapshot;
    parts_.done.wake();
    return true;
}

Mesh SurfaceFollower::mesh() {
    if (!thread_.joinable())
        while (update()) {
        }
    const std::scoped_lock held(mutex_);
    return surface_ ? surface_->mesh() : Mesh();
}

void SurfaceFollower::run(const std::stop_token& stop) {
    profile::name_thread("mesher");
    constexpr std::chrono::milliseconds kAgain(10);
    while (!stop.stop_requested())
        try {
            if (!update())
                wake_.wait(stop);
        } catch (const std::exception&) { // memory that ran out: a whole surface once more
            wake_.wait(stop, Wake::Clock::now() + kAgain);
        }
}

} // namespace palpate
