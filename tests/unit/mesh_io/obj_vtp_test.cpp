// OBJ and VTP: what is written comes back, and what other programs write is read.

#include <gmock/gmock.h>

#include <algorithm>

#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vtp_files.h"

namespace palpate {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class ObjAndVtp : public TemporaryFolder {
 protected:
    LoadedMesh read(const std::string& name, const std::string& bytes) const {
        write(name, bytes);
        Result<LoadedMesh> loaded = load_mesh(file(name));
        EXPECT_TRUE(loaded) << loaded.error().message;
        return loaded ? std::move(*loaded) : LoadedMesh{};
    }
    std::string refusal(const std::string& name, const std::string& bytes,
                        const MeshReadOptions& options = {}) const {
        write(name, bytes);
        const Result<LoadedMesh> loaded = load_mesh(file(name), options);
        EXPECT_FALSE(loaded) << bytes.substr(0, 200);
        if (loaded)
            return "";
        EXPECT_THAT(loaded.error().message, StartsWith(file(name).string()));
        return loaded.error().message;
    }
};

// With labels, outer labels and normals; the triangles of one pair of labels together, as OBJ holds
// them.
Mesh sample(double radius_mm) {
    Mesh mesh = meshes::ball(radius_mm, 2, {1, 2, 3});
    mesh.normals = vertex_normals(mesh);
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        mesh.labels.push_back(static_cast<uint16_t>(1 + 3 * n / mesh.triangles.size()));
        mesh.outer_labels.push_back(
            static_cast<uint16_t>(n * 2 < mesh.triangles.size() ? 0 : 65535));
    }
    return mesh;
}

TEST_F(ObjAndVtp, ComeBackToTheBit) {
    for (const char* name : {"a.obj", "a.vtp", "a.ply"})
        for (const bool labelled : {false, true}) {
            Mesh mesh = sample(10.0);
            if (!labelled) {
                mesh.labels.clear();
                mesh.outer_labels.clear();
            }
            ASSERT_TRUE(save_mesh(file(name), mesh));
            const Result<LoadedMesh> loaded = load_mesh(file(name));
            ASSERT_TRUE(loaded) << loaded.error().message;
            EXPECT_THAT(loaded->warnings, IsEmpty());
            EXPECT_EQ(loaded->mesh.positions, mesh.positions) << name;
            EXPECT_EQ(loaded->mesh.normals, mesh.normals) << name;
            EXPECT_EQ(loaded->mesh.triangles, mesh.triangles) << name;
            EXPECT_EQ(loaded->mesh.labels, mesh.labels) << name;
            EXPECT_EQ(loaded->mesh.outer_labels, mesh.outer_labels) << name;
            const std::string again = std::string("again") + name;
            ASSERT_TRUE(save_mesh(file(again), loaded->mesh));
            EXPECT_TRUE(bytes_of(again) == bytes_of(name)) << name;
        }
}

// Far off, files hold doubles: the mesh is floats about an offset, 2^-20 mm apart at 10 mm.
TEST_F(ObjAndVtp, ComeBackFromFarAway) {
    Mesh mesh = sample(10.0);
    mesh.world_from_mesh[3] = glm::dvec4(123456.789, -98765.4321, 1e6, 1);
    for (const char* name : {"far.obj", "far.vtp"}) {
        ASSERT_TRUE(save_mesh(file(name), mesh));
        const Result<LoadedMesh> loaded = load_mesh(file(name));
        ASSERT_TRUE(loaded) << loaded.error().message;
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const glm::dvec4 written =
                mesh.world_from_mesh * glm::dvec4(glm::dvec3(mesh.positions[v]), 1);
            const glm::dvec4 found =
                loaded->mesh.world_from_mesh * glm::dvec4(glm::dvec3(loaded->mesh.positions[v]), 1);
            ASSERT_LT(glm::length(written - found), 2e-6);
        }
    }
}

