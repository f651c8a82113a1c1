#include "apps/view/drawing/ui_tiles.h"

#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace palpate::view {

namespace {

// Mixes one hash with another word: every bit of either changes about half of the bits.
uint64_t mixed(uint64_t hash, uint64_t word) {
    const uint64_t bits = (std::rotl(hash, 23) ^ word) * 0x9e3779b97f4a7c15u;
    return bits ^ (bits >> 29);
}

template <class T>
uint64_t mixed_with(uint64_t hash, const T& value) {
    static_assert(sizeof(T) % 4 == 0);
    std::array<uint32_t, sizeof(T) / 4> words;
    std::memcpy(words.data(), &value, sizeof(T));
    for (const uint32_t word : words)
        hash = mixed(hash, word);
    return hash;
}

// Pixels from low to below high.
struct Pixels {
    glm::ivec2 low, high;
};

void add(UiTiles& tiles, const Pixels& pixels, uint64_t hash) {
    if (pixels.low.x >= pixels.high.x || pixels.low.y >= pixels.high.y)
        return;
    const glm::ivec2 first = pixels.low / UiTiles::kEdge_px;
    const glm::ivec2 last = (pixels.high - 1) / UiTiles::kEdge_px;
    const int columns = tiles.count().x;
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) {
            uint64_t& tile = tiles.hashes[static_cast<size_t>(y * columns + x)];
            tile = mixed(tile, hash);
        }
}

} // namespace

UiTiles tiles_of(const ImDrawData& data,
                 const std::function<uint64_t(uint32_t number)>& version_of) {
    UiTiles tiles{glm::ivec2(data.DisplaySize.x, data.DisplaySize.y), {}};
    tiles.hashes.assign(static_cast<size_t>(tiles.count().x * tiles.count().y), 1);
    const auto pixel_of = [&](float at, int size) { // also where it is far outside, or no number
        return at > 0.0f ? static_cast<int>(std::min(at, static_cast<float>(size))) : 0;
    };
    std::vector<uint64_t> vertices;
    for (int i = 0; i < data.CmdListsCount; ++i) {
        const ImDrawList& list = *data.CmdLists[i];
        vertices.clear();
        for (const ImDrawVert& vertex : list.VtxBuffer)
            vertices.push_back(mixed_with(0, vertex));
        for (const ImDrawCmd& command : list.CmdBuffer) {
            const auto number =
                static_cast<uint32_t>(reinterpret_cast<uintptr_t>(command.GetTexID()));
            uint64_t state = mixed_with(number, command.ClipRect);
            if (version_of)
                state = mixed(state, version_of(number));
            const ImDrawVert* from = list.VtxBuffer.Data + command.VtxOffset;
            const uint64_t* hashes = vertices.data() + command.VtxOffset;
            const ImDrawIdx* index = list.IdxBuffer.Data + command.IdxOffset;
            for (unsigned n = 0; n + 2 < command.ElemCount; n += 3, index += 3) {
                const ImVec2 &a = from[index[0]].pos, &b = from[index[1]].pos,
                             &c = from[index[2]].pos;
                const ImVec4& clip = command.ClipRect;
                // A pixel is drawn if its middle lies within.
                const glm::vec2 low{std::max({std::min({a.x, b.x, c.x}), clip.x}),
                                    std::max({std::min({a.y, b.y, c.y}), clip.y})};
                const glm::vec2 high{std::min({std::max({a.x, b.x, c.x}), clip.z}),
                                     std::min({std::max({a.y, b.y, c.y}), clip.w})};
                const Pixels pixels{
                    {pixel_of(low.x, tiles.size_px.x), pixel_of(low.y, tiles.size_px.y)},
                    {pixel_of(std::ceil(high.x), tiles.size_px.x),
                     pixel_of(std::ceil(high.y), tiles.size_px.y)}};
                uint64_t hash = state;
                for (int k = 0; k < 3; ++k)
                    hash = mixed(hash, hashes[index[k]]);
                add(tiles, pixels, hash);
            }
        }
    }
    return tiles;
}

std::vector<Box> changes(const UiTiles& before, const UiTiles& now) {
    if (before.size_px != now.size_px)
        return {{glm::ivec2(0), now.size_px}};
    const glm::ivec2 count = now.count();
    std::vector<Box> all; // in tiles
    for (int y = 0; y < count.y; ++y)
        for (int x = 0; x < count.x;) {
            const auto differs = [&](int column) {
                const auto tile = static_cast<size_t>(y * count.x + column);
                return before.hashes[tile] != now.hashes[tile];
            };
            const int from = x;
            while (x < count.x && differs(x))
                ++x;
            if (x == from) {
                ++x;
                continue;
            }
            // A run that lies below one as long goes on with it.
            const auto above = std::ranges::find_if(all, [&](const Box& box) {
                return box.low_px.x == from && box.size_px.x == x - from &&
                       box.low_px.y + box.size_px.y == y;
            });
            if (above != all.end())
                ++above->size_px.y;
            else
                all.push_back({{from, y}, {x - from, 1}});
        }
    if (all.size() > kMostChanges) {
        glm::ivec2 low = all.front().low_px, high = low;
        for (const Box& box : all) {
            low = glm::min(low, box.low_px);
            high = glm::max(high, box.low_px + box.size_px);
        }
        all = {{low, high - low}};
    }
    for (Box& box : all) {
        const glm::ivec2 high =
            glm::min((box.low_px + box.size_px) * UiTiles::kEdge_px, now.size_px);
        box.low_px *= UiTiles::kEdge_px;
        box.size_px = high - box.low_px;
    }
    return all;
}

} // namespace palpate::view
