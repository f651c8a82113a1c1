// The surface that compute passes extract against that of the CPU, block by block and byte by byte.

#include <algorithm>
#include <random>
#include <set>

#include "apps/palpate/surface_device.h"
#include "engine/gpu/error.h"
#include "engine/surface/block_surface.h"
#include "engine/surface_gpu/gpu_surface.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/unit/surface/random_edits.h"

namespace palpate {
namespace {

using testing::noise_volume;
using testing::random_edit;

class GpuExtraction : public GpuTest {
 protected:
    static ExtractPipelines& pipelines() { // compiled once
        static auto& kept = KeptForTests<ExtractPipelines>::make(
            [] { return std::make_unique<ExtractPipelines>(device()); });
        return kept.get();
    }
};

// -0 counts as 0: devices need not keep the sign of a product that is 0.
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
    return a == b;
}

void expect_same_block(const BlockMesh& mine, const BlockMesh& theirs) {
    ASSERT_TRUE(same(mine.positions, theirs.positions));
    ASSERT_TRUE(same(mine.normals, theirs.normals));
    ASSERT_TRUE(same(mine.triangles, theirs.triangles));
    ASSERT_EQ(mine.edges, theirs.edges);
    ASSERT_EQ(mine.own_edges, theirs.own_edges);
    ASSERT_EQ(mine.inner, 0u);
}

// All that the GPU holds is what the CPU's blocks hold.
void expect_same(GpuSurface& mine, const BlockSurface& theirs, GpuDevice& device) {
    const std::vector<glm::ivec3> blocks = mine.blocks();
    ASSERT_EQ(blocks, theirs.blocks());
    ASSERT_EQ(mine.triangles(), theirs.triangles());
    const std::vector<BlockMesh> meshes = mine.read_back();
    for (size_t i = 0; i < blocks.size(); ++i) {
        expect_same_block(meshes[i], *theirs.block(blocks[i]));
        if (::testing::Test::HasFatalFailure())
            return;
    }
    const Mesh a = mine.mesh(), b = theirs.mesh();
    ASSERT_TRUE(same(a.positions, b.positions));
    ASSERT_TRUE(same(a.normals, b.normals));
    ASSERT_TRUE(same(a.triangles, b.triangles));
    EXPECT_EQ(a.world_from_mesh, b.world_from_mesh);

    // Triangles that no block holds are (0, 0, 0), so that only these triangles are drawn.
    uint64_t held = 0;
    for (SurfacePool::Arena& arena : mine.pool().arenas()) {
        Buffer copy(device, "triangles to read", arena.triangles.bytes(), Memory::read_back);
        Commands commands(device);
        commands.copy(arena.triangles, copy);
        commands.submit();
        commands.finish();
        const std::span all(reinterpret_cast<const glm::uvec3*>(copy.mapped().data()),
                            copy.bytes() / sizeof(glm::uvec3));
        for (size_t i = 0; i < all.size(); ++i) {
            if (all[i] == glm::uvec3(0))
                continue;
            ++held;
            ASSERT_LT(i, arena.end);
        }
    }
    EXPECT_EQ(held, mine.triangles());
}

void expect_twin(ExtractPipelines& pipelines, const Volume& volume, float iso,
                 const SurfaceOptions& options, bool may_be_empty = false) {
    GpuSurface mine(pipelines, volume, iso, options);
    const BlockSurface theirs(volume, iso, options);
    if (!may_be_empty) {
        EXPECT_GT(theirs.triangles(), 0u);
    }
    expect_same(mine, theirs, pipelines.device());
}

TEST_F(GpuExtraction, EqualsTheCpuForEveryTypeAndOption) {
    uint64_t seed = 1;
    for (const ScalarType type :
         {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::f32})
        for (const SurfaceNormals normals : {SurfaceNormals::gradient, SurfaceNormals::none})
            for (const bool closed : {false, true}) {
                SCOPED_TRACE(::testing::Message()
                             << name_of(type) << " normals " << static_cast<int>(normals)
                             << " closed " << closed);
                // Whole numbers, of which many equal iso; then an iso between.
                const Volume volume = noise_volume({37, 20, 18}, type, 7, ++seed);
                const SurfaceOptions options{SurfaceTopology::classic, normals, closed};
                expect_twin(pipelines(), volume, 3.0f, options);
                expect_twin(pipelines(), volume, 3.5f, options);
            }
}

// 66 x 9 x 10 = 5940 blocks: the prefix sum over groups of 64 takes 64 groups a turn, 4096 blocks,
// and so a second. Found blocks lie in both, and full and empty ones among them. Small whole
// numbers have slopes that cancel between two samples.
TEST_F(GpuExtraction, EqualsTheCpuWhereThePrefixSumTakesASecondTurn) {
    const Volume volume =
        make_volume(make_grid({521, 65, 73}, glm::dvec3(1)), ScalarType::u8, [](glm::uvec3 i) {
            const glm::uvec3 cell = i / 24u;
            const bool noisy = (cell.x + cell.y + cell.z) % 4 == 0;
            return noisy ? std::floor(8.0 * std::abs(synthetic::noise(i, 11))) : 0.0;
        });
    expect_twin(pipelines(), volume, 3.0f, {});
}

TEST_F(GpuExtraction, NormalsOfTrianglesAreThoseOfTheCpu) {
    const Volume volume = noise_volume({20, 19, 18}, ScalarType::f32, 5, 77);
    const SurfaceOptions options{.normals = SurfaceNormals::triangles};
    GpuSurface mine(pipelines(), volume, 2.0f, options);
    testing::expect_same_bytes(mine.mesh(), marching_cubes(volume, 2.0f, options));
}

// Floats with all their digits: quotients and roots that round.
TEST_F(GpuExtraction, EqualsTheCpuOnSmoothFieldsAndSignedOnes) {
    const Grid grid = make_grid({45, 33, 29}, {0.7, 0.9, 1.3}, {-15.0, -14.0, -18.0});
    expect_twin(pipelines(), synthetic::sample(synthetic::gyroid(17.0), grid, ScalarType::f32),
                0.0f, {});
    expect_twin(
        pipelines(),
        synthetic::sample(synthetic::sphere_distance(glm::dvec3(0.3), 9.1), grid, ScalarType::f32),
        -0.37f, {.closed_at_border = true});
    const Volume noise = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        return 1e3 * synthetic::noise(i, 5) + 1e-3 * synthetic::noise(i, 6);
    });
    expect_twin(pipelines(), noise, 17.3f, {});
}

