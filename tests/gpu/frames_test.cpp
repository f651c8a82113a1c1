// Frames like the ones before make no Vulkan object and allocate no device memory; and one is
// recorded while the one before is drawn.

#include <algorithm>
#include <deque>
#include <functional>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/created.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/recording.h"
#include "tests/gpu/surface_meshes.h"

namespace palpate {
namespace {

struct Case {
    const char* name;
    std::function<void(Scene&)> look;
    bool meshes = false, labels = false;
    RendererOptions options = {};
    bool live = false;
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

void with_live_surface(Scene& scene) {
    SurfaceLayer live;
    live.live_iso = 300.0;
    scene.surfaces = {live};
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
        {"live surface",
         with_live_surface,
         false,
         false,
         {.block_maker = BlockMaker::device},
         true},
        {"live surface, made by the CPU",
         with_live_surface,
         false,
         false,
         {.block_maker = BlockMaker::cpu},
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
         // by hand, because the device's sampler rounds by where a brick lies in the atlas
         {.residency = Residency::atlas,
          .most_resident_bricks = 45,
          .sampling = Sampling::by_hand}},
    };
    return all;
}

// FramesTest takes over 5 s of a processor: each kind of frame is drawn many times, and the CPU
// driver compiles the shaders of each kind.
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
                std::make_shared<Mesh>(testing_meshes::torus_mesh({0, 0, 0}, 60, 20)),
                std::make_shared<Mesh>(testing_meshes::box({-40, -90, -40}, {30, -20, 30}))};
        if (one.live)
            data.meshes = {nullptr};
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

    static constexpr int kWarm = 3, kMore = 2;
    // draw(frame) draws one; from the fourth on nothing is made.
    template <class Draw>
    static void expect_nothing_created(const Draw& draw) {
        for (int frame = 0; frame < kWarm; ++frame)
            draw(frame);
        const CreatedObjects created;
        for (int frame = kWarm; frame < kWarm + kMore; ++frame)
            draw(frame);
        EXPECT_EQ(created.count(), 0u);
    }
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
        expect_nothing_created(draw);
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
        expect_nothing_created(draw);
    }
}

