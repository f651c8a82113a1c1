#include "engine/surface/net_layers.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>

#include "engine/base/assert.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

constexpr uint32_t kChunk = 16;                // layers of cells
constexpr uint32_t kGhost = uint32_t{1} << 31; // of a vertex in the last layer of the chunk before

// The labels of a slice of samples, with a border of background.
struct Slice {
    size_t stride = 0;
    std::vector<uint16_t> labels;

    // Row y + 1 holds sample (x, y) at x + 1. Four more at the end of a row may be read.
    const uint16_t* row(uint32_t y) const { return &labels[stride * y]; }
};

void read_slice(const Volume& volume, int64_t z, Slice& slice) {
    const glm::uvec3 size = volume.size();
    slice.stride = size_t{size.x} + 2 + 4;
    slice.labels.assign(slice.stride * (size.y + size_t{2}), 0);
    if (z < 0 || z >= int64_t{size.z})
        return;
    read_box(volume, {0, 0, int(z)}, {size.x, size.y, 1}, {slice.stride, 0},
             &slice.labels[slice.stride + 1]);
}

uint64_t four(const uint16_t* at) {
    uint64_t bits;
    std::memcpy(&bits, at, sizeof bits);
    return bits;
}

struct ActiveCell {
    uint32_t x, y;
    uint32_t base; // its first vertex
    NetCell cell;
    std::array<uint16_t, 4> low; // labels of corner 0 and of those beyond it on x, y and z

    uint32_t vertex(int edge) const { return base + cell.vertex[static_cast<size_t>(edge)]; }
};

// One layer of cells, between two slices of samples.
struct Layer {
    std::vector<ActiveCell> cells;
    std::vector<uint32_t> at; // the number in `cells`, valid where a cell is active

    const ActiveCell& cell(uint32_t x, uint32_t y, size_t width) const {
        return cells[at[x + width * y]];
    }
};

// Finds the active cells of a layer and numbers their vertices from `next` on.
void find_cells(const Slice& below, const Slice& above, glm::uvec3 size, uint32_t& next,
                Layer& layer) {
    const size_t width = size.x + size_t{1};
    layer.cells.clear();
    layer.at.resize(width * (size.y + size_t{1}));
    for (uint32_t y = 0; y <= size.y; ++y) {
        const uint16_t* rows[4] = {below.row(y), below.row(y + 1), above.row(y), above.row(y + 1)};
        for (uint32_t x = 0; x <= size.x; ++x) {
            if (x % 4 == 0) { // four cells at once: five columns, in each four labels
                const uint64_t here = four(rows[0] + x), beyond = four(rows[0] + x + 1);
                uint64_t differ = here ^ beyond;
                for (int r = 1; r < 4; ++r)
                    differ |= (here ^ four(rows[r] + x)) | (beyond ^ four(rows[r] + x + 1));
                if (differ == 0) {
                    x += 3;
                    continue;
                }
            }
            std::array<uint16_t, 8> labels;
            bool is_active = false;
            for (size_t c = 0; c < 8; ++c) {
                labels[c] = rows[c >> 1][x + (c & 1)];
                is_active = is_active || labels[c] != labels[0];
            }
            if (!is_active)
                continue;
            layer.at[x + width * y] = static_cast<uint32_t>(layer.cells.size());
            layer.cells.push_back(
                {x, y, next, quick_net_cell(labels), {labels[0], labels[1], labels[2], labels[4]}});
            next += layer.cells.back().cell.vertices;
        }
    }
}

int edge_at(int corner, int axis) {
    for (int e = 4 * axis; e < 4 * axis + 4; ++e)
        if (cell_edge(e).corner == corner)
            return e;
    return -1;
}

// The part that a chunk of layers adds; vertices counted from its own first one.
struct Part {
    Net net;
    uint32_t before_last = 0; // vertices below its last layer
};

class Chunk {
 public:
    Chunk(const Volume& volume, uint32_t first, uint32_t end, const NetCells& linked)
        : volume_(volume), size_(volume.size()), first_(first), end_(end), linked_(linked) {}

    Part make(const std::stop_token& stop) {
        Layer layers[2];
        Slice slices[2];
        read_slice(volume_, int64_t{first_} - 2, slices[0]);
        read_slice(volume_, int64_t{first_} - 1, slices[1]);
        uint32_t ghosts = kGhost, next = 0;
        if (first_ > 0)
            find_cells(slices[0], slices[1], size_, ghosts, layers[(first_ + 1) % 2]);
        for (uint32_t z = first_; z < end_ && !stop.stop_requested(); ++z) {
            std::swap(slices[0], slices[1]);
            read_slice(volume_, z, slices[1]);
            Layer& now = layers[z % 2];
            part_.before_last = next;
            find_cells(slices[0], slices[1], size_, next, now);
            for (const ActiveCell& cell : now.cells) {
                add_vertices(cell, z);
                const bool is_linked = linked_.holds({cell.x, cell.y, z});
                for (int axis = 0; axis < 3; ++axis) {
                    add_wall(layers[(z + 1) % 2], now, cell, z, axis);
                    if (is_linked)
                        add_links(layers[(z + 1) % 2], now, cell, axis);
                }
            }
        }
        return std::move(part_);
    }

