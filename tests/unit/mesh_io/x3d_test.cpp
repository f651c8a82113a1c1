// X3D scenes: shapes and places in closed form, and a list of what was left out.

#include "engine/io/x3d.h"

#include <gmock/gmock.h>

#include <cmath>

#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class X3d : public TemporaryFolder {
 protected:
    X3dScene read(const std::string& nodes) const {
        write("s.x3d", "<?xml version='1.0'?><X3D><Scene>" + nodes + "</Scene></X3D>");
        Result<X3dScene> scene = load_x3d(file("s.x3d"));
        EXPECT_TRUE(scene) << scene.error().message;
        return scene ? std::move(*scene) : X3dScene{};
    }
    std::string refusal(const std::string& text) const {
        write("s.x3d", text);
        const Result<X3dScene> scene = load_x3d(file("s.x3d"));
        return scene ? "" : scene.error().message;
    }
    static glm::dvec3 world(const Mesh& mesh, size_t i) {
        return glm::dvec3(mesh.world_from_mesh * glm::dvec4(glm::dvec3(mesh.positions[i]), 1.0));
    }
    // Expects a closed surface without holes. Positions are floats of at most 4 m about the middle.
    static double volume_mm3(const Mesh& mesh) {
        const MeshTopology found = topology(mesh);
        EXPECT_TRUE(found.closed);
        EXPECT_TRUE(found.consistently_oriented);
        EXPECT_EQ(found.euler_number, 2);
        return found.volume_mm3;
    }
};

// Prisms and pyramids over a regular polygon of 32 corners: its area is 16 r^2 sin(2 pi / 32).
TEST_F(X3d, ShapesHaveTheVolumeOfTheirFacets) {
    const double area = 16.0 * std::sin(2.0 * M_PI / 32.0); // m^2 for a radius of 1 m
    const auto volume_of = [&](const char* shape) {
        return 1e-9 * volume_mm3(read("<Shape>" + std::string(shape) + "</Shape>").mesh);
    };
    constexpr double kRounding = 1e-5; // of floats of metres in mm
    EXPECT_NEAR(volume_of("<Box size='1 2 3'/>"), 6.0, kRounding);
    EXPECT_NEAR(volume_of("<Box/>"), 8.0, kRounding);
    EXPECT_NEAR(volume_of("<Cylinder height='3' radius='0.5'/>"), 3.0 * 0.25 * area, kRounding);
    EXPECT_NEAR(volume_of("<Cone height='3' bottomRadius='0.5'/>"), 0.25 * area, kRounding);
    // Frusta between rings at angles t: h / 3 (a + b + sqrt(a b)) of their areas.
    double ball = 0.0;
    for (int i = 0; i < 16; ++i) {
        const double a = M_PI * i / 16.0, b = M_PI * (i + 1) / 16.0;
        ball += (std::cos(a) - std::cos(b)) / 3.0 * area *
                (std::pow(std::sin(a), 2) + std::pow(std::sin(b), 2) + std::sin(a) * std::sin(b));
    }
    EXPECT_NEAR(volume_of("<Sphere radius='1'/>"), ball, kRounding);
}

