// The pixels in which an edit can be seen are drawn: no pixel outside of them changes, and the
// drawing of them over the frame before is the whole frame's to the bit.

#include "engine/render/changed_pixels.h"

#include <random>

#include "engine/render/interactive.h"
#include "engine/render/seen_box.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

// ChangedPixelsTest takes over 5 s of a processor: a frame after an edit is compared with one that
// is drawn anew, both by a CPU driver.
class ChangedPixelsTest : public GpuTest {
 protected:
    ChangedPixelsTest()
        : volume_(synthetic::sample(synthetic::ct_phantom(), grid(), ScalarType::i16)),
          labels_(VolumeBuilder(grid(), ScalarType::u8).finish()) {}
    static Grid grid() {
        const glm::uvec3 size(90, 70, 50);
        const glm::dvec3 spacing(2.0, 2.5, 4.0);
        return make_grid(size, spacing, -0.5 * (glm::dvec3(size) - 1.0) * spacing);
    }
    // A ball of samples in a random place.
    Volume edited(const Volume& before, double value) {
        VolumeEdit edit(before);
        const glm::ivec3 size(before.size());
        const glm::ivec3 at(random_() % 90, random_() % 70, random_() % 50);
        for (int z = -2; z <= 2; ++z)
            for (int y = -2; y <= 2; ++y)
                for (int x = -2; x <= 2; ++x)
                    if (const glm::ivec3 p = at + glm::ivec3(x, y, z);
                        glm::all(glm::greaterThanEqual(p, glm::ivec3(0))) &&
                        glm::all(glm::lessThan(p, size)))
                        edit.set(glm::uvec3(p), value);
        return edit.commit();
    }
    std::vector<Scene> scenes() const {
        Scene scene;
        scene.size_px = {151, 117};
        scene.camera = frame_volume(grid(), {-0.6, -0.5, 0.3}, {0, 0, 1});
        scene.slice_transfer = window_function(-500, 1500, 1.0);
        std::vector<Scene> all;
        for (const double slab_mm : {0.0, 9.0})
            for (const Interpolation kind : {Interpolation::linear, Interpolation::cubic}) {
                Scene sliced = scene;
                sliced.slices = {{{3.0, 1.0, 5.0}, {0.2, 0.1, 1.0}, kind, slab_mm},
                                 {{-9.0, 4.0, 0.0}, {1.0, 0.0, 0.0}, kind, slab_mm}};
                sliced.camera.projection =
                    slab_mm > 0.0 ? Projection::orthographic : Projection::perspective;
                all.push_back(sliced);
            }
        for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
            Scene cast = scene;
            RayCastLayer layer;
            layer.mode = mode;
            layer.transfer = window_function(-100, 1200, mode == RayMode::mip ? 1.0 : 0.05);
            layer.isos = {{300.0}};
            if (mode == RayMode::alpha) {
                layer.shading = Shading{};
                cast.stereo = StereoSettings{};
            }
            cast.ray_cast = layer;
            all.push_back(cast);
        }
        all.push_back(all.back()); // rays before slices
        all.back().slices = {{{3.0, 1.0, 5.0}, {0.2, 0.1, 1.0}, Interpolation::linear, 0.0}};
        for (Scene& one : all)
            one.labels = LabelLayer{.outline_px = 2.0};
        return all;
    }
    static size_t differing(const Image& a, const Image& b, const PixelBox* outside) {
        size_t count = 0;
        const size_t channels = a.channels.size();
        for (uint32_t y = 0; y < a.size_px.y; ++y)
            for (uint32_t x = 0; x < a.size_px.x; ++x) {
                const glm::uvec2 p(x, y);
                if (outside && glm::all(glm::greaterThanEqual(p, outside->low)) &&
                    glm::all(glm::lessThan(p, outside->high)))
                    continue;
                const size_t at = (size_t{y} * a.size_px.x + x) * channels;
                count += !std::equal(&a.samples[at], &a.samples[at] + channels, &b.samples[at]);
            }
        return count;
    }
    std::mt19937 random_{5};
    Volume volume_, labels_;
};

