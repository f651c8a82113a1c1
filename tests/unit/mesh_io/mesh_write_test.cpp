// Meshes written and read back, or read by what a format's own description says.

#include <gtest/gtest.h>

#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <sstream>

#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

class MeshFiles : public TemporaryFolder {
 protected:
    // Labelled, with normals, turned and mirrored.
    static Mesh sample() {
        Mesh mesh = meshes::ball(10.0, 2, {1, 2, 3});
        mesh.normals = vertex_normals(mesh);
        for (size_t n = 0; n < mesh.triangles.size(); ++n) {
            mesh.labels.push_back(static_cast<uint16_t>(1 + n % 3));
            mesh.outer_labels.push_back(static_cast<uint16_t>(n % 2 ? 0 : 65535));
        }
        glm::dmat4 world = glm::rotate(glm::dmat4(1.0), 0.7, glm::dvec3(1, 2, -1));
        mesh.world_from_mesh = glm::scale(world, glm::dvec3(-1, 1, 1));
        return mesh;
    }
    static glm::dvec3 world(const Mesh& mesh, size_t v) {
        return glm::dvec3(mesh.world_from_mesh * glm::dvec4(glm::dvec3(mesh.positions[v]), 1.0));
    }
    // Topology and size of the surface alone: the labels here are numbers to be kept, which enclose
    // nothing, and what lies between two of them would not count in the volume.
    static MeshTopology of_surface(Mesh mesh) {
        mesh.labels.clear();
        mesh.outer_labels.clear();
        return topology(mesh);
    }
    // The same surface, vertex by vertex, outward in the world.
    static void expect_same(const Mesh& written, const Mesh& read, double within_mm) {
        ASSERT_EQ(read.positions.size(), written.positions.size());
        ASSERT_EQ(read.triangles.size(), written.triangles.size());
        for (size_t v = 0; v < read.positions.size(); ++v)
            ASSERT_LT(glm::length(world(read, v) - world(written, v)), within_mm);
        const MeshTopology a = of_surface(written), b = of_surface(read);
        EXPECT_GT(b.volume_mm3, 0.0);
        EXPECT_NEAR(b.volume_mm3, a.volume_mm3, a.area_mm2 * within_mm);
        EXPECT_EQ(b.euler_number, a.euler_number);
        EXPECT_TRUE(b.closed && b.consistently_oriented);
    }
    Mesh saved_and_loaded(const Mesh& mesh, const std::string& name, bool ascii) {
        const Result<void> saved = save_mesh(file(name), mesh, {.ascii = ascii});
        EXPECT_TRUE(saved) << saved.error().message;
        Result<LoadedMesh> loaded = load_mesh(file(name));
        EXPECT_TRUE(loaded) << loaded.error().message;
        EXPECT_TRUE(loaded->warnings.empty());
        return std::move(loaded->mesh);
    }
};

TEST_F(MeshFiles, PlyComesBackWithNormalsAndLabels) {
    for (const bool ascii : {false, true}) {
        const Mesh mesh = sample();
        const Mesh read = saved_and_loaded(mesh, ascii ? "a.ply" : "b.PLY", ascii);
        expect_same(mesh, read, 2e-6); // floats up to 14: half of 2^-20 an axis
        EXPECT_EQ(read.labels, mesh.labels);
        EXPECT_EQ(read.outer_labels, mesh.outer_labels);
        // Orthogonal worlds turn normals as they turn positions.
        for (size_t v = 0; v < mesh.normals.size(); ++v)
            ASSERT_LT(glm::length(glm::dmat3(mesh.world_from_mesh) * glm::dvec3(mesh.normals[v]) -
                                  glm::dvec3(read.normals[v])),
                      1e-6);
    }
    EXPECT_EQ(bytes_of("a.ply").find("double"), std::string::npos);
}

TEST_F(MeshFiles, FarAwayPlyHoldsDoubles) {
    Mesh mesh = sample();
    mesh.world_from_mesh =
        glm::translate(glm::dmat4(1.0), glm::dvec3(1e7, -1e7, 3)) * mesh.world_from_mesh;
    for (const bool ascii : {false, true}) {
        const Mesh read = saved_and_loaded(mesh, "far.ply", ascii);
        expect_same(mesh, read, 4e-6);
        EXPECT_NE(bytes_of("far.ply").find("property double x"), std::string::npos);
    }
    const Result<void> refused = save_mesh(file("far.stl"), mesh);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("floats of STL"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(file("far.stl")));
}

TEST_F(MeshFiles, StlComesBackWelded) {
    for (const bool ascii : {false, true}) {
        const Mesh mesh = sample();
        const Mesh read = saved_and_loaded(mesh, "m.stl", ascii);
        const MeshTopology found = topology(read);
        EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
        EXPECT_EQ(read.positions.size(), mesh.positions.size());
        EXPECT_NEAR(found.volume_mm3, of_surface(mesh).volume_mm3, 1e-3);
        EXPECT_GT(found.volume_mm3, 0.0);
    }
    ASSERT_TRUE(save_mesh(file("m.stl"), sample()));
    EXPECT_EQ(bytes_of("m.stl").size(), 84 + 50 * sample().triangles.size());
}