TEST_F(X3d, TransformsComposeAsTheStandardSays) {
    // A quarter turn about z of (1, 0, 0), twice as large, about the centre (1, 0, 0), moved up
    // by 5.
    const X3dScene scene = read(
        "<Transform translation='0 0 5'><Transform center='1 0 0' rotation='0 0 1 "
        "1.5707963267948966'"
        " scale='2 2 2'><Shape><IndexedTriangleSet index='0 1 2'><Coordinate"
        " point='2 0 0, 1 1 0, 1 0 1'/></IndexedTriangleSet></Shape></Transform></Transform>");
    const glm::dvec3 expected[] = {{1000, 2000, 5000}, {-1000, 0, 5000}, {1000, 0, 7000}};
    for (size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(glm::distance(world(scene.mesh, i), expected[i]), 0.0, 1e-3) << i;
    EXPECT_EQ(scene.mesh.triangles.front(), glm::uvec3(0, 1, 2));
    // A mirror turns triangles over, so that they still face outwards.
    EXPECT_GT(volume_mm3(read("<Transform scale='-1 1 1'><Shape><Box/></Shape></Transform>").mesh),
              0.0);
}

TEST_F(X3d, FacesAreFansAndNamedNodesAreUsedAgain) {
    const X3dScene scene = read(
        "<Transform DEF='Quad'><Shape><Appearance><Material DEF='Red' diffuseColor='1 0 0'"
        " transparency='0.25'/></Appearance><IndexedFaceSet coordIndex='0 1 2 3 -1'><Coordinate"
        " point='0 0 0 1 0 0 1 1 0 0 1 0'/></IndexedFaceSet></Shape></Transform>"
        "<Transform translation='0 0 1'><Transform USE='Quad'/></Transform>"
        "<Shape><Appearance><Material diffuseColor='0 1 0'/></Appearance><IndexedFaceSet "
        "ccw='false'"
        " coordIndex='0 1 2'><Coordinate point='0 0 0 1 0 0 1 1 0'/></IndexedFaceSet></Shape>");
    EXPECT_THAT(scene.mesh.triangles,
                ElementsAre(glm::uvec3(0, 1, 2), glm::uvec3(0, 2, 3), glm::uvec3(4, 5, 6),
                            glm::uvec3(4, 6, 7), glm::uvec3(8, 10, 9)));
    EXPECT_THAT(scene.mesh.labels, ElementsAre(1, 1, 1, 1, 2));
    ASSERT_EQ(scene.materials.size(), 2u);
    EXPECT_EQ(scene.materials[0], (SurfaceStyle{{1, 0, 0}, 0.75}));
    EXPECT_EQ(scene.materials[1], (SurfaceStyle{{0, 1, 0}, 1.0}));
    EXPECT_NEAR(world(scene.mesh, 4).z, 1000.0, 1e-3);
}

TEST_F(X3d, ViewsPlanesAndVolumesBecomePartsOfAScene) {
    const std::string text =
        "<X3D><Scene><Background skyColor='0 0 1'/><StereoInfo interocularDistance='0.05'"
        " focalDistance='0.4'/><Transform translation='1 0 0'><Viewpoint position='0 0 2'"
        " fieldOfView='0.5'/><ClipPlane plane='0 0 2 -1'/></Transform><IsoSurfaceVolumeData"
        " surfaceValues='300 900'><ImageTexture3D containerField='voxels' url='\"head.nrrd\"'/>"
        "</IsoSurfaceVolumeData><Shape><Sphere/></Shape></Scene></X3D>";
    write("s.x3d", text);
    const SceneFile file_of = load_x3d_scene(file("s.x3d")).value();
    const Scene& scene = file_of.scene;
    EXPECT_EQ(file_of.volume, "head.nrrd");
    EXPECT_EQ(file_of.surfaces.front().mesh, "s.x3d");
    EXPECT_EQ(scene.background, glm::dvec3(0, 0, 1));
    EXPECT_DOUBLE_EQ(scene.stereo->rig.eye_separation_mm, 50.0);
    EXPECT_DOUBLE_EQ(scene.stereo->rig.convergence_mm, 400.0);
    EXPECT_EQ(scene.camera.eye_mm, glm::dvec3(1000, 0, 2000));
    EXPECT_EQ(scene.camera.target_mm, glm::dvec3(1000, 0, 0)); // centerOfRotation is ahead
    EXPECT_DOUBLE_EQ(scene.camera.view_angle_deg, glm::degrees(0.5));
    ASSERT_EQ(scene.clip_planes.size(), 1u);
    EXPECT_EQ(scene.clip_planes[0].normal, glm::dvec3(0, 0, 1));
    EXPECT_DOUBLE_EQ(scene.clip_planes[0].point_mm.z, 500.0);
    ASSERT_EQ(scene.ray_cast->isos.size(), 2u);
    EXPECT_EQ(scene.ray_cast->isos[1].value, 900.0);
    write("t.x3d",
          "<X3D><Scene><VolumeData><ImageTexture3D url='a.nrrd'/></VolumeData></Scene></X3D>");
    const SceneFile plain = load_x3d_scene(file("t.x3d")).value();
    EXPECT_EQ(plain.scene.ray_cast->mode, RayMode::alpha);
    EXPECT_TRUE(plain.surfaces.empty());
}

TEST_F(X3d, WhatIsLeftOutIsNamedOnce) {
    const X3dScene scene = read(
        "<DeviceInfo><AnyDevice/></DeviceInfo><Shape><Appearance><Material/><FrictionalSurface/>"
        "</Appearance><Text string='a'/></Shape><TimeSensor/><TimeSensor/><Shape><IndexedFaceSet"
        " coordIndex='0 1 2'><Coordinate point='0 0 0 1 0 0 0 1 0'/><Normal vector='0 0 1'/>"
        "</IndexedFaceSet></Shape>");
    EXPECT_THAT(scene.skipped,
                ElementsAre("DeviceInfo", "FrictionalSurface", "Text", "TimeSensor", "Normal"));
    const LoadedMesh mesh = load_mesh(file("s.x3d")).value();
    EXPECT_THAT(
        mesh.warnings,
        ElementsAre(HasSubstr("left out: DeviceInfo, FrictionalSurface, Text, TimeSensor")));
}

TEST_F(X3d, BadOnesAreRefusedInASentence) {
    const auto error = [&](const std::string& nodes) {
        return refusal("<X3D><Scene>" + nodes + "</Scene></X3D>");
    };
    EXPECT_THAT(refusal("<X3D>"), HasSubstr("s.x3d: expected XML"));
    EXPECT_THAT(refusal("<svg/>"), HasSubstr("expected the element X3D, found 'svg'"));
    EXPECT_THAT(error("<Shape USE='none'/>"), HasSubstr("a node of the name 'none'"));
    EXPECT_THAT(error("<Group DEF='a'><Group USE='a'/></Group>"), HasSubstr("nodes in each other"));
    EXPECT_THAT(error("<Transform translation='1 2'/>"), HasSubstr("expected 3 numbers"));
    EXPECT_THAT(error("<Shape><IndexedFaceSet coordIndex='0 1 9'><Coordinate point='0 0 0 1 1 1'/>"
                      "</IndexedFaceSet></Shape>"),
                HasSubstr("expected coordIndex of 0 .. 1, found 9"));
    EXPECT_THAT(error("<Shape><IndexedFaceSet coordIndex='0'/></Shape>"),
                HasSubstr("expected a Coordinate"));
    // Each group uses the one before ten times: 10^8 boxes in a few lines.
    std::string nested = "<Group DEF='g0'><Shape><Box/></Shape></Group>";
    for (int i = 1; i < 9; ++i) {
        nested += fmt::format("<Group DEF='g{}'>", i);
        for (int k = 0; k < 10; ++k)
            nested += fmt::format("<Group USE='g{}'/>", i - 1);
        nested += "</Group>";
    }
    EXPECT_THAT(error(nested), HasSubstr("those that are used again"));
    write("s.x3d", "<X3D><Scene/></X3D>");
    EXPECT_THAT(load_x3d_scene(file("s.x3d")).error().message, HasSubstr("expected a VolumeData"));
}

} // namespace
} // namespace palpate
