#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "engine/base/json.h"

namespace palpate {

struct EditState;

// Latency of the readers of an edit behind the hand.
//
// Each reader says which snapshot it has got to, and when; latencies count from the moment the
// newest input within that snapshot was pushed, once a snapshot and reader: a picture drawn again
// is no news. While a profile is recorded, each report is also a span of no length on the reporting
// thread that carries the figures.
class EditLag {
 public:
    enum class Reader { texture, mesh, picture };

    // The servo's thread; wait-free: ticks from now on feel the snapshot of this number.
    void feels(uint64_t snapshot) noexcept { felt_.store(snapshot, std::memory_order_release); }

    // Any thread. at_ns is of profile::now_ns(). A picture also counts by how many snapshots the
    // hand is ahead of it at this moment: what is felt and what is seen differ by so many.
    void reached(Reader reader, const EditState& state, int64_t at_ns);

    // Covers the newest 10,000 reports or more. Percentiles: at least so many values are not above.
    struct Figures {
        size_t count = 0;
        double median = 0, p99 = 0, most = 0;
    };
    Figures latency_ms(Reader reader) const;
    Figures hand_eye_snapshots() const;

    // {"edit_to_texture_ms": {...}, .., "hand_eye_lag_snapshots": {...}}, for --stats; what nothing
    // was reported of is left out.
    Json json() const;

 private:
    std::atomic<uint64_t> felt_{0};
    mutable std::mutex lock_;
    std::array<uint64_t, 3> last_{};         // by reader
    std::array<int64_t, 3> last_input_ns_{}; // likewise
    std::array<std::vector<double>, 3> latencies_ms_;
    std::vector<double> ahead_;
};

} // namespace palpate
