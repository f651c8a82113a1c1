#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/render/cell_map.h"
#include "engine/render/residency.h"
#include "engine/scene/scene.h"

namespace palpate {

// Which bricks of a volume a scene needs on the device: those in which rays may take samples that
// matter, and those that slices run through. Kept from frame to frame: a camera that moves costs
// nothing, an edit what it changed, other slices what they run through.
//
// Constant bricks whose upper neighbours hold the same value are needed by alpha and iso alone,
// where something of theirs can be seen.
class NeededBricks {
 public:
    explicit NeededBricks(const Volume& volume);

    // For a frame of `scene`. `volume` is the snapshot of the last call or another one, `changed`
    // where they differ (nothing: anywhere). Rays of alpha and iso read `cells`, after its show();
    // others may have none. Steps are up to step_factor times as long as the layer's.
    void update(const Scene& scene, const Volume& volume,
                std::optional<std::span<const ChangedBrick>> changed, const CellMap* cells,
                double step_factor);

    bool needs(glm::uvec3 brick) const { return flags_[index_of(brick)] & (kSeen | kSliced); }
    size_t count() const { return needed_; } // by rays or slices
    size_t seen_count() const { return seen_; }
    size_t sliced_count() const { return sliced_; }

    // 1 where rays need the brick, x fastest. These three look at all bricks.
    BrickMask seen() const;
    std::vector<glm::uvec3> sliced() const;
    std::vector<glm::uvec3> all() const;

    // Bricks that came to be needed, or no longer are, since this was last called.
    std::vector<glm::uvec3> take_turned();

    // The number of bricks that all calls together looked at.
    uint64_t bricks_visited() const { return bricks_visited_; }

 private:
    enum Flag : uint8_t {
        kVaries = 1,  // see varies(); where somebody asks for it
        kSeen = 2,    // needed by rays
        kOnPlane = 4, // a slice runs through it
        kSliced = 8,  // and shows more than one value: needed by slices
        kTold = 16,   // was needed at the last take_turned()
    };
    struct Rays { // what kSeen was found for
        bool mip;
        uint64_t generation; // of the cells; 0 for MIP
        uint32_t reach;      // cells; 0 for MIP
        friend bool operator==(const Rays&, const Rays&) = default;
    };
    size_t index_of(glm::uvec3 brick) const {
        return brick.x + count_.x * (brick.y + size_t{count_.y} * brick.z);
    }
    void set(glm::uvec3 brick, Flag flag, bool on);
    template <class Visit>
    void for_each(const Visit& visit) const;
    template <class Visit>
    std::vector<glm::uvec3> list(const Visit& is_listed) const;
    void find_planes(const Scene& scene, const Grid& grid);

    glm::uvec3 count_;
    std::vector<uint8_t> flags_;
    size_t needed_ = 0, seen_ = 0, sliced_ = 0;
    bool knows_what_varies_ = false;
    std::optional<Rays> rays_;
    std::vector<SliceLayer> slices_;
    glm::dmat4 world_from_index_{1.0}; // that kOnPlane was found for
    std::vector<glm::uvec3> on_planes_, turned_;
    uint64_t bricks_visited_ = 0;
};

} // namespace palpate
