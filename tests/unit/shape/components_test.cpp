#include "engine/segment/components.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <deque>
#include <map>

#include "engine/segment/smooth_labels.h"
#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

constexpr Neighbours kAll[] = {Neighbours::faces, Neighbours::edges, Neighbours::corners};

struct Piece {
    float label;
    std::vector<size_t> samples;
};

// Floods from every sample in memory order.
std::vector<Piece> flooded(const Volume& labels, Neighbours neighbours,
                           const std::function<float(float)>& kind) {
    const std::vector<float> values = samples_of(labels);
    const glm::ivec3 size(labels.size());
    const int reach = neighbours == Neighbours::faces ? 1 : neighbours == Neighbours::edges ? 2 : 3;
    std::vector<bool> seen(values.size());
    std::vector<Piece> out;
    for (size_t i = 0; i < values.size(); ++i) {
        if (seen[i] || kind(values[i]) == 0.0f)
            continue;
        Piece piece{values[i], {}};
        std::deque<size_t> open{i};
        seen[i] = true;
        while (!open.empty()) {
            const size_t at = open.front();
            open.pop_front();
            piece.samples.push_back(at);
            const glm::ivec3 p(index_of(labels.size(), at));
            for (int n = 0; n < 27; ++n) {
                const glm::ivec3 d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1), q = p + d;
                if (std::abs(d.x) + std::abs(d.y) + std::abs(d.z) > reach ||
                    glm::any(glm::lessThan(q, glm::ivec3(0))) ||
                    glm::any(glm::greaterThanEqual(q, size)))
                    continue;
                const size_t to =
                    size_t(q.x) + size_t(size.x) * (size_t(q.y) + size_t(size.y) * size_t(q.z));
                if (!seen[to] && kind(values[to]) == kind(values[i])) {
                    seen[to] = true;
                    open.push_back(to);
                }
            }
        }
        out.push_back(std::move(piece));
    }
    std::stable_sort(out.begin(), out.end(), [](const Piece& a, const Piece& b) {
        return a.samples.size() > b.samples.size();
    });
    return out;
}

const glm::uvec3 kSizes[] = {{40, 9, 7}, {5, 34, 33}, {1, 30, 20}, {70, 1, 1}};

TEST(Components, AreThoseOfFloodsNumberedBySizeThenPosition) {
    uint64_t seed = 1;
    for (const glm::uvec3 size : kSizes)
        for (const Neighbours neighbours : kAll)
            for (const bool as_mask : {false, true}) {
                const Volume labels =
                    random_labels(make_grid(size, {1, 1, 1}), as_mask ? 5 : 3, 0.4, seed++);
                const Result<Components> found = connected_components(
                    labels, {.neighbours = neighbours, .as_mask = as_mask}, {});
                ASSERT_TRUE(found) << found.error().message;
                const std::vector<Piece> expected = flooded(labels, neighbours, [&](float label) {
                    return as_mask ? float(label != 0.0f) : label;
                });
                ASSERT_EQ(found->list.size(), expected.size());
                std::vector<float> numbers(sample_count(labels.grid()), 0.0f);
                for (size_t i = 0; i < expected.size(); ++i) {
                    EXPECT_EQ(found->list[i].count, expected[i].samples.size());
                    EXPECT_EQ(float(found->list[i].label), expected[i].label);
                    EXPECT_EQ(found->list[i].first, index_of(size, expected[i].samples[0]));
                    for (const size_t at : expected[i].samples)
                        numbers[at] = float(i + 1);
                }
                EXPECT_EQ(samples_of(found->numbers), numbers);
            }
}

TEST(Components, MoreThanALabelMapHoldsAreRefusedWithTheSizeThatHelps) {
    const Volume dots = make_volume(make_grid({160, 80, 42}, {1, 1, 1}), ScalarType::u8,
                                    [](glm::uvec3 i) { return (i.x + i.y + i.z) % 2 ? 1.0 : 0.0; });
    const Result<Components> found = connected_components(dots, {}, {});
    ASSERT_FALSE(found);
    EXPECT_NE(found.error().message.find("fewer than 2 samples"), std::string::npos);
    EXPECT_EQ(connected_components(dots, {.neighbours = Neighbours::edges}, {})->list.size(), 1u);
}

TEST(Islands, GoBySizeAndTheLargestStay) {
    const Volume labels = random_labels(make_grid({40, 12, 10}, {2, 2.5, 4}), 3, 0.5, 5);
    const auto kind = [](float label) { return label; };
    const std::vector<Piece> pieces = flooded(labels, Neighbours::corners, kind);
    const std::vector<float> before = samples_of(labels);
    for (const bool largest : {false, true}) {
        std::vector<float> expected = before;
        std::map<float, bool> seen;
        for (const Piece& piece : pieces) { // 20 mm3 a sample: 0.1 ml are five
            const bool goes = piece.samples.size() < 5 || (largest && seen[piece.label]);
            seen[piece.label] = true;
            for (const size_t at : piece.samples)
                expected[at] = goes ? 0.0f : expected[at];
        }
        const Result<Volume> found =
            remove_islands(labels, {.least_ml = 0.1, .largest_alone = largest}, {});
        EXPECT_EQ(samples_of(*found), expected);
        EXPECT_EQ(
            samples_of(*remove_islands(labels, {.least_count = 5, .largest_alone = largest}, {})),
            expected);
    }
}

