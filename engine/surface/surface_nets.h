#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "engine/mesh/mesh.h"
#include "engine/volume/volume.h"

namespace palpate {

inline constexpr uint32_t kStepsOfPass = 2, kStepsOfRound = 6; // each reaches one cell farther

struct SurfaceNetsOptions {
    uint32_t passes = 0;  // of smoothing; 0 and no rounds: walls are the faces between samples
    uint32_t rounds = 0;  // of strong smoothing, after the passes
    double bound = 0.375; // most a vertex may move on each axis, in samples; 0 <= bound < 0.5
    std::stop_token stop; // asked to stop, there is no triangle
};

// The walls between all labels of a volume at once: surface nets (Gibson, "Constrained elastic
// surface nets", 1998; Frisken, "SurfaceNets for multi-label segmentations with preservation of
// sharp boundaries", 2022).
//
// The mesh has shared walls (labels, outer_labels; labels[n] > outer_labels[n]): where two samples
// side by side differ there is one piece of wall, of two triangles, with its corners in the cells
// of 2 x 2 x 2 samples about it. Beyond the volume is background, 0, so what touches its border is
// closed there: half a sample outside, which is where a voxel ends. Whatever the labels are, the
// surface of each one (surface_of_label()) is closed, consistently oriented and has no edge in more
// than two of its triangles; it may touch itself in a point, where four or more labels meet in one
// cell. The volumes of all labels and of the background add up to the box of voxels.
//
// Unsmoothed, vertices lie at the centres of cells, and a label's volume is that of its voxels.
// Cells that hold several vertices, and faces where walls cross, keep them an eighth of a sample
// apart, so that sheets do not touch; this moves volume between labels there.
//
// Smoothing moves each vertex towards the mean of those it is joined to, and back by 1.06 as much
// (Taubin), never farther than `bound` from the centre of its cell: so the surface stays within a
// sample of the walls of voxels, and no label vanishes, not of one voxel either. A round of strong
// smoothing is five steps of 0.6 of the way and one back of their sum, 3, with which a surface of
// low curvature keeps its place: it has the reach of three passes, and leaves 0.91 of stairs of
// eight samples, 0.42 of stairs of four along one axis, where these leave 1.00 and 0.85. Vertices
// on lines where several walls meet move along these lines; those on the box of voxels stay on it.
//
// Samples must be whole numbers 0 .. 65535, and each side below 65535. Threaded; the same on any
// number of threads. Order: cells x fastest, then the wall's axis.
Mesh surface_nets(const Volume& labels, const SurfaceNetsOptions& options = {});

// A part of the walls of a larger volume, whose samples from `first` on are those of `part`.
struct NetPart {
    Mesh mesh; // in the mesh space of the larger volume
    // The cell of the larger volume that owns each triangle's wall: the wall is between the lowest
    // corner of the cell and one beyond it on an axis.
    std::vector<glm::ivec3> owners;
    // The cells of the larger volume that the first positions belong to, x fastest; those after
    // them lie on split walls.
    std::vector<glm::ivec3> cells;
};
// The vertices of some cells are smoothed; those of all others are known.
struct NetMoved {
    glm::ivec3 first, last; // cells of the larger volume
    // Position in mm of vertex n of a cell beside these.
    std::function<glm::vec3(glm::ivec3 cell, uint32_t n)> known;
};
// Positions have the bits of surface_nets() of the larger volume where the part holds what they
// follow from: the samples of cells as far as smoothing reaches, a cell a step, from `moved`.
NetPart surface_nets_part(const Volume& part, glm::ivec3 first, const NetMoved& moved,
                          const SurfaceNetsOptions& options);

// The volume that the surface of one label encloses, in world mm^3.
struct LabelVolume {
    uint16_t label = 0;
    double volume_mm3 = 0.0;
};
// Volumes of all labels of surface_nets(labels, options) but the background, in rising order, with
// vertices kept in double throughout.
std::vector<LabelVolume> surface_nets_volumes_fp64(const Volume& labels,
                                                   const SurfaceNetsOptions& options = {});

} // namespace palpate