TEST_F(ChangedPixelsTest, OutsideOfThemNothingChangesAndOverTheFrameBeforeTheyAreTheWholeFrame) {
    size_t missed_slices = 0, changed_pictures = 0;
    for (const Scene& scene : scenes()) {
        Renderer whole(device()), kept(device());
        Interactive interactive(kept, 1e9);
        SceneData before{volume_, labels_, {}};
        Frame last = whole.render(scene, before).value();
        if (scene.ray_cast)
            while (!interactive.draw(scene, before).value().complete) {
            }
        else
            ASSERT_TRUE(kept.draw(scene, before));
        for (int i = 0; i < 12; ++i) {
            SceneData now = before;
            if (i % 3 == 2)
                now.labels = edited(*before.labels, 3.0);
            else
                now.volume = edited(before.volume, i % 2 ? 3000.0 : -1000.0);
            const PixelBox box = united(changed_pixels(scene, before.volume, now.volume),
                                        changed_pixels(scene, *before.labels, *now.labels));
            Frame next = whole.render(scene, now).value();
            for (size_t eye = 0; eye < next.eyes.size(); ++eye) {
                EXPECT_EQ(differing(last.eyes[eye], next.eyes[eye], &box), 0u);
                changed_pictures += differing(last.eyes[eye], next.eyes[eye], nullptr) > 0;
            }
            missed_slices += box.empty();
            if (scene.ray_cast) {
                const InteractiveFrame drawn = interactive.draw(scene, now, box).value();
                EXPECT_TRUE(drawn.complete);
                EXPECT_EQ(drawn.error_estimate, 0.0);
            } else if (!box.empty()) {
                Commands commands(device());
                ASSERT_TRUE(kept.record(commands, scene, now, ChangedPixels{box}));
                commands.submit();
                commands.ticket().wait();
            }
            const std::vector<Image> over = kept.read_back();
            for (size_t eye = 0; eye < next.eyes.size(); ++eye)
                EXPECT_EQ(differing(over[eye], next.eyes[eye], nullptr), 0u);
            before = std::move(now);
            last = std::move(next);
        }
    }
    EXPECT_GT(missed_slices, 5u);
    EXPECT_GT(changed_pictures, 20u);
}

// As a tool that cuts: an edit, and a mesh that moves with it, out of the picture too.
TEST_F(ChangedPixelsTest, OfAMeshThatMovesTheyAreWhereItWasAndWhereItIs) {
    const Grid of_ball = make_grid({17, 17, 17}, glm::dvec3(2.0), glm::dvec3(-16.0));
    Mesh ball = marching_cubes(
        synthetic::sample(synthetic::gaussian({}, 8.0), of_ball, ScalarType::f32), 500.0f);
    ball.world_from_mesh = world_from_mesh(of_ball);
    const auto ball_at = [&](glm::dvec3 center_mm) {
        Mesh mesh = ball;
        mesh.world_from_mesh[3] += glm::dvec4(center_mm, 0.0);
        return std::make_shared<const Mesh>(std::move(mesh));
    };
    ASSERT_FALSE(ball.triangles.empty());
    size_t changed_pictures = 0, small = 0;
    for (Scene scene : scenes()) {
        if (!scene.ray_cast)
            continue;
        scene.surfaces = {SurfaceLayer{.style = {.color = {0.9, 0.2, 0.3}}}};
        Renderer whole(device()), kept(device());
        Interactive interactive(kept, 1e9);
        SceneData before{volume_, labels_, {ball_at({-40.0, -60.0, 0.0})}};
        Frame last = whole.render(scene, before).value();
        while (!interactive.draw(scene, before).value().complete) {
        }
        for (const glm::dvec3 to :
             {glm::dvec3(-40, -70, 10), {0, -60, 30}, {0, -60, 600}, {9, 0, 0}}) {
            SceneData now = before;
            now.volume = edited(before.volume, 3000.0);
            now.meshes = {ball_at(to)};
            const PixelBox box = united(
                changed_pixels(scene, before.volume, now.volume),
                united(pixels_of(scene, *before.meshes[0]), pixels_of(scene, *now.meshes[0])));
            small += box != PixelBox{glm::uvec2(0), scene.size_px};
            const Frame next = whole.render(scene, now).value();
            const InteractiveFrame drawn = interactive.draw(scene, now, box).value();
            EXPECT_TRUE(drawn.complete);
            const std::vector<Image> over = kept.read_back();
            for (size_t eye = 0; eye < next.eyes.size(); ++eye) {
                EXPECT_EQ(differing(last.eyes[eye], next.eyes[eye], &box), 0u);
                EXPECT_EQ(differing(over[eye], next.eyes[eye], nullptr), 0u);
                changed_pictures += differing(last.eyes[eye], next.eyes[eye], nullptr) > 0;
            }
            before = std::move(now);
            last = next;
        }
    }
    EXPECT_GT(changed_pictures, 10u);
    EXPECT_GT(small, 10u);
}

// A picture that has to be drawn in full, of a mesh that can be seen through or of the volume's own
// surface, is drawn from few rays first.
TEST_F(ChangedPixelsTest, OfOtherMeshesAllAreDrawnAnew) {
    Scene scene = scenes().back();
    scene.surfaces = {SurfaceLayer{.style = {.opacity = 0.5}}};
    const auto mesh = std::make_shared<const Mesh>(
        Mesh{.positions = {{0, 0, 0}, {9, 0, 0}, {0, 0, 9}}, .triangles = {{0, 1, 2}}});
    const PixelBox box = pixels_of(scene, *mesh);
    for (const bool live : {false, true}) {
        Renderer renderer(device());
        Interactive interactive(renderer, 1e9);
        if (live)
            scene.surfaces[0] = {.live_iso = 300.0};
        SceneData data{volume_, labels_, {live ? nullptr : mesh}};
        while (!interactive.draw(scene, data).value().complete) {
        }
        data.volume = edited(data.volume, 3000.0);
        EXPECT_FALSE(interactive.draw(scene, data, box).value().complete);
        EXPECT_EQ(
            changed_pixels(scene, volume_, data.volume) == (PixelBox{glm::uvec2(0), scene.size_px}),
            live);
    }
}

