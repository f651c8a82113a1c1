#pragma once

#include <cstdint>
#include <vector>

#include "engine/mesh/mesh.h"

namespace palpate {

// Effect of smoothing on a mesh, in world millimetres.
struct SmoothReport {
    double volume_before_mm3 = 0.0, volume_after_mm3 = 0.0; // signed, as topology() gives them
    double area_before_mm2 = 0.0, area_after_mm2 = 0.0;
    double largest_shift_mm = 0.0; // of a vertex
};

// All filters below move every vertex towards or away from the mean of its neighbours (the vertices
// it shares an edge with, weighted alike), all at once, so that the order of vertices and triangles
// changes nothing but rounding. Vertices on open edges stay, so that joined meshes stay joined.
// Triangles and labels are kept; a mesh that had normals gets them anew (vertex_normals()).
//
// A filter multiplies a pattern of frequency k by f(k). The mean of the neighbours of a vertex is 1
// - k times the vertex, k from 0 (all alike) to 2.

// f = (1 - share k)^passes. Drilling into volume data (the third paper, section 2, after KBSS01)
// filters the extracted surface with share 1. Shrinks small features.
SmoothReport mean_filter(Mesh& mesh, uint32_t passes, double share = 1.0);

// f = ((1 - lambda k) (1 - mu k))^passes, nearly 1 up to the pass band 1 / lambda + 1 / mu, 0.1 as
// given: inflates as much as it shrinks (Taubin, "A signal processing approach to fair surface
// design", 1995). 0 < lambda < -mu.
SmoothReport taubin_filter(Mesh& mesh, uint32_t passes, double lambda = 0.5,
                           double mu = -1.0 / 1.9);

// f is the step down that `terms` Chebyshev polynomials make under a Hamming window, scaled to
// f(0) = 1 (Taubin, Zhang & Golub, "Optimal surface smoothing as filter design", 1996). The window
// blurs the step by 2 pi / (terms + 1) of arccos(1 - k / 2); the step stands that far beyond
// pass_band, so that f is still 1 there. 0 < pass_band < 2; terms >= 1, each as dear as a pass.
SmoothReport windowed_sinc_filter(Mesh& mesh, uint32_t terms = 20, double pass_band = 0.1);

// Coefficients of the windowed sinc: f(k) = sum of c[i] cos(i arccos(1 - k / 2)).
std::vector<double> windowed_sinc_coefficients(uint32_t terms, double pass_band);

// The vertices that each shares an edge with, in rising order: those of v are vertices[first[v]] up
// to vertices[first[v + 1] - 1]. `open` is 1 at vertices of open edges.
struct Neighbors {
    std::vector<uint32_t> first, vertices;
    std::vector<uint8_t> open;
};
Neighbors neighbors_of(const Mesh& mesh);

} // namespace palpate
