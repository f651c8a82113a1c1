// The felt surface while the volume is edited.

#include "engine/volume/edit.h"
#include "haptics/proxy/swept_mesh.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

// A dent of two samples' depth about a place of the surface, or what was there before.
Volume dented(const Volume& before, dvec3 at_mm, double radius_mm) {
    VolumeEdit edit(before);
    const Grid& grid = before.grid();
    const glm::uvec3 size = before.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                if (glm::distance(world_point(grid, dvec3(x, y, z)), at_mm) < radius_mm)
                    edit.set({x, y, z}, 0.0);
    return edit.commit();
}

// Block by block of what changed, and the same as made from scratch, to the bit.
TEST(TouchSurface, FollowsEditsAsIfMadeFromScratch) {
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm}) {
        TouchCase body = flat_plane();
        body.reach_mm = 8.0;
        const Scene scene = make_scene(body, {.spacing_mm = spacing});
        const haptics::TouchParameters parameters = settings(scene);
        Volume volume = *scene.touch.grey;
        haptics::TouchSurface followed(volume, parameters);
        const size_t all = followed.mesh()->mesh->triangles.size();
        EXPECT_EQ(all, haptics::touch_surface(volume, parameters).triangles.size());
        size_t most = 0;
        for (const dvec3 at : {dvec3(0.0), dvec3(1.3, -0.4, 0.2), dvec3(-7.9, 7.8, 0.0)}) {
            volume = dented(volume, at, 1.0);
            most = std::max(most, followed.follow(volume));
            const auto mesh = followed.mesh();
            const auto scratch = haptics::TouchSurface(volume, parameters).mesh();
            ASSERT_EQ(mesh->mesh->positions, scratch->mesh->positions);
            ASSERT_EQ(mesh->mesh->normals, scratch->mesh->normals);
            ASSERT_EQ(mesh->mesh->triangles, scratch->mesh->triangles);
            EXPECT_NE(mesh->mesh->triangles.size(), all);
        }
        EXPECT_GT(most, 0u);
        // A dent of 2 mm, and 8 samples to each side: blocks of two samples.
        const glm::dvec3 blocks = 0.5 * (2.0 / spacing + 2.0 * 8.0) + 1.0;
        EXPECT_LT(double(most), blocks.x * blocks.y * blocks.z);
        EXPECT_EQ(followed.follow(volume), 0u);
    }
}

// Normals come from samples blurred over five to either side where spacing is uneven, farther than
// those that triangles are made of.
TEST(TouchSurface, TakesNormalsAnewAsFarAsTheyAreBlurred) {
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm})
        for (const double blur : {0.6, 1.0}) {
            TouchCase body = flat_plane();
            body.reach_mm = 8.0;
            const Scene scene = make_scene(body, {.spacing_mm = spacing});
            haptics::TouchParameters parameters = settings(scene);
            parameters.normal_blur_samples = blur;
            Volume volume = *scene.touch.grey;
            haptics::TouchSurface followed(volume, parameters);
            for (const dvec3 at : {dvec3(0.0), dvec3(1.3, -0.4, 0.2)}) {
                volume = dented(volume, at, 1.0);
                followed.follow(volume);
                const auto mesh = followed.mesh();
                const auto scratch = haptics::TouchSurface(volume, parameters).mesh();
                ASSERT_EQ(mesh->mesh->positions, scratch->mesh->positions);
                EXPECT_EQ(mesh->mesh->normals, scratch->mesh->normals)
                    << "spacing " << spacing.z << ", blur " << blur;
            }
        }
}

} // namespace
} // namespace palpate::touch
