#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include "engine/base/file.h"
#include "engine/io/mesh_formats.h"
#include "engine/io/mesh_io.h"
#include "engine/io/output_file.h"
#include "engine/mesh/mesh_check.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

using io::OutputFile;

constexpr double kFloatSuffices_mm = 1e-4;
constexpr double kMostStlRounding_mm = 0.01;
constexpr size_t kFlushBytes = 1 << 20;

// A mesh as files hold it: in the world.
struct WorldMesh {
    std::vector<glm::dvec3> positions;
    std::vector<glm::dvec3> normals; // none, or one a position
    const Mesh& mesh;
    bool turn;                // triangles are turned over
    double rounding_mm = 0.0; // of the coordinate that a float holds least well

    explicit WorldMesh(const Mesh& m)
        : mesh(m), turn(glm::determinant(glm::dmat3(m.world_from_mesh)) < 0.0) {
        positions.reserve(m.positions.size());
        for (const glm::vec3 p : m.positions) {
            const glm::dvec3 world(m.world_from_mesh * glm::dvec4(glm::dvec3(p), 1.0));
            for (int i = 0; i < 3; ++i)
                rounding_mm = std::max(rounding_mm, std::abs(world[i] - double(float(world[i]))));
            positions.push_back(world);
        }
        const glm::dmat3 covariant = glm::transpose(glm::inverse(glm::dmat3(m.world_from_mesh)));
        for (const glm::vec3 n : m.normals)
            normals.emplace_back(io::unit_normal(covariant * glm::dvec3(n)));
    }
    glm::uvec3 triangle(size_t n) const {
        const glm::uvec3 t = mesh.triangles[n];
        return turn ? glm::uvec3(t.x, t.z, t.y) : t;
    }
    bool needs_double() const { return rounding_mm > kFloatSuffices_mm; }
};

// Collects what is written, and hands it to the file in large parts.
class Writer {
 public:
    Writer(OutputFile file, std::string name, const std::stop_token& stop)
        : file_(std::move(file)), name_(std::move(name)), stop_(stop) {}

    void text(std::string_view words) { append(words.data(), words.size()); }
    template <class... Args>
    void print(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(buffer_), format, std::forward<Args>(args)...);
        if (buffer_.size() >= kFlushBytes)
            flush();
    }
    template <class T>
    void value(T v) { // little endian
        static_assert(std::endian::native == std::endian::little);
        append(reinterpret_cast<const char*>(&v), sizeof v);
    }
    void vector(glm::dvec3 v, bool as_double) {
        for (int i = 0; i < 3; ++i)
            as_double ? value(v[i]) : value(static_cast<float>(v[i]));
    }
    void words(glm::dvec3 v, bool as_double) {
        if (as_double)
            print("{} {} {}", v.x, v.y, v.z);
        else
            print("{} {} {}", float(v.x), float(v.y), float(v.z));
    }
    Result<void> finish() {
        flush();
        if (failed_)
            return tl::unexpected<Error>(*failed_);
        return file_.finish();
    }

 private:
    void append(const char* bytes, size_t count) {
        buffer_.append(bytes, bytes + count);
        if (buffer_.size() >= kFlushBytes)
            flush();
    }
    void flush() {
        if (!failed_ && stop_.stop_requested())
            failed_ = Error{fmt::format("{}: writing was stopped", name_)};
        if (!failed_)
            if (Result<void> written =
                    file_.write(std::string_view(buffer_.data(), buffer_.size()));
                !written)
                failed_ = written.error();
        buffer_.clear();
    }

    OutputFile file_;
    std::string name_;
    std::stop_token stop_;
    fmt::memory_buffer buffer_;
    std::optional<Error> failed_;
};