TEST_F(GpuExtraction, GapsAreOutsideAndWalledOff) {
    const Volume volume =
        make_volume(make_grid({26, 21, 17}, {0.5, 0.5, 3.0}), ScalarType::f32, [](glm::uvec3 i) {
            return synthetic::noise(i, 3) > 0.8 ? std::numeric_limits<double>::quiet_NaN()
                                                : std::floor(4.0 * synthetic::noise(i, 4));
        });
    ASSERT_GT(volume.no_data_count(), 100u);
    for (const bool closed : {false, true})
        for (const SurfaceNormals normals : {SurfaceNormals::gradient, SurfaceNormals::none})
            expect_twin(pipelines(), volume, 0.0f, {{}, normals, closed});
}

// All samples missing, flat fields, and iso-values that nothing and everything reaches.
TEST_F(GpuExtraction, NothingToExtractIsNothing) {
    const Grid grid = make_grid({19, 17, 9}, glm::dvec3(1.0));
    const auto constant = [&](double value) {
        return make_volume(grid, ScalarType::f32, [=](glm::uvec3) { return value; });
    };
    const float inf = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const bool closed : {false, true}) {
        const SurfaceOptions options{.closed_at_border = closed};
        const auto expect_empty_or_box = [&](const Volume& volume, float iso) {
            expect_twin(pipelines(), volume, iso, options, true);
        };
        expect_empty_or_box(constant(nan), 0.0f);
        expect_empty_or_box(constant(2.0), 2.0f);
        for (const float iso : {2.5f, -inf, inf, nan})
            expect_empty_or_box(constant(2.0), iso);
        const Volume noise = noise_volume({19, 17, 9}, ScalarType::i16, 5, 2);
        for (const float iso : {-1e30f, 1e30f, -inf, inf, nan})
            expect_empty_or_box(noise, iso);
    }
}

TEST_F(GpuExtraction, OneVoxelAndSizesOfOne) {
    for (const glm::uvec3 at : {glm::uvec3(8, 8, 8), glm::uvec3(7, 15, 0), glm::uvec3(3, 4, 5)}) {
        const Volume volume =
            make_volume(make_grid(glm::uvec3(17), {0.5, 0.5, 3.0}), ScalarType::u8,
                        [=](glm::uvec3 i) { return i == at ? 10.0 : 0.0; });
        expect_twin(pipelines(), volume, 5.0f, {});
        expect_twin(pipelines(), volume, 10.0f, {.closed_at_border = true});
    }
    for (const glm::uvec3 size : {glm::uvec3(1, 20, 9), glm::uvec3(11, 1, 17), glm::uvec3(8, 16, 1),
                                  glm::uvec3(1, 1, 1), glm::uvec3(8), glm::uvec3(9)})
        for (const bool closed : {false, true})
            expect_twin(pipelines(), noise_volume(size, ScalarType::f32, 5, 8), 2.0f,
                        {.closed_at_border = closed}, true);
}

