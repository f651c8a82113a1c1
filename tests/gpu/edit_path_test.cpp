// The cost of an edit for a frame, and that a frame after many edits is that of a fresh renderer.

#include <random>

#include "engine/render/cell_map.h"
#include "engine/render/occupancy.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

class EditPath : public GpuTest {
 protected:
    static Volume phantom() {
        return synthetic::sample_ct_phantom(
            make_grid({100, 100, 100}, glm::dvec3(2), glm::dvec3(-99)));
    }
    static Scene iso_scene() {
        Scene scene;
        scene.size_px = {64, 64};
        scene.camera.eye_mm = {-300, -250, 150};
        scene.camera.view_angle_deg = 40.0;
        scene.ray_cast.emplace();
        scene.ray_cast->mode = RayMode::iso;
        scene.ray_cast->isos = {{300.0}};
        return scene;
    }
    // A ball of `value` somewhere: bone where there was none, or a hole.
    static Volume dab(const Volume& volume, std::mt19937& random, double value) {
        std::uniform_int_distribution<int> place(5, 94);
        const glm::ivec3 center(place(random), place(random), place(random));
        VolumeEdit edit(volume);
        for (int z = -4; z <= 4; ++z)
            for (int y = -4; y <= 4; ++y)
                for (int x = -4; x <= 4; ++x)
                    if (x * x + y * y + z * z <= 17)
                        edit.set(glm::uvec3(center + glm::ivec3(x, y, z)), value);
        return edit.commit();
    }
};

TEST_F(EditPath, AFrameAfterAnEditIsOneSubmission) {
    std::mt19937 random(1);
    Renderer renderer(device());
    Volume now = phantom();
    const Scene scene = iso_scene();
    ASSERT_TRUE(renderer.draw(scene, {now, std::nullopt}));
    for (int i = 0; i < 5; ++i) {
        now = dab(now, random, 900.0);
        const uint64_t before = device().last_submitted();
        const Result<FrameStats> stats = renderer.draw(scene, {now, std::nullopt});
        ASSERT_TRUE(stats);
        EXPECT_GE(stats->uploaded_bricks, 1u);
        EXPECT_LE(stats->uploaded_bricks, 8u);
        EXPECT_EQ(device().last_submitted(), before + 1);
    }
}

TEST_F(EditPath, FramesAreThoseOfAFreshRenderer) {
    std::mt19937 random(2);
    Renderer renderer(device());
    Volume now = phantom();
    Scene alpha = iso_scene();
    alpha.ray_cast->mode = RayMode::alpha;
    alpha.ray_cast->transfer = window_function(100, 1500, 0.3);
    for (const Scene& scene : {iso_scene(), alpha})
        for (int i = 0; i < 8; ++i) {
            now = dab(now, random, i % 2 ? -1000.0 : 1100.0);
            if (i == 5)
                for (int k = 0; k < 40; ++k) // more bricks than one submission takes
                    now = dab(now, random, 700.0);
            const Result<Frame> edited = renderer.render(scene, {now, std::nullopt});
            Renderer fresh(device());
            const Result<Frame> expected = fresh.render(scene, {now, std::nullopt});
            ASSERT_TRUE(edited && expected);
            ASSERT_EQ(edited->eyes[0].samples, expected->eyes[0].samples) << i;
            if (i % 3 == 0) { // and once more, now that no edit is new
                const Result<Frame> again = renderer.render(scene, {now, std::nullopt});
                ASSERT_EQ(again->eyes[0].samples, expected->eyes[0].samples) << i;
            }
        }
}

// Distances are never too large, and exact again after some frames without an edit.
TEST_F(EditPath, PatchedDistancesAreSafeAndSettle) {
    std::mt19937 random(3);
    Volume now = phantom(), before = now;
    const Scene scene = iso_scene();
    const auto voxels = std::make_shared<VolumeCells>(now);
    CellMap patched(device(), voxels);
    const auto show = [&](CellMap& cells, std::span<const ChangedBrick> changed = {}) {
        Commands commands(device());
        cells.show(*scene.ray_cast, 1.0f, 0.0f, changed, commands);
        commands.submit();
        commands.finish();
        return cells.distances();
    };
    show(patched);
    for (int i = 0; i < 12; ++i) {
        // Bone somewhere, and then taken away again: its cells are empty as before.
        const Volume next = i % 2 ? before : dab(now, random, 1100.0);
        before = now;
        const std::vector<ChangedBrick> changed = changed_bricks(now, next);
        voxels->update(next, changed);
        now = next;
        const std::vector<uint8_t> found = show(patched, changed);
        CellMap fresh(device(), std::make_shared<VolumeCells>(now));
        const std::vector<uint8_t> exact = show(fresh);
        ASSERT_EQ(found.size(), exact.size());
        for (size_t cell = 0; cell < found.size(); ++cell) {
            ASSERT_LE(found[cell], exact[cell]);
            ASSERT_EQ(found[cell] == 0, exact[cell] == 0);
        }
        if (i % 4 == 3) {
            for (int frame = 0; frame < 100; ++frame) // 8 tiles of 8 each, up to 15 times
                show(patched);
            EXPECT_EQ(patched.distances(), exact);
        }
    }
    EXPECT_EQ(patched.generation(), 1u); // nothing was worked out anew
}

} // namespace
} // namespace palpate
