#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "engine/volume/volume.h"

namespace palpate {

// How many samples of a volume have which value, for a volume that is edited: the cost of a change
// follows the bricks that it replaced. For one thread.
class Histogram {
 public:
    // `bins` >= 1 of equal width from low to high, low < high. Values beyond count in the first and
    // the last one; a value between two bins counts in the upper one.
    Histogram(double low, double high, size_t bins);
    // One bin for each label: bin i counts the samples of value i, 0 .. 65535.
    static Histogram of_labels() { return {-0.5, 65535.5, 65536}; }

    // Counts a volume. Of another snapshot of the one counted last, bricks that both share are not
    // read. False where `stop` was asked: then nothing is known, and the next call begins anew.
    bool count(const Volume& volume, const std::stop_token& stop = {});

    double low() const { return low_; }
    double high() const { return high_; }
    const std::vector<uint64_t>& counts() const { return counts_; } // by bin
    size_t bin_of(double value) const;
    uint64_t bricks_read() const { return bricks_read_; } // so far

 private:
    void add(const Volume& volume, glm::uvec3 position, bool takes_away);

    double low_, high_;
    std::vector<uint64_t> counts_;
    std::optional<Volume> counted_;
    uint64_t bricks_read_ = 0;
};

} // namespace palpate
