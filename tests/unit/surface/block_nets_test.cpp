// Walls between labels kept block by block: those of the whole map at once, from scratch and after
// edits, with normals to shade them.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include "engine/mesh/label_surfaces.h"
#include "engine/mesh/topology.h"
#include "engine/surface/block_nets.h"
#include "engine/surface/net_normals.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate {
namespace {

// Balls of labels over one another, up to the border, and, where wanted, noise in a corner: every
// kind of cell.
Volume some_labels(glm::uvec3 size, uint32_t seed, uint32_t labels, bool noise,
                   ScalarType type = ScalarType::u8) {
    std::mt19937 random(seed);
    std::vector<uint16_t> values(size_t{size.x} * size.y * size.z, 0);
    for (uint32_t n = 0; n < 24; ++n) {
        const glm::dvec3 center(random() % size.x, random() % size.y, random() % size.z);
        const double radius = 1.0 + random() % 10;
        const auto label = static_cast<uint16_t>(random() % labels);
        for (uint32_t i = 0; i < values.size(); ++i) {
            const glm::dvec3 at(i % size.x, i / size.x % size.y, i / (size.x * size.y));
            const bool in_corner = noise && at.x + at.y + at.z < 20.0;
            if (in_corner)
                values[i] = static_cast<uint16_t>(random() % labels);
            else if (glm::length(at - center) < radius)
                values[i] = label;
        }
    }
    return make_volume(make_grid(size, {0.5, 0.75, 2.0}, {-5, 7, 100}), type, [&](glm::uvec3 i) {
        return values[i.x + size.x * (i.y + size_t{size.y} * i.z)];
    });
}

// A triangle by the places of its corners in their order, its labels, and, where wanted, the
// normals there. -0 equals 0.
using Triangle = std::array<float, 20>;
Triangle triangle_of(const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>* normals,
                     glm::uvec3 corners, uint32_t label, uint32_t outer) {
    Triangle one{};
    for (int corner = 0; corner < 3; ++corner)
        for (int axis = 0; axis < 3; ++axis) {
            one[3 * corner + axis] = positions[corners[corner]][axis] + 0.0f;
            if (normals)
                one[11 + 3 * corner + axis] = (*normals)[corners[corner]][axis] + 0.0f;
        }
    one[9] = static_cast<float>(label);
    one[10] = static_cast<float>(outer);
    return one;
}

std::vector<Triangle> sorted_triangles(const Mesh& mesh) {
    std::vector<Triangle> all;
    for (size_t i = 0; i < mesh.triangles.size(); ++i)
        all.push_back(triangle_of(mesh.positions, nullptr, mesh.triangles[i], mesh.labels[i],
                                  mesh.outer_labels[i]));
    std::ranges::sort(all);
    return all;
}

std::vector<Triangle> sorted_triangles(const BlockNets& nets, bool normals) {
    std::vector<Triangle> all;
    for (uint32_t number = 0; number < nets.block_count(); ++number) {
        const BlockNets::Block& block = nets.block(number);
        for (size_t i = 0; i < block.triangles.size(); ++i)
            all.push_back(triangle_of(block.positions, normals ? &block.normals : nullptr,
                                      block.triangles[i], block.labels[i] & 0xffff,
                                      block.labels[i] >> 16));
    }
    std::ranges::sort(all);
    return all;
}

Mesh whole(const Volume& labels, const BlockNetsOptions& options) {
    return surface_nets(labels, {.rounds = options.rounds, .bound = options.bound, .stop = {}});
}

TEST(BlockNets, HaveTheTrianglesOfTheWholeMap) {
    uint32_t seed = 0;
    for (const glm::uvec3 size :
         {glm::uvec3(40, 33, 21), glm::uvec3(8, 16, 7), glm::uvec3(1, 20, 5), glm::uvec3(1, 1, 1)})
        for (const bool noise : {false, true}) {
            const Volume labels = some_labels(size, ++seed, 5, noise);
            const BlockNetsOptions options{.rounds = seed % 3};
            const BlockNets nets(labels, options);
            ASSERT_EQ(sorted_triangles(nets, false), sorted_triangles(whole(labels, options)));
        }
}

// Boxes and balls of labels, some of them two at once and far apart; the labels become wider, too.
TEST(BlockNets, AfterEditsTheyAreThoseFromScratch) {
    for (const BlockNetsOptions options : {BlockNetsOptions{},
                                           {.rounds = 0, .normal_rounds = 0},
                                           {.rounds = 2, .normal_rounds = 2}}) {
        Volume labels = some_labels({71, 50, 60}, 7, 4, true);
        BlockNets nets(labels, options);
        std::mt19937 random(3);
        for (int i = 0; i < 6; ++i) {
            SCOPED_TRACE(i);
            VolumeEdit edit(labels);
            const glm::uvec3 size = labels.size();
            for (int place = 0; place <= i % 2; ++place) {
                const glm::uvec3 low(random() % size.x, random() % size.y, random() % size.z);
                const glm::uvec3 high = glm::min(low + 1u + uint32_t(random() % 9), size);
                for (uint32_t z = low.z; z < high.z; ++z)
                    for (uint32_t y = low.y; y < high.y; ++y)
                        for (uint32_t x = low.x; x < high.x; ++x)
                            edit.set({x, y, z}, i == 2 ? double(random() % 4) : double(i % 4));
            }
            labels = edit.commit();
            const size_t made = nets.update(labels).size();
            if (options.rounds < 1) {
                EXPECT_LT(made, nets.block_count());
            }
            ASSERT_EQ(sorted_triangles(nets, false), sorted_triangles(whole(labels, options)));
            ASSERT_EQ(sorted_triangles(nets, true),
                      sorted_triangles(BlockNets(labels, options), true));
        }
        EXPECT_TRUE(nets.update(labels).empty());
        const Volume wider = some_labels(labels.size(), 9, 900, false, ScalarType::u16);
        EXPECT_FALSE(nets.update(wider).empty());
        ASSERT_EQ(sorted_triangles(nets, true), sorted_triangles(BlockNets(wider, options), true));
    }
}

// The surface of each label is closed, whatever the bound: what the window shows can be cut.
TEST(BlockNets, EachLabelIsClosed) {
    const Volume labels = some_labels({40, 33, 41}, 5, 4, true);
    for_each_label(whole(labels, {}), [](uint16_t label, const Mesh& surface) {
        if (label == 0)
            return;
        const MeshTopology found = topology(surface);
        EXPECT_TRUE(found.closed) << label;
        EXPECT_TRUE(found.consistently_oriented) << label;
    });
}

// A ball's normals are those of the sphere. The samples of a ball of radius r lie within half a
// diagonal of a sample of it, and the vertices within one sample more on each axis: 1.4 of r = 15.
// Over a patch of normal_rounds + 1 = 4 samples about a vertex such errors turn a plane by at most
// atan(2 * 1.4 / 8) = 19 degrees, and the sphere itself bends away from the plane on all sides
// alike. The mean is much nearer.
TEST(BlockNets, NormalsOfABallPointOutward) {
    const glm::dvec3 middle(20.0);
    const double radius = 15.0;
    const Volume labels = make_volume(
        make_grid(glm::uvec3(41), glm::dvec3(1.0)), ScalarType::u8,
        [&](glm::uvec3 i) { return glm::length(glm::dvec3(i) - middle) < radius ? 3.0 : 0.0; });
    const BlockNets nets(labels);
    double worst = 1.0, sum = 0.0;
    size_t count = 0;
    for (uint32_t number = 0; number < nets.block_count(); ++number)
        for (size_t v = 0; v < nets.block(number).positions.size(); ++v) {
            const glm::dvec3 out =
                glm::normalize(glm::dvec3(nets.block(number).positions[v]) - middle);
            const double cosine = glm::dot(out, glm::dvec3(nets.block(number).normals[v]));
            worst = std::min(worst, cosine);
            sum += cosine;
            ++count;
        }
    ASSERT_GT(count, 1000u);
    EXPECT_GT(worst, std::cos(glm::radians(19.0)));
    std::printf("    normals within %.1f degrees, mean cosine %.5f\n",
                glm::degrees(std::acos(worst)), sum / static_cast<double>(count));
}

// No one normal exists where three labels meet.
TEST(BlockNets, LinesWhereWallsMeetHaveNoNormal) {
    const Volume labels =
        make_volume(make_grid({16, 16, 16}, glm::dvec3(1.0)), ScalarType::u8, [](glm::uvec3 i) {
            return i.z < 8 ? 1.0 : i.x < 8 ? 2.0 : 3.0;
        });
    Mesh mesh = whole(labels, {});
    const std::vector<glm::vec3> normals = wall_normals(mesh, 4);
    std::vector<std::map<uint32_t, int>> pairs(mesh.positions.size());
    for (size_t n = 0; n < mesh.triangles.size(); ++n)
        for (int corner = 0; corner < 3; ++corner)
            ++pairs[mesh.triangles[n][corner]]
                   [uint32_t{mesh.labels[n]} | uint32_t{mesh.outer_labels[n]} << 16];
    size_t without = 0;
    for (size_t v = 0; v < normals.size(); ++v) {
        EXPECT_NEAR(glm::length(normals[v]), pairs[v].size() == 1 ? 1.0 : 0.0, 1e-6);
        without += pairs[v].size() > 1;
    }
    EXPECT_GT(without, 16u);
}

} // namespace
} // namespace palpate