TEST(Pieces, TheOneAtASampleStaysAlone) {
    for (const Neighbours neighbours : kAll) {
        const Volume labels = random_labels(make_grid({30, 12, 10}, {2, 2.5, 4}), 3, 0.6, 6);
        const std::vector<Piece> pieces =
            flooded(labels, neighbours, [](float label) { return label; });
        for (size_t n = 0; n < pieces.size(); n += 20) {
            std::vector<float> expected = samples_of(labels);
            for (const Piece& piece : pieces)
                for (const size_t at : piece.samples)
                    if (piece.label == pieces[n].label)
                        expected[at] = &piece == &pieces[n] ? piece.label : 0.0f;
            const glm::uvec3 at = index_of(labels.size(), pieces[n].samples.back());
            EXPECT_EQ(samples_of(*keep_piece(labels, {at, neighbours}, {})), expected);
        }
    }
    const Volume none = make_volume(make_grid({3, 3, 3}, {1, 1, 1}), ScalarType::u8,
                                    [](glm::uvec3) { return 0.0; });
    EXPECT_FALSE(keep_piece(none, {}, {}));
}

TEST(Pieces, SplitIntoFreeLabelsLargerOnesFirst) {
    for (const bool many : {false, true}) { // more than u8 holds
        const Volume labels =
            random_labels(make_grid({40, 12, 10}, {2, 2.5, 4}), 5, many ? 0.1 : 0.9, 17);
        const double least_ml = many ? 0.0 : 0.1; // 20 mm3 a sample: five
        std::vector<float> expected = samples_of(labels);
        float next = 1.0f;
        bool is_first = true;
        for (const Piece& piece :
             flooded(labels, Neighbours::faces, [](float label) { return label; })) {
            if (piece.label != 3.0f || std::exchange(is_first, false) ||
                (!many && piece.samples.size() < 5))
                continue;
            for (next = next == 1.0f ? 5.0f : next + 1.0f; const size_t at : piece.samples)
                expected[at] = next; // 1 .. 4 are there
        }
        EXPECT_EQ(next > 255.0f, many);
        const Result<Volume> found = split_pieces(
            labels, {.label = 3, .neighbours = Neighbours::faces, .least_ml = least_ml}, {});
        ASSERT_TRUE(found) << found.error().message;
        EXPECT_EQ(samples_of(*found), expected);
        EXPECT_EQ(found->type(), many ? ScalarType::u16 : ScalarType::u8);
    }
}

// Neither one that is there nor one that no sample has.
TEST(Pieces, ALockedLabelIsNotGiven) {
    const Volume labels = make_volume(make_grid({7, 1, 1}, {1, 1, 1}), ScalarType::u8,
                                      [](glm::uvec3 i) { return i.x % 2 ? 0.0 : 1.0; });
    const uint16_t locked[] = {2, 4};
    const Result<Volume> found = split_pieces(labels, {.label = 1, .locked = locked}, {});
    ASSERT_TRUE(found);
    EXPECT_EQ(samples_of(*found), (std::vector<float>{1, 0, 3, 0, 5, 0, 6}));
}

TEST(Holes, GetTheLabelThatSharesMostFacesWithThem) {
    uint64_t seed = 30;
    for (const Neighbours background : kAll) {
        const Volume labels = random_labels(make_grid({24, 14, 12}, {1, 1, 1}), 8, 0.3, seed++);
        const std::vector<float> before = samples_of(labels);
        std::vector<float> expected = before;
        const glm::ivec3 size(labels.size());
        size_t filled = 0;
        for (const Piece& hole :
             flooded(labels, background, [](float label) { return float(label == 0.0f); })) {
            bool open = false;
            std::map<float, int> faces;
            for (const size_t at : hole.samples) {
                const glm::ivec3 p(index_of(labels.size(), at));
                for (int n = 0; n < 6; ++n) {
                    glm::ivec3 q = p;
                    q[n / 2] += n % 2 ? 1 : -1;
                    if (q[n / 2] < 0 || q[n / 2] >= size[n / 2])
                        open = true;
                    else if (const float other = labels.value(glm::uvec3(q)); other != 0.0f)
                        ++faces[other];
                }
            }
            float best = 0.0f;
            for (const auto& [label, count] : faces)
                if (best == 0.0f || count > faces[best])
                    best = label;
            for (const size_t at : hole.samples)
                expected[at] = open ? 0.0f : best;
            filled += !open;
        }
        EXPECT_GT(filled, 5u);
        EXPECT_EQ(samples_of(*fill_holes(labels, {.background = background}, {})), expected);
    }
}

