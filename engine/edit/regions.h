#pragma once

#include <functional>
#include <unordered_map>
#include <vector>

#include "engine/edit/operation.h"
#include "engine/edit/sample_mask.h"
#include "engine/volume/edit.h"

namespace palpate {

// Finds the components that fill and islands ask for, a slice at a time, and writes them.
class RegionSearch {
 public:
    // `region` is T: masks by brick, which must outlive this, as must before. `key_of` of a brick
    // is x + count.x * (y + count.y * z).
    using Region = std::unordered_map<uint64_t, const SampleMask*>;
    RegionSearch(const Volume& before, const Operation& operation, Region region);

    // Works until all is done (true) or go_on says false. Writes to `edit`, which may be another
    // one each time.
    bool work(VolumeEdit& edit, const std::function<bool()>& go_on);
    uint16_t met_spared() const { return met_spared_; } // StrokeRun::met_spared()

 private:
    bool member(glm::ivec3 index) const; // a label that components consist of
    bool in_region(glm::ivec3 index) const;
    void visit(glm::ivec3 index); // of a member: into the component, or it is open
    void finish(VolumeEdit& edit);

    Volume before_;
    Operation operation_;
    Region region_;
    std::vector<glm::ivec3> offsets_;
    double sample_mm3_;
    std::vector<std::pair<uint64_t, const SampleMask*>> order_;
    std::unordered_map<uint64_t, SampleMask> visited_;
    size_t brick_ = 0, row_ = 0; // where seeds are looked for
    std::vector<glm::ivec3> component_;
    size_t looked_at_ = 0; // of the component
    bool open_ = false, searching_ = false;
    uint16_t met_spared_ = 0;
};

} // namespace palpate
