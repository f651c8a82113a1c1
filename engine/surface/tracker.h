#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <vector>

#include "engine/mesh/mesh.h"
#include "engine/volume/volume.h"

namespace palpate {

struct TrackerOptions {
    // As if the volume lay in background: objects that touch its border are closed there. As
    // printed (false), cells end with the samples and such objects stay open.
    bool closed = false;

    // The grey volume V that was segmented with threshold `iso`; same grid as the labels.
    std::optional<Volume> grey;
    float iso = 0.0f;
    // Vertices where V crosses iso, at 2^-12 .. 1 - 2^-12 of their edge; midway where V does not
    // cross it there. Else all are midway.
    bool interpolate = false;
    // Normals against the gradient of V; where that says nothing, and else, by the table.
    bool gradient_normals = false;
    std::stop_token stop{}; // of track_labels(): asked to stop, there is no mesh
};

// The surface of one label by tracking, as Vidholm & Agmund describe it ("Fast surface rendering
// for interactive medical image segmentation with haptic feedback", 2004, section 4), whole: cell
// index array C, connectivity table, deque, coverage arrays X- and X+, a linear search or a given
// seed, triangles in xyz order that skip by coverage, three new edges a cell, index caches, midway
// vertices with normals from a table per case, and a local update of C, X- and X+.
//
// Two faults of the print are repaired. X+ counts from 1, as 0 means "no cell on this line" and
// would hide a cell at x = 0. The search looks at cells that have both a sample of the label and
// another one: the lowest cell of the first such sample alone may lie wholly within the object.
//
// C takes a byte a cell whatever the object's size. One thread uses a tracker.
class SurfaceTracker {
 public:
    // `labels` of any type; the object is where samples equal `label`.
    SurfaceTracker(Volume labels, uint16_t label, TrackerOptions options = {});

    // Cells on each axis; 0 on an axis of one sample, where there is no surface, unless `closed`.
    // Cell c covers samples c and c + 1, with `closed` c - 1 and c.
    glm::uvec3 cell_count() const { return cells_; }

    // Finds every surface of the object.
    void find_all();

    // Adds the surface that passes through a cell; false where none does. seed < cell_count().
    bool track(glm::uvec3 seed);

    // Takes an edited snapshot, of which samples low .. high (both included) may differ, and brings
    // C, X- and X+ up to date there. The result equals a new find_all(). After track() alone,
    // surfaces that pass through the box are found whole.
    void update(const Volume& edited, glm::uvec3 low, glm::uvec3 high);

    // The triangles of all cells found. Order: cells x fastest; a function of C alone.
    Mesh triangulate() const;

    // The configuration of a cell as found: bit c is set where corner c is inside; 0 where it was
    // not visited.
    uint8_t cell(glm::uvec3 at) const { return index_[offset(at)]; }
    // The first cell found in the line of cells (y, z), and one more than the last; the latter is 0
    // where there is none.
    uint32_t first(uint32_t y, uint32_t z) const { return first_[y + size_t{cells_.y} * z]; }
    uint32_t end(uint32_t y, uint32_t z) const { return end_[y + size_t{cells_.y} * z]; }

 private:
    size_t offset(glm::uvec3 at) const {
        return at.x + cells_.x * (at.y + size_t{cells_.y} * at.z);
    }
    template <class T>
    void search();
    template <class T>
    void track_surface(glm::uvec3 seed);
    template <class T>
    void follow(glm::uvec3 at);
    // Calls visit(cell) for the neighbours that the surface goes on to and that were not visited.
    template <class Visit>
    void for_each_next(glm::uvec3 at, const Visit& visit);
    void cover(glm::uvec3 at);

    Volume labels_;
    uint16_t label_;
    TrackerOptions options_;
    uint32_t border_; // cells beyond the samples on each side: 0 or 1
    glm::uvec3 cells_;
    std::vector<uint8_t> index_;        // C
    std::vector<uint32_t> first_, end_; // X-, X+
};

// The paper's surface of every label but 0 that the volume holds, in rising order, each on its own.
std::vector<Mesh> track_labels(const Volume& labels, const TrackerOptions& options = {});

} // namespace palpate
