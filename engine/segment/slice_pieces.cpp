#include "engine/segment/slice_pieces.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

namespace palpate {

SlicePieces pieces_of(const std::vector<uint8_t>& samples, glm::ivec2 size) {
    SlicePieces out{size, std::vector<uint32_t>(samples.size(), 0), {0}, {glm::dvec2(0.0)}};
    std::vector<glm::ivec2> open;
    for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x) {
            const auto place = [&](glm::ivec2 at) {
                return size_t(at.x) + size_t(size.x) * size_t(at.y);
            };
            if (samples[place({x, y})] == 0 || out.numbers[place({x, y})] != 0)
                continue;
            const auto number = uint32_t(out.counts.size());
            uint64_t count = 0;
            glm::i64vec2 sum(0);
            open.assign(1, {x, y});
            out.numbers[place({x, y})] = number;
            while (!open.empty()) {
                const glm::ivec2 at = open.back();
                open.pop_back();
                ++count;
                sum += glm::i64vec2(at);
                for (int n = 0; n < 9; ++n) {
                    const glm::ivec2 to = at + glm::ivec2(n % 3 - 1, n / 3 - 1);
                    if (glm::any(glm::lessThan(to, glm::ivec2(0))) ||
                        glm::any(glm::greaterThanEqual(to, size)) || samples[place(to)] == 0 ||
                        out.numbers[place(to)] != 0)
                        continue;
                    out.numbers[place(to)] = number;
                    open.push_back(to);
                }
            }
            out.counts.push_back(count);
            out.centroids.push_back(glm::dvec2(sum) / double(count));
        }
    return out;
}

std::vector<PieceGroup> matched_pieces(const SlicePieces& a, const SlicePieces& b,
                                       glm::dvec2 spacing_mm) {
    const size_t in_a = a.counts.size() - 1, in_b = b.counts.size() - 1;
    // A forest over the pieces of both: those of a first.
    std::vector<size_t> parents(in_a + in_b);
    std::iota(parents.begin(), parents.end(), size_t{0});
    const auto root = [&](size_t i) {
        while (parents[i] != i)
            i = parents[i] = parents[parents[i]];
        return i;
    };
    std::vector<bool> linked(parents.size());
    const auto link = [&](size_t i, size_t j) {
        const size_t one = root(i), other = root(j);
        parents[std::max(one, other)] = std::min(one, other);
        linked[i] = linked[j] = true;
    };
    for (size_t i = 0; i < a.numbers.size(); ++i)
        if (a.numbers[i] != 0 && b.numbers[i] != 0)
            link(a.numbers[i] - 1, in_a + b.numbers[i] - 1);
    std::vector<std::tuple<double, size_t, size_t>> pairs; // by distance, then by number
    const auto diameter = [&](uint64_t count) {
        return 2.0 * std::sqrt(double(count) * spacing_mm.x * spacing_mm.y / std::numbers::pi);
    };
    for (size_t i = 0; i < in_a; ++i)
        for (size_t j = 0; !linked[i] && j < in_b; ++j) {
            const double mm = glm::length((a.centroids[i + 1] - b.centroids[j + 1]) * spacing_mm);
            if (!linked[in_a + j] && mm <= diameter(a.counts[i + 1]) + diameter(b.counts[j + 1]))
                pairs.emplace_back(mm, i, j);
        }
    std::sort(pairs.begin(), pairs.end());
    for (const auto& [mm, i, j] : pairs)
        if (!linked[i] && !linked[in_a + j])
            link(i, in_a + j);
    std::vector<PieceGroup> groups;
    std::vector<size_t> group_of(parents.size());
    for (size_t i = 0; i < parents.size(); ++i) {
        if (root(i) == i) { // a root has the lowest number of its group
            group_of[i] = groups.size();
            groups.emplace_back();
        }
        PieceGroup& group = groups[group_of[root(i)]];
        if (i < in_a)
            group.in_a.push_back(uint32_t(i + 1));
        else
            group.in_b.push_back(uint32_t(i - in_a + 1));
    }
    return groups;
}

glm::dvec2 centroid_of(const SlicePieces& pieces, const std::vector<uint32_t>& numbers) {
    glm::dvec2 sum(0.0);
    uint64_t count = 0;
    for (const uint32_t number : numbers) {
        sum += double(pieces.counts[number]) * pieces.centroids[number];
        count += pieces.counts[number];
    }
    return sum / double(count);
}

} // namespace palpate