TEST(SmoothLabels, IsTheLargestSmoothedIndicatorOfAll) {
    const glm::dvec3 spacing(0.5, 1.0, 2.0);
    const Volume labels = random_labels(make_grid({40, 9, 36}, spacing), 5, 0.7, 8);
    const double sigma = 1.3;
    const Result<Volume> found = // of 0 .. 3
        smooth_labels(labels, {.sigma_mm = sigma, .keeps_volumes = false, .locked = {4}}, {});
    ASSERT_TRUE(found) << found.error().message;
    const glm::ivec3 last = glm::ivec3(labels.size()) - 1;
    const glm::ivec3 reach(glm::ceil(3.0 * sigma / spacing));
    size_t compared = 0;
    for (size_t i = 0; i < sample_count(labels.grid()); i += 7) {
        const glm::ivec3 p(index_of(labels.size(), i));
        if (labels.value(glm::uvec3(p)) == 4.0f) {
            ASSERT_EQ(found->value(glm::uvec3(p)), 4.0f);
            continue;
        }
        double votes[5] = {};
        for (int z = -reach.z; z <= reach.z; ++z)
            for (int y = -reach.y; y <= reach.y; ++y)
                for (int x = -reach.x; x <= reach.x; ++x) {
                    const glm::dvec3 mm = glm::dvec3(x, y, z) * spacing;
                    const glm::ivec3 q = glm::clamp(p + glm::ivec3(x, y, z), glm::ivec3(0), last);
                    votes[int(labels.value(glm::uvec3(q)))] +=
                        std::exp(-0.5 * glm::dot(mm, mm) / (sigma * sigma));
                }
        const auto best = std::max_element(votes, votes + 4) - votes;
        double second = 0.0, sum = 0.0;
        for (int k = 0; k < 4; ++k) {
            second = k == best ? second : std::max(second, votes[k]);
            sum += votes[k];
        }
        if (votes[best] - second < 1e-5 * sum)
            continue; // nearly equal: floats decide
        ++compared;
        ASSERT_EQ(found->value(glm::uvec3(p)), float(best)) << i;
    }
    EXPECT_GT(compared, 1200u); // a fifth has the locked label
}

// Two halves of balls that a Gaussian of a fifth to a third of their radius would make smaller by
// 0.4 to 9 %, each within a sample or 0.5 %.
TEST(SmoothLabels, KeepsVolumes) {
    const Grid grid = make_grid({40, 40, 30}, {0.9, 1.0, 1.3}, {-17.6, -19.5, -18.9});
    for (const auto& [radius_mm, sigma_mm] :
         {std::pair(6.0, 1.0), std::pair(10.0, 2.0), std::pair(14.0, 1.0), std::pair(14.0, 3.0)}) {
        const Volume labels = make_volume(grid, ScalarType::u8, [&, r = radius_mm](glm::uvec3 i) {
            const glm::dvec3 p = world_point(grid, glm::dvec3(i));
            return glm::length(p) > r ? 0.0 : p.x + 0.3 * p.y > 0.0 ? 1.0 : 2.0;
        });
        const Result<Volume> smooth = smooth_labels(labels, {.sigma_mm = sigma_mm}, {});
        ASSERT_TRUE(smooth) << smooth.error().message;
        double before[3] = {}, after[3] = {};
        for (size_t i = 0; i < sample_count(grid); ++i) {
            ++before[int(labels.value(index_of(labels.size(), i)))];
            ++after[int(smooth->value(index_of(labels.size(), i)))];
        }
        for (int label = 1; label < 3; ++label)
            EXPECT_NEAR(after[label], before[label], std::max(1.0, 0.005 * before[label]))
                << radius_mm << " " << sigma_mm;
    }
}

TEST(SmoothLabels, KeepsFlatWallsAndRefusesWideKernels) {
    const Volume walls =
        make_volume(make_grid({40, 40, 4}, {1, 1, 1}), ScalarType::u16, [](glm::uvec3 i) {
            return i.x < 20 ? 700.0 : i.y < 13 ? 3.0 : 0.0;
        });
    const Result<Volume> found = smooth_labels(walls, {.sigma_mm = 1.0}, {});
    EXPECT_EQ(found->type(), ScalarType::u16);
    for (uint32_t x = 0; x < 40; ++x)
        if (x < 14 || x > 25) {
            EXPECT_EQ(found->value({x, 5, 2}), walls.value({x, 5, 2}));
        }
    EXPECT_FALSE(smooth_labels(walls, {.sigma_mm = 9.0}, {}));
    EXPECT_FALSE(smooth_labels(walls, {.sigma_mm = 0.0}, {}));
}

} // namespace
} // namespace palpate