 private:
    void add_vertices(const ActiveCell& active, uint32_t z) {
        const auto first = static_cast<uint32_t>(part_.net.vertices.size());
        const NetCell& cell = active.cell;
        part_.net.vertices.insert(part_.net.vertices.end(), cell.vertices,
                                  {glm::u16vec3(active.x, active.y, z)});
        for (uint32_t v = 0; cell.vertices > 1 && v < cell.vertices; ++v) {
            NetApart apart{first + v, 0};
            for (int e = 0; e < 12; ++e)
                if ((cell.crossed >> e & 1) && cell.vertex[static_cast<size_t>(e)] == v)
                    apart.edges |= static_cast<uint16_t>(1 << e);
            part_.net.apart.push_back(apart);
        }
    }

    // The wall between the lowest corner of a cell and the one beyond it on `axis`.
    void add_wall(const Layer& below, const Layer& now, const ActiveCell& cell, uint32_t z,
                  int axis) {
        const uint16_t low = cell.low[0], high = cell.low[static_cast<size_t>(axis) + 1];
        if (low == high)
            return;
        // The cells about the wall, counter-clockwise seen from beyond: on the two other axes, b
        // and c, they are this one less (1, 1), (0, 1), (0, 0) and (1, 0).
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        constexpr uint32_t kLess[4][2] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}};
        NetWall wall{{}, std::max(low, high), std::min(low, high)};
        std::array<const ActiveCell*, 4> cells{};
        std::array<glm::uvec3, 4> places;
        std::array<int, 4> edges{};
        bool is_split = false;
        for (size_t i = 0; i < 4; ++i) {
            places[i] = {cell.x, cell.y, z};
            places[i][b] -= kLess[i][0];
            places[i][c] -= kLess[i][1];
            cells[i] = &(places[i].z == z ? now : below)
                            .cell(places[i].x, places[i].y, size_.x + size_t{1});
            const auto corner = static_cast<int>(kLess[i][0] << b | kLess[i][1] << c);
            edges[i] = kEdgeAt[static_cast<size_t>(corner)][static_cast<size_t>(axis)];
            wall.corners[i] = cells[i]->vertex(edges[i]);
            is_split = is_split || cells[i]->cell.splits != 0;
        }
        NetSplit split{.wall = static_cast<uint32_t>(part_.net.walls.size())};
        bool has_split_side = false;
        if (is_split)
            for (size_t side = 0; side < 4; ++side) {
                // Seen from the lower of the two cells, whose upper face it is.
                const int across = side % 2 == 0 ? b : c;
                const size_t lower = side < 2 ? side : (side + 1) % 4;
                const int face = 2 * across + 1;
                const int kind = cells[lower]->cell.splits >> (2 * face) & 3;
                if (kind == 0)
                    continue;
                const auto& corners = net_face(face).corners;
                const CellEdge edge = cell_edge(edges[lower]);
                for (const size_t i :
                     {static_cast<size_t>(kind) - 1, static_cast<size_t>(kind) + 1})
                    if (corners[i] == edge.corner || corners[i] == edge.corner + (1 << axis))
                        split.corner[side] = static_cast<int8_t>(corners[i] & ~(1 << across));
                split.axis[side] = static_cast<int8_t>(across);
                const glm::uvec3 at = places[lower];
                split.face[side] =
                    3 * (at.x + (size_.x + uint64_t{1}) * (at.y + (size_.y + uint64_t{1}) * at.z)) +
                    static_cast<uint64_t>(across);
                has_split_side = true;
            }
        if (high > low) { // seen from the other side: corners 0, 3, 2, 1, and sides 3, 2, 1, 0
            std::swap(wall.corners[1], wall.corners[3]);
            for (const auto& [i, j] : {std::pair<size_t, size_t>(0, 3), {1, 2}}) {
                std::swap(split.corner[i], split.corner[j]);
                std::swap(split.axis[i], split.axis[j]);
                std::swap(split.face[i], split.face[j]);
            }
        }
        part_.net.walls.push_back(wall);
        if (has_split_side)
            part_.net.splits.push_back(split);
    }

    // Through the lower face on `axis`, to the cell before.
    void add_links(const Layer& below, const Layer& now, const ActiveCell& active, int axis) {
        const NetFace& face = net_face(2 * axis);
        const NetCell& cell = active.cell;
        int crossed = 0, any = -1;
        for (const uint8_t e : face.edges)
            if (cell.crossed >> e & 1) {
                ++crossed;
                any = e;
            }
        if (crossed == 0)
            return;
        const ActiveCell& before =
            axis == 2
                ? below.cell(active.x, active.y, size_.x + size_t{1})
                : now.cell(active.x - (axis == 0), active.y - (axis == 1), size_.x + size_t{1});
        const auto link = [&](int e, bool is_line) {
            const CellEdge edge = cell_edge(e);
            const int there = kEdgeAt[edge.corner | size_t{1} << axis][edge.axis];
            part_.net.links.push_back({active.vertex(e), before.vertex(there), is_line});
        };
        const int kind = cell.splits >> (4 * axis) & 3;
        if (kind == 0)
            return link(any, crossed > 2);
        for (const int corner : {kind - 1, kind + 1})
            link(face.edges[static_cast<size_t>(corner)], false);
    }

    using EdgeTable = std::array<std::array<int8_t, 3>, 8>; // by lower corner and axis
    static EdgeTable make_edge_table() {
        EdgeTable table;
        for (int corner = 0; corner < 8; ++corner)
            for (int axis = 0; axis < 3; ++axis)
                table[static_cast<size_t>(corner)][static_cast<size_t>(axis)] =
                    static_cast<int8_t>(edge_at(corner, axis));
        return table;
    }
    static inline const EdgeTable kEdgeAt = make_edge_table();

    const Volume& volume_;
    glm::uvec3 size_;
    uint32_t first_, end_; // layers
    NetCells linked_;
    Part part_;
};

} // namespace

