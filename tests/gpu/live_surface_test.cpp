// Surfaces that are drawn where they are extracted: the picture is that of the mesh, and an edit
// costs what it touches.

#include "engine/surface/marching_cubes.h"
#include "engine/volume/edit.h"
#include "tests/gpu/surface_scenes.h"
#include "tests/unit/surface/random_edits.h"

namespace palpate {
namespace {

using namespace testing_meshes;

constexpr BlockMaker kMakers[] = {BlockMaker::device, BlockMaker::cpu};

SceneData live_data(Volume volume) {
    return {std::move(volume), std::nullopt, {nullptr}};
}

// The mesh that a live surface stands for.
SceneData mesh_data(const Volume& volume, double iso) {
    return {volume,
            std::nullopt,
            {shared(marching_cubes(volume, static_cast<float>(iso), {.closed_at_border = true}))}};
}

Scene mesh_scene(Scene scene) {
    for (SurfaceLayer& surface : scene.surfaces)
        surface.live_iso.reset();
    return scene;
}

Scene live_scene(const Volume& volume, double iso, double opacity = 1.0) {
    Scene scene = scene_of({layer({0.9, 0.8, 0.6}, opacity)});
    scene.surfaces[0].live_iso = iso;
    scene.camera = frame_volume(volume.grid(), {-0.6, -0.7, 0.4}, {0, 0, 1});
    return scene;
}

// Noise about a ball, so that there are folds, gaps and small parts at all block borders.
Volume rough_ball(glm::uvec3 size, glm::dvec3 spacing_mm, ScalarType type) {
    const Grid grid = make_grid(size, spacing_mm, {-9.0, 4.0, 11.0});
    const glm::dvec3 middle = 0.5 * glm::dvec3(size - 1u);
    return make_volume(grid, type, [=](glm::uvec3 i) {
        const double r = glm::length((glm::dvec3(i) - middle) / middle);
        return std::floor(100.0 * (1.0 - r) + 25.0 * synthetic::noise(i, 3));
    });
}

using LiveSurface = SurfaceTest;

TEST_F(LiveSurface, PictureIsThatOfTheMesh) {
    const Volume volume = rough_ball({37, 41, 19}, {0.7, 0.6, 1.5}, ScalarType::i16);
    const SceneData live = live_data(volume), mesh = mesh_data(volume, 35.0);
    ASSERT_GT(mesh.meshes[0]->triangles.size(), 5000u);
    std::vector<Scene> scenes(4, live_scene(volume, 35.0));
    scenes[1].surfaces[0].style.opacity = 0.4;
    scenes[1].clip_planes = {{{0, 10, 20}, {0.3, 1, 0.2}}};
    scenes[1].stereo = StereoSettings{};
    add_slices(scenes[2]);
    add_rays(scenes[2], RayMode::alpha);
    scenes[3].clip_planes = {{{0, 10, 20}, {0.3, 1, 0.2}}};
    for (const Scene& scene : scenes) {
        const std::vector<Image> expected = drawn(mesh_scene(scene), mesh);
        for (const BlockMaker maker : kMakers)
            EXPECT_TRUE(same_bits(drawn(scene, live, {.block_maker = maker}), expected));
    }
}

// The renderer that has seen every edit, one that begins now, and the mesh.
TEST_F(LiveSurface, AfterEditsThePictureIsThatOfTheMeshFromScratch) {
    for (const BlockMaker maker : kMakers)
        for (const ScalarType type : {ScalarType::i16, ScalarType::f32}) {
            std::mt19937 random(5);
            SceneData data = live_data(rough_ball({50, 33, 29}, {0.6, 0.9, 1.0}, type));
            const RendererOptions options{.block_maker = maker};
            Renderer edited(device(), options);
            double iso = 30.0;
            for (int edit = 0; edit < 8; ++edit) {
                SCOPED_TRACE(edit);
                if (edit > 0)
                    data.volume = testing::random_edit(data.volume, random, 12.0);
                if (edit == 5) // with an edit, and alone
                    iso = 12.0;
                if (edit == 6)
                    data.volume = rough_ball({31, 30, 29}, {1.0, 0.9, 1.0}, type);
                const Scene scene = live_scene(data.volume, iso, edit % 2 ? 0.5 : 1.0);
                const Result<Frame> frame = edited.render(scene, data);
                ASSERT_TRUE(frame) << frame.error().message;
                EXPECT_TRUE(same_bits(frame->eyes, drawn_on(device(), mesh_scene(scene),
                                                            mesh_data(data.volume, iso), {})));
                Renderer afresh(device(), options);
                const Result<Frame> first = afresh.render(scene, data);
                ASSERT_TRUE(first);
                EXPECT_TRUE(same_bits(frame->eyes, first->eyes));
                if (edit > 0 && edit < 5) {
                    EXPECT_LT(frame->stats.made_blocks, first->stats.made_blocks);
                }
                const Result<Frame> again = edited.render(scene, data);
                ASSERT_TRUE(again);
                EXPECT_EQ(again->stats.made_blocks, 0u);
            }
        }
}

// A dab of radius 5 mm on samples 1 mm apart. It changes samples in a box of 11 a side, and blocks
// read one sample before and two behind their own: 14 samples meet at most 3 blocks on each axis.
// The device gets 3^3 blocks of 8^3 samples of two bytes at most, and where triangles were as many
// zeros; or, made by the CPU, these blocks' arrays. It is the same on 16 times as many samples.
TEST_F(LiveSurface, BytesAndBlocksFollowTheEditAndNotTheVolume) {
    for (const BlockMaker maker : kMakers) {
        std::vector<std::pair<size_t, uint64_t>> costs;
        for (const glm::uvec3 size : {glm::uvec3(48, 48, 48), glm::uvec3(144, 128, 96)}) {
            SceneData data = live_data(
                make_volume(make_grid(size, glm::dvec3(1.0)), ScalarType::i16, [](glm::uvec3 i) {
                    return 40.0 * (20.0 - i.z) + 30.0 * std::sin(0.3 * i.x) * std::cos(0.2 * i.y);
                }));
            const Scene scene = live_scene(data.volume, 0.0);
            Renderer renderer(device(), {.block_maker = maker});
            const Result<Frame> first = renderer.render(scene, data);
            ASSERT_TRUE(first) << first.error().message;
            EXPECT_GE(first->stats.made_blocks, size_t{size.x / 8} * (size.y / 8));
            VolumeEdit edit(data.volume);
            const glm::ivec3 centre(22, 25, 20);
            size_t triangles = 0;
            for (int z = -5; z <= 5; ++z)
                for (int y = -5; y <= 5; ++y)
                    for (int x = -5; x <= 5; ++x)
                        if (x * x + y * y + z * z <= 25)
                            edit.set(glm::uvec3(centre + glm::ivec3(x, y, z)), -500.0);
            data.volume = edit.commit();
            const uint64_t before = device().traffic().uploaded_bytes;
            const Result<FrameStats> stats = renderer.draw(scene, data);
            const uint64_t bytes = device().traffic().uploaded_bytes - before;
            ASSERT_TRUE(stats) << stats.error().message;
            EXPECT_GT(stats->made_blocks, 0u);
            EXPECT_LE(stats->made_blocks, 27u);
            triangles = 27 * 512 * 5; // of 27 blocks, at most
            EXPECT_GT(bytes, 0u);
            EXPECT_LE(bytes, maker == BlockMaker::device
                                 ? 27 * 1024 + 27 * 200 * sizeof(glm::uvec3)
                                 : triangles * sizeof(glm::uvec3) + 27 * 3 * 729 * 24);
            costs.emplace_back(stats->made_blocks, bytes);
            const Result<Frame> now = renderer.render(scene, data);
            ASSERT_TRUE(now);
            EXPECT_TRUE(
                same_bits(now->eyes, drawn(mesh_scene(scene), mesh_data(data.volume, 0.0))));
        }
        EXPECT_EQ(costs[0], costs[1]);
        std::printf("    %s: %zu blocks, %llu bytes\n",
                    maker == BlockMaker::device ? "device" : "cpu", costs[0].first,
                    static_cast<unsigned long long>(costs[0].second));
    }
}

// More than the spare fifth: the pool grows by another set of buffers, and is drawn from both.
TEST_F(LiveSurface, APoolThatIsFullGrows) {
    const glm::uvec3 size(96, 96, 40);
    const auto layers = [&](uint32_t count) {
        return make_volume(make_grid(size, glm::dvec3(1.0)), ScalarType::u8, [=](glm::uvec3 i) {
            return i.z % 5 < 2 && i.z / 5 < count ? 100.0 : 0.0;
        });
    };
    for (const BlockMaker maker : kMakers) {
        SceneData data = live_data(layers(1));
        const Scene scene = live_scene(data.volume, 50.0);
        Renderer renderer(device(), {.block_maker = maker});
        ASSERT_TRUE(renderer.draw(scene, data));
        const auto pools = [&] {
            return std::ranges::count_if(device().resources(), [](const ResourceInfo& one) {
                return one.name == "surface triangles";
            });
        };
        const auto before = pools();
        data.volume = layers(8);
        const Result<Frame> grown = renderer.render(scene, data);
        ASSERT_TRUE(grown);
        EXPECT_GT(pools(), before);
        EXPECT_TRUE(same_bits(grown->eyes, drawn(mesh_scene(scene), mesh_data(data.volume, 50.0))));
        data.volume = layers(2);
        const Result<Frame> shrunk = renderer.render(scene, data);
        ASSERT_TRUE(shrunk);
        EXPECT_TRUE(
            same_bits(shrunk->eyes, drawn(mesh_scene(scene), mesh_data(data.volume, 50.0))));
    }
}

} // namespace
} // namespace palpate
