// Frames after edits are those of a fresh renderer, to the bit, and what they cost follows the edit
// and not the volume.

#include <tbb/global_control.h>
#include <volk.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <random>

#include "engine/render/cell_map.h"
#include "engine/render/change_log.h"
#include "engine/render/needed_bricks.h"
#include "engine/volume/builder.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"
#include "tests/gpu/allocations.h"
#include "tests/gpu/created.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/surface_meshes.h"

namespace palpate {
namespace {

// Distances after random changes of occupancy, with and without time to settle, on grids that are
// no multiple of a tile.
TEST(CellDistances, AreSafeAtOnceAndExactWhenRaised) {
    std::mt19937 random(11);
    for (const glm::uvec3 count : {glm::uvec3(40, 21, 33), {16, 16, 16}, {70, 3, 1}, {5, 50, 17}}) {
        std::vector<uint8_t> occupied(size_t{count.x} * count.y * count.z);
        std::bernoulli_distribution some(0.003);
        for (uint8_t& cell : occupied)
            cell = some(random);
        CellDistances distances(occupied, count);
        std::vector<uint8_t> told = distances.values(); // as an image that follows the boxes has it
        const auto tell = [&](const CellBox& box) {
            for (uint32_t z = box.low.z; z < box.high.z; ++z)
                for (uint32_t y = box.low.y; y < box.high.y; ++y)
                    for (uint32_t x = box.low.x; x < box.high.x; ++x)
                        told[x + count.x * (y + size_t{count.y} * z)] = distances.at({x, y, z});
        };
        size_t lower = 0;
        for (int turn = 0; turn < 40; ++turn) {
            CellBox box;
            for (int axis = 0; axis < 3; ++axis) {
                const auto a = static_cast<uint32_t>(random() % count[axis]);
                const auto n = static_cast<uint32_t>(random() % 12);
                box.low[axis] = a;
                box.high[axis] = std::min(a + 1 + n, count[axis]);
            }
            std::vector<uint8_t> now;
            std::bernoulli_distribution fills(turn % 3 == 0 ? 0.1 : 0.0); // mostly they are emptied
            for (uint32_t z = box.low.z; z < box.high.z; ++z)
                for (uint32_t y = box.low.y; y < box.high.y; ++y)
                    for (uint32_t x = box.low.x; x < box.high.x; ++x) {
                        now.push_back(fills(random));
                        occupied[x + count.x * (y + size_t{count.y} * z)] = now.back();
                    }
            tell(distances.update(box, now));
            if (turn % 4 == 1)
                distances.raise(3);
            for (const CellBox& raised : distances.take_raised(2))
                tell(raised);
            std::vector<uint8_t> exact = occupied;
            chebyshev_distances(exact, count);
            const bool settles = turn % 10 == 9;
            if (settles) {
                while (distances.raise(5) > 0) {
                }
                for (int i = 0; i < 1000; ++i)
                    for (const CellBox& raised : distances.take_raised(2))
                        tell(raised);
            }
            for (size_t cell = 0; cell < exact.size(); ++cell) {
                ASSERT_EQ(distances.values()[cell] == 0, exact[cell] == 0);
                ASSERT_LE(distances.values()[cell], exact[cell]);
                ASSERT_LE(told[cell], exact[cell]);
                ASSERT_TRUE(!settles || told[cell] == exact[cell]);
                lower += told[cell] < exact[cell];
            }
        }
        EXPECT_GT(lower, 0u);
    }
}

// GrowthTest takes over 5 s of a processor: only volumes of several sizes show that the work grows
// with the edit alone.
class GrowthTest : public GpuTest {
 protected:
    // A ball with an edge 6 samples wide in the first corner of a volume, whatever its size; the
    // rest of it is empty.
    static Volume ball(uint32_t side) {
        const Grid grid = make_grid(glm::uvec3(side), glm::dvec3(1.0));
        VolumeBuilder builder(grid, ScalarType::u16);
        const glm::uvec3 bricks(3);
        for (uint32_t z = 0; z < bricks.z; ++z)
            for (uint32_t y = 0; y < bricks.y; ++y)
                for (uint32_t x = 0; x < bricks.x; ++x)
                    builder.set_brick(
                        {x, y, z}, make_brick(grid, ScalarType::u16,
                                              [](glm::uvec3 i) {
                                                  const double r =
                                                      glm::length(glm::dvec3(i) - glm::dvec3(47.0));
                                                  return std::clamp(500.0 + (30.0 - r) * 160.0, 0.0,
                                                                    1000.0);
                                              },
                                              {x, y, z}));
        return builder.finish();
    }

