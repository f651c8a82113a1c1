#include "engine/session/milling_follower.h"

#include <exception>
#include <utility>

namespace palpate {

using haptics::Milling;

int64_t MillingFollower::due_ns() {
    const bool is_over = rate_mm3_per_s_.load(std::memory_order_relaxed) == 0.0;
    return is_over && states_.pin()->snapshot == snapshot_ ? kNever_ns
                                                           : measured_ns_ + kMeasure_ms * 1'000'000;
}

void MillingFollower::measure(int64_t now_ns, double speed_mm_per_s) {
    if (now_ns - measured_ns_ < kMeasure_ms * 1'000'000)
        return;
    measured_ns_ = now_ns;
    const EditState state = *states_.pin();
    snapshot_ = state.snapshot;
    const NamedVolume& edited = state.document.volumes[state.edited];
    const bool is_labels = edited.kind == VolumeKind::labels;
    // Undo and filters change samples, too; up to the one command since the last look it was the
    // hand.
    const uint64_t commands = state.commands_done - std::exchange(commands_, state.commands_done);
    const auto look = [&](const Volume& volume, bool by_hand) {
        return meter_.look(1e-9 * static_cast<double>(now_ns), volume,
                           is_labels ? 0.5 : parameters_.pin()->iso, is_labels, by_hand,
                           speed_mm_per_s);
    };
    Milling now;
    try {
        if (commands == 1 && state.before_command)
            look(*state.before_command, true);
        now = look(edited.volume, commands == 0);
    } catch (const std::exception&) { // samples that cannot be read: the editor says so
        return;
    }
    removed_mm3_.store(now.removed_mm3, std::memory_order_relaxed);
    rate_mm3_per_s_.store(now.rate_mm3_per_s, std::memory_order_relaxed);
    hardness_.store(now.hardness, std::memory_order_relaxed);
    removal_.store(static_cast<float>(milling_level(now)), std::memory_order_relaxed);
}

void MillingFollower::rest() noexcept {
    rate_mm3_per_s_.store(0.0, std::memory_order_relaxed);
    removal_.store(0.0f, std::memory_order_relaxed);
}

Milling MillingFollower::milling(double speed_mm_per_s) const noexcept {
    return {removed_mm3_.load(std::memory_order_relaxed),
            rate_mm3_per_s_.load(std::memory_order_relaxed),
            hardness_.load(std::memory_order_relaxed), speed_mm_per_s};
}

} // namespace palpate
