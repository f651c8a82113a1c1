#include "engine/mesh/used_positions.h"

#include <algorithm>

namespace palpate {

void take_used_positions(const Mesh& whole, Mesh& part, std::vector<uint32_t>& renamed) {
    constexpr uint32_t kUnused = ~0u;
    renamed.resize(whole.positions.size(), kUnused);
    std::vector<uint32_t> used;
    for (const glm::uvec3 t : part.triangles)
        for (int corner = 0; corner < 3; ++corner)
            if (uint32_t& name = renamed[t[corner]]; name == kUnused) {
                name = 0;
                used.push_back(t[corner]);
            }
    std::sort(used.begin(), used.end());
    for (const uint32_t v : used) {
        renamed[v] = static_cast<uint32_t>(part.positions.size());
        part.positions.push_back(whole.positions[v]);
        if (!whole.normals.empty())
            part.normals.push_back(whole.normals[v]);
    }
    for (glm::uvec3& t : part.triangles)
        t = {renamed[t.x], renamed[t.y], renamed[t.z]};
    for (const uint32_t v : used)
        renamed[v] = kUnused;
}

} // namespace palpate
