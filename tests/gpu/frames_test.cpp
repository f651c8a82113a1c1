// Frames like the ones before make no Vulkan object and allocate no device memory.

#include <array>
#include <functional>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/created.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/surface_meshes.h"

namespace palpate {
namespace {

struct Case {
    const char* name;
    std::function<void(Scene&)> look;
    bool meshes = false, labels = false;
    RendererOptions options = {};
};

RayCastLayer layer_of(RayMode mode) {
    RayCastLayer layer;
    layer.mode = mode;
    layer.transfer = window_function(100, 1500, mode == RayMode::mip ? 1.0 : 0.3);
    layer.isos = {{300.0}};
    if (mode != RayMode::mip)
        layer.shading = Shading{};
    return layer;
}

void with_slices(Scene& scene) {
    for (int axis = 0; axis < 3; ++axis) {
        SliceLayer slice;
        slice.point_mm = glm::dvec3(3.0);
        slice.normal = glm::dvec3(axis == 0, axis == 1, axis == 2);
        scene.slices.push_back(slice);
    }
    scene.slice_transfer = window_function(-500, 1500, 1.0);
}

void with_surfaces(Scene& scene) {
    SurfaceLayer opaque, through;
    through.style.opacity = 0.5;
    scene.surfaces = {opaque, through};
    scene.clip_planes.push_back({{0, 0, 30}, {0, 0, -1}});
}

const std::vector<Case>& cases() {
    static const std::vector<Case> all{
        {"MIP", [](Scene& s) { s.ray_cast = layer_of(RayMode::mip); }},
        {"alpha", [](Scene& s) { s.ray_cast = layer_of(RayMode::alpha); }},
        {"alpha, stored gradients",
         [](Scene& s) { s.ray_cast = layer_of(RayMode::alpha); },
         false,
         false,
         {.stored_gradients = true}},
        {"iso",
         [](Scene& s) {
             s.ray_cast = layer_of(RayMode::iso);
             s.value_and_depth = true;
         }},
        {"labels", [](Scene& s) { s.ray_cast = layer_of(RayMode::alpha); }, false, true},
        {"slices", with_slices},
        {"slices, two eyes",
         [](Scene& s) {
             with_slices(s);
             s.ray_cast = layer_of(RayMode::alpha);
             s.stereo = StereoSettings{};
         }},
        {"surfaces", with_surfaces, true},
        {"surfaces and rays, two eyes",
         [](Scene& s) {
             with_surfaces(s);
             s.ray_cast = layer_of(RayMode::iso);
             s.stereo = StereoSettings{};
         },
         true},
        {"atlas",
         [](Scene& s) { s.ray_cast = layer_of(RayMode::alpha); },
         false,
         false,
         {.residency = Residency::atlas}},
        {"atlas in parts, with slices",
         [](Scene& s) {
             with_slices(s);
             s.ray_cast = layer_of(RayMode::iso);
         },
         false,
         false,
         {.residency = Residency::atlas, .most_resident_bricks = 45}},
    };
    return all;
}

class FramesTest : public GpuTest {
 protected:
    Scene scene_of(const Case& one, int frame) const {
        Scene scene;
        scene.size_px = {48, 40};
        scene.camera = frame_volume(volume_.grid(), {-0.6, -0.5, 0.3}, {0, 0, 1});
        scene.camera = orbit(scene.camera, 3.0 * frame);
        one.look(scene);
        if (one.labels)
            scene.labels = LabelLayer{};
        return scene;
    }
    SceneData data_of(const Case& one) const {
        SceneData data{volume_, std::nullopt};
        if (one.labels)
            data.labels = labels_;
        if (one.meshes)
            data.meshes = {
                std::make_shared<Mesh>(testing_meshes::torus({0, 0, 0}, 60, 20)),
                std::make_shared<Mesh>(testing_meshes::box({-40, -90, -40}, {30, -20, 30}))};
        return data;
    }
    // The same volume with a hole, another one each time.
    static void dab(Volume& volume, int i) {
        VolumeEdit edit(volume);
        for (int z = -3; z <= 3; ++z)
            for (int y = -3; y <= 3; ++y)
                for (int x = -3; x <= 3; ++x)
                    edit.set(glm::uvec3(50 + 4 * i + x, 50 + y, 50 + z), i % 2 ? -1000.0 : 1200.0);
        volume = edit.commit();
    }