// Zeros of both signs, and numbers that a device may take for zero: the same samples are inside, so
// cells and triangles are the same. Where ends differ by less than 2^-126 vertices may lie
// elsewhere on their edges, and gradients may count as none.
TEST_F(GpuExtraction, TinyValuesChangeNoTriangle) {
    constexpr std::array<double, 8> kValues{0.0,    -0.0,    1e-44,    -1e-44,
                                            -1e-39, 1.2e-38, -1.2e-38, 3e-41};
    const Grid grid = make_grid({21, 18, 19}, glm::dvec3(1.0));
    const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        return kValues[static_cast<size_t>(std::abs(synthetic::noise(i, 9)) * 1e6) % 8];
    });
    for (const float iso : {0.0f, -0.0f, 1e-44f, -1e-39f}) {
        GpuSurface mine(pipelines(), volume, iso);
        const Mesh a = mine.mesh(), b = marching_cubes(volume, iso);
        ASSERT_GT(b.triangles.size(), 1000u);
        EXPECT_EQ(a.triangles, b.triangles);
        ASSERT_EQ(a.positions.size(), b.positions.size());
        for (size_t i = 0; i < a.positions.size(); ++i)
            ASSERT_LT(glm::length(a.positions[i] - b.positions[i]), 1.0f);
        for (const glm::vec3 n : a.normals)
            ASSERT_NEAR(glm::length(n), 1.0f, 1e-6f);
    }
}

// Slopes whose square is beyond floats: normals within 2^-20 of those that the CPU finds in
// doubles, unless slopes cancel, and a field without curvature has none that do.
TEST_F(GpuExtraction, NormalsOfVerySmallAndLargeSlopes) {
    for (const double slope : {1e-20, 3e-25, 1e18, 4e30}) {
        const Volume volume =
            make_volume(make_grid({18, 19, 20}, {0.5, 0.7, 1.1}), ScalarType::f32,
                        [=](glm::uvec3 i) { return slope * (i.x + 2.0 * i.y - 0.7 * i.z - 20.3); });
        GpuSurface mine(pipelines(), volume, 0.0f);
        const Mesh a = mine.mesh(), b = marching_cubes(volume, 0.0f);
        ASSERT_GT(b.triangles.size(), 100u);
        EXPECT_EQ(a.triangles, b.triangles);
        EXPECT_EQ(a.positions, b.positions);
        ASSERT_EQ(a.normals.size(), b.normals.size());
        for (size_t i = 0; i < a.normals.size(); ++i)
            ASSERT_LT(glm::length(a.normals[i] - b.normals[i]), 0x1p-20f) << slope;
    }
}

TEST_F(GpuExtraction, AnotherIsoIsExtractedAfresh) {
    const Volume volume = noise_volume({40, 30, 20}, ScalarType::i16, 9, 4);
    GpuSurface mine(pipelines(), volume, 2.0f);
    for (const float iso : {5.5f, 100.0f, 4.0f}) {
        mine.set_iso(iso);
        expect_same(mine, BlockSurface(volume, iso), device());
    }
}

TEST_F(GpuExtraction, IncrementalEqualsFullAfterRandomEdits) {
    std::mt19937 random(11);
    for (int run = 0; run < 4; ++run) {
        const SurfaceOptions options{
            {}, run == 1 ? SurfaceNormals::none : SurfaceNormals::gradient, run == 2};
        const glm::uvec3 size(20 + random() % 40, 20 + random() % 20, 20 + random() % 20);
        Volume volume =
            noise_volume(size, run % 2 == 0 ? ScalarType::f32 : ScalarType::i16, 9, random());
        GpuSurface mine(pipelines(), volume, 4.0f, options);
        BlockSurface theirs(volume, 4.0f, options);
        for (int edit = 0; edit < 6; ++edit) {
            SCOPED_TRACE(::testing::Message() << "run " << run << " edit " << edit);
            volume = random_edit(volume, random, 9.0);
            const GpuSurface::Update a = mine.update(volume);
            const BlockSurface::Update b = theirs.update(volume);
            EXPECT_EQ(a.blocks, b.blocks);
            EXPECT_EQ(a.triangles, b.triangles);
            expect_same(mine, theirs, device());
            if (HasFatalFailure())
                return;
        }
        GpuSurface afresh(pipelines(), volume, 4.0f, options);
        testing::expect_same_bytes(mine.mesh(), afresh.mesh());
    }
}

