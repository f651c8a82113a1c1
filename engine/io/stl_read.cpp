#include <cmath>
#include <cstring>

#include "engine/io/mesh_formats.h"
#include "engine/mesh/topology.h"

namespace palpate::io {

namespace {

constexpr size_t kHeader = 84, kFacet = 50; // bytes
// A facet of text has 21 words of 65 letters and digits, apart by a space each.
constexpr size_t kLeastFacetText = 86;
// A triangle's corners as read (72 bytes), as floats (36), its numbers (12), and what weld() takes
// for it at the most: corners to sort and new numbers, or new numbers and a mesh (60).
constexpr size_t kMemoryOfFacet = 180;

Result<void> expect_room(uint64_t facets, uint64_t limit_bytes, const std::string& name) {
    if (facets > limit_bytes / kMemoryOfFacet)
        return fail("{}: expected at most {} triangles, as memory allows, found {}", name,
                    limit_bytes / kMemoryOfFacet, facets);
    return {};
}

// Corners in threes; equal ones become one vertex.
Result<LoadedMesh> welded(std::vector<glm::dvec3>& corners, std::string_view statement,
                          const std::string& name) {
    LoadedMesh loaded;
    PALPATE_TRY(place_in_world(loaded, corners, statement, name));
    Mesh& soup = loaded.mesh;
    soup.triangles.reserve(corners.size() / 3);
    for (uint32_t i = 0; i < corners.size(); i += 3)
        soup.triangles.emplace_back(i, i + 1, i + 2);
    loaded.mesh = weld(soup);
    return loaded;
}

bool is_sane(glm::dvec3 p) {
    return std::abs(p.x) <= 1e12 && std::abs(p.y) <= 1e12 && std::abs(p.z) <= 1e12;
}

Result<LoadedMesh> parse_binary(std::string_view text, const std::string& name,
                                uint64_t limit_bytes) {
    uint32_t count = 0;
    std::memcpy(&count, text.data() + 80, sizeof count);
    const uint64_t expected = kHeader + uint64_t{kFacet} * count;
    if (text.size() < expected)
        return fail("{}: expected {} triangles in {} bytes, found {} bytes", name, count, expected,
                    text.size());
    PALPATE_TRY(expect_room(count, limit_bytes, name));
    std::vector<glm::dvec3> corners;
    corners.reserve(size_t{3} * count);
    for (uint64_t n = 0; n < count; ++n) {
        float numbers[12]; // normal and corners
        std::memcpy(numbers, text.data() + kHeader + kFacet * n, sizeof numbers);
        for (int i = 1; i < 4; ++i) {
            const glm::dvec3 p(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
            if (!is_sane(p))
                return fail(
                    "{}: expected positions within 1e12 mm, found ({}, {}, {}) in "
                    "triangle {}",
                    name, p.x, p.y, p.z, n);
            corners.push_back(p);
        }
    }
    PALPATE_TRY(LoadedMesh loaded, welded(corners, text.substr(0, 80), name));
    if (text.size() > expected)
        loaded.warnings.push_back(
            fmt::format("{}: {} bytes follow the last triangle", name, text.size() - expected));
    return loaded;
}

Result<LoadedMesh> parse_ascii(std::string_view text, const std::string& name,
                               uint64_t limit_bytes) {
    const uint64_t most = text.size() / kLeastFacetText; // facets that there may be
    PALPATE_TRY(expect_room(most, limit_bytes, name));
    Words words(text);
    std::vector<glm::dvec3> corners;
    corners.reserve(3 * most + 3);
    const auto expect = [&](std::string_view expected, std::string_view word) -> Result<void> {
        if (word == expected)
            return {};
        return fail("{}: expected \"{}\" in triangle {}, found {}", name, expected,
                    corners.size() / 3,
                    word.empty()
                        ? "the end of the file"
                        : fmt::format("\"{}\"", word.substr(0, std::min<size_t>(40, word.size()))));
    };
    std::string titles;   // of the solids
    bool is_open = false; // between solid and endsolid
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
        if (word == (is_open ? "endsolid" : "solid")) {
            if (const std::string_view title = words.line(); !is_open)
                add_comment(titles, title);
            is_open = !is_open;
            continue;
        }
        PALPATE_TRY(expect(is_open ? "facet" : "solid", word));
        PALPATE_TRY(expect("normal", words.next()));
        for (int i = 0; i < 3; ++i) // a normal that is no number says no less than the corners do
            if (words.next().empty())
                return fail(
                    "{}: expected a normal of three numbers in triangle {}, found the end of "
                    "the file",
                    name, corners.size() / 3);
        for (const char* next : {"outer", "loop"})
            PALPATE_TRY(expect(next, words.next()));
        for (int i = 0; i < 3; ++i) {
            PALPATE_TRY(expect("vertex", words.next()));
            glm::dvec3 p;
            for (int axis = 0; axis < 3; ++axis) {
                const std::optional<double> value = words.number();
                if (!value)
                    return fail("{}: expected a coordinate in triangle {}, found {}", name,
                                corners.size() / 3, words.quoted());
                p[axis] = double(float(*value)); // as the binary form holds it
            }
            if (!is_sane(p))
                return fail(
                    "{}: expected positions within 1e12 mm, found ({}, {}, {}) in "
                    "triangle {}",
                    name, p.x, p.y, p.z, corners.size() / 3);
            corners.push_back(p);
        }
        for (const char* next : {"endloop", "endfacet"})
            PALPATE_TRY(expect(next, words.next()));
    }
    if (is_open)
        return fail("{}: expected \"endsolid\", found the end of the file", name);
    return welded(corners, titles, name);
}

} // namespace

// A binary file may begin with "solid" too: its length tells.
Result<LoadedMesh> parse_stl(std::string_view text, const std::string& name, uint64_t limit_bytes) {
    if (text.size() >= kHeader) {
        uint32_t count = 0;
        std::memcpy(&count, text.data() + 80, sizeof count);
        if (text.size() == kHeader + uint64_t{kFacet} * count)
            return parse_binary(text, name, limit_bytes);
    }
    if (Words(text).next() == "solid")
        return parse_ascii(text, name, limit_bytes);
    if (text.size() < kHeader)
        return fail("{}: expected a mesh (PLY, STL, OBJ or VTP), found {} bytes that are none",
                    name, text.size());
    return parse_binary(text, name, limit_bytes);
}

} // namespace palpate::io