    static Volume dab(const Volume& volume, glm::ivec3 center, double value, int radius = 5) {
        VolumeEdit edit(volume);
        for (int z = -radius; z <= radius; ++z)
            for (int y = -radius; y <= radius; ++y)
                for (int x = -radius; x <= radius; ++x) {
                    const glm::ivec3 at = center + glm::ivec3(x, y, z);
                    if (x * x + y * y + z * z <= radius * radius &&
                        glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
                        glm::all(glm::lessThan(at, glm::ivec3(volume.size()))))
                        edit.set(glm::uvec3(at), value);
                }
        return edit.commit();
    }

    static Scene scene_of(RayMode mode) {
        Scene scene;
        scene.size_px = {48, 40};
        scene.camera.target_mm = glm::dvec3(47.0);
        scene.camera.eye_mm = {-130, -100, 90};
        scene.camera.view_angle_deg = 35.0;
        scene.value_and_depth = true;
        scene.ray_cast.emplace();
        scene.ray_cast->mode = mode;
        scene.ray_cast->isos = {{500.0}};
        scene.ray_cast->transfer = window_function(mode == RayMode::mip ? 0 : 200, 1000, 0.2);
        return scene;
    }
};

bool same_bits(const Frame& a, const Frame& b) {
    for (size_t eye = 0; eye < a.eyes.size(); ++eye)
        if (std::memcmp(a.eyes[eye].samples.data(), b.eyes[eye].samples.data(),
                        a.eyes[eye].samples.size() * sizeof(float)) != 0)
            return false;
    return a.eyes.size() == b.eyes.size();
}

// By hand, because the device's sampler rounds by where a brick lies in the atlas.
TEST_F(GrowthTest, AfterRandomEditsPicturesAreThoseOfAFreshRenderer) {
    std::mt19937 random(5);
    std::uniform_int_distribution<int> place(0, 95);
    for (const Residency residency : {Residency::dense, Residency::atlas})
        for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
            SCOPED_TRACE(testing::Message() << "mode " << static_cast<int>(mode) << ", residency "
                                            << static_cast<int>(residency));
            const RendererOptions options{.residency = residency, .sampling = Sampling::by_hand};
            Renderer renderer(device(), options);
            Volume now = ball(96), before = now;
            Volume labels = make_volume(now.grid(), ScalarType::u16, [](glm::uvec3 i) {
                return static_cast<double>((i.x / 16 + i.y / 16 + i.z / 16) % 3);
            });
            Scene scene = scene_of(mode);
            scene.labels = LabelLayer{};
            scene.slices = {{glm::dvec3(47.0), {0, 0.3, 1}, Interpolation::linear, 2.0}};
            scene.slice_transfer = window_function(0, 1000, 1.0);
            for (int turn = 0; turn < 8; ++turn) {
                const Volume then = now;
                if (turn == 5)
                    now = before; // undone
                else
                    for (int i = 0; i < 1 + turn % 3; ++i) // some of them far apart
                        now = dab(now, {place(random), place(random), place(random)},
                                  turn % 2 ? 0.0 : 900.0 + 60.0 * turn);
                before = then;
                if (turn % 3 == 1)
                    labels =
                        dab(labels, {place(random), place(random), place(random)}, 400.0 + turn);
                if (turn == 6)
                    scene.slices[0].point_mm.z += 20.0;
                const SceneData data{now, labels};
                scene.camera = orbit(scene.camera, 7.0);
                const Result<Frame> edited = renderer.render(scene, data);
                ASSERT_TRUE(edited) << edited.error().message;
                EXPECT_EQ(edited->stats.atlas, residency == Residency::atlas);
                if (turn != 2 && turn != 5 && turn != 7)
                    continue;
                Renderer fresh(device(), options);
                const Result<Frame> expected = fresh.render(scene, data);
                ASSERT_TRUE(expected);
                ASSERT_TRUE(same_bits(*edited, *expected)) << turn;
            }
        }
}

// An atlas with room for what rays and slices need uploads it once.
TEST_F(GrowthTest, SlicesAndRaysTogetherAreUploadedOnce) {
    Renderer renderer(device(), {.residency = Residency::atlas});
    Scene scene = scene_of(RayMode::alpha);
    scene.slices = {{glm::dvec3(47.0), {0, 0, 1}}, {glm::dvec3(47.0), {1, 0, 0}}};
    scene.slice_transfer = window_function(0, 1000, 1.0);
    const SceneData data{ball(160), std::nullopt};
    ASSERT_TRUE(renderer.draw(scene, data));
    const uint64_t before = device().last_submitted();
    for (int i = 0; i < 3; ++i) {
        scene.camera = orbit(scene.camera, 10.0);
        const Result<FrameStats> stats = renderer.draw(scene, data);
        ASSERT_TRUE(stats);
        EXPECT_EQ(stats->uploaded_bricks, 0u);
    }
    EXPECT_EQ(device().last_submitted(), before + 3);
}

// The same dabs in volumes that differ in what lies about the ball: the same bytes travel, dense as
// in an atlas. Sizes beyond 320^3, because smaller volumes have smaller cells.
TEST_F(GrowthTest, BytesOfADabDoNotGrowWithTheVolume) {
    for (const Residency residency : {Residency::dense, Residency::atlas})
        for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
            std::vector<std::vector<uint64_t>> bytes; // of each volume, frame by frame
            for (const uint32_t side : {352u, 416u}) {
                Renderer renderer(device(), {.residency = residency});
                Volume now = ball(side);
                const Scene scene = scene_of(mode);
                for (int i = 0; i < 2; ++i)
                    ASSERT_TRUE(renderer.draw(scene, {now, std::nullopt}));
                bytes.emplace_back();
                for (int i = 0; i < 12; ++i) {
                    if (i < 8) // then quiet frames, in which distances are raised
                        now = dab(now, {47 + 4 * i, 47, 17}, i % 2 ? 0.0 : 900.0);
                    const uint64_t before = device().traffic().uploaded_bytes;
                    ASSERT_TRUE(renderer.draw(scene, {now, std::nullopt}));
                    bytes.back().push_back(device().traffic().uploaded_bytes - before);
                }
            }
            EXPECT_EQ(bytes[0], bytes[1]) << static_cast<int>(mode);
            EXPECT_GT(bytes[0][0], 0u);
            EXPECT_LT(bytes[0][0], uint64_t{1} << 18);
        }
}

