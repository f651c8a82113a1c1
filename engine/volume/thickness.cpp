#include "engine/volume/thickness.h"

namespace palpate {

bool is_thin(const Grid& grid) {
    return glm::any(glm::equal(grid.size, glm::uvec3(1)));
}

Grid thickened(Grid grid) {
    for (int axis = 0; axis < 3; ++axis)
        if (grid.size[axis] == 1) {
            grid.size[axis] = 2;
            grid.world_from_index[3] -= 0.5 * grid.world_from_index[axis];
        }
    return grid;
}

Volume thickened(const Volume& volume) {
    if (!is_thin(volume.grid()))
        return volume;
    auto root = std::make_shared<Volume::Root>(volume.root());
    root->grid = thickened(root->grid);
    return Volume(std::move(root));
}

} // namespace palpate
