// Several views of one volume: pictures as of renderers of their own, and what they share lies on
// the device once.

#include <deque>
#include <map>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/created.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/recording.h"
#include "tests/gpu/surface_meshes.h"

namespace palpate {
namespace {

RayCastLayer rays_of(RayMode mode) {
    RayCastLayer layer;
    layer.mode = mode;
    layer.transfer = window_function(100, 1500, mode == RayMode::mip ? 1.0 : 0.3);
    layer.isos = {{300.0}};
    if (mode == RayMode::alpha)
        layer.shading = Shading{};
    return layer;
}

SliceLayer slice_of(int axis, double at_mm) {
    SliceLayer slice;
    slice.normal = glm::dvec3(axis == 0, axis == 1, axis == 2);
    slice.point_mm = at_mm * slice.normal;
    return slice;
}

// Three slices, one with labels, and four that cast rays: two of one look, one of these for two
// eyes.
constexpr int kViewCount = 7;

// ViewsTest takes over 5 s of a processor: seven views are drawn in each frame, and once more by
// renderers of their own.
class ViewsTest : public GpuTest {
 protected:
    Scene scene_of(int view, int frame) const {
        Scene scene;
        scene.size_px = glm::uvec2(30 + 9 * view, 52 - 5 * view);
        scene.camera = frame_volume(grid_, {-0.6, -0.5, 0.3}, {0, 0, 1});
        scene.camera = orbit(scene.camera, 40.0 * view + 3.0 * frame);
        scene.slice_transfer = window_function(-500, 1500, 1.0);
        if (view < 3)
            scene.slices = {slice_of(view, 7.0 * frame - 30.0)};
        if (view == 2)
            scene.labels = LabelLayer{};
        if (view >= 3)
            scene.ray_cast = rays_of(view == 3   ? RayMode::mip
                                     : view == 6 ? RayMode::iso
                                                 : RayMode::alpha);
        if (view == 5) {
            scene.stereo = StereoSettings{};
            scene.slices = {slice_of(1, 20.0)};
        }
        if (view == 6)
            scene.surfaces.resize(1);
        return scene;
    }
    SceneData data_of(int view, const Volume& volume) const {
        SceneData data{volume, std::nullopt, {}};
        if (view == 2)
            data.labels = labels_;
        if (view == 6)
            data.meshes = {mesh_};
        return data;
    }
    // The volume with a hole, or something in it, at another place each time.
    static Volume dabbed(const Volume& volume, int i) {
        VolumeEdit edit(volume);
        for (int z = -3; z <= 3; ++z)
            for (int y = -3; y <= 3; ++y)
                for (int x = -3; x <= 3; ++x)
                    edit.set(glm::uvec3(30 + 5 * i % 50 + x, 50 + y, 50 + z),
                             i % 2 ? -1000.0 : 1200.0);
        return edit.commit();
    }
    static std::deque<Renderer> views_of_one_store(int count, RendererOptions options = {}) {
        std::deque<Renderer> views;
        views.emplace_back(device(), std::move(options));
        while (static_cast<int>(views.size()) < count)
            views.emplace_back(views.front().store());
        return views;
    }
    // The resources on the device under a name.
    struct Held {
        size_t count = 0;
        uint64_t bytes = 0;
    };
    static Held held(const std::string& name) {
        Held held;
        for (const ResourceInfo& resource : device().resources())
            if (resource.name == name) {
                ++held.count;
                held.bytes += resource.bytes;
            }
        return held;
    }
    static bool is_there(const std::string& name) { return held(name).count > 0; }