// The blocks that are made again are those that read a changed sample, by going over all; the
// ranges of all others stay where they were, and no two overlap.
TEST_F(GpuExtraction, MakesAgainTheBlocksThatReadAChangedSampleAndNoOthers) {
    const Volume volume = noise_volume({70, 40, 35}, ScalarType::i16, 9, 4);
    GpuSurface surface(pipelines(), volume, 4.0f);
    std::mt19937 random(3);
    size_t single = 0;
    for (int edit = 0; edit < 12; ++edit) {
        const glm::ivec3 at(random() % 70, random() % 40, random() % 35);
        VolumeEdit change(surface.volume());
        change.set(glm::uvec3(at), change.value(glm::uvec3(at)) + 3.0);
        std::vector<std::pair<glm::ivec3, PoolRange>> before;
        for (const glm::ivec3 b : surface.blocks())
            before.emplace_back(b, *surface.range(b));
        std::set<std::array<int, 3>> expected, found;
        for (int z = 0; z < 5; ++z)
            for (int y = 0; y < 5; ++y)
                for (int x = 0; x < 9; ++x) {
                    const glm::ivec3 low = 8 * glm::ivec3(x, y, z) - 1, high = low + 10;
                    if (glm::all(glm::greaterThanEqual(at, low)) &&
                        glm::all(glm::lessThanEqual(at, high)))
                        expected.insert({z, y, x});
                }
        for (const glm::ivec3 b : surface.update(change.commit()).blocks)
            found.insert({b.z, b.y, b.x});
        EXPECT_EQ(found, expected);
        single += expected.size() == 1;
        for (const auto& [b, range] : before)
            if (!expected.contains({b.z, b.y, b.x})) {
                ASSERT_NE(surface.range(b), nullptr);
                EXPECT_EQ(surface.range(b)->first_vertex, range.first_vertex);
                EXPECT_EQ(surface.range(b)->first_triangle, range.first_triangle);
            }
    }
    EXPECT_GT(single, 0u);
    std::set<std::array<uint32_t, 3>> vertices, triangles; // arena, first, end
    for (const glm::ivec3 b : surface.blocks()) {
        const PoolRange& r = *surface.range(b);
        vertices.insert({r.arena, r.first_vertex, r.first_vertex + r.vertices});
        triangles.insert({r.arena, r.first_triangle, r.first_triangle + r.triangles});
    }
    for (const auto* ranges : {&vertices, &triangles})
        for (auto i = ranges->begin(), next = std::next(i); next != ranges->end(); i = next++)
            if ((*i)[0] == (*next)[0]) {
                EXPECT_LE((*i)[2], (*next)[1]);
            }
}

TEST_F(GpuExtraction, NoChangeMakesNothing) {
    const Volume volume = noise_volume({20, 20, 20}, ScalarType::u8, 5, 1);
    GpuSurface surface(pipelines(), volume, 2.5f);
    const uint64_t before = device().last_submitted();
    EXPECT_TRUE(surface.update(volume).blocks.empty());
    EXPECT_EQ(device().last_submitted(), before);
}

// 17 MiB of changes go through 16 of staging.
TEST_F(GpuExtraction, ChangesLargerThanWhatIsStagedAtOnceArrive) {
    const auto ball = [](double x) {
        return make_volume(make_grid({176, 168, 152}, glm::dvec3(1.0)), ScalarType::f32,
                           [x](glm::uvec3 i) {
                               return 20.0 - glm::distance(glm::dvec3(i), {x, 80.0, 75.0});
                           });
    };
    GpuSurface surface(pipelines(), ball(60.0), 0.0f);
    surface.update(ball(100.25));
    expect_same(surface, BlockSurface(ball(100.25), 0.0f), device());
}

TEST_F(GpuExtraction, ModeCorrectAndVolumesTooLargeAreRefusedInASentence) {
    const Volume volume = noise_volume({20, 20, 20}, ScalarType::u8, 5, 1);
    EXPECT_TRUE(GpuSurface::supports(device(), volume, {}));
    const auto refused =
        GpuSurface::supports(device(), volume, {.topology = SurfaceTopology::correct});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("expected the topology classic"), std::string::npos);
    const uint32_t most = device().limits().maxImageDimension3D;
    const Volume wide = make_volume(make_grid({most + 1, 1, 1}, glm::dvec3(1.0)), ScalarType::u8,
                                    [](glm::uvec3) { return 0.0; });
    EXPECT_FALSE(GpuSurface::supports(device(), wide, {}));
}

