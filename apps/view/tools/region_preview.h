#pragma once

#include <array>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "engine/segment/click_region.h"

namespace palpate::view {

// Finds on a thread of its own, for the newest place alone, or at once in scripts, what a click
// would take.
class RegionPreview {
 public:
    RegionPreview() = default;
    ~RegionPreview();
    RegionPreview(const RegionPreview&) = delete;
    RegionPreview& operator=(const RegionPreview&) = delete;

    // Cheap where it is the same as before. threaded: by the thread, which the
    // first call starts.
    void want(const Volume& grey, const RegionClick& click, bool threaded);

    // The sides of the squares of samples that divide what is taken from what is
    // not, in a layer across an axis: ends of lines, in samples. Never null.
    using Sides = std::vector<std::pair<glm::dvec3, glm::dvec3>>;
    std::shared_ptr<const Sides> sides(int axis, uint32_t layer);
    void wait(); // until the newest place was looked at
    // The newest that was found; null: none, or it has no answer.
    std::shared_ptr<const ClickRegion> region();

 private:
    struct Wish {
        Volume grey;
        RegionClick click;
    };
    void run(const std::stop_token& stop);
    void find(const Wish& wish, const std::stop_token& stop);

    struct Drawn { // of which region
        std::shared_ptr<const ClickRegion> of;
        uint32_t layer = 0;
        std::shared_ptr<const Sides> sides = std::make_shared<Sides>();
    };

    std::array<Drawn, 3> drawn_; // by axis
    std::mutex mutex_;           // of what follows
    std::condition_variable_any wake_;
    std::optional<Wish> wish_;
    bool is_new_ = false, is_at_work_ = false;
    std::stop_source older_; // ends what a newer wish makes idle
    std::shared_ptr<const ClickRegion> region_;
    std::jthread thread_; // last: ends before the rest goes
};

} // namespace palpate::view
