#include "haptics/proxy/tool_points.h"

#include <algorithm>
#include <cmath>

#include "engine/edit/shape.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

dvec3 gradient(const Shape& shape, dvec3 p, double h) {
    dvec3 g{};
    for (int axis = 0; axis < 3; ++axis) {
        dvec3 step(0.0);
        step[axis] = h;
        g[axis] = (shape.signed_mm(p + step) - shape.signed_mm(p - step)) / (2.0 * h);
    }
    return g;
}

} // namespace

ToolPoints sample_tool(const Shape& shape, uint32_t count) {
    const BoxMm box = shape.bounds();
    const dvec3 size = box.high - box.low;
    const double longest = std::max({size.x, size.y, size.z});
    ToolPoints made;
    for (double cell = longest / 8.0; made.points_mm.size() < count && cell > longest / 300.0;
         cell *= 0.8) {
        made.points_mm.clear();
        const glm::ivec3 cells(glm::ceil(size / cell));
        for (int z = 0; z < cells.z; ++z)
            for (int y = 0; y < cells.y; ++y)
                for (int x = 0; x < cells.x; ++x) {
                    dvec3 p = box.low + cell * (dvec3(x, y, z) + 0.5);
                    // Cells that the surface cuts about their middle, one layer of them.
                    if (std::abs(shape.signed_mm(p)) > 0.5 * cell)
                        continue;
                    for (int i = 0; i < 8; ++i) {
                        const dvec3 g = gradient(shape, p, 1e-4 * longest);
                        const double square = glm::dot(g, g);
                        if (square < 1e-6)
                            break;
                        p -= shape.signed_mm(p) / square * g;
                    }
                    if (std::abs(shape.signed_mm(p)) < 0.01 * cell)
                        made.points_mm.push_back(p);
                }
    }
    if (made.points_mm.size() > count) { // evenly thinned, in lattice order
        std::vector<dvec3> kept;
        for (uint32_t i = 0; i < count; ++i)
            kept.push_back(made.points_mm[i * made.points_mm.size() / count]);
        made.points_mm = std::move(kept);
    }
    return made;
}

} // namespace palpate::haptics