void write_ply(Writer& out, const WorldMesh& world, bool ascii) {
    const Mesh& mesh = world.mesh;
    const char* real = world.needs_double() ? "double" : "float";
    out.print(
        "ply\nformat {} 1.0\ncomment world millimetres, left-posterior-superior\n"
        "comment SPACE=LPS\n",
        ascii ? "ascii" : "binary_little_endian");
    out.print("element vertex {}\n", mesh.positions.size());
    for (const char* axis : {"x", "y", "z"})
        out.print("property {} {}\n", real, axis);
    if (!world.normals.empty())
        out.text("property float nx\nproperty float ny\nproperty float nz\n");
    out.print("element face {}\nproperty list uchar int vertex_indices\n", mesh.triangles.size());
    if (!mesh.labels.empty())
        out.text("property ushort label\n");
    if (!mesh.outer_labels.empty())
        out.text("property ushort outer_label\n");
    out.text("end_header\n");
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        if (ascii) {
            out.words(world.positions[v], world.needs_double());
            if (!world.normals.empty()) {
                out.text(" ");
                out.words(world.normals[v], false);
            }
            out.text("\n");
            continue;
        }
        out.vector(world.positions[v], world.needs_double());
        if (!world.normals.empty())
            out.vector(world.normals[v], false);
    }
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const glm::uvec3 t = world.triangle(n);
        if (ascii) {
            out.print("3 {} {} {}", t.x, t.y, t.z);
            if (!mesh.labels.empty())
                out.print(" {}", mesh.labels[n]);
            if (!mesh.outer_labels.empty())
                out.print(" {}", mesh.outer_labels[n]);
            out.text("\n");
            continue;
        }
        out.value(uint8_t{3});
        for (int i = 0; i < 3; ++i)
            out.value(static_cast<int32_t>(t[i]));
        if (!mesh.labels.empty())
            out.value(mesh.labels[n]);
        if (!mesh.outer_labels.empty())
            out.value(mesh.outer_labels[n]);
    }
}

void write_stl(Writer& out, const WorldMesh& world, bool ascii) {
    const char* about = "palpate, world millimetres. SPACE=LPS";
    if (ascii) {
        out.print("solid {}\n", about);
    } else {
        std::string header(80, '\0');
        std::copy_n(about, std::strlen(about), header.begin());
        out.text(header);
        out.value(static_cast<uint32_t>(world.mesh.triangles.size()));
    }
    for (size_t n = 0; n < world.mesh.triangles.size(); ++n) {
        const glm::uvec3 t = world.triangle(n);
        const glm::dvec3 a = world.positions[t.x];
        glm::dvec3 normal = glm::cross(world.positions[t.y] - a, world.positions[t.z] - a);
        const double length = glm::length(normal);
        normal = length > 0.0 ? normal / length : glm::dvec3(0.0);
        if (!ascii) {
            out.vector(normal, false);
            for (int i = 0; i < 3; ++i)
                out.vector(world.positions[t[i]], false);
            out.value(uint16_t{0});
            continue;
        }
        out.text("facet normal ");
        out.words(normal, false);
        out.text("\nouter loop\n");
        for (int i = 0; i < 3; ++i) {
            out.text("vertex ");
            out.words(world.positions[t[i]], false);
            out.text("\n");
        }
        out.text("endloop\nendfacet\n");
    }
    if (ascii)
        out.print("endsolid {}\n", about);
}

void write_obj(Writer& out, const WorldMesh& world) {
    const Mesh& mesh = world.mesh;
    out.text("# world millimetres, left-posterior-superior. SPACE=LPS\n");
    for (const glm::dvec3 p : world.positions) {
        out.text("v ");
        out.words(p, world.needs_double());
        out.text("\n");
    }
    for (const glm::dvec3 n : world.normals) {
        out.text("vn ");
        out.words(n, false);
        out.text("\n");
    }
    // One group a label (or pair of them), in rising order; within it the mesh's own order.
    std::map<std::pair<uint32_t, uint32_t>, std::vector<size_t>> groups;
    for (size_t n = 0; n < mesh.triangles.size(); ++n)
        groups[{mesh.labels.empty() ? 0 : mesh.labels[n],
                mesh.outer_labels.empty() ? 0 : mesh.outer_labels[n]}]
            .push_back(n);
    for (const auto& [labels, triangles] : groups) {
        if (!mesh.outer_labels.empty())
            out.print("g label_{}_{}\n", labels.first, labels.second);
        else if (!mesh.labels.empty())
            out.print("g label_{}\n", labels.first);
        for (const size_t n : triangles) {
            const glm::uvec3 t = world.triangle(n) + 1u;
            if (world.normals.empty())
                out.print("f {} {} {}\n", t.x, t.y, t.z);
            else
                out.print("f {}//{} {}//{} {}//{}\n", t.x, t.x, t.y, t.y, t.z, t.z);
        }
    }
}

