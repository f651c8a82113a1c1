#include "engine/mesh/open_edges.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <vector>

namespace palpate {

uint64_t count_open_edges(const Mesh& mesh) {
    std::vector<uint64_t> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const glm::uvec3 t : mesh.triangles)
        if (t.x != t.y && t.y != t.z && t.z != t.x)
            for (int i = 0; i < 3; ++i) {
                const uint64_t a = t[i], b = t[(i + 1) % 3];
                edges.push_back(std::min(a, b) << 32 | std::max(a, b));
            }
    tbb::parallel_sort(edges.begin(), edges.end());
    uint64_t open = 0;
    for (size_t i = 0; i < edges.size(); ++i)
        open += (i == 0 || edges[i - 1] != edges[i]) &&
                (i + 1 == edges.size() || edges[i + 1] != edges[i]);
    return open;
}

} // namespace palpate
