#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>

#include "engine/volume/volume.h"

namespace palpate {

// Material that edits took away, by the label that lies there; 0: none does. In samples.
using RemovedSamples = std::map<uint16_t, uint64_t>;

// Counts the samples that are solid (at or above `iso`) in one snapshot of a volume and not in a
// later one. It is a function of the two, so undo gives back and redo takes away again.
//
// The cost follows the bricks that have changed since the last count. It keeps those of the first
// snapshot that differ from the last one counted. For one thread.
class RemovedCounter {
 public:
    // From here on; `before` may be any snapshot of the same volume, also a later one.
    void begin(Volume before);

    // `labels` is on the volume's grid; where it is not, or there is none, all is of label 0.
    // Throws SourceError where samples cannot be read.
    const RemovedSamples& count(const Volume& now, double iso, const std::optional<Volume>& labels);

 private:
    struct Counted { // of a brick that differs
        BrickPtr now, labels;
        RemovedSamples removed;
    };
    std::optional<Volume> before_;
    double iso_ = 0.0;
    uint64_t now_version_ = 0, labels_version_ = 0; // of the last count
    bool is_counted_ = false;
    std::unordered_map<uint64_t, Counted> bricks_; // by place
    RemovedSamples all_;
};

} // namespace palpate
