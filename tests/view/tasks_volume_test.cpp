// Tasks 22 to 28, 46 and 47: the volume in 3D, cut and drilled.

#include "engine/scene/presets.h"
#include "tests/view/task_session.h"

namespace palpate::view {
namespace {

class VolumeTask : public Task {};

const RayCastLayer& rays_of(Viewer& viewer) {
    return *viewer.work().session().scene().ray_cast;
}

// Two sides are dragged to samples 12 and 28 of 41, the others lie a tenth in.
TEST_F(VolumeTask, T22_ABoxOfTheVolumeIsSeen) {
    begin(head());
    play("22_crop");
    const auto& planes = state().notes.clip_planes;
    ASSERT_EQ(planes.size(), 6u);
    std::vector<double> across_x;
    for (const ClipPlane& plane : planes)
        if (std::abs(plane.normal.x) > 0.5)
            across_x.push_back(plane.point_mm.x);
    std::sort(across_x.begin(), across_x.end());
    ASSERT_EQ(across_x.size(), 2u);
    EXPECT_NEAR(across_x[0], mm({12, 0, 0}).x, 1e-6);
    EXPECT_NEAR(across_x[1], mm({28, 0, 0}).x, 1e-6);
}

TEST_F(VolumeTask, T23_AnObliquePlaneCutsTheVolumeOpen) {
    begin(head());
    play("23_clip_plane");
    const auto& planes = state().notes.clip_planes;
    ASSERT_EQ(planes.size(), 1u);
    const glm::dvec3 n = glm::normalize(planes[0].normal);
    EXPECT_LT(std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)}), 0.999);
    EXPECT_NEAR(glm::dot(n, state().crosshair_mm - planes[0].point_mm), 0.0, 1e-6);
    EXPECT_LT(glm::dot(n, state().camera.eye_mm - planes[0].point_mm), 0.0); // this side goes
}

// The bone of a CT begins at 300 HU.
TEST_F(VolumeTask, T24_BoneIsAShadedSurface) {
    begin(head());
    play("24_bone_in_3d");
    EXPECT_EQ(state().seen_as, SeenAs::mesh);
    EXPECT_EQ(viewer().work().session().parameters().iso, 300.0);
}

TEST_F(VolumeTask, T25_BoneIsSeenThroughSkin) {
    begin(head());
    play("25_skin_and_bone");
    const RayCastLayer& rays = rays_of(viewer());
    EXPECT_EQ(rays.mode, RayMode::iso);
    ASSERT_EQ(rays.isos.size(), 2u);
    EXPECT_EQ(rays.isos[0].value, -300.0);
    EXPECT_LT(rays.isos[0].opacity, 0.5);
    EXPECT_EQ(rays.isos[1].value, 300.0);
    EXPECT_EQ(rays.isos[1].opacity, 1.0);
}

// Vessels of the head have 320 HU, its brain 35.
TEST_F(VolumeTask, T26_VesselsAreSeenByAPreset) {
    begin(head());
    play("26_vessel_preset");
    const TransferFunction& function = rays_of(viewer()).transfer;
    EXPECT_EQ(function.colors.size(), preset("ct-vessels")->colors.size());
    EXPECT_GT(opacity_at(function, 320.0), 10.0 * opacity_at(function, 35.0));
    EXPECT_GT(opacity_at(function, 320.0), 0.0);
}

TEST_F(VolumeTask, T27_TheViewIsAMaximumIntensityProjection) {
    begin(head());
    play("27_mip_in_3d");
    EXPECT_EQ(rays_of(viewer()).mode, RayMode::mip);
}

// World is left-posterior-superior: the patient's left is where x is larger.
TEST_F(VolumeTask, T28_ThePatientsLeftSideIsSeen) {
    begin(head());
    play("28_view_from_the_left");
    const Camera& camera = state().camera;
    const glm::dvec3 towards = glm::normalize(camera.eye_mm - camera.target_mm);
    EXPECT_NEAR(towards.x, 1.0, 1e-9);
    EXPECT_NEAR(camera.up.z, 1.0, 1e-9);
}

constexpr uint32_t kDrillSide = 81; // samples of 1 mm; the middle is sample 40
constexpr double kHole_mm = 2.0;

// A cylinder of 4 mm through 6 mm of bone; where its wall lies is known to half a sample each way.
TEST_F(VolumeTask, T46_AHoleOf4mmGoesThroughTheSkull) {
    begin(scene_of_volume(skull(kDrillSide, 1.0)));
    const Volume before = grey();
    play("46_drill_a_hole");
    const Volume after = grey();
    const double iso = viewer().work().session().parameters().iso;
    double gone_mm3 = 0.0;
    for (uint32_t z = 0; z < kDrillSide; ++z)
        for (uint32_t y = 0; y < kDrillSide; ++y)
            for (uint32_t x = 0; x < kDrillSide; ++x)
                if (before.value({x, y, z}) >= iso && after.value({x, y, z}) < iso) {
                    gone_mm3 += 1.0;
                    // No sample goes that lies farther than the burr and half a sample's diagonal.
                    EXPECT_LE(std::hypot(x - 40.0, z - 40.0), kHole_mm + 0.87);
                    EXPECT_LT(y, 40u);
                }
    for (uint32_t y = 40 - 34; y <= 40 - 28; ++y)
        EXPECT_LT(after.value({40, y, 40}), iso) << y; // through
    const double through_mm = kSkullOut_mm - kSkull_mm;
    const double wall_mm2 = 2.0 * M_PI * kHole_mm * through_mm;
    EXPECT_NEAR(gone_mm3, M_PI * kHole_mm * kHole_mm * through_mm, 0.5 * wall_mm2);
}

TEST_F(VolumeTask, T47_TheVolumeRemovedIsRead) {
    begin(scene_of_volume(skull(kDrillSide, 1.0)));
    const Volume before = grey();
    play("46_drill_a_hole");
    play("start/47");
    ASSERT_FALSE(has_widget("removed/all"));
    play("47_volume_removed");
    EXPECT_TRUE(has_widget("removed/all"));
    const Volume after = grey();
    const double iso = viewer().work().session().parameters().iso;
    double gone_mm3 = 0.0;
    for (uint32_t z = 0; z < kDrillSide; ++z)
        for (uint32_t y = 0; y < kDrillSide; ++y)
            for (uint32_t x = 0; x < kDrillSide; ++x)
                gone_mm3 += before.value({x, y, z}) >= iso && after.value({x, y, z}) < iso;
    ASSERT_GT(gone_mm3, 0.0);
    EXPECT_NEAR(dump()["removed_ml"]["all"], 1e-3 * gone_mm3, 1e-9);
}

} // namespace
} // namespace palpate::view