// Work of the recording thread for one frame: what is uploaded, and calls of Vulkan.
struct FrameWork {
    uint64_t uploaded_bytes, uploads, dispatches, barriers, copies, sets;
    friend bool operator==(const FrameWork&, const FrameWork&) = default;
};
std::ostream& operator<<(std::ostream& out, const FrameWork& work) {
    return out << work.uploads << " uploads of " << work.uploaded_bytes << " bytes, "
               << work.dispatches << " dispatches, " << work.barriers << " barriers, "
               << work.copies << " copies, " << work.sets << " sets\n";
}

// With dabs, and in the quiet frames behind them, while the camera turns: one view, and three
// slices with two eyes. Allocations are those of the validation layers, too, whose tables grow at
// times of their own. From 352^3 samples on volumes grow by 1.65 (dense) and 3.08: a thirtieth or a
// hundredth of the work that grew with them would add the 2 % that are let pass.
TEST_F(GrowthTest, WorkOfAFrameDoesNotGrowWithTheVolume) {
    const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
    struct Case {
        RayMode mode;
        bool slices;
    };
    for (const auto& [residency, larger] :
         {std::pair(Residency::dense, 416u), std::pair(Residency::atlas, 512u)}) {
        const Volume volumes[] = {ball(352), ball(larger)};
        for (const auto& [mode, slices] : {Case{RayMode::mip, false}, Case{RayMode::alpha, false},
                                           Case{RayMode::iso, false}, Case{RayMode::alpha, true}}) {
            SCOPED_TRACE(testing::Message()
                         << "mode " << static_cast<int>(mode) << ", residency "
                         << static_cast<int>(residency) << ", slices " << slices);
            std::vector<std::vector<FrameWork>> work; // of each volume, frame by frame
            std::vector<Allocations> allocated;       // in all
            for (Volume now : volumes) {
                std::deque<Renderer> views;
                views.emplace_back(device(), RendererOptions{.residency = residency});
                std::vector<Scene> scenes{scene_of(mode)};
                for (int axis = 0; slices && axis < 3; ++axis) {
                    views.emplace_back(views.front().store());
                    scenes.push_back(scenes[0]);
                    scenes.back().ray_cast.reset();
                    scenes.back().slices = {
                        {glm::dvec3(47.0), glm::dvec3(axis == 0, axis == 1, axis == 2)}};
                    scenes.back().slice_transfer = window_function(0, 1000, 1.0);
                }
                if (slices)
                    scenes[0].stereo = StereoSettings{};
                work.emplace_back();
                allocated.push_back({});
                for (int frame = 0; frame < 24; ++frame) {
                    if (frame >= 3 && frame < 12)
                        now = dab(now, {47 + 4 * frame, 47, 17}, frame % 2 ? 0.0 : 900.0);
                    for (Scene& scene : scenes)
                        scene.camera = orbit(scene.camera, 1.0);
                    const auto before = device().traffic();
                    const Calls<vkCmdDispatchBase> dispatches;
                    const Calls<vkCmdDispatchIndirect> indirect;
                    const Calls<vkCmdPipelineBarrier2> barriers;
                    const Calls<vkCmdCopyBufferToImage> to_image;
                    const Calls<vkCmdCopyBuffer> to_buffer;
                    const Calls<vkAllocateDescriptorSets> sets;
                    const Allocations until_then = allocations_so_far();
                    Commands commands(device());
                    for (size_t view = 0; view < scenes.size(); ++view)
                        ASSERT_TRUE(
                            views[view].record(commands, scenes[view], {now, std::nullopt}));
                    commands.submit();
                    const Allocations by_now = allocations_so_far();
                    commands.finish();
                    if (frame < 3) // these make what is kept
                        continue;
                    allocated.back().count += by_now.count - until_then.count;
                    allocated.back().bytes += by_now.bytes - until_then.bytes;
                    work.back().push_back(
                        {device().traffic().uploaded_bytes - before.uploaded_bytes,
                         device().traffic().uploads - before.uploads,
                         dispatches.count() + indirect.count(), barriers.count(),
                         to_image.count() + to_buffer.count(), sets.count()});
                }
            }
            EXPECT_EQ(work[0], work[1]);
            EXPECT_LE(allocated[1].count, 1.02 * allocated[0].count);
            EXPECT_LE(allocated[1].bytes, 1.02 * allocated[0].bytes);
            EXPECT_GT(work[0][0].uploaded_bytes, 0u);
            EXPECT_GT(work[0][0].dispatches * work[0][0].barriers * work[0][0].sets, 0u);
            EXPECT_EQ(work[0].back().uploaded_bytes, 0u) << "quiet at last";
        }
    }
}

