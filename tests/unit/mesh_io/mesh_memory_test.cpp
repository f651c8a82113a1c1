// Readers keep to the memory they were given, whatever a file is made of. Counted here: what is
// taken from operator new, at its highest.

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>
#include <random>

#include "engine/io/mesh_io.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"

namespace {

std::atomic<int64_t> held = 0, highest = 0;

void* take(size_t bytes) {
    void* memory = std::malloc(bytes);
    if (!memory)
        throw std::bad_alloc();
    const auto size = static_cast<int64_t>(malloc_usable_size(memory));
    const int64_t now = held.fetch_add(size) + size;
    int64_t before = highest.load();
    while (now > before && !highest.compare_exchange_weak(before, now)) {
    }
    return memory;
}
void give(void* memory) {
    if (memory)
        held.fetch_sub(static_cast<int64_t>(malloc_usable_size(memory)));
    std::free(memory);
}

} // namespace

void* operator new(size_t bytes) {
    return take(bytes);
}
void* operator new[](size_t bytes) {
    return take(bytes);
}
void operator delete(void* memory) noexcept {
    give(memory);
}
void operator delete[](void* memory) noexcept {
    give(memory);
}
void operator delete(void* memory, size_t) noexcept {
    give(memory);
}
void operator delete[](void* memory, size_t) noexcept {
    give(memory);
}

namespace palpate {
namespace {

// The file's stream and what is said of it; nothing here grows with the file.
constexpr int64_t kSmallThings = 64 * 1024;

class MeshMemory : public TemporaryFolder {
 protected:
    struct Reading {
        Result<LoadedMesh> loaded;
        int64_t taken;
    };
    Reading read(const std::string& bytes, uint64_t limit) const {
        write("m", bytes);
        const int64_t before = held.load();
        highest = before;
        Result<LoadedMesh> loaded = load_mesh(file("m"), {.max_memory_bytes = limit});
        return {std::move(loaded), highest.load() - before};
    }
};

std::string repeated(const std::string& what, size_t times) {
    std::string all;
    for (size_t i = 0; i < times; ++i)
        all += what;
    return all;
}

TEST_F(MeshMemory, NoFileTakesMoreThanItWasGiven) {
    const std::string points =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty char x\nproperty char y\n"
        "property char z\n";
    // One polygon of a million corners of a byte each, and many of 255: a byte makes a triangle.
    const std::string one = points +
                            "element face 1\nproperty list uint uchar vertex_indices\n"
                            "property uchar label\nproperty uchar outer_label\nend_header\n" +
                            std::string(12, '\1') + std::string("\x40\x42\x0f\0", 4) +
                            std::string(1'000'002, '\2');
    const std::string many = points +
                             "element face 4000\nproperty list uchar uchar vertex_indices\n"
                             "end_header\n" +
                             std::string(12, '\1') +
                             repeated("\xff" + std::string(255, '\3'), 4000);
    // Vertices of six bytes.
    const std::string vertices =
        "ply\nformat binary_little_endian 1.0\nelement vertex 200000\nproperty char x\n"
        "property char y\nproperty char z\nproperty char nx\nproperty char ny\nproperty char nz\n"
        "end_header\n" +
        std::string(1'200'000, '\5');
    std::string stl = std::string(84, '\0') + std::string(20000 * 50, '\0');
    std::mt19937 random(1);
    for (size_t i = 84; i + 50 <= stl.size(); i += 50)
        for (int n = 0; n < 9; ++n) { // all corners apart
            const auto place = static_cast<float>(random());
            std::memcpy(&stl[i + 12 + 4 * static_cast<size_t>(n)], &place, 4);
        }
    const uint32_t count = 20000;
    std::memcpy(&stl[80], &count, 4);
    const std::string text = "solid\n" +
                             repeated(
                                 "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 "
                                 "vertex 0 1 0 endloop endfacet ",
                                 12000) +
                             "endsolid";
    for (const std::string& bytes : {one, many, vertices, stl, text}) {
        int refused = 0;
        for (uint64_t limit = bytes.size() / 2; limit <= 64 * bytes.size(); limit *= 2) {
            const Reading reading = read(bytes, limit);
            EXPECT_LE(reading.taken, static_cast<int64_t>(limit) + kSmallThings);
            refused += !reading.loaded;
            if (!reading.loaded)
                EXPECT_NE(reading.loaded.error().message.find("as memory allows"),
                          std::string::npos)
                    << reading.loaded.error().message;
            else
                EXPECT_GT(reading.loaded->mesh.positions.size(), 0u);
        }
        EXPECT_GE(refused, 2);
        EXPECT_LE(refused, 6);
    }
}

// Pieces cut out, doubled, moved and overwritten: an answer or one sentence, within the memory, and
// meshes that hold together.
TEST_F(MeshMemory, DamagedFilesKeepToItToo) {
    Mesh mesh = meshes::ball(1.0, 1);
    mesh.labels.assign(mesh.triangles.size(), 3);
    std::mt19937 random(7);
    for (const auto& [name, ascii] :
         {std::pair("d.ply", false), {"d.ply", true}, {"d.stl", false}, {"d.stl", true}}) {
        ASSERT_TRUE(save_mesh(file(name), mesh, {.ascii = ascii}));
        const std::string whole = bytes_of(name);
        int refused = 0;
        for (int round = 0; round < 400; ++round) {
            std::string bytes = whole;
            for (uint32_t n = 1 + random() % 3; n > 0; --n) {
                const size_t from = random() % bytes.size();
                const std::string piece = bytes.substr(from, 1 + random() % 64);
                const size_t to =
                    random() % (round % 2 ? std::min<size_t>(400, bytes.size()) : bytes.size());
                if (random() % 3 == 0)
                    bytes.erase(from, piece.size());
                else if (random() % 2 == 0)
                    bytes.insert(to, piece);
                else
                    bytes.replace(to, std::min(piece.size(), bytes.size() - to), piece);
            }
            const uint64_t limit = uint64_t{8} << 20;
            const Reading reading = read(bytes, limit);
            ASSERT_LE(reading.taken, static_cast<int64_t>(limit) + kSmallThings);
            if (!reading.loaded) {
                ++refused;
                ASSERT_EQ(reading.loaded.error().message.find('\n'), std::string::npos);
                continue;
            }
            const Mesh& got = reading.loaded->mesh;
            for (const glm::uvec3 t : got.triangles)
                for (int i = 0; i < 3; ++i)
                    ASSERT_LT(t[i], got.positions.size());
            ASSERT_TRUE(got.labels.empty() || got.labels.size() == got.triangles.size());
        }
        EXPECT_GT(refused, 100) << name << " " << ascii;
    }
}

} // namespace
} // namespace palpate