TEST_F(ChangedPixelsTest, AreAllWhereNothingElseIsKnown) {
    const Scene scene = scenes().front();
    EXPECT_TRUE(changed_pixels(scene, volume_, volume_).empty());
    const PixelBox all{glm::uvec2(0), scene.size_px};
    EXPECT_EQ(changed_pixels(scene, volume_, labels_), all); // of another type
    Scene inside = scene;                                    // the eye
    inside.camera.projection = Projection::perspective;
    inside.camera.eye_mm = {3.0, 1.0, 5.0};
    inside.camera.target_mm = {50.0, 1.0, 5.0};
    VolumeEdit edit(volume_);
    for (uint32_t x = 0; x < 90; ++x)
        for (uint32_t y = 0; y < 70; ++y)
            edit.set({x, y, 25}, 77.0);
    EXPECT_EQ(changed_pixels(inside, volume_, edit.commit()), all);
}

// In a picture that is half refined the pixels of an edit are full ones and the others stay; the
// rest is refined after that, and nothing is left of the document before.
TEST_F(ChangedPixelsTest, OfAPictureThatIsBeingRefinedTheyAreFullAndTheOthersStay) {
    size_t changed_pictures = 0;
    for (const Scene& scene : scenes()) {
        if (!scene.ray_cast)
            continue;
        Renderer whole(device()), kept(device());
        Interactive interactive(kept, 1e-3); // a row of tiles a frame
        SceneData data{volume_, labels_, {}};
        for (int frame = 0; frame < 5; ++frame)
            ASSERT_FALSE(interactive.draw(scene, data).value().complete);
        interactive.set_budget_ms(1e9); // time for any box
        for (int i = 0; i < 4; ++i) {
            const SceneData before = data;
            data.volume = edited(before.volume, i % 2 ? 3000.0 : 2000.0);
            const PixelBox box = changed_pixels(scene, before.volume, data.volume);
            const PixelBox tiles{box.low / 8u * 8u,
                                 glm::min((box.high + 7u) / 8u * 8u, scene.size_px)};
            const std::vector<Image> last = kept.read_back();
            const InteractiveFrame drawn = interactive.draw(scene, data, box).value();
            EXPECT_FALSE(drawn.complete);
            EXPECT_GT(drawn.error_estimate, 0.0);
            const std::vector<Image> over = kept.read_back();
            const Frame full = whole.render(scene, data).value();
            for (size_t eye = 0; eye < over.size(); ++eye) {
                EXPECT_EQ(differing(last[eye], over[eye], &tiles), 0u);
                changed_pictures += differing(last[eye], over[eye], nullptr) > 0;
                for (uint32_t y = box.low.y; y < box.high.y; ++y)
                    for (uint32_t x = box.low.x; x < box.high.x; ++x)
                        ASSERT_EQ(over[eye].at(x, y, 0), full.eyes[eye].at(x, y, 0))
                            << x << ' ' << y;
            }
        }
        interactive.set_budget_ms(1e-3);
        while (!interactive.draw(scene, data).value().complete) {
        }
        const std::vector<Image> rested = kept.read_back();
        const Frame full = whole.render(scene, data).value();
        for (size_t eye = 0; eye < rested.size(); ++eye)
            EXPECT_EQ(differing(rested[eye], full.eyes[eye], nullptr), 0u);
    }
    EXPECT_GT(changed_pictures, 5u);
}

// An edit that a full picture cannot take in time begins from fewer rays.
TEST_F(ChangedPixelsTest, OfAnEditBeyondTheBudgetAreRefinedLater) {
    // Rays that take long beside all else: one in 16 x 16 of them is sooner there.
    Scene scene = scenes().back();
    scene.slices.clear();
    scene.size_px = {300, 240};
    scene.ray_cast->mode = RayMode::mip;
    scene.ray_cast->step_mm = 0.1;
    Renderer renderer(device());
    Interactive interactive(renderer, 1e-6);
    SceneData data{volume_, labels_, {}};
    bool coarsest = false;
    for (int i = 0; i < 30 && !coarsest; ++i) {
        scene.camera = orbit(scene.camera, 3.0);
        coarsest = interactive.draw(scene, data).value().coarsest;
    }
    ASSERT_TRUE(coarsest);
    // The sooner way is judged by times that were measured, which another process may have
    // disturbed.
    bool later = false;
    for (int i = 0; i < 5 && !later; ++i) {
        interactive.set_budget_ms(1e9);
        while (!interactive.draw(scene, data).value().complete) {
        }
        data.volume = edited(data.volume, 3000.0 + i);
        interactive.set_budget_ms(1e-6);
        later = !interactive.draw(scene, data, PixelBox{{0, 0}, scene.size_px}).value().complete;
    }
    EXPECT_TRUE(later);
}

} // namespace
} // namespace palpate
