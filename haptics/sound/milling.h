#pragma once

#include <cstdint>
#include <optional>

#include "engine/volume/volume.h"

namespace palpate::haptics {

// Material that an edit took away.
struct Removed {
    double mm3 = 0.0;        // samples that were solid and are not any more, times their volume
    double mean_value = 0.0; // of these samples in `material`; 0 where there are none
};

// Samples at or above `iso` are solid. All snapshots are of one volume (changed_bricks()); the cost
// follows the bricks in which before and after differ. `material` is an earlier one: a wall that
// passes through a sample has lowered its value before it goes.
Removed removed_between(const Volume& before, const Volume& after, double iso,
                        const Volume& material);

// A tool's removal of material at a moment. Sound, vibration and dust are functions of it
// (Eriksson, Dixon & Wikander, MMVR 2006: milling is heard and felt).
struct Milling {
    double removed_mm3 = 0.0;    // in all, since the beginning; never falls
    double rate_mm3_per_s = 0.0; // exactly 0 from MillingMeter::kWindow_s after the last removal on
    double hardness = 0.0;       // 0 .. 1: of what is being removed; see MillingMeter
    double speed_mm_per_s = 0.0; // of the tool
};

// How strong sound and vibration are: 0 exactly where nothing is removed, then rising with the
// rate and with hardness to below 1. At kHalf_mm3_per_s it is half of its limit. The numbers are
// our choice: the paper states none.
double milling_level(const Milling& milling) noexcept;
constexpr double kHalf_mm3_per_s = 100.0; // a burr of 3 mm radius that moves by 3.5 mm/s

// Measures removal by comparing snapshots. For a thread that waits for nobody and for whom nobody
// waits; it allocates.
class MillingMeter {
 public:
    static constexpr double kWindow_s = 0.05; // over which the rate is measured

    // `now` is the volume at time_s, which never falls. Where `by_hand` is false (undo, a filter,
    // another volume) the change counts as no removal. Hardness is where the mean of the removed
    // values lies between iso, 0, and the highest value that the volume had at first, 1; of labels
    // it is 1.
    Milling look(double time_s, const Volume& now, double iso, bool is_labels, bool by_hand,
                 double speed_mm_per_s);

 private:
    static constexpr uint32_t kLooks = 8;
    struct Look {
        double time_s = 0.0, mm3 = 0.0;
    };
    std::optional<Volume> last_, material_; // material_: before what is being removed
    double top_ = 0.0;
    Milling milling_;
    Look looks_[kLooks]; // a ring
    uint32_t next_ = 0;
};

// Grains of dust for a removed volume. A grain stands for kGrain_mm3; remainders are kept.
class Dust {
 public:
    static constexpr double kGrain_mm3 = 0.05;
    // How many grains came since the last call. removed_mm3: Milling's; one that fell begins anew.
    uint64_t take(double removed_mm3) noexcept;

 private:
    uint64_t given_ = 0;
};

} // namespace palpate::haptics
