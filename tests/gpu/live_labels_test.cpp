// Surfaces of labels that are drawn from the map: the picture is that of the mesh of the whole map,
// an edit costs what it touches, and another style costs no triangle.

#include "engine/render/changed_pixels.h"
#include "engine/render/interactive.h"
#include "engine/surface/block_nets.h"
#include "engine/surface/net_normals.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "tests/gpu/surface_scenes.h"

namespace palpate::live_labels {
namespace {

using namespace testing_meshes;

using LiveLabels = SurfaceTest;

constexpr uint32_t kLabels = 5; // 0 .. 4

// Balls of labels over one another, on a grid of their own.
Volume ball_labels(uint32_t seed, glm::uvec3 size = {44, 40, 30}) {
    std::mt19937 random(seed);
    struct Ball {
        glm::dvec3 middle;
        double radius;
        double label;
    };
    std::vector<Ball> balls;
    for (int n = 0; n < 14; ++n)
        balls.push_back({glm::dvec3(random() % size.x, random() % size.y, random() % size.z),
                         3.0 + random() % 8, double(random() % kLabels)});
    return make_volume(make_grid(size, {1.1, 1.2, 1.4}, glm::dvec3(-22.0)), ScalarType::u8,
                       [&](glm::uvec3 i) {
                           double label = 0.0;
                           for (const Ball& ball : balls)
                               if (glm::length(glm::dvec3(i) - ball.middle) < ball.radius)
                                   label = ball.label;
                           return label;
                       });
}

Volume edited(const Volume& labels, std::mt19937& random) {
    VolumeEdit edit(labels);
    const glm::ivec3 size(labels.size());
    const glm::ivec3 middle(random() % size.x, random() % size.y, random() % size.z);
    const auto was = static_cast<uint32_t>(labels.value(glm::uvec3(middle)));
    const double label = (was + 1 + random() % (kLabels - 1)) % kLabels; // another one
    for (int z = -3; z <= 3; ++z)
        for (int y = -3; y <= 3; ++y)
            for (int x = -3; x <= 3; ++x) {
                const glm::ivec3 at = middle + glm::ivec3(x, y, z);
                if (x * x + y * y + z * z <= 10 && at == glm::clamp(at, glm::ivec3(0), size - 1))
                    edit.set(glm::uvec3(at), label);
            }
    return edit.commit();
}

Scene live_scene() {
    Scene scene = scene_of({SurfaceLayer{.live_labels = true}});
    scene.labels = LabelLayer{};
    return scene;
}

SceneData live_data(Volume labels) {
    return {ball_volume(), std::move(labels), {nullptr}};
}

// They stand for the walls of the whole map, with the labels' styles as the mesh's.
SceneData mesh_data(const SceneData& live) {
    const BlockNetsOptions options;
    Mesh mesh =
        surface_nets(*live.labels, {.rounds = options.rounds, .bound = options.bound, .stop = {}});
    mesh.normals = wall_normals(mesh, options.normal_rounds);
    SceneData data = live;
    data.meshes[0] = shared(std::move(mesh));
    return data;
}

Scene mesh_scene(Scene scene) {
    SurfaceLayer& layer = scene.surfaces[0];
    layer.live_labels = false;
    for (uint32_t label = 0; label < kLabels; ++label)
        layer.label_styles.push_back(style_of(layer, *scene.labels, label));
    return scene;
}

void set_style(Scene& scene, uint32_t label, double opacity, bool visible) {
    std::vector<LabelStyle>& styles = scene.labels->styles;
    while (styles.size() <= label)
        styles.push_back(style_of(LabelLayer{}, static_cast<uint32_t>(styles.size())));
    styles[label].opacity = opacity;
    styles[label].visible = visible;
}

TEST_F(LiveLabels, PictureIsThatOfTheMeshOfTheWholeMap) {
    const SceneData live = live_data(ball_labels(3)), mesh = mesh_data(live);
    ASSERT_GT(mesh.meshes[0]->triangles.size(), 5000u);
    std::vector<Scene> scenes(5, live_scene());
    set_style(scenes[1], 2, 0.4, true);
    scenes[1].surfaces[0].style.opacity = 0.8;
    scenes[1].clip_planes = {{{0, 0, 0}, {0.3, 1, 0.2}}};
    scenes[1].stereo = StereoSettings{};
    set_style(scenes[2], 1, 1.0, false);
    set_style(scenes[2], 3, 0.0, true);
    add_slices(scenes[2]);
    add_rays(scenes[2], RayMode::alpha);
    scenes[3].clip_planes = {{{0, 0, 0}, {0.3, 1, 0.2}}};
    scenes[4].surfaces[0].style.opacity = 0.0;
    for (const Scene& scene : scenes)
        EXPECT_TRUE(same_bits(drawn(scene, live), drawn(mesh_scene(scene), mesh)));
}

// Each edit compares the renderer that has seen all before with the mesh of the whole map. Labels
// go, and come again on another grid.
TEST_F(LiveLabels, AfterEditsThePictureIsThatOfTheMeshFromScratch) {
    std::mt19937 random(5);
    SceneData data = live_data(ball_labels(4, {80, 40, 30}));
    Renderer renderer(device());
    const Scene scene = live_scene();
    const Result<Frame> first = renderer.render(scene, data);
    ASSERT_TRUE(first) << first.error().message;
    for (int i = 0; i < 6; ++i) {
        SCOPED_TRACE(i);
        if (i < 4)
            data.labels = edited(*data.labels, random);
        if (i == 5)
            data.labels = ball_labels(6);
        Scene wanted = scene;
        if (i == 4)
            wanted.labels.reset();
        SceneData given = data;
        if (i == 4)
            given.labels.reset();
        const Result<Frame> frame = renderer.render(wanted, given);
        ASSERT_TRUE(frame) << frame.error().message;
        if (i == 4) { // nothing but the background
            const Image& picture = frame->eyes[0];
            const size_t channels = picture.channels.size();
            for (size_t p = 0; p < picture.samples.size(); p += channels)
                ASSERT_EQ(picture.samples[p], static_cast<float>(wanted.background.x));
            continue;
        }
        EXPECT_TRUE(same_bits(frame->eyes, drawn(mesh_scene(scene), mesh_data(data))));
        if (i < 4) {
            EXPECT_GT(frame->stats.made_blocks, 0u);
            EXPECT_LT(frame->stats.made_blocks, first->stats.made_blocks);
        }
        const Result<Frame> again = renderer.render(wanted, given);
        ASSERT_TRUE(again);
        EXPECT_EQ(again->stats.made_blocks, 0u);
    }
}

// All walls, or a part of them, lie behind the eye.
TEST_F(LiveLabels, OfACameraThatLooksAwayThePictureIsTheMeshs) {
    const SceneData live = live_data(ball_labels(8)), mesh = mesh_data(live);
    const Grid& grid = live.labels->grid();
    const glm::dvec3 middle = world_point(grid, 0.5 * glm::dvec3(grid.size));
    for (const double turn : {0.0, 0.5, 1.0}) { // of half a circle
        SCOPED_TRACE(turn);
        Scene scene = live_scene();
        const glm::dvec3 eye = turn == 0.5 ? middle : scene.camera.eye_mm;
        const glm::dvec3 away = glm::normalize(scene.camera.eye_mm - scene.camera.target_mm);
        scene.camera.eye_mm = eye;
        scene.camera.target_mm = eye + (turn == 0.0 ? -away : away);
        Renderer renderer(device());
        const Result<Frame> frame = renderer.render(scene, live);
        ASSERT_TRUE(frame);
        EXPECT_TRUE(same_bits(frame->eyes, drawn(mesh_scene(scene), mesh)));
    }
}

TEST_F(LiveLabels, AnotherStyleMakesNoTriangle) {
    const SceneData live = live_data(ball_labels(8)), mesh = mesh_data(live);
    Renderer renderer(device());
    Scene scene = live_scene();
    ASSERT_TRUE(renderer.draw(scene, live));
    set_style(scene, 2, 1.0, false);
    set_style(scene, 3, 0.5, true);
    const uint64_t before = device().traffic().uploaded_bytes;
    const Result<Frame> frame = renderer.render(scene, live);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->stats.made_blocks, 0u);
    EXPECT_LT(device().traffic().uploaded_bytes - before, 16384u); // styles and frames alone
    EXPECT_TRUE(same_bits(frame->eyes, drawn(mesh_scene(scene), mesh)));
}

// An edit redraws a box of pixels of a picture with rays, and that is the whole picture.
TEST_F(LiveLabels, OutsideOfChangedPixelsNothingChanges) {
    for (const bool rays : {false, true}) {
        Scene scene = live_scene();
        scene.value_and_depth = false;
        if (rays)
            add_rays(scene, RayMode::alpha);
        std::mt19937 random(7);
        SceneData data = live_data(ball_labels(9, {80, 40, 30}));
        Renderer whole(device()), kept(device());
        Interactive interactive(kept, 1e9);
        Frame last = whole.render(scene, data).value();
        while (rays && !interactive.draw(scene, data).value().complete) {
        }
        size_t small = 0;
        for (int i = 0; i < 6; ++i) {
            SCOPED_TRACE(i);
            const Volume before = *data.labels;
            data.labels = edited(before, random);
            const PixelBox box = changed_pixels(scene, before, *data.labels);
            const Frame now = whole.render(scene, data).value();
            const Image &a = last.eyes[0], &b = now.eyes[0];
            const size_t channels = a.channels.size();
            for (uint32_t y = 0; y < a.size_px.y; ++y)
                for (uint32_t x = 0; x < a.size_px.x; ++x) {
                    const size_t at = (size_t{y} * a.size_px.x + x) * channels;
                    const bool in_box =
                        x >= box.low.x && x < box.high.x && y >= box.low.y && y < box.high.y;
                    ASSERT_TRUE(in_box || std::equal(&a.samples[at], &a.samples[at] + channels,
                                                     &b.samples[at]));
                }
            small += box != PixelBox{glm::uvec2(0), scene.size_px};
            if (rays) {
                const auto frame = interactive.draw(scene, data, box);
                ASSERT_TRUE(frame) << frame.error().message;
                EXPECT_TRUE(frame->complete);
                EXPECT_TRUE(same_bits(kept.read_back(), now.eyes));
            }
            last = now;
        }
        EXPECT_GT(small, 0u);
    }
}

} // namespace
} // namespace palpate::live_labels
