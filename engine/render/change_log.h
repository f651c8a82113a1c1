#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/volume/changes.h"

namespace palpate {

// The latest changes of a volume, for readers that come at times of their own. A place in it counts
// the changes before.
class ChangeLog {
 public:
    void add(std::span<const ChangedBrick> changed) {
        changes_.insert(changes_.end(), changed.begin(), changed.end());
        if (changes_.size() <= 2 * kKept)
            return;
        const size_t dropped = changes_.size() - kKept;
        changes_.erase(changes_.begin(), changes_.begin() + static_cast<std::ptrdiff_t>(dropped));
        first_ += dropped;
    }

    uint64_t end() const { return first_ + changes_.size(); }
    // Those from `place` on, some bricks several times; valid until add(). Nothing where they are
    // no longer known: anything may have changed.
    std::optional<std::span<const ChangedBrick>> since(uint64_t place) const {
        if (place < first_)
            return std::nullopt;
        return std::span(changes_).subspan(place - first_);
    }

 private:
    static constexpr size_t kKept = 4096;
    std::vector<ChangedBrick> changes_;
    uint64_t first_ = 0; // place of the first that is kept
};

} // namespace palpate