// Counts of what is looked at for a dab: cells, and bricks that may be needed.
TEST_F(GrowthTest, CellsAndBricksLookedAtDoNotGrowWithTheVolume) {
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
        std::vector<std::vector<uint64_t>> counts;
        for (const uint32_t side : {352u, 512u}) {
            Volume now = ball(side);
            Scene scene = scene_of(mode);
            scene.slices = {{glm::dvec3(47.0), {0, 0, 1}}};
            const auto voxels = std::make_shared<VolumeCells>(now);
            CellMap cells(device(), voxels);
            NeededBricks needed(now);
            counts.emplace_back();
            for (int i = 0; i < 12; ++i) {
                Volume next = now;
                if (i > 0 && i < 8)
                    next = dab(now, {47 + 4 * i, 47, 17}, i % 2 ? 0.0 : 900.0);
                const std::vector<ChangedBrick> changed = changed_bricks(now, next);
                now = next;
                const uint64_t before = cells.cells_visited() + needed.bricks_visited();
                voxels->update(now, changed);
                Commands commands(device());
                cells.show(*scene.ray_cast, 1.0f, 0.0f, changed, commands);
                commands.submit();
                commands.finish();
                needed.update(scene, now, changed, &cells, 1.0);
                if (i > 0)
                    counts.back().push_back(cells.cells_visited() + needed.bricks_visited() -
                                            before);
            }
        }
        EXPECT_EQ(counts[0], counts[1]) << static_cast<int>(mode);
        EXPECT_GT(counts[0][0], 0u);
        EXPECT_EQ(counts[0].size(), 11u);
    }
}

