// Files that others wrote, or that nobody should have written.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

class MeshReading : public TemporaryFolder {
 protected:
    Result<LoadedMesh> read(const std::string& bytes, const std::string& name = "m") const {
        write(name, bytes);
        return load_mesh(file(name));
    }
    // The error of a file that must not be read.
    std::string refusal(const std::string& bytes) const {
        const Result<LoadedMesh> loaded = read(bytes);
        EXPECT_FALSE(loaded) << bytes.substr(0, 200);
        if (loaded)
            return "";
        const std::string& message = loaded.error().message;
        EXPECT_EQ(message.rfind(file("m").string(), 0), 0u) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return message;
    }
};

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

const std::string kVertices =
    "element vertex 4\nproperty float x\nproperty float y\n"
    "property float z\n";

TEST_F(MeshReading, PlyOfOthers) {
    // Windows line ends, comments, colours, an element nobody asked for, a quad, plus signs.
    const Result<LoadedMesh> quad = read(
        "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info none\r\n"
        "element camera 1\r\nproperty float fov\r\nproperty list uchar float rest\r\n"
        "element vertex 4\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\n"
        "property uchar red\r\nelement face 2\r\nproperty uchar flags\r\n"
        "property list uint8 int32 vertex_index\r\nend_header\r\n"
        "45 2 1.5 2.5\r\n0 0 0 255\r\n+1 0 0 255\r\n1 1e0 0 255\r\n0 1 0 255\r\n"
        "7 4 0 1 2 3\r\n7 3 0 2 1\r\n\r\n");
    ASSERT_TRUE(quad) << quad.error().message;
    EXPECT_TRUE(quad->warnings.empty());
    const std::vector<glm::uvec3> expected{{0, 1, 2}, {0, 2, 3}, {0, 2, 1}};
    EXPECT_EQ(quad->mesh.triangles, expected);
    EXPECT_EQ(quad->mesh.positions[2], glm::vec3(1, 1, 0));

    // Big endian, of short positions and double indices.
    std::string big =
        "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\n"
        "property short y\nproperty short z\nelement face 1\n"
        "property list int double vertex_indices\nend_header\n";
    for (const int n : {0, 0, 0, 300, 0, 0, 0, -2, 0})
        big += {static_cast<char>(n >> 8), static_cast<char>(n)};
    big += std::string("\0\0\0\3", 4);
    for (const char* d : {"\x00\x00", "\x3f\xf0", "\x40\x00"}) // 0, 1, 2
        big += std::string(d, 2) + std::string(6, '\0');
    const Result<LoadedMesh> triangle = read(big);
    ASSERT_TRUE(triangle) << triangle.error().message;
    EXPECT_EQ(triangle->mesh.positions[1], glm::vec3(300, 0, 0));
    EXPECT_EQ(triangle->mesh.positions[2], glm::vec3(0, -2, 0));
    EXPECT_EQ(triangle->mesh.triangles[0], glm::uvec3(0, 1, 2));
    const Result<LoadedMesh> longer = read(big + "more");
    ASSERT_TRUE(longer);
    ASSERT_EQ(longer->warnings.size(), 1u);
    EXPECT_TRUE(has(longer->warnings[0], "4 bytes follow"));

    // Points alone are a mesh without triangles.
    const Result<LoadedMesh> points =
        read("ply\nformat ascii 1.0\n" + kVertices + "end_header\n0 0 0 1 0 0 0 1 0 0 0 1");
    ASSERT_TRUE(points) << points.error().message;
    EXPECT_EQ(points->mesh.positions.size(), 4u);
}

