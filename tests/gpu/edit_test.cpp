// One voxel of a real CT is edited: one brick travels, and only the rays that can see it change.

#include <algorithm>
#include <cmath>

#include "engine/io/volume_io.h"
#include "engine/scene/presets.h"
#include "engine/volume/edit.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

constexpr const char* kHeadCt = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";

class EditTest : public GpuTest {
 protected:
    static const Volume& head() { // loaded once, by the program's own decoder
        static const Volume volume = [] {
            const Result<LoadedVolume> loaded = load_volume(kHeadCt);
            EXPECT_TRUE(loaded) << loaded.error().message;
            return loaded->volume;
        }();
        return volume;
    }

    // Whether the ray through a pixel comes within `reach` samples of `voxel` on every axis.
    static bool passes_near(const Scene& scene, const Grid& grid, glm::dvec2 pixel,
                            glm::dvec3 voxel, double reach) {
        const Ray ray = ray_through(make_view(scene.camera, scene.size_px), pixel, scene.size_px);
        const glm::dvec3 o = index_point(grid, ray.origin_mm) - voxel;
        const glm::dvec3 d = index_point(grid, ray.origin_mm + ray.direction) - voxel - o;
        double from = -1e30, to = 1e30;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-reach - o[axis]) / d[axis], b = (reach - o[axis]) / d[axis];
            from = std::max(from, std::min(a, b));
            to = std::min(to, std::max(a, b));
        }
        return from <= to;
    }

    // Draws the head before and after the edit of one voxel; the changed pixels, and how many of
    // them lie where the edit cannot reach.
    static void check(const Scene& scene, double reach_samples) {
        const glm::uvec3 voxel(70, 40, 60);
        VolumeEdit edit(head());
        edit.set(voxel, 3000.0);
        const Volume after = edit.commit();
        Renderer renderer(device());
        const Result<Frame> first = renderer.render(scene, {head(), std::nullopt});
        const Result<Frame> second = renderer.render(scene, {after, std::nullopt});
        ASSERT_TRUE(first && second);
        EXPECT_EQ(first->stats.uploaded_bricks, 8u * 8u * 4u);
        EXPECT_EQ(second->stats.uploaded_bricks, 1u);
        size_t changed = 0, out_of_reach = 0;
        for (uint32_t y = 0; y < scene.size_px.y; ++y)
            for (uint32_t x = 0; x < scene.size_px.x; ++x) {
                bool differs = false;
                for (size_t c = 0; c < 4; ++c)
                    differs = differs || first->eyes[0].at(x, y, c) != second->eyes[0].at(x, y, c);
                changed += differs;
                // fp32 coordinates err by far less than a hundredth of a sample.
                out_of_reach += differs && !passes_near(scene, head().grid(), {x, y},
                                                        glm::dvec3(voxel), reach_samples + 0.01);
            }
        EXPECT_GT(changed, 0u);
        EXPECT_EQ(out_of_reach, 0u);
    }

    static Scene scene_near_the_voxel() {
        Scene scene;
        scene.size_px = {160, 160};
        const glm::dvec3 voxel_mm = world_point(head().grid(), {70, 40, 60});
        scene.camera.target_mm = voxel_mm;
        scene.camera.eye_mm = voxel_mm + glm::dvec3(-60, -70, 40);
        scene.camera.view_angle_deg = 10.0;
        RayCastLayer layer;
        layer.transfer = *preset("ct-peer");
        layer.min_transmittance = 0.0;
        layer.step_mm = 0.5;
        scene.ray_cast = layer;
        return scene;
    }
};

TEST_F(EditTest, OneVoxelIsOneBrickAndTheRaysThroughItsEightCells) {
    check(scene_near_the_voxel(), 1.0);
}

// Central differences reach one sample farther: 4 x 4 x 4 cells.
TEST_F(EditTest, ShadedOneVoxelReachesSixtyFourCells) {
    Scene scene = scene_near_the_voxel();
    scene.ray_cast->shading = Shading{};
    check(scene, 2.0);
}

TEST_F(EditTest, TwoRunsGiveTheSameBits) {
    const Scene scene = scene_near_the_voxel();
    Renderer one(device()), two(device());
    const Result<Frame> a = one.render(scene, {head(), std::nullopt});
    const Result<Frame> b = two.render(scene, {head(), std::nullopt});
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->eyes[0].samples, b->eyes[0].samples);
}

// Resources that a scene does not use do not exist.
TEST_F(EditTest, AnIsoSceneHoldsNeitherLabelsNorTablesNorASecondEye) {
    Renderer renderer(device());
    Scene scene = scene_near_the_voxel();
    ASSERT_TRUE(renderer.draw(scene, {head(), std::nullopt}));
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{300.0}};
    ASSERT_TRUE(renderer.draw(scene, {head(), std::nullopt}));
    std::vector<std::string> names;
    for (const ResourceInfo& resource : device().resources())
        if (resource.kind == "image")
            names.push_back(resource.name);
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (std::vector<std::string>{"macro-cells", "picture", "volume"}));
}

} // namespace
} // namespace palpate
