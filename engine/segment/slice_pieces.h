#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

// The pieces of a label in two parallel slices, and which of them belong together.
namespace palpate {

// Samples of a slice, x fastest; those of one piece share a number above 0.
struct SlicePieces {
    glm::ivec2 size{};
    std::vector<uint32_t> numbers;
    std::vector<uint64_t> counts;      // of samples, by number; counts[0] is not used
    std::vector<glm::dvec2> centroids; // in samples, likewise
};
// Pieces of the samples that are not 0, joined by edges and corners, in memory order.
SlicePieces pieces_of(const std::vector<uint8_t>& samples, glm::ivec2 size);

// Pieces that belong together, by their numbers; one list may be empty.
struct PieceGroup {
    std::vector<uint32_t> in_a, in_b;
};
// As interpolate_slices() says: those over each other, then the nearest of what is left. In the
// order of their lowest numbers.
std::vector<PieceGroup> matched_pieces(const SlicePieces& a, const SlicePieces& b,
                                       glm::dvec2 spacing_mm);

// The centroid of several pieces of a slice, in samples.
glm::dvec2 centroid_of(const SlicePieces& pieces, const std::vector<uint32_t>& numbers);

} // namespace palpate