// After edits, other slices, other layers: what would be found from nothing.
TEST_F(GrowthTest, NeededBricksAreThoseFoundFromNothing) {
    std::mt19937 random(9);
    std::uniform_int_distribution<int> place(0, 139);
    Volume now = with_grid(
        ball(140), make_grid(glm::uvec3(140), {1.0, 0.8, 2.5}, glm::dvec3(-50.0, 20.0, 1000.0)));
    const auto voxels = std::make_shared<VolumeCells>(now);
    CellMap cells(device(), voxels);
    uint64_t shown = 0; // place in the log
    ChangeLog log;
    NeededBricks needed(now);
    std::vector<uint8_t> wanted(5 * 5 * 5, 0); // by what is told to have turned
    for (int turn = 0; turn < 40; ++turn) {
        Scene scene = scene_of(turn % 13 < 4   ? RayMode::iso
                               : turn % 13 < 9 ? RayMode::alpha
                                               : RayMode::mip);
        if (turn % 7 == 6)
            scene.ray_cast.reset();
        if (turn % 5 > 1)
            scene.slices = {{world_point(now.grid(), glm::dvec3(60.0 + turn / 10)),
                             {0.1 * (turn / 10), 0.2, 1}}};
        if (turn % 5 > 3)
            scene.slices.push_back({world_point(now.grid(), {20, 20, 20}), {1, 0, 0}, {}, 30.0});
        const Volume next =
            dab(now, {place(random), place(random), place(random)}, turn % 2 ? 0.0 : 900.0, 7);
        const std::vector<ChangedBrick> changed = changed_bricks(now, next);
        now = next;
        voxels->update(now, changed);
        log.add(changed);
        CellMap fresh_cells(device(), std::make_shared<VolumeCells>(now));
        const double factor = turn % 4 == 3 ? 9.0 : 1.0;
        if (scene.ray_cast) {
            Commands commands(device());
            cells.show(*scene.ray_cast, 1.0f, 0.0f, log.since(shown), commands);
            shown = log.end();
            fresh_cells.show(*scene.ray_cast, 1.0f, 0.0f, {}, commands);
            commands.submit();
            commands.finish();
        }
        needed.update(scene, now, changed, &cells, factor);
        NeededBricks fresh(now);
        fresh.update(scene, now, {}, &fresh_cells, factor);
        ASSERT_EQ(needed.seen(), fresh.seen()) << turn;
        ASSERT_EQ(needed.sliced(), fresh.sliced()) << turn;
        ASSERT_EQ(needed.count(), fresh.all().size());
        ASSERT_EQ(needed.sliced_count(), fresh.sliced().size());
        for (const glm::uvec3 brick : needed.take_turned())
            wanted[brick.x + 5 * (brick.y + 5 * brick.z)] = needed.needs(brick);
        ASSERT_EQ(static_cast<size_t>(std::count(wanted.begin(), wanted.end(), 1)), needed.count());
        // A slice runs through the bricks with a point in its slab, and reads three samples beyond.
        if (scene.slices.size() == 1) {
            const glm::dvec3 normal = glm::normalize(scene.slices[0].normal);
            const std::vector<glm::uvec3> sliced = needed.sliced();
            for_each_brick(now, [&](glm::uvec3 p) {
                if (!varies(now, p))
                    return;
                double least = 1e9, most = -1e9;
                for (int corner = 0; corner < 8; ++corner) {
                    const glm::dvec3 at(p + glm::uvec3(corner & 1, corner >> 1 & 1, corner >> 2));
                    const double d = glm::dot(
                        normal, world_point(now.grid(), 32.0 * at) - scene.slices[0].point_mm);
                    least = std::min(least, d);
                    most = std::max(most, d);
                }
                const bool is_there = std::find(sliced.begin(), sliced.end(), p) != sliced.end();
                if (least <= 0.0 && most >= 0.0) {
                    EXPECT_TRUE(is_there);
                }
                // the spacing's diagonal is 2.81 mm
                if (least > 3 * 2.82 || most < -3 * 2.82) {
                    EXPECT_FALSE(is_there);
                }
            });
        }
    }
}