TEST_F(ObjAndVtp, ObjOfOthers) {
    // Windows line ends, comments, texture coordinates, negative and positive indices, a joined
    // line, a polygon of five corners, a colour and a weight behind positions, points and lines.
    const LoadedMesh loaded = read(
        "o.obj",
        "# a comment\r\nmtllib x.mtl\r\no thing\r\nv 0 0 0\r\nv 1 0 0 0.5 0.5 0.5\r\nv 1 1 0 1\r\n"
        "v +0 1e0 0 # behind\r\nvt 0 0\r\nvn 0 0 2\r\nusemtl red\r\ns off\r\ng a b\r\n"
        "f 1/1/1 2/1/1 3/1/1 4/1/1\r\nv -1 0.5 0\r\nf -5//1 -4//-1 \\\r\n 3//1 4//1 -1//1\r\n"
        "p 1 2\r\nl 1 2 3");
    const std::vector<glm::uvec3> expected{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
    EXPECT_EQ(loaded.mesh.triangles, expected);
    EXPECT_EQ(loaded.mesh.positions[4], glm::vec3(-1, 0.5f, 0));
    ASSERT_EQ(loaded.mesh.normals.size(), 5u);
    EXPECT_EQ(loaded.mesh.normals[4], glm::vec3(0, 0, 1));
    EXPECT_THAT(loaded.mesh.labels, IsEmpty());
    EXPECT_THAT(loaded.warnings, ElementsAre(HasSubstr("2 points and lines are left out")));

    const std::string corner = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn 0 1 0\n";
    const LoadedMesh hard = read("o.obj", corner + "f 1//1 2//1 3//1\nf 1//2 2//2 4//2\n");
    EXPECT_THAT(hard.mesh.normals, IsEmpty());
    EXPECT_THAT(hard.warnings, ElementsAre(HasSubstr("several normals")));
    EXPECT_EQ(read("noname", corner + "f 1 2 3\n").mesh.triangles.size(), 1u); // told by content
}

TEST_F(ObjAndVtp, ObjIsRefusedWithTheLine) {
    const std::string v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    EXPECT_THAT(refusal("o.obj", v + "f 1 2 4\n"), HasSubstr(":4: expected a vertex from 1 to 3"));
    EXPECT_THAT(refusal("o.obj", v + "f 1 2 -4\n"), HasSubstr("found \"-4\""));
    EXPECT_THAT(refusal("o.obj", v + "f 1 2 0\n"), HasSubstr("found \"0\""));
    EXPECT_THAT(refusal("o.obj", v + "f 1//1 2//1 3//1\n"), HasSubstr("expected a normal"));
    EXPECT_THAT(refusal("o.obj", v + "f 1 2\n"), HasSubstr("3 or more corners in a face, found 2"));
    EXPECT_THAT(refusal("o.obj", "v 0 0\n"), HasSubstr(":1: expected a coordinate"));
    EXPECT_THAT(refusal("o.obj", "v 0 0 nan\n"), HasSubstr("\"nan\""));
    EXPECT_THAT(refusal("o.obj", v + "curv 0 1 1 2\n"), HasSubstr("free-form"));
    EXPECT_THAT(refusal("o.obj", v + "gibberish\n"), HasSubstr("expected a key of OBJ"));
    EXPECT_THAT(refusal("o.obj", ""), HasSubstr("with vertices, found none"));
    EXPECT_THAT(refusal("o.obj", v + v + v + "f 1 2 3\n", {.max_memory_bytes = 300}),
                HasSubstr("as memory allows"));
}

std::vector<vtp::Style> all_styles() {
    std::vector<vtp::Style> styles{{}};
    for (const vtp::Form form :
         {vtp::Form::base64, vtp::Form::appended_base64, vtp::Form::appended_raw})
        for (const bool packed : {false, true})
            for (const bool big_endian : {false, true})
                for (const bool wide : {false, true})
                    styles.push_back({form, packed, big_endian, wide});
    return styles;
}

TEST_F(ObjAndVtp, VtpOfOthersInEveryEncoding) {
    for (const vtp::Style& style : all_styles()) {
        SCOPED_TRACE(fmt::format("form {} packed {} big {} wide {}", int(style.form), style.packed,
                                 style.big_endian, style.wide_header));
        const LoadedMesh loaded = read("s.vtp", vtp::square(style));
        const std::vector<glm::uvec3> expected{
            {0, 1, 2}, {0, 2, 3}, {1, 4, 2}, {1, 4, 2}, {2, 4, 5}};
        EXPECT_EQ(loaded.mesh.triangles, expected);
        EXPECT_THAT(loaded.mesh.labels, ElementsAre(7, 7, 8, 9, 9));
        ASSERT_EQ(loaded.mesh.positions.size(), 6u);
        EXPECT_EQ(loaded.mesh.positions[5], glm::vec3(2, 1, 0));
        ASSERT_EQ(loaded.mesh.normals.size(), 6u);
        EXPECT_EQ(loaded.mesh.normals[5], glm::vec3(0, 0, 1));
        EXPECT_THAT(loaded.warnings, ElementsAre(HasSubstr("1 points and lines are left out")));
    }
}

TEST_F(ObjAndVtp, VtpIsRefusedWithACause) {
    const std::string good = vtp::square({});
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::string bytes = good;
        const size_t at = bytes.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        return refusal("s.vtp", bytes.replace(at, from.size(), to));
    };
    EXPECT_THAT(changed("PolyData\"", "UnstructuredGrid\""), HasSubstr("kind UnstructuredGrid"));
    EXPECT_THAT(changed("0 1 2 3 1 4 2", "0 1 2 3 1 4 6"), HasSubstr("points 0 .. 5 in Polys"));
    EXPECT_THAT(changed("4 7 ", "4 5 "), HasSubstr("3 corners or more in cell 1 of Polys"));
    EXPECT_THAT(changed("NumberOfPoints=\"6\"", "NumberOfPoints=\"600000\""),
                HasSubstr("expected 1800000 numbers for points"));
    EXPECT_THAT(changed("NumberOfPoints=\"6\"", "NumberOfPoints=\"-6\""),
                HasSubstr("NumberOfPoints, found \"-6\""));
    EXPECT_THAT(changed("header_type", "compressor=\"vtkLZ4DataCompressor\" header_type"),
                HasSubstr("vtkLZ4DataCompressor"));
    EXPECT_THAT(changed("1 7 8 9", "1 7 8 70000"),
                HasSubstr("its label: expected a number of type u16, found \"70000\""));
    EXPECT_THAT(changed("</Strips>", "</Strip>"), HasSubstr("damaged XML"));
    EXPECT_THAT(refusal("s.vtp", good, {.max_memory_bytes = good.size() + 100}),
                HasSubstr("as memory allows"));
    EXPECT_THAT(refusal("s.vtp", "<VTKFile"), HasSubstr("damaged XML"));
}

TEST_F(ObjAndVtp, EveryTruncationIsRefused) {
    for (const vtp::Style& style : all_styles()) {
        const std::string whole = vtp::square(style);
        const size_t end = whole.find("</AppendedData>");
        const size_t least = end == std::string::npos ? whole.rfind("</VTKFile>") + 10 : end - 1;
        for (size_t length = 0; length < least; length += 7)
            ASSERT_NE(refusal("s.vtp", whole.substr(0, length)), "") << length;
    }
}

} // namespace
} // namespace palpate