TEST_F(FramesTest, CreateNothingWhileTheyAreInteractive) {
    for (const Case& one : cases()) {
        const Scene first = scene_of(one, 0);
        if (!first.ray_cast || one.meshes || one.labels || one.options.most_resident_bricks > 0)
            continue;
        SCOPED_TRACE(one.name);
        const SceneData data = data_of(one);
        Renderer renderer(device(), one.options);
        const auto draw = [&](int frame) {
            const Scene scene = scene_of(one, frame);
            EXPECT_TRUE(renderer.draw(
                scene, data,
                CoarseSettings{.step_factor = 2.0, .px_per_ray = frame % 2 ? 2u : 4u}));
            EXPECT_TRUE(renderer.draw(scene, data, TileRows{1, 2}));
        };
        expect_nothing_created(draw);
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

// The first frame is held back by a semaphore until the second one is recorded and submitted, each
// of another snapshot: nothing waits, and nothing that the first one reads is written over.
TEST_F(FramesTest, AreRecordedWhileTheOneBeforeIsDrawn) {
    for (const Case& one : cases()) {
        SCOPED_TRACE(one.name);
        SceneData data = data_of(one);
        Renderer renderer(device(), one.options);
        Renderer waiting(device(), one.options);
        ASSERT_TRUE(renderer.draw(scene_of(one, 0), data));
        const auto expect_same = [&](const Recording& recording, const SceneData& of, int frame) {
            Scene scene = scene_of(one, frame);
            scene.value_and_depth = false;
            const Result<Frame> expected = waiting.render(scene, of);
            ASSERT_TRUE(expected);
            for (uint32_t eye = 0; eye < recording.eyes; ++eye)
                EXPECT_EQ(recording.eye(eye), expected->eyes[eye].samples) << frame;
        };
        Commands first_commands(device()), second_commands(device());
        Recording first(first_commands), second(second_commands);
        HeldBack held_back(device(), first_commands);
        const SceneData before = data;
        first.take(renderer.record(first_commands, scene_of(one, 1), before));
        first_commands.submit();
        dab(data.volume, 2);
        EXPECT_TRUE(held_back.is_held()) << "recording begins before the frame ends";
        second.take(renderer.record(second_commands, scene_of(one, 2), data));
        EXPECT_TRUE(held_back.is_held()) << "nor does it end after it";
        second_commands.submit();
        EXPECT_FALSE(first.ticket->ready() || second.ticket->ready());
        held_back.let_go();
        EXPECT_FALSE(second.ticket->stats().passes.empty());
        EXPECT_TRUE(first.ticket->ready());
        EXPECT_FALSE(first.ticket->stats().passes.empty());
        expect_same(first, before, 1);
        expect_same(second, data, 2);
    }
}

// Pictures from fewer rays and the rows that refine them, recorded while the first is held back:
// those of waiting for each, and so are their statistics.
TEST_F(FramesTest, InteractiveOnesAreRecordedWhileTheOnesBeforeAreDrawn) {
    for (const Case& one : cases()) {
        if (!scene_of(one, 0).ray_cast || one.options.most_resident_bricks > 0)
            continue;
        SCOPED_TRACE(one.name);
        const SceneData data = data_of(one);
        RendererOptions options = one.options;
        options.frames_in_flight = 4;
        options.sampling = Sampling::by_hand; // of an atlas, bricks may lie elsewhere
        Renderer renderer(device(), options), waiting(device(), options);
        const Scene scene = scene_of(one, 1), next = scene_of(one, 2);
        const uint32_t rows = Renderer::tile_rows(scene);
        const CoarseSettings listed{.step_factor = 2.0}, apart{.px_per_ray = 4};
        ASSERT_TRUE(renderer.draw(scene_of(one, 0), data, listed));
        ASSERT_TRUE(waiting.draw(scene_of(one, 0), data, listed));
        std::deque<Commands> commands;
        for (int frame = 0; frame < 4; ++frame)
            commands.emplace_back(device());
        Recording first(commands[0]), upper(commands[1]), lower(commands[2]), last(commands[3]);
        {
            HeldBack held_back(device(), commands[0]);
            first.take(renderer.record(commands[0], scene, data, listed));
            commands[0].submit();
            upper.take(renderer.record(commands[1], scene, data, TileRows{0, rows / 2}));
            commands[1].submit();
            lower.take(
                renderer.record(commands[2], scene, data, TileRows{rows / 2, rows - rows / 2}));
            commands[2].submit();
            last.take(renderer.record(commands[3], next, data, apart));
            commands[3].submit();
            EXPECT_TRUE(held_back.is_held());
        }
        const auto expect_same = [&](const auto& recording, const auto& drawn) {
            ASSERT_TRUE(drawn) << drawn.error().message;
            const std::vector<Image> expected = waiting.read_back();
            for (uint32_t eye = 0; eye < recording.eyes; ++eye)
                EXPECT_EQ(recording.eye(eye), expected[eye].samples);
        };
        const auto expect_same_rays = [](const FrameStats& got, const FrameStats& wanted) {
            ASSERT_TRUE(got.coarse && wanted.coarse);
            const CoarseStats &a = *got.coarse, &b = *wanted.coarse;
            EXPECT_EQ(a.error_estimate, b.error_estimate);
            EXPECT_EQ(a.first_judged, b.first_judged);
            EXPECT_EQ(a.traced_share, b.traced_share);
        };
        const Result<FrameStats> coarse = waiting.draw(scene, data, listed);
        expect_same(first, coarse);
        expect_same_rays(first.ticket->stats(), *coarse);
        expect_same(upper, waiting.draw(scene, data, TileRows{0, rows / 2}));
        expect_same(lower, waiting.draw(scene, data, TileRows{rows / 2, rows - rows / 2}));
        const Result<FrameStats> few = waiting.draw(next, data, apart);
        expect_same(last, few);
        expect_same_rays(last.ticket->stats(), *few);
    }
}

// Two views of one submission, each with its own statistics.
TEST_F(FramesTest, TicketsTellOfTheirOwnPasses) {
    const Case& rays = cases()[1];
    const SceneData data = data_of(rays);
    Renderer first(device()), second(device());
    Scene slices = scene_of(rays, 0);
    slices.ray_cast.reset();
    with_slices(slices);
    Commands commands(device());
    const Result<RecordedFrame> a = first.record(commands, scene_of(rays, 0), data);
    const Result<RecordedFrame> b = second.record(commands, slices, data);
    ASSERT_TRUE(a && b);
    commands.submit();
    const auto has = [](const FrameStats& stats, const std::string& name) {
        return std::any_of(stats.passes.begin(), stats.passes.end(),
                           [&](const PassTime& pass) { return pass.name == name; });
    };
    EXPECT_TRUE(has(a->ticket.stats(), "ray cast"));
    EXPECT_FALSE(has(a->ticket.stats(), "slices"));
    EXPECT_TRUE(has(b->ticket.stats(), "slices"));
    EXPECT_FALSE(has(b->ticket.stats(), "ray cast"));
}

// The third frame waits for the first, and for no other.
TEST_F(FramesTest, NoMoreAreInFlightThanAskedFor) {
    const Case& one = cases()[1];
    const SceneData data = data_of(one);
    Renderer renderer(device());
    std::vector<uint64_t> values;
    for (int frame = 0; frame < 8; ++frame) {
        Commands commands(device());
        ASSERT_TRUE(renderer.record(commands, scene_of(one, frame), data));
        const uint64_t one_but_last = frame < 2 ? 0 : values[frame - 2];
        EXPECT_GE(device().passed(), one_but_last);
        values.push_back(commands.submit());
    }
}

} // namespace
} // namespace palpate
