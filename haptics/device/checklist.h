#pragma once

#include <array>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "haptics/core/clock.h"
#include "haptics/core/device.h"

// Measures what an owner's device does: the tests that need hardware.
namespace palpate::haptics {

struct ChecklistOptions {
    bool is_armed = false;   // a person allowed force
    size_t exchanges = 2000; // without force, for the times
    double homing_s = 60.0;  // the longest that homing may take
    double rest_s = 1.0;     // in which the handle is left alone
    double move_s = 15.0;    // in which a person moves it to all its ends; 0: not asked for
};

struct Checklist {
    // From a write to the sample that answers it, of devices that set the pace; else from one
    // sample to the next.
    struct Times {
        size_t count = 0, stale = 0; // samples that came, and ticks without one
        double p50_ms = 0, p95_ms = 0, p99_ms = 0, max_ms = 0;
        std::vector<uint32_t> bins; // of kBin_ms; the last holds all that took longer
    };
    static constexpr double kBin_ms = 0.1;
    static constexpr size_t kBins = 50;

    // Positions while nobody touched it, and of all ends; mm in the device's axes.
    struct Places {
        glm::dvec3 low_mm{0.0}, high_mm{0.0};
        glm::dvec3 step_mm{0.0}; // the smallest change that was seen on each axis; 0: none
    };

    // A force of kForce_n for kPush_s.
    struct Push {
        glm::dvec3 direction{0.0};
        std::vector<double> moved_mm; // along it, one a tick
        double across_mm = 0.0;       // the farthest to a side
        double delay_ms = -1.0;       // until it moved along; below 0: it did not
        bool was_stopped = false;     // it went too far or too fast
    };
    static constexpr double kForce_n = 1.0, kPush_s = 0.06;
    static constexpr double kFarthest_mm = 15.0, kFastest_m_per_s = 0.5;

    Times times;
    bool was_homed = false; // already
    double homed_s = -1.0;  // how long it took; below 0: not done
    Places rest, ends;
    std::vector<std::pair<int, std::string>> lights; // a bit, and what the person saw
    std::vector<Push> pushes;                        // none: no force was allowed, or it has none
};

// A person beside the device.
struct Owner {
    std::function<void(const std::string& what)> tell;
    // The answer; empty where nobody answers.
    std::function<std::string(const std::string& question)> ask;
};

// No force but in the pushes, which only an armed checklist makes, and none afterwards. An error:
// the device is gone, or was not homed, or `stop` was asked; force has then ended too.
Result<Checklist> run_checklist(HapticDevice& device, Clock& clock, const ChecklistOptions& options,
                                const Owner& owner, const std::stop_token& stop = {});

} // namespace palpate::haptics