Net make_net(const Volume& labels, const NetCells& linked, const std::stop_token& stop) {
    const glm::uvec3 size = labels.size();
    PALPATE_ASSERT(size.x < 65535 && size.y < 65535 && size.z < 65535);
    const uint32_t layers = size.z + 1, chunks = (layers + kChunk - 1) / kChunk;
    std::vector<Part> parts(chunks);
    tbb::parallel_for(uint32_t{0}, chunks, [&](uint32_t n) {
        parts[n] = Chunk(labels, n * kChunk, std::min(layers, (n + 1) * kChunk), linked).make(stop);
    });
    struct Start {
        size_t vertices = 0, walls = 0, apart = 0, splits = 0, links = 0;
    };
    std::vector<Start> starts(chunks + 1);
    for (size_t n = 0; n < chunks; ++n) {
        const Net& net = parts[n].net;
        starts[n + 1] = {starts[n].vertices + net.vertices.size(),
                         starts[n].walls + net.walls.size(), starts[n].apart + net.apart.size(),
                         starts[n].splits + net.splits.size(), starts[n].links + net.links.size()};
    }
    PALPATE_ASSERT_CMP(starts[chunks].vertices, <, size_t{kGhost});
    Net whole;
    whole.vertices.resize(starts[chunks].vertices);
    whole.walls.resize(starts[chunks].walls);
    whole.apart.resize(starts[chunks].apart);
    whole.splits.resize(starts[chunks].splits);
    whole.links.resize(starts[chunks].links);
    tbb::parallel_for(size_t{0}, size_t{chunks}, [&](size_t n) {
        const Net& net = parts[n].net;
        const auto own = static_cast<uint32_t>(starts[n].vertices);
        const uint32_t ghost =
            n == 0 ? 0 : static_cast<uint32_t>(starts[n - 1].vertices) + parts[n - 1].before_last;
        const auto renamed = [&](uint32_t v) {
            return v & kGhost ? ghost + (v & ~kGhost) : own + v;
        };
        std::copy(net.vertices.begin(), net.vertices.end(), whole.vertices.data() + own);
        for (size_t i = 0; i < net.walls.size(); ++i) {
            NetWall wall = net.walls[i];
            for (uint32_t& v : wall.corners)
                v = renamed(v);
            whole.walls[starts[n].walls + i] = wall;
        }
        for (size_t i = 0; i < net.apart.size(); ++i)
            whole.apart[starts[n].apart + i] = {own + net.apart[i].vertex, net.apart[i].edges};
        for (size_t i = 0; i < net.splits.size(); ++i) {
            NetSplit split = net.splits[i];
            split.wall += static_cast<uint32_t>(starts[n].walls);
            whole.splits[starts[n].splits + i] = split;
        }
        for (size_t i = 0; i < net.links.size(); ++i) {
            const NetLink link = net.links[i];
            whole.links[starts[n].links + i] = {renamed(link.a), renamed(link.b), link.is_line};
        }
    });
    return whole;
}

} // namespace palpate
