// Walls between labels that compute passes make, against those of the CPU: the same triangles, to
// the bit.

#include <algorithm>
#include <random>

#include "engine/surface_gpu/gpu_nets.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

class GpuNetsTest : public GpuTest {
 protected:
    static NetPipelines& pipelines() { // compiled once
        static auto& kept = KeptForTests<NetPipelines>::make(
            [] { return std::make_unique<NetPipelines>(device()); });
        return kept.get();
    }
    static GpuNets nets(const Volume& labels, const SurfaceNetsOptions& options) {
        Result<GpuNets> made = GpuNets::make(pipelines(), labels, options);
        EXPECT_TRUE(made) << made.error().message;
        return std::move(*made);
    }
};

// Every sample drawn by chance, or balls of labels over one another.
Volume random_labels(glm::uvec3 size, uint32_t seed, uint32_t labels, bool balls,
                     ScalarType type = ScalarType::u16) {
    std::mt19937 random(seed);
    std::vector<uint16_t> values(size_t{size.x} * size.y * size.z, 0);
    const auto at = [&](glm::uvec3 i) -> uint16_t& {
        return values[i.x + size.x * (i.y + size_t{size.y} * i.z)];
    };
    if (!balls)
        for (uint16_t& v : values)
            v = static_cast<uint16_t>(random() % labels);
    for (uint32_t n = 0; balls && n < 30; ++n) {
        const glm::dvec3 center(random() % size.x, random() % size.y, random() % size.z);
        const double radius = 1.0 + random() % 9;
        const auto label = static_cast<uint16_t>(random() % labels);
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    if (glm::length(glm::dvec3(x, y, z) - center) < radius)
                        at({x, y, z}) = label;
    }
    return make_volume(make_grid(size, {0.5, 0.75, 2.0}, {-5, 7, 100}), type,
                       [&](glm::uvec3 i) { return at(i); });
}

// A triangle by the places of its corners, in their order, and its labels. -0 equals 0.
using Triangle = std::array<float, 11>;
std::vector<Triangle> sorted_triangles(const Mesh& mesh) {
    std::vector<Triangle> all;
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
        Triangle one{};
        for (int corner = 0; corner < 3; ++corner)
            for (int axis = 0; axis < 3; ++axis)
                one[3 * corner + axis] = mesh.positions[mesh.triangles[i][corner]][axis] + 0.0f;
        one[9] = mesh.labels[i];
        one[10] = mesh.outer_labels[i];
        all.push_back(one);
    }
    std::ranges::sort(all);
    return all;
}

void expect_same(GpuNets& mine, const SurfaceNetsOptions& options) {
    const Mesh expected = surface_nets(mine.labels(), options), found = mine.mesh();
    EXPECT_EQ(mine.triangles(), expected.triangles.size());
    EXPECT_EQ(found.positions.size(), expected.positions.size());
    EXPECT_EQ(found.world_from_mesh, expected.world_from_mesh);
    ASSERT_EQ(sorted_triangles(found), sorted_triangles(expected));
}

// Noise of few labels has every kind of cell: split faces, lines, points where four labels meet.
TEST_F(GpuNetsTest, EqualTheCpuForAnyLabels) {
    uint32_t seed = 1;
    for (const glm::uvec3 size :
         {glm::uvec3(19, 17, 9), glm::uvec3(8, 16, 7), glm::uvec3(1, 20, 5), glm::uvec3(33, 1, 1),
          glm::uvec3(1, 1, 1), glm::uvec3(24, 17, 20)})
        for (const uint32_t labels : {2u, 3u, 300u})
            for (const bool balls : {false, true}) {
                const uint32_t passes = ++seed % 3;
                SCOPED_TRACE(::testing::Message()
                             << size.x << " " << size.y << " " << size.z << ", " << labels
                             << " labels, balls " << balls << ", passes " << passes);
                const auto type = labels < 256 && balls ? ScalarType::u8 : ScalarType::u16;
                const SurfaceNetsOptions options{.passes = passes};
                GpuNets mine = nets(random_labels(size, seed, labels, balls, type), options);
                expect_same(mine, options);
                if (HasFatalFailure())
                    return;
            }
}

TEST_F(GpuNetsTest, SmoothingIsThatOfTheCpuToTheBit) {
    for (const bool balls : {false, true})
        for (const double bound : {0.375, 0.1}) {
            const SurfaceNetsOptions options{.passes = 10, .bound = bound};
            GpuNets mine = nets(random_labels({27, 23, 18}, 5, 5, balls), options);
            ASSERT_GT(mine.triangles(), 1000u);
            expect_same(mine, options);
        }
}

TEST_F(GpuNetsTest, NoLabelsAreNoWalls) {
    const Volume none = make_volume(make_grid({20, 9, 8}, glm::dvec3(1.0)), ScalarType::u8,
                                    [](glm::uvec3) { return 0.0; });
    GpuNets mine = nets(none, {});
    EXPECT_EQ(mine.triangles(), 0u);
    EXPECT_TRUE(mine.mesh().triangles.empty());
}

// Labels set in boxes here and there, at borders too; also so many that the room for walls does not
// suffice.
TEST_F(GpuNetsTest, AfterEditsTheyAreThoseFromScratch) {
    for (const uint32_t passes : {0u, 2u}) {
        const SurfaceNetsOptions options{.passes = passes};
        Volume volume = random_labels({60, 41, 41}, 9, 4, true, ScalarType::u8);
        GpuNets mine = nets(volume, options);
        const size_t all = 8 * 6 * 6; // blocks
        std::mt19937 random(3);
        for (int i = 0; i < 4; ++i) {
            SCOPED_TRACE(i);
            VolumeEdit edit(volume);
            const glm::uvec3 size = volume.size();
            const glm::uvec3 low(random() % size.x, random() % size.y, random() % size.z);
            const glm::uvec3 high = glm::min(low + 1u + uint32_t(random() % 9), size);
            for (uint32_t z = low.z; z < high.z; ++z)
                for (uint32_t y = low.y; y < high.y; ++y)
                    for (uint32_t x = low.x; x < high.x; ++x)
                        edit.set({x, y, z}, i % 2 ? double(random() % 4) : double(i % 4));
            volume = edit.commit();
            const Result<size_t> made = mine.update(volume);
            ASSERT_TRUE(made) << made.error().message;
            EXPECT_LT(*made, all);
            expect_same(mine, options);
            if (HasFatalFailure())
                return;
        }
        ASSERT_TRUE(mine.update(random_labels(volume.size(), 11, 4, false, ScalarType::u8)));
        expect_same(mine, options);
    }
}

} // namespace
} // namespace palpate