// A mesh of which a few vertices move, then one with some triangles more, then fewer.
TEST_F(GrowthTest, AMeshThatChangesUploadsWhatChanged) {
    Scene scene = scene_of(RayMode::alpha);
    scene.ray_cast.reset();
    scene.camera.target_mm = glm::dvec3(0.0);
    scene.camera.eye_mm = {-70, -60, 80};
    scene.surfaces.resize(1);
    SceneData data{ball(96), std::nullopt, {}};
    const auto first = std::make_shared<Mesh>(
        testing_meshes::torus_mesh(glm::dvec3(0.0), 20.0, 8.0, /*across=*/192, /*down=*/96));
    data.meshes = {first};
    Renderer renderer(device());
    ASSERT_TRUE(renderer.draw(scene, data));
    const auto whole = static_cast<uint64_t>(first->triangles.size() * sizeof(glm::uvec3) +
                                             2 * first->positions.size() * sizeof(glm::vec3));
    const auto uploaded_for = [&](std::shared_ptr<const Mesh> mesh) {
        data.meshes = {std::move(mesh)};
        const uint64_t before = device().traffic().uploaded_bytes;
        const Result<Frame> changed = renderer.render(scene, data);
        const uint64_t bytes = device().traffic().uploaded_bytes - before;
        Renderer fresh(device());
        const Result<Frame> expected = fresh.render(scene, data);
        EXPECT_TRUE(changed && expected);
        EXPECT_TRUE(same_bits(*changed, *expected));
        return bytes;
    };
    Mesh moved = *first;
    for (size_t i = 5000; i < 5040; ++i)
        moved.positions[i] *= 1.2f;
    EXPECT_LE(uploaded_for(std::make_shared<Mesh>(moved)), 2u * 4096u); // 480 bytes, in two pieces
    Mesh more = moved;
    for (size_t i = 0; i < 30; ++i)
        more.triangles.push_back(more.triangles[i]);
    uploaded_for(std::make_shared<Mesh>(more)); // into larger buffers
    for (size_t i = 0; i < 30; ++i)
        more.triangles.push_back(more.triangles[i] + 7u);
    EXPECT_LE(uploaded_for(std::make_shared<Mesh>(more)), 2u * 4096u);
    more.triangles.resize(more.triangles.size() - 45);
    EXPECT_LE(uploaded_for(std::make_shared<Mesh>(more)), 4096u);
    EXPECT_GT(whole, 50u * 4096u);
    more.normals.clear();
    uploaded_for(std::make_shared<Mesh>(more)); // other buffers
    uploaded_for(std::make_shared<Mesh>());
    uploaded_for(first);
}

// Styles of 65 535 labels are made when they change, and not in every frame.
TEST_F(GrowthTest, LabelStylesFollowTheScene) {
    Volume labels = ball(96);
    VolumeEdit edit(labels);
    edit.set({40, 40, 20}, 65535.0);
    SceneData data{ball(96), edit.commit(), {}};
    Scene scene = scene_of(RayMode::alpha);
    scene.labels = LabelLayer{};
    Renderer renderer(device());
    for (int turn = 0; turn < 4; ++turn) {
        if (turn == 1)
            scene.labels->styles.resize(1001, {{1, 0, 0}, true});
        if (turn == 2)
            scene.labels->styles[1000].visible = false;
        if (turn == 3)
            data.labels = labels;
        const Result<Frame> changed = renderer.render(scene, data);
        Renderer fresh(device());
        const Result<Frame> expected = fresh.render(scene, data);
        ASSERT_TRUE(changed && expected);
        EXPECT_TRUE(same_bits(*changed, *expected)) << turn;
    }
}

} // namespace
} // namespace palpate