// Read as the format is described: one statement a line, indices from 1.
TEST_F(MeshFiles, ObjHasAGroupALabel) {
    const Mesh mesh = sample();
    ASSERT_TRUE(save_mesh(file("m.obj"), mesh));
    std::istringstream in(bytes_of("m.obj"));
    Mesh read;
    std::map<std::string, size_t> faces;
    std::string group;
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string key;
        words >> key;
        if (key == "v") {
            glm::vec3 p;
            words >> p.x >> p.y >> p.z;
            read.positions.push_back(p);
        } else if (key == "g") {
            words >> group;
        } else if (key == "f") {
            unsigned a = 0, b = 0, c = 0, na = 0, nb = 0, nc = 0;
            ASSERT_EQ(
                std::sscanf(line.c_str(), "f %u//%u %u//%u %u//%u", &a, &na, &b, &nb, &c, &nc), 6);
            ASSERT_TRUE(a == na && b == nb && c == nc);
            read.triangles.emplace_back(a - 1, b - 1, c - 1);
            ++faces[group];
        }
    }
    expect_same(mesh, read, 2e-6);
    ASSERT_EQ(faces.size(), 6u);
    EXPECT_EQ(faces["label_1_65535"] + faces["label_1_0"], (mesh.triangles.size() + 2) / 3);
}

// Appended raw data, read by the offsets that the text before it tells.
TEST_F(MeshFiles, VtpHoldsWhatItsHeaderSays) {
    for (const double offset_mm : {0.0, 1e7}) {
        Mesh mesh = sample();
        mesh.world_from_mesh[3] = glm::dvec4(offset_mm, 0, 0, 1);
        ASSERT_TRUE(save_mesh(file("m.vtp"), mesh));
        const std::string bytes = bytes_of("m.vtp");
        const size_t data = bytes.find("<AppendedData encoding=\"raw\">\n_") + 31;
        const auto array = [&](const std::string& name) {
            const size_t at = bytes.find("Name=\"" + name + "\"");
            EXPECT_LT(at, data);
            const size_t offset = data + std::stoull(bytes.substr(bytes.find("offset=\"", at) + 8));
            uint64_t length = 0;
            std::memcpy(&length, bytes.data() + offset, 8);
            return bytes.substr(offset + 8, length);
        };
        const std::string points = array("Points"), corners = array("connectivity");
        const size_t wide = offset_mm > 0 ? 8 : 4;
        ASSERT_EQ(points.size(), mesh.positions.size() * 3 * wide);
        Mesh read;
        read.world_from_mesh[3] = mesh.world_from_mesh[3];
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            glm::dvec3 p;
            for (int i = 0; i < 3; ++i) {
                float f = 0;
                std::memcpy(&f, points.data() + (3 * v + i) * wide, 4);
                p[i] = f;
                if (wide == 8)
                    std::memcpy(&p[i], points.data() + (3 * v + i) * wide, 8);
            }
            read.positions.emplace_back(p - glm::dvec3(read.world_from_mesh[3]));
        }
        ASSERT_EQ(corners.size(), mesh.triangles.size() * 24);
        for (size_t n = 0; n < mesh.triangles.size(); ++n) {
            int64_t t[3];
            std::memcpy(t, corners.data() + 24 * n, 24);
            read.triangles.emplace_back(t[0], t[1], t[2]);
        }
        expect_same(mesh, read, 3e-6);
        EXPECT_EQ(array("offsets").size(), mesh.triangles.size() * 8);
        EXPECT_EQ(array("label").size(), mesh.triangles.size() * 2);
        EXPECT_EQ(std::memcmp(array("outer_label").data(), mesh.outer_labels.data(),
                              mesh.triangles.size() * 2),
                  0);
        EXPECT_EQ(array("Normals").size(), mesh.positions.size() * 12);
    }
}

TEST_F(MeshFiles, AnEmptyMeshIsAFileToo) {
    for (const char* name : {"e.ply", "e.stl", "e.obj", "e.vtp"})
        ASSERT_TRUE(save_mesh(file(name), Mesh{}));
    EXPECT_TRUE(load_mesh(file("e.ply"))->mesh.triangles.empty());
    EXPECT_TRUE(load_mesh(file("e.stl"))->mesh.triangles.empty());
}

TEST_F(MeshFiles, RefusalsAreOneSentenceAndLeaveNothing) {
    Mesh mesh = sample();
    std::stop_source stop;
    stop.request_stop();
    const Result<void> stopped = save_mesh(file("s.ply"), mesh, {.stop = stop.get_token()});
    ASSERT_FALSE(stopped);
    EXPECT_NE(stopped.error().message.find("writing was stopped"), std::string::npos);
    EXPECT_FALSE(save_mesh(file("m.xyz"), mesh));
    EXPECT_FALSE(save_mesh(file("no/such/folder.ply"), mesh));
    mesh.positions[5].y = std::numeric_limits<float>::quiet_NaN();
    const Result<void> nan = save_mesh(file("n.obj"), mesh);
    ASSERT_FALSE(nan);
    EXPECT_NE(nan.error().message.find("at vertex 5"), std::string::npos);
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(file("")))
        ADD_FAILURE() << entry.path();
}

} // namespace
} // namespace palpate