TEST_F(MeshReading, StlOfOthers) {
    const std::string facet =
        "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n"
        "  vertex 0 1e0 0\n endloop\nendfacet\n";
    const Result<LoadedMesh> two = read("solid a name of words\n" + facet +
                                        "endsolid a name of words\nsolid\n" + facet + "endsolid\n");
    ASSERT_TRUE(two) << two.error().message;
    EXPECT_EQ(two->mesh.triangles.size(), 2u);
    EXPECT_EQ(two->mesh.positions.size(), 3u);
    const Result<LoadedMesh> nan =
        read("solid\nfacet normal nan nan nan\n" + facet.substr(19) + "endsolid\n");
    EXPECT_TRUE(nan) << nan.error().message; // the corners say what the normal is

    // A binary file whose 80 free bytes begin with "solid".
    std::string binary(84 + 50, '\0');
    binary.replace(0, 5, "solid");
    binary[80] = 1;
    const float numbers[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::memcpy(&binary[84], numbers, sizeof numbers);
    const Result<LoadedMesh> solid = read(binary);
    ASSERT_TRUE(solid) << solid.error().message;
    EXPECT_EQ(solid->mesh.triangles.size(), 1u);

    std::string flat = binary;
    std::memcpy(&flat[84 + 24], numbers + 3, 12);
    const Result<LoadedMesh> degenerate = read(flat);
    ASSERT_TRUE(degenerate);
    ASSERT_EQ(degenerate->warnings.size(), 1u);
    EXPECT_TRUE(has(degenerate->warnings[0], "1 of 1 triangles"));
}

TEST_F(MeshReading, HostileFilesAreRefusedInOneSentence) {
    const std::string ascii = "ply\nformat ascii 1.0\n",
                      binary = "ply\nformat binary_little_endian 1.0\n";
    const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
    const std::string points = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    const std::string good = ascii + kVertices + face + "end_header\n" + points;
    EXPECT_TRUE(has(refusal(""), "are none"));
    EXPECT_TRUE(has(refusal("what is this?"), "are none"));
    EXPECT_TRUE(has(refusal("ply\n"), "end_header"));
    EXPECT_TRUE(has(refusal("ply\nformat dancing 1.0\nend_header\n"), "\"dancing\""));
    EXPECT_TRUE(has(refusal("ply\nformat ascii 2.0\nend_header\n"), "\"2.0\""));
    EXPECT_TRUE(has(refusal("ply\nelement vertex 1\nend_header\n"), "format"));
    EXPECT_TRUE(has(refusal(ascii + "property float x\nend_header\n"), ":3: expected an element"));
    EXPECT_TRUE(has(refusal(ascii + "end_header\n"), "element vertex, found none"));
    EXPECT_TRUE(
        has(refusal(ascii + "element vertex 2\nproperty float x\nend_header\n1 2"), "a number y"));
    EXPECT_TRUE(has(refusal(ascii + face + "end_header\n3 0 1 2"), "vertices before faces"));
    EXPECT_TRUE(has(refusal(good + "3 0 1 4\n"), "vertices 0 .. 3 in face 0, found 4"));
    EXPECT_TRUE(has(refusal(good + "3 0 1 -1\n"), "found -1"));
    EXPECT_TRUE(has(refusal(good + "3 0 1 1.5\n"), "found 1.5"));
    EXPECT_TRUE(has(refusal(good + "2 0 1 1\n"), "3 or more"));
    EXPECT_TRUE(has(refusal(good + "3 0 one 1\n"), "\"one\""));
    EXPECT_TRUE(has(refusal(good + "3 0 1\n"), "the end of the file"));
    EXPECT_TRUE(
        has(refusal(ascii + kVertices + "end_header\n0 0 0 1 0 0 0 inf 0 0 0 1"), "y = inf"));
    EXPECT_TRUE(
        has(refusal(ascii + kVertices + "end_header\n0 0 0 1 0 0 0 1 0 0 0 1e300"), "1e12 mm"));
    // Sizes far beyond the file, without the memory for them.
    for (const char* count : {"4294967295", "1000000000"}) {
        const std::string huge = std::string("element vertex ") + count +
                                 "\nproperty float x\nproperty float y\nproperty float z\n";
        EXPECT_TRUE(has(refusal(binary + huge + "end_header\n" + points), "at least"));
        EXPECT_TRUE(has(refusal(ascii + huge + "end_header\n" + points), "at least"));
    }
    EXPECT_TRUE(has(refusal(ascii + "element vertex 99999999999\nend_header\n"), "4294967295"));
    EXPECT_TRUE(has(refusal(ascii + "element vertex -1\nend_header\n"), "\"-1\""));
    EXPECT_TRUE(has(refusal(ascii + "element x 1\nproperty list float int y\nend_header\n"),
                    "whole-number type"));
    const std::string longest_list = binary + kVertices +
                                     "element face 1\nproperty list uint int vertex_indices\n"
                                     "end_header\n" +
                                     std::string(48, '\0') + "\xff\xff\xff\xff";
    EXPECT_TRUE(has(refusal(longest_list + std::string(12, '\0')), "at least 17179869180 bytes"));
    const std::string labels = ascii + kVertices +
                               "element face 1\nproperty list uchar int vertex_indices\n"
                               "property int label\nend_header\n" +
                               points;
    EXPECT_TRUE(has(refusal(labels + "3 0 1 2 65536\n"), "label = 65536"));
    EXPECT_TRUE(read(labels + "3 0 1 2 65535\n"));

    std::string stl(84, '\0');
    std::memset(&stl[80], 0xff, 4);
    EXPECT_TRUE(has(refusal(stl + std::string(100, '\0')), "expected 4294967295 triangles"));
    EXPECT_TRUE(has(refusal("solid\nfacet normal 0 0\n"), "triangle 0"));
    EXPECT_TRUE(has(refusal("solid\nfacet normal 0 0 1 outer loop vertex 0 0 zero"), "\"zero\""));
    EXPECT_TRUE(has(refusal("solid\nvertex 0 0 0\n"), "expected \"facet\""));
    EXPECT_TRUE(has(refusal("solid\n"), "endsolid"));

    EXPECT_FALSE(load_mesh(file("absent")));
    EXPECT_FALSE(load_mesh(file("")));
    write("large.ply", good + "3 0 1 2\n");
    ASSERT_TRUE(load_mesh(file("large.ply")));
    const Result<LoadedMesh> limited = load_mesh(file("large.ply"), {.max_memory_bytes = 300});
    ASSERT_FALSE(limited);
    EXPECT_TRUE(has(limited.error().message, "as memory allows"));
}

TEST_F(MeshReading, EveryTruncationIsRefused) {
    Mesh mesh = meshes::ball(1.0, 0);
    mesh.labels.assign(mesh.triangles.size(), 3);
    for (const auto& [name, ascii] :
         {std::pair("t.ply", false), {"t.ply", true}, {"t.stl", false}, {"t.stl", true}}) {
        ASSERT_TRUE(save_mesh(file(name), mesh, {.ascii = ascii}));
        const std::string whole = bytes_of(name);
        // Text may lack what follows its last word, and its last word may be cut to another: the
        // last line of an ascii PLY ends with a label of one digit.
        const size_t least = ascii ? whole.find_last_not_of(" \n") + 1 : whole.size();
        const size_t end =
            ascii && std::string(name) == "t.stl" ? whole.rfind("endsolid") + 8 : least;
        for (size_t length = 0; length < end; ++length)
            ASSERT_NE(refusal(whole.substr(0, length)), "") << name << " " << length;
        EXPECT_TRUE(read(whole.substr(0, end)));
    }
}

// Whatever the bytes are: an answer or a sentence, and meshes whose triangles have their corners.
TEST_F(MeshReading, DamagedFilesNeverGiveDamagedMeshes) {
    Mesh mesh = meshes::ball(1.0, 1);
    mesh.normals = vertex_normals(mesh);
    std::mt19937 random(6);
    for (const auto& [name, ascii] :
         {std::pair("d.ply", false), {"d.ply", true}, {"d.stl", false}, {"d.stl", true}}) {
        ASSERT_TRUE(save_mesh(file(name), mesh, {.ascii = ascii}));
        const std::string whole = bytes_of(name);
        int refused = 0;
        for (int round = 0; round < 500; ++round) {
            std::string bytes = whole;
            for (uint32_t n = 1 + random() % 4; n > 0; --n)
                bytes[random() % (round % 2 ? 300 : bytes.size())] =
                    static_cast<char>(round % 3 ? random() : '0' + random() % 10);
            const Result<LoadedMesh> loaded = read(bytes);
            refused += !loaded;
            if (!loaded)
                continue;
            for (const glm::uvec3 t : loaded->mesh.triangles)
                for (int i = 0; i < 3; ++i)
                    ASSERT_LT(t[i], loaded->mesh.positions.size());
            ASSERT_TRUE(loaded->mesh.normals.empty() ||
                        loaded->mesh.normals.size() == loaded->mesh.positions.size());
        }
        EXPECT_GT(refused, 20) << name << " " << ascii;
    }
}

} // namespace
} // namespace palpate