TEST(RangeAllocator, GivesTheSmallestRangeThatSufficesAndJoinsWhatIsFreed) {
    RangeAllocator ranges(100, 10); // 0 .. 99
    EXPECT_EQ(ranges.take(25), 0u);
    EXPECT_EQ(ranges.take(10), 30u);
    EXPECT_EQ(ranges.take(20), 40u);
    EXPECT_EQ(ranges.take(1), 60u);
    EXPECT_EQ(ranges.taken(), 70u);
    ranges.give(30, 10);
    EXPECT_EQ(ranges.take(10), 30u); // and not from the 30 at the end
    EXPECT_EQ(ranges.take(31), std::nullopt);
    ranges.give(0, 25);
    ranges.give(40, 20);
    ranges.give(30, 10); // 0 .. 59 are free, and 70 .. 99
    EXPECT_EQ(ranges.take(31), 0u);
    EXPECT_EQ(ranges.take(25), 70u);
    EXPECT_EQ(ranges.take(20), 40u);
    EXPECT_EQ(ranges.taken(), 100u);
    EXPECT_EQ(ranges.take(1), std::nullopt);
    ranges.give(0, 31);
    ranges.give(70, 25);
    ranges.give(40, 20);
    ranges.give(60, 1);
    EXPECT_EQ(ranges.taken(), 0u);
    EXPECT_EQ(ranges.take(100), 0u);
}

// Ranges of a size drawn by chance, some given back: none overlap, whatever the order.
TEST(RangeAllocator, RangesNeverOverlap) {
    std::mt19937 random(1);
    RangeAllocator ranges(4096, 16);
    std::vector<int> owner(4096, 0);
    std::vector<std::array<uint32_t, 3>> taken; // first, count, owner
    for (int step = 1; step < 5000; ++step) {
        const auto count = static_cast<uint32_t>(1 + random() % 200);
        if (const auto first = ranges.take(count)) {
            for (uint32_t i = *first; i < *first + count; ++i) {
                ASSERT_EQ(owner[i], 0);
                owner[i] = step;
            }
            taken.push_back({*first, count, static_cast<uint32_t>(step)});
        } else {
            ASSERT_FALSE(taken.empty());
        }
        while (taken.size() > random() % 40) {
            std::swap(taken[random() % taken.size()], taken.back());
            const auto [first, length, who] = taken.back();
            taken.pop_back();
            std::fill_n(owner.begin() + first, length, 0);
            ranges.give(first, length);
        }
    }
}

// A device that cannot hold the surface: who chose the device decides what follows.
TEST_F(GpuExtraction, GivesWayToTheCpuWhereMemoryRunsOut) {
    const Volume volume = noise_volume({20, 19, 18}, ScalarType::u8, 5, 3);
    const auto out_of_memory = [](GpuDevice&, const Volume&, float, const SurfaceOptions&,
                                  ExtractPasses& passes) -> Mesh {
        passes.emplace_back("upload and extract", 1.0);
        throw GpuError("allocating: VK_ERROR_OUT_OF_DEVICE_MEMORY");
    };
    const auto chosen = [](bool may_fall_back) {
        return Extractor{std::make_unique<GpuDevice>(DeviceOptions{}), "asked for", may_fall_back};
    };
    ExtractPasses passes;
    Extractor automatic = chosen(true);
    const Result<Mesh> mesh = extract_on(automatic, volume, 2.0f, {}, passes, out_of_memory);
    ASSERT_TRUE(mesh) << mesh.error().message;
    testing::expect_same_bytes(*mesh, marching_cubes(volume, 2.0f, {}));
    EXPECT_EQ(automatic.device, nullptr);
    EXPECT_NE(automatic.why.find("VK_ERROR_OUT_OF_DEVICE_MEMORY"), std::string::npos);
    EXPECT_TRUE(passes.empty());

    Extractor asked = chosen(false);
    const Result<Mesh> none = extract_on(asked, volume, 2.0f, {}, passes, out_of_memory);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message, "--on gpu: allocating: VK_ERROR_OUT_OF_DEVICE_MEMORY");

    Extractor able = chosen(true);
    testing::expect_same_bytes(*extract_on(able, volume, 2.0f, {}, passes),
                               marching_cubes(volume, 2.0f, {}));
    EXPECT_NE(able.device, nullptr);
}

} // namespace
} // namespace palpate
