// Meshes that name their axes as 3D Slicer does: SPACE=RAS turns to LPS, and ours say SPACE=LPS.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vtp_files.h"

namespace palpate {
namespace {

using testing::HasSubstr;

class MeshSpace : public TemporaryFolder {
 protected:
    Result<LoadedMesh> read(const std::string& name, const std::string& bytes) const {
        write(name, bytes);
        return load_mesh(file(name));
    }
    // A ball far from the axes, with normals and labels where the format has them.
    static Mesh ball() {
        Mesh mesh = meshes::ball(10.0, 1);
        mesh.world_from_mesh[3] = glm::dvec4(40, -70, 25, 1);
        mesh.normals = vertex_normals(mesh);
        return mesh;
    }
    static double signed_volume(const Mesh& mesh) {
        double volume = 0;
        for (const glm::uvec3 t : mesh.triangles)
            volume += glm::dot(glm::dvec3(mesh.positions[t.x]),
                               glm::cross(glm::dvec3(mesh.positions[t.y]),
                                          glm::dvec3(mesh.positions[t.z]))) /
                      6;
        return volume;
    }
    static glm::dvec3 world(const Mesh& mesh, size_t vertex) {
        return glm::dvec3(mesh.world_from_mesh *
                          glm::dvec4(glm::dvec3(mesh.positions[vertex]), 1.0));
    }
};

struct Form {
    const char* name;
    bool ascii;
};
constexpr Form kForms[] = {{"m.stl", false}, {"m.stl", true},  {"m.ply", false},
                           {"m.ply", true},  {"m.obj", false}, {"m.vtp", false}};

TEST_F(MeshSpace, OfOursIsStatedAndRasTurnsAboutZ) {
    for (const Form& form : kForms) {
        SCOPED_TRACE(std::string(form.name) + (form.ascii ? " as text" : ""));
        ASSERT_TRUE(save_mesh(file(form.name), ball(), {.ascii = form.ascii}));
        const Result<LoadedMesh> lps = load_mesh(file(form.name));
        ASSERT_TRUE(lps) << lps.error().message;
        EXPECT_TRUE(lps->warnings.empty());
        std::string changed = bytes_of(form.name);
        const bool is_vtp = std::string(form.name) == "m.vtp";
        const std::string ours = is_vtp ? "76 80 83 0" : "SPACE=LPS";
        const size_t at = changed.find(ours);
        ASSERT_NE(at, std::string::npos);
        changed.replace(at, ours.size(), is_vtp ? "82 65 83 0" : "SPACE=RAS");
        const Result<LoadedMesh> ras = read(form.name, changed);
        ASSERT_TRUE(ras) << ras.error().message;
        EXPECT_TRUE(ras->warnings.empty());
        // STL numbers its vertices by place, so that those of both are compared by place.
        const auto places = [](const Mesh& mesh, double sign) {
            std::vector<std::array<double, 3>> all;
            for (size_t v = 0; v < mesh.positions.size(); ++v) {
                const glm::dvec3 p = world(mesh, v) * glm::dvec3(sign, sign, 1);
                all.push_back({p.x, p.y, p.z});
            }
            std::sort(all.begin(), all.end());
            return all;
        };
        EXPECT_EQ(places(ras->mesh, 1), places(lps->mesh, -1));
        EXPECT_NEAR(signed_volume(ras->mesh), signed_volume(lps->mesh), 1e-3); // floats of 80 mm
        EXPECT_GT(topology(ras->mesh).volume_mm3, 0);
        ASSERT_EQ(ras->mesh.normals.size(), lps->mesh.normals.size());
        for (size_t v = 0; v < ras->mesh.normals.size(); ++v)
            EXPECT_EQ(ras->mesh.normals[v], lps->mesh.normals[v] * glm::vec3(-1, -1, 1));
    }
}

// How others write the statement: case, spaces, words round it.
TEST_F(MeshSpace, IsFoundInEveryComment) {
    const auto x_of = [&](const std::string& name, const std::string& text) {
        const Result<LoadedMesh> loaded = read(name, text);
        EXPECT_TRUE(loaded) << loaded.error().message;
        return loaded ? world(loaded->mesh, 1).x : NAN;
    };
    const std::string ply =
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const std::pair<const char*, double> statements[] = {{"SPACE=RAS", -1},
                                                         {"# 3D Slicer output. SPACE=RAS #", -1},
                                                         {"space = ras", -1},
                                                         {"SPACE=right-anterior-superior", -1},
                                                         {"SPACE=RAS;UNIT=mm", -1},
                                                         {"3D Slicer output. SPACE=LPS", 1},
                                                         {"a comment on SPACE and RAS", 1},
                                                         {"COLORSPACE=RAS", 1},
                                                         {"", 1}};
    for (const auto& [statement, x] : statements) {
        EXPECT_EQ(x_of("m.ply", "ply\nformat ascii 1.0\ncomment VTK generated PLY File\ncomment " +
                                    std::string(statement) + "\n" + ply),
                  x)
            << statement;
        EXPECT_EQ(x_of("m.obj", "# made by hand\n# " + std::string(statement) + "\n\n" + obj), x);
        EXPECT_EQ(x_of("m.stl", "solid " + std::string(statement) +
                                    "\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                                    "vertex 0 1 0\nendloop\nendfacet\nendsolid\n"),
                  x);
    }
    // A comment behind the first vertex speaks of something else.
    EXPECT_EQ(x_of("m.obj", obj + "# SPACE=RAS\n"), 1);
}

TEST_F(MeshSpace, OfVtpIsReadInEveryForm) {
    for (const vtp::Form form :
         {vtp::Form::ascii, vtp::Form::base64, vtp::Form::appended_base64, vtp::Form::appended_raw})
        for (const bool packed : {false, true})
            for (const bool big : {false, true})
                for (const std::string space : {"RAS", "LPS"}) {
                    const vtp::Style style{form, packed, big, !big};
                    const Result<LoadedMesh> loaded = read("m.vtp", vtp::square(style, space));
                    ASSERT_TRUE(loaded) << loaded.error().message;
                    EXPECT_EQ(world(loaded->mesh, 4), glm::dvec3(space == "RAS" ? -2 : 2, 0, 0));
                    EXPECT_EQ(loaded->mesh.normals[0], glm::vec3(0, 0, 1));
                    EXPECT_TRUE(std::none_of(
                        loaded->warnings.begin(), loaded->warnings.end(),
                        [](const std::string& w) { return w.find("SPACE") != w.npos; }));
                }
}

TEST_F(MeshSpace, OthersAreNamedAndContradictionsRefused) {
    const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const Result<LoadedMesh> odd = read("m.obj", "# SPACE=LIA\n" + obj);
    ASSERT_TRUE(odd);
    EXPECT_THAT(odd->warnings, testing::ElementsAre(HasSubstr("found \"LIA\"; LPS is assumed")));
    const Result<LoadedMesh> both = read("m.obj", "# SPACE=RAS\n# SPACE=LPS\n" + obj);
    ASSERT_FALSE(both);
    EXPECT_THAT(both.error().message, HasSubstr("found both SPACE=RAS and SPACE=LPS"));
}

} // namespace
} // namespace palpate
