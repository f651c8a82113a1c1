#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "apps/view/window/panel.h"

struct ImDrawData;

namespace palpate::view {

// The drawing of Dear ImGui's lists on each tile of a window, as a hash of the triangles that touch
// it, in their order. Tiles of equal hashes look the same, so that of a new frame only those that
// differ are drawn. (Two looks share a hash of 64 bits with a chance of 2^-64.)
struct UiTiles {
    static constexpr int kEdge_px = 64; // llvmpipe draws in tiles of this size

    glm::ivec2 size_px{0};        // of the window
    std::vector<uint64_t> hashes; // row by row; the last of a row or column may be cut off

    glm::ivec2 count() const { return (size_px + (kEdge_px - 1)) / kEdge_px; }
    friend bool operator==(const UiTiles&, const UiTiles&) = default;
};

// `version_of`: rises with each new content of the texture of a number; may be empty.
UiTiles tiles_of(const ImDrawData& data,
                 const std::function<uint64_t(uint32_t number)>& version_of = {});

// Rectangles of whole tiles, at most kMostChanges and none upon another, which hold all tiles that
// differ. Where the sizes do, this is the whole window.
constexpr size_t kMostChanges = 32;
std::vector<Box> changes(const UiTiles& before, const UiTiles& now);

} // namespace palpate::view