    const Grid grid_ = make_grid({100, 100, 100}, glm::dvec3(2), glm::dvec3(-99));
    const Volume volume_ = synthetic::sample_ct_phantom(grid_);
    const Volume labels_ =
        make_volume(grid_, ScalarType::u8, [](glm::uvec3 i) { return (i.x / 25 + i.y / 25) % 3; });
    const std::shared_ptr<const Mesh> mesh_ =
        std::make_shared<Mesh>(testing_meshes::torus_mesh({0, 0, 0}, 60, 20));
};

// Frames of all views recorded into the same commands, without waiting, while the volume is edited,
// and some views are left out of some frames.
TEST_F(ViewsTest, PicturesAreThoseOfRenderersOfTheirOwn) {
    const std::pair<const char*, RendererOptions> options[] = {
        {"dense", {.residency = Residency::dense}},
        {"gradients", {.residency = Residency::dense, .stored_gradients = true}},
        // by hand, because the device's sampler rounds by where a brick lies in the atlas
        {"atlas", {.residency = Residency::atlas, .sampling = Sampling::by_hand}},
        {"room for some views",
         {.residency = Residency::atlas,
          .most_resident_bricks = 50,
          .sampling = Sampling::by_hand}},
        {"in parts",
         {.residency = Residency::atlas,
          .most_resident_bricks = 30,
          .sampling = Sampling::by_hand}},
    };
    for (const auto& [name, option] : options) {
        SCOPED_TRACE(name);
        std::deque<Renderer> views = views_of_one_store(kViewCount, option);
        std::deque<Renderer> alone;
        for (int view = 0; view < kViewCount; ++view)
            alone.emplace_back(device(), option);
        Volume volume = volume_;
        for (int frame = 0; frame < 6; ++frame) {
            if (frame > 1)
                volume = dabbed(volume, frame);
            std::deque<Recording> recordings;
            const auto is_shown = [&](int view) { return (view + frame) % 3 != 0 || frame == 0; };
            Commands commands(device());
            for (int view = 0; view < kViewCount; ++view)
                if (is_shown(view)) {
                    recordings.emplace_back(commands);
                    recordings.back().take(
                        views[view].record(commands, scene_of(view, frame), data_of(view, volume)));
                }
            commands.submit();
            commands.finish();
            for (int view = 0; view < kViewCount; ++view) {
                if (!is_shown(view))
                    continue;
                const Scene scene = scene_of(view, frame);
                const Result<Frame> expected = alone[view].render(scene, data_of(view, volume));
                ASSERT_TRUE(expected) << expected.error().message;
                for (uint32_t eye = 0; eye < expected->eyes.size(); ++eye)
                    EXPECT_TRUE(recordings.front().eye(eye) == expected->eyes[eye].samples)
                        << "frame " << frame << ", view " << view;
                recordings.pop_front();
            }
        }
    }
}

TEST_F(ViewsTest, WhatTheyShareLiesOnTheDeviceOnce) {
    const RendererOptions options{.residency = Residency::dense, .stored_gradients = true};
    const std::string shared[] = {"volume", "gradients", "macro-cells", "transfer function"};
    std::deque<Renderer> views = views_of_one_store(1, options);
    ASSERT_TRUE(views[0].draw(scene_of(4, 0), data_of(4, volume_)));
    std::map<std::string, uint64_t> before;
    for (const std::string& name : shared) {
        EXPECT_EQ(held(name).count, 1u) << name;
        before[name] = held(name).bytes;
    }
    const uint64_t all_before = device().resource_bytes();
    uint64_t pictures = 0;
    for (int more = 0; more < 3; ++more) {
        Scene scene = scene_of(4, 1 + more);
        scene.size_px = {40, 24};
        views.emplace_back(views[0].store());
        ASSERT_TRUE(views.back().draw(scene, data_of(4, volume_)));
        pictures += uint64_t{40} * 24 * sizeof(glm::vec4);
    }
    for (const std::string& name : shared) {
        EXPECT_EQ(held(name).count, 1u) << name;
        EXPECT_EQ(held(name).bytes, before[name]) << name;
    }
    // A view's own: its picture and lists of its tiles, of less than 64 KiB.
    EXPECT_LE(device().resource_bytes() - all_before, pictures + 3 * (64 << 10));
    EXPECT_GT(before["volume"], uint64_t{2} << 20);
}

// Meshes, and live surfaces made by either: uploaded or extracted once for two views and the eyes
// of one, and brought up to date once; a view that stays behind gets its own.
TEST_F(ViewsTest, SurfacesLieThereOnceAndChangeOnce) {
    const auto moved_mesh = std::make_shared<Mesh>(*mesh_);
    for (size_t i = 40; i < 60; ++i)
        moved_mesh->positions[i] *= 1.05f;
    const std::shared_ptr<const Mesh> meshes[] = {mesh_, moved_mesh};
    const Volume volumes[] = {volume_, dabbed(volume_, 1)};
    struct Kind {
        const char* name;
        const char* triangles; // of the buffer
        bool live;
        BlockMaker maker;
    };
    for (const Kind& kind : {Kind{"mesh", "surface 1 triangles", false, BlockMaker::cpu},
                             {"live, by the device", "surface triangles", true, BlockMaker::device},
                             {"live, by the CPU", "surface triangles", true, BlockMaker::cpu}}) {
        SCOPED_TRACE(kind.name);
        const RendererOptions options{.block_maker = kind.maker};
        std::deque<Renderer> views = views_of_one_store(2, options);
        const auto scene_for = [&](int view) {
            Scene scene = scene_of(6, 2 * view);
            scene.ray_cast.reset();
            if (view == 1)
                scene.stereo = StereoSettings{};
            if (kind.live)
                scene.surfaces[0].live_iso = 300.0;
            return scene;
        };
        const auto data_for = [&](int state) {
            SceneData data{volumes[kind.live ? state : 0], std::nullopt, {nullptr}};
            if (!kind.live)
                data.meshes = {meshes[state]};
            return data;
        };
        // Draws, checks the picture, and tells what it uploaded and extracted.
        const auto draw = [&](int view, int state) {
            const uint64_t before = device().traffic().uploaded_bytes;
            const Result<Frame> frame = views[view].render(scene_for(view), data_for(state));
            const uint64_t bytes = device().traffic().uploaded_bytes - before;
            Renderer alone(device(), options);
            const Result<Frame> expected = alone.render(scene_for(view), data_for(state));
            EXPECT_TRUE(frame && expected);
            for (size_t eye = 0; eye < expected->eyes.size(); ++eye)
                EXPECT_TRUE(frame->eyes[eye].samples == expected->eyes[eye].samples) << eye;
            return std::pair(bytes, frame->stats.made_blocks);
        };
        const auto nothing = [](const std::pair<uint64_t, size_t>& cost) {
            return cost.first < 4096 && cost.second == 0; // styles of the view's own
        };
        const auto first = draw(0, 0);
        EXPECT_GT(first.first, 20'000u);
        EXPECT_TRUE(nothing(draw(1, 0)));
        EXPECT_EQ(held(kind.triangles).count, 1u);
        const auto changed = draw(1, 1); // the second view comes first
        EXPECT_GT(changed.first, 0u);
        EXPECT_LT(changed.first, first.first / 2);
        EXPECT_TRUE(nothing(draw(0, 1)));
        EXPECT_EQ(held(kind.triangles).count, 1u);
        EXPECT_FALSE(nothing(draw(0, 0))); // back, and the other view stays
        EXPECT_FALSE(nothing(draw(1, 1)));
        EXPECT_EQ(held(kind.triangles).count, 2u);
        EXPECT_TRUE(nothing(draw(0, 0)));
        EXPECT_TRUE(nothing(draw(1, 1)));
        EXPECT_TRUE(nothing(draw(0, 1))); // together again
        EXPECT_EQ(held(kind.triangles).count, 1u);
        views.pop_back();
        EXPECT_EQ(held(kind.triangles).count, 1u);
        views.pop_back();
        EXPECT_EQ(held(kind.triangles).count, 0u);
    }
}

// Two layers of one scene: the same mesh, then one of them another.
TEST_F(ViewsTest, LayersThatShareAMeshPart) {
    const auto other = std::make_shared<Mesh>(testing_meshes::torus_mesh({10, 0, 20}, 50, 15));
    Scene scene = scene_of(6, 0);
    scene.ray_cast.reset();
    scene.surfaces.resize(2);
    scene.surfaces[1].style.opacity = 0.5;
    Renderer renderer(device());
    SceneData data{volume_, std::nullopt, {}};
    using Meshes = std::vector<std::shared_ptr<const Mesh>>;
    for (const Meshes& meshes :
         {Meshes{mesh_, mesh_}, {mesh_, other}, {other, mesh_}, {other, other}, {mesh_, other}}) {
        data.meshes = meshes;
        const Result<Frame> frame = renderer.render(scene, data);
        EXPECT_EQ(held("surface 1 triangles").count + held("surface 2 triangles").count,
                  (meshes[0] == meshes[1] ? 1u : 2u));
        Renderer alone(device());
        const Result<Frame> expected = alone.render(scene, data);
        ASSERT_TRUE(frame && expected);
        EXPECT_TRUE(frame->eyes[0].samples == expected->eyes[0].samples);
    }
}

TEST_F(ViewsTest, AnAtlasLiesThereOnceToo) {
    std::deque<Renderer> views = views_of_one_store(4, {.residency = Residency::atlas});
    for (int view = 0; view < 4; ++view)
        ASSERT_TRUE(views[view].draw(scene_of(4, view), data_of(4, volume_)));
    EXPECT_EQ(held("volume atlas").count, 1u);
    EXPECT_EQ(held("volume pages").count, 1u);
}

TEST_F(ViewsTest, WhatNoViewShowsGoes) {
    std::deque<Renderer> views = views_of_one_store(1, {.residency = Residency::dense});
    const auto draw = [&](int i, int view) {
        return views[i].draw(scene_of(view, 0), data_of(view, volume_)).has_value();
    };
    ASSERT_TRUE(draw(0, 6));
    {
        Renderer labels(views[0].store());
        ASSERT_TRUE(labels.draw(scene_of(2, 0), data_of(2, volume_)));
        EXPECT_TRUE(is_there("labels"));
        EXPECT_TRUE(is_there("transfer function"));
        ASSERT_TRUE(draw(0, 6));
        EXPECT_TRUE(is_there("labels")) << "the other view still shows them";
    }
    EXPECT_FALSE(is_there("labels"));
    EXPECT_FALSE(is_there("transfer function"));
    EXPECT_TRUE(is_there("volume"));
    EXPECT_TRUE(is_there("macro-cells"));
    Scene surface = scene_of(6, 0);
    surface.ray_cast.reset();
    ASSERT_TRUE(views[0].draw(surface, data_of(6, volume_)));
    EXPECT_FALSE(is_there("volume"));
    EXPECT_FALSE(is_there("macro-cells"));
    ASSERT_TRUE(draw(0, 6));
}

// Views in turn, each with bricks of its own.
TEST_F(ViewsTest, AnAtlasKeepsWhatTheOthersNeedWhereItHasRoom) {
    for (const size_t most : {size_t{0}, size_t{16}}) {
        std::deque<Renderer> views =
            views_of_one_store(3, {.residency = Residency::atlas, .most_resident_bricks = most});
        size_t uploaded = 0;
        for (int round = 0; round < 3; ++round) {
            for (int view = 0; view < 3; ++view) {
                Scene scene = scene_of(view, 0);
                scene.camera = orbit(scene.camera, 5.0 * round);
                scene.slices = {slice_of(view, -50.0)}; // within one layer of bricks
                const Result<FrameStats> stats = views[view].draw(scene, data_of(view, volume_));
                ASSERT_TRUE(stats) << stats.error().message;
                EXPECT_TRUE(stats->atlas);
                EXPECT_LE(stats->needed_bricks, 16u) << "of a plane";
                uploaded += stats->uploaded_bricks;
                if (most == 0 && round > 0) {
                    EXPECT_EQ(stats->uploaded_bricks, 0u);
                }
            }
            if (most == 0 && round == 0) {
                EXPECT_GT(uploaded, 16u);
            }
        }
        if (most > 0) {
            EXPECT_GT(uploaded, 3 * 16u) << "bricks take each other's place";
        }
    }
}

TEST_F(ViewsTest, CreateNothingAfterTheThirdFrame) {
    for (const Residency residency : {Residency::dense, Residency::atlas})
        for (const bool edits : {false, true}) {
            std::deque<Renderer> views = views_of_one_store(kViewCount, {.residency = residency});
            Volume volume = volume_;
            const auto draw = [&](int frame) {
                if (edits)
                    volume = dabbed(volume, frame);
                Commands commands(device());
                for (int view = 0; view < kViewCount; ++view) {
                    Scene scene = scene_of(view, frame);
                    if (edits) // and another window, in all views at a time
                        scene.slice_transfer = window_function(-500, 1000 + 9 * frame, 1.0);
                    if (edits && view >= 4 && view < 6)
                        scene.ray_cast->transfer = window_function(100, 1000 + 9 * frame, 0.3);
                    ASSERT_TRUE(views[view].record(commands, scene, data_of(view, volume)));
                }
                commands.submit();
                commands.finish();
            };
            for (int frame = 0; frame < 3; ++frame)
                draw(frame);
            const CreatedObjects created;
            for (int frame = 3; frame < 6; ++frame)
                draw(frame);
            EXPECT_EQ(created.count(), 0u)
                << (residency == Residency::atlas ? "atlas" : "dense") << " edits " << edits;
        }
}

// Another volume, smaller or larger, while the frame before is held back: its image is let go when
// the device is past it.
TEST_F(ViewsTest, AnotherVolumeIsNotWaitedFor) {
    const Grid grid = make_grid({60, 70, 80}, glm::dvec3(2.5), glm::dvec3(-70));
    const Volume other = synthetic::sample_ct_phantom(grid);
    for (const Residency residency : {Residency::dense, Residency::atlas}) {
        std::deque<Renderer> views =
            views_of_one_store(2, {.residency = residency, .sampling = Sampling::by_hand});
        for (int view = 0; view < 2; ++view)
            ASSERT_TRUE(views[view].draw(scene_of(3 + view, 0), data_of(3 + view, volume_)));
        std::deque<Commands> commands;
        std::deque<Recording> recordings;
        commands.emplace_back(device());
        HeldBack held_back(device(), commands.front());
        for (int frame = 0; frame < 2; ++frame) {
            if (frame > 0)
                commands.emplace_back(device());
            for (int view = 0; view < 2; ++view) {
                recordings.emplace_back(commands.back());
                recordings.back().take(
                    views[view].record(commands.back(), scene_of(3 + view, 1),
                                       data_of(3 + view, frame == 0 ? volume_ : other)));
            }
            commands.back().submit();
            EXPECT_TRUE(held_back.is_held());
        }
        held_back.let_go();
        device().wait(device().last_submitted());
        for (int frame = 0; frame < 2; ++frame)
            for (int view = 0; view < 2; ++view) {
                Renderer fresh(device(), {.residency = residency, .sampling = Sampling::by_hand});
                const Result<Frame> expected = fresh.render(
                    scene_of(3 + view, 1), data_of(3 + view, frame == 0 ? volume_ : other));
                ASSERT_TRUE(expected);
                EXPECT_TRUE(recordings.front().eye(0) == expected->eyes[0].samples)
                    << "frame " << frame << ", view " << view;
                recordings.pop_front();
            }
    }
}

// If both do not fit the limit, the first has gone before the second is made.
TEST_F(ViewsTest, AnotherVolumeWaitsForItsRoom) {
    const uint64_t bytes = 100 * 100 * 100 * sizeof(float);
    Renderer renderer(device(), {.memory_limit_bytes = device().resource_bytes() + bytes * 3 / 2,
                                 .residency = Residency::dense});
    ASSERT_TRUE(renderer.draw(scene_of(4, 0), data_of(4, volume_)));
    const Volume other =
        synthetic::sample_ct_phantom(make_grid({100, 100, 99}, glm::dvec3(2), glm::dvec3(-99)));
    Commands commands(device());
    const Result<RecordedFrame> recorded =
        renderer.record(commands, scene_of(4, 0), data_of(4, other));
    ASSERT_TRUE(recorded) << recorded.error().message;
    EXPECT_EQ(device().retired_bytes(), 0u);
    commands.submit();
    commands.finish();
}

} // namespace
} // namespace palpate