    static constexpr int kWarm = 3, kMore = 5;
    const Grid grid_ = make_grid({100, 100, 100}, glm::dvec3(2), glm::dvec3(-99));
    const Volume volume_ = synthetic::sample_ct_phantom(grid_);
    const Volume labels_ =
        make_volume(grid_, ScalarType::u8, [](glm::uvec3 i) { return (i.x / 25 + i.y / 25) % 3; });
};

TEST_F(FramesTest, CreateNothingWhileTheCameraMoves) {
    for (const Case& one : cases()) {
        SCOPED_TRACE(one.name);
        const SceneData data = data_of(one);
        Renderer renderer(device(), one.options);
        const auto draw = [&](int frame) {
            const Result<Frame> drawn = renderer.render(scene_of(one, frame), data);
            EXPECT_TRUE(drawn) << drawn.error().message;
        };
        for (int frame = 0; frame < kWarm; ++frame)
            draw(frame);
        const CreatedObjects created;
        for (int frame = kWarm; frame < kWarm + kMore; ++frame)
            draw(frame);
        EXPECT_EQ(created.count(), 0u);
    }
}

TEST_F(FramesTest, CreateNothingWhileTheVolumeIsEdited) {
    for (const Case& one : cases()) {
        SCOPED_TRACE(one.name);
        SceneData data = data_of(one);
        Renderer renderer(device(), one.options);
        const auto draw = [&](int frame) {
            dab(data.volume, frame);
            const Result<Frame> drawn = renderer.render(scene_of(one, frame), data);
            EXPECT_TRUE(drawn) << drawn.error().message;
        };
        for (int frame = 0; frame < kWarm; ++frame)
            draw(frame);
        const CreatedObjects created;
        for (int frame = kWarm; frame < kWarm + kMore; ++frame)
            draw(frame);
        EXPECT_EQ(created.count(), 0u);
    }
}

TEST_F(FramesTest, CreateNothingWhileTheyAreInteractive) {
    for (const Case& one : cases()) {
        const Scene first = scene_of(one, 0);
        if (!first.ray_cast || one.options.most_resident_bricks > 0)
            continue;
        SCOPED_TRACE(one.name);
        const SceneData data = data_of(one);
        Renderer renderer(device(), one.options);
        const auto draw = [&](int frame) {
            const Scene scene = scene_of(one, frame);
            EXPECT_TRUE(renderer.draw_coarse(
                scene, data, {.step_factor = 2.0, .px_per_ray = frame % 2 ? 2u : 4u}));
            EXPECT_TRUE(renderer.refine(scene, data, 1, 2));
        };
        for (int frame = 0; frame < kWarm; ++frame)
            draw(frame);
        const CreatedObjects created;
        for (int frame = kWarm; frame < kWarm + kMore; ++frame)
            draw(frame);
        EXPECT_EQ(created.count(), 0u);
    }
}

TEST_F(FramesTest, CreateNothingForAnotherTransferFunction) {
    const Case& one = cases()[1];
    const SceneData data = data_of(one);
    Renderer renderer(device());
    const auto draw = [&](int frame) {
        Scene scene = scene_of(one, 0);
        scene.ray_cast->transfer = window_function(100 + 10 * frame, 1500, 0.3);
        EXPECT_TRUE(renderer.draw(scene, data));
    };
    for (int frame = 0; frame < kWarm; ++frame)
        draw(frame);
    const CreatedObjects created;
    for (int frame = kWarm; frame < kWarm + kMore; ++frame)
        draw(frame);
    EXPECT_EQ(created.count(), 0u);
}

} // namespace
} // namespace palpate
