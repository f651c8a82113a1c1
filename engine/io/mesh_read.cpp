#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <string_view>

#include "engine/io/mesh_formats.h"
#include "engine/io/mesh_io.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

constexpr double kFloatIsEnough_mm = 1e-4;

Result<std::string> whole_file(const fs::path& path, uint64_t limit_bytes) {
    std::error_code error;
    const std::string name = path.string();
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status))
        return fail("{}: no such file", name);
    if (!fs::is_regular_file(status))
        return fail("{}: expected a regular file", name);
    const uint64_t bytes = fs::file_size(path, error);
    if (error)
        return fail("{}: cannot be read: {}", name, error.message());
    if (bytes > limit_bytes)
        return fail("{}: expected at most {} bytes, as memory allows, found {}", name, limit_bytes,
                    bytes);
    std::string text(bytes, '\0');
    std::ifstream in(path, std::ios::binary);
    in.read(text.data(), static_cast<std::streamsize>(bytes));
    if (!in || static_cast<uint64_t>(in.gcount()) != bytes)
        return fail("{}: cannot be read: expected {} bytes, found {}", name, bytes, in.gcount());
    return text;
}

} // namespace

void io::set_world_positions(Mesh& mesh, const std::vector<glm::dvec3>& world) {
    glm::dvec3 low(0.0), high(0.0);
    double rounding_mm = 0.0;
    for (size_t v = 0; v < world.size(); ++v) {
        low = v == 0 ? world[v] : glm::min(low, world[v]);
        high = v == 0 ? world[v] : glm::max(high, world[v]);
        for (int i = 0; i < 3; ++i)
            rounding_mm = std::max(rounding_mm, std::abs(world[v][i] - double(float(world[v][i]))));
    }
    glm::dvec3 offset(0.0);
    // Floats beyond 2048 are more than 1e-4 apart: their differences, about a nearer origin, are
    // held exactly.
    const double largest = std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z),
                                     std::abs(high.x), std::abs(high.y), std::abs(high.z)});
    if (rounding_mm > kFloatIsEnough_mm || largest > 2048.0)
        offset = glm::round(0.5 * (low + high));
    mesh.positions.clear();
    mesh.positions.reserve(world.size());
    for (const glm::dvec3 p : world)
        mesh.positions.emplace_back(p - offset);
    mesh.world_from_mesh[3] = glm::dvec4(offset, 1.0);
}

namespace {

bool is_letter(char c) {
    return std::isalpha(static_cast<unsigned char>(c)) != 0;
}

// The values of "SPACE=..." in a text, in upper case.
std::vector<std::string> stated_spaces(std::string_view text) {
    constexpr std::string_view key = "SPACE";
    std::string upper(text);
    std::transform(upper.begin(), upper.end(), upper.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    std::vector<std::string> spaces;
    for (size_t at = upper.find(key); at != upper.npos; at = upper.find(key, at + 1)) {
        const auto white = [&](size_t from) {
            return std::min(upper.find_first_not_of(" \t", from), upper.size());
        };
        const size_t sign = white(at + key.size());
        if ((at > 0 && is_letter(upper[at - 1])) || sign == upper.size() || upper[sign] != '=')
            continue;
        const size_t begin = white(sign + 1);
        size_t end = begin;
        while (end < upper.size() && (is_letter(upper[end]) || upper[end] == '-'))
            ++end;
        spaces.push_back(upper.substr(begin, end - begin));
    }
    return spaces;
}

} // namespace

Result<void> io::place_in_world(LoadedMesh& loaded, std::vector<glm::dvec3>& positions,
                                std::string_view statement, const std::string& name) {
    bool is_ras = false, is_lps = false;
    for (const std::string& space : stated_spaces(statement)) {
        is_ras = is_ras || space == "RAS" || space == "RIGHT-ANTERIOR-SUPERIOR";
        is_lps = is_lps || space == "LPS" || space == "LEFT-POSTERIOR-SUPERIOR";
        if (!is_ras && !is_lps)
            loaded.warnings.push_back(
                fmt::format("{}: expected SPACE=LPS or SPACE=RAS, found \"{}\"; LPS is assumed",
                            name, space.substr(0, 40)));
    }
    if (is_ras && is_lps)
        return fail("{}: expected one space, found both SPACE=RAS and SPACE=LPS", name);
    if (is_ras) {
        const glm::dvec3 lps_from_ras(-1.0, -1.0, 1.0);
        for (glm::dvec3& p : positions)
            p = p * lps_from_ras + glm::dvec3(0.0); // no -0
        for (glm::vec3& n : loaded.mesh.normals)
            n = n * glm::vec3(lps_from_ras) + glm::vec3(0.0f);
    }
    set_world_positions(loaded.mesh, positions);
    return {};
}

namespace {

using Parse = Result<LoadedMesh> (*)(std::string_view text, const std::string& name,
                                     uint64_t limit_bytes);

// Tells the format of a text by its beginning and, for formats that may begin with anything (the
// first 80 bytes of a binary STL, comments of OBJ), by its extension.
Parse parser_of(const fs::path& path, std::string_view text) {
    if (text.starts_with("ply\n") || text.starts_with("ply\r"))
        return io::parse_ply;
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension == ".stl")
        return io::parse_stl;
    const std::string_view head = text.substr(0, 4096);
    if (extension == ".x3d" || head.find("<X3D") != head.npos)
        return io::parse_x3d;
    if (extension == ".vtp" || text.starts_with("<?xml") || head.find("<VTKFile") != head.npos)
        return io::parse_vtp;
    const bool has_vertex = text.starts_with("v ") || text.find("\nv ") != text.npos;
    if (extension == ".obj" || (has_vertex && text.find('\0') == text.npos))
        return io::parse_obj;
    return io::parse_stl;
}

} // namespace

Result<LoadedMesh> load_mesh(const fs::path& path, const MeshReadOptions& options) {
    const std::string name = path.string();
    PALPATE_TRY(const std::string text, whole_file(path, options.max_memory_bytes));
    const uint64_t limit_bytes = options.max_memory_bytes - text.size();
    PALPATE_TRY(LoadedMesh loaded, parser_of(path, text)(text, name, limit_bytes));
    const Mesh& mesh = loaded.mesh;
    const auto degenerate =
        std::count_if(mesh.triangles.begin(), mesh.triangles.end(),
                      [](glm::uvec3 t) { return t.x == t.y || t.y == t.z || t.z == t.x; });
    if (degenerate > 0)
        loaded.warnings.push_back(
            fmt::format("{}: {} of {} triangles have two corners in one place", name, degenerate,
                        mesh.triangles.size()));
    return loaded;
}

} // namespace palpate