// Appended data without encoding: after "_", each array is its length in bytes (u64) and its bytes.
void write_vtp(Writer& out, const WorldMesh& world) {
    const Mesh& mesh = world.mesh;
    const uint64_t points = mesh.positions.size(), polys = mesh.triangles.size();
    const bool wide = world.needs_double();
    out.print(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n"
        "<FieldData>\n<Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" "
        "format=\"ascii\">76 80 83 0</Array>\n</FieldData>\n"
        "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
        "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
        points, polys);
    uint64_t offset = 0;
    const auto array = [&](const char* type, const char* name, int components, uint64_t bytes) {
        out.print(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" "
            "format=\"appended\" offset=\"{}\"/>\n",
            type, name, components, offset);
        offset += sizeof(uint64_t) + bytes;
    };
    const uint64_t position_bytes = points * 3 * (wide ? sizeof(double) : sizeof(float));
    out.text(world.normals.empty() ? "<PointData>\n" : "<PointData Normals=\"Normals\">\n");
    if (!world.normals.empty())
        array("Float32", "Normals", 3, points * 12);
    out.text(mesh.labels.empty() ? "</PointData>\n<CellData>\n"
                                 : "</PointData>\n<CellData Scalars=\"label\">\n");
    if (!mesh.labels.empty())
        array("UInt16", "label", 1, polys * 2);
    if (!mesh.outer_labels.empty())
        array("UInt16", "outer_label", 1, polys * 2);
    out.text("</CellData>\n<Points>\n");
    array(wide ? "Float64" : "Float32", "Points", 3, position_bytes);
    out.text("</Points>\n<Polys>\n");
    array("Int64", "connectivity", 1, polys * 24);
    array("Int64", "offsets", 1, polys * 8);
    out.text("</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
    if (!world.normals.empty()) {
        out.value(points * 12);
        for (const glm::dvec3 n : world.normals)
            out.vector(n, false);
    }
    for (const std::vector<uint16_t>* labels : {&mesh.labels, &mesh.outer_labels}) {
        if (labels->empty())
            continue;
        out.value(polys * 2);
        for (const uint16_t label : *labels)
            out.value(label);
    }
    out.value(position_bytes);
    for (const glm::dvec3 p : world.positions)
        out.vector(p, wide);
    out.value(polys * 24);
    for (size_t n = 0; n < polys; ++n)
        for (int i = 0; i < 3; ++i)
            out.value(static_cast<int64_t>(world.triangle(n)[i]));
    out.value(polys * 8);
    for (size_t n = 0; n < polys; ++n)
        out.value(static_cast<int64_t>(3 * (n + 1)));
    out.text("\n</AppendedData>\n</VTKFile>\n");
}

std::string extension_of(const fs::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

} // namespace

bool has_mesh_extension(const fs::path& path) {
    const std::string extension = extension_of(path);
    return extension == ".ply" || extension == ".stl" || extension == ".obj" || extension == ".vtp";
}

Result<void> save_mesh(const fs::path& path, const Mesh& mesh, const MeshWriteOptions& options) {
    const std::string name = path.string(), extension = extension_of(path);
    if (Result<void> whole = check_mesh(mesh); !whole)
        return fail("{}: {}", name, whole.error().message);
    if (!has_mesh_extension(path))
        return fail("{}: expected an extension .ply, .stl, .obj or .vtp, found \"{}\"", name,
                    path.extension().string());
    const WorldMesh world(mesh);
    for (size_t v = 0; v < world.positions.size(); ++v)
        if (const glm::dvec3 p = world.positions[v];
            !(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
            return fail("{}: expected finite positions, found ({}, {}, {}) at vertex {}", name, p.x,
                        p.y, p.z, v);
    if (extension == ".stl" && world.rounding_mm > kMostStlRounding_mm)
        return fail(
            "{}: expected positions that the floats of STL hold to {} mm, found one that is "
            "off by {:.3g} mm; write .ply or .vtp instead",
            name, kMostStlRounding_mm, world.rounding_mm);
    if (extension == ".stl" && mesh.triangles.size() >= size_t{1} << 32)
        return fail("{}: expected at most 4294967295 triangles for STL, found {}", name,
                    mesh.triangles.size());
    if (mesh.positions.size() >= size_t{1} << 31)
        return fail("{}: expected at most 2147483647 vertices, found {}", name,
                    mesh.positions.size());
    return write_atomically(path, [&](const fs::path& temporary) -> Result<void> {
        PALPATE_TRY(OutputFile file, OutputFile::create(temporary, name));
        Writer out(std::move(file), name, options.stop);
        if (extension == ".ply")
            write_ply(out, world, options.ascii);
        else if (extension == ".stl")
            write_stl(out, world, options.ascii);
        else if (extension == ".obj")
            write_obj(out, world);
        else
            write_vtp(out, world);
        return out.finish();
    });
}

} // namespace palpate
