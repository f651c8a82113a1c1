#include "engine/surface/block_count.h"

namespace palpate::block {

BlockCounter::BlockCounter() {
    classic_table(); // made now rather than within a deadline
    cells_.count = 0;
    Count none;
    count_cells(cells_, none);
}

BlockCounter::Result BlockCounter::count(Last last, float iso) {
    const Signs signs = signs_of(samples_, iso);
    Count count;
    count_edges(signs, last, count);
    find_cells(signs, last, cells_);
    count_cells(cells_, count);
    return {count.edge_vertices,
            static_cast<uint32_t>(borrowed_edges(signs, last, borrowed_.data())), count.triangles};
}

} // namespace palpate::block
