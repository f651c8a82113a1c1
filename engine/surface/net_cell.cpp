#include "engine/surface/net_cell.h"

#include "engine/base/forest.h"

namespace palpate {

namespace {

std::array<NetFace, 6> make_faces() {
    std::array<NetFace, 6> faces;
    for (int f = 0; f < 6; ++f) {
        NetFace& face = faces[static_cast<size_t>(f)];
        face.corners = face_corners(f);
        for (size_t i = 0; i < 4; ++i) {
            const uint8_t a = face.corners[i], b = face.corners[(i + 1) % 4];
            for (int e = 0; e < 12; ++e)
                if (const CellEdge edge = cell_edge(e);
                    edge.corner == (a & b) && (1 << edge.axis) == (a ^ b))
                    face.edges[i] = static_cast<uint8_t>(e);
        }
    }
    return faces;
}

} // namespace

const NetFace& net_face(int face) {
    static const std::array<NetFace, 6> faces = make_faces();
    return faces[static_cast<size_t>(face)];
}

FaceLink face_link(uint16_t a, uint16_t b, uint16_t c, uint16_t d) {
    const int crossed = (a != b) + (b != c) + (c != d) + (d != a);
    if (crossed < 4)
        return crossed == 0 ? FaceLink::none : crossed == 2 ? FaceLink::wall : FaceLink::line;
    if (a == c && (b != d || a > b))
        return FaceLink::split_1;
    return b == d ? FaceLink::split_0 : FaceLink::line;
}

NetCell net_cell(const std::array<uint16_t, 8>& labels) {
    NetCell cell;
    for (int e = 0; e < 12; ++e) {
        const CellEdge edge = cell_edge(e);
        if (labels[edge.corner] != labels[edge.corner + (size_t{1} << edge.axis)])
            cell.crossed |= static_cast<uint16_t>(1 << e);
    }
    Forest<std::array<uint8_t, 12>> links;
    for (int f = 0; f < 6; ++f) {
        const NetFace& face = net_face(f);
        const FaceLink link = face_link(labels[face.corners[0]], labels[face.corners[1]],
                                        labels[face.corners[2]], labels[face.corners[3]]);
        // Edge i lies between corners i and i + 1: round corner i meet edges i - 1 and i.
        if (link == FaceLink::split_0 || link == FaceLink::split_1) {
            const size_t first = link == FaceLink::split_0 ? 0 : 1;
            for (const size_t corner : {first, first + 2})
                links.join(face.edges[(corner + 3) % 4], face.edges[corner]);
            cell.splits |= static_cast<uint16_t>((first + 1) << (2 * f));
            continue;
        }
        int last = -1;
        for (const uint8_t e : face.edges) {
            if (!(cell.crossed >> e & 1))
                continue;
            if (last >= 0)
                links.join(static_cast<uint8_t>(last), e);
            last = e;
        }
    }
    std::array<uint8_t, 12> number{};
    for (uint8_t e = 0; e < 12; ++e) {
        if (!(cell.crossed >> e & 1))
            continue;
        const uint8_t root = links.root(e);
        if (root == e)
            number[e] = cell.vertices++;
        cell.vertex[e] = number[root];
    }
    return cell;
}

const NetCell& net_cell_of_two(uint8_t pattern) {
    static const std::array<NetCell, 256> cells = [] {
        std::array<NetCell, 256> made;
        for (size_t p = 0; p < 256; ++p) {
            std::array<uint16_t, 8> labels;
            for (size_t c = 0; c < 8; ++c)
                labels[c] = p >> c & 1;
            made[p] = net_cell(labels);
        }
        return made;
    }();
    return cells[pattern];
}

NetCell quick_net_cell(const std::array<uint16_t, 8>& labels) {
    const uint16_t a = labels[0];
    uint16_t b = a;
    for (const uint16_t label : labels)
        b = label != a ? label : b;
    uint8_t is_b = 0;
    for (size_t c = 0; c < 8; ++c) {
        if (labels[c] == b)
            is_b |= static_cast<uint8_t>(1 << c);
        else if (labels[c] != a)
            return net_cell(labels);
    }
    return net_cell_of_two(b > a ? is_b : static_cast<uint8_t>(~is_b));
}

} // namespace palpate
