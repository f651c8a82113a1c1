#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include <pugixml.hpp>

#include "engine/base/file.h"
#include "engine/base/option_name.h"
#include "engine/base/printable.h"
#include "engine/io/mesh_formats.h"
#include "engine/io/x3d.h"
#include "engine/io/x3d_shapes.h"

namespace palpate {

namespace {

constexpr double kMmPerUnit = 1000.0;      // X3D is in metres
constexpr int kDeepest = 200;              // of nodes in each other
constexpr uint64_t kMostNodes = 1'000'000; // with those of USE
// A point as double and float, and its triangles with their labels.
constexpr uint64_t kMemoryOfPoint = 64, kMemoryOfTriangle = 24;

class Reader {
 public:
    Reader(std::string name, uint64_t limit_bytes)
        : name_(std::move(name)), limit_bytes_(limit_bytes) {}

    Result<X3dScene> read(const pugi::xml_node& root) {
        find_names(root, 0);
        PALPATE_TRY(visit(root, glm::scale(glm::dmat4(1.0), glm::dvec3(kMmPerUnit)), 0));
        io::set_world_positions(scene_.mesh, points_);
        return std::move(scene_);
    }

 private:
    Result<void> refuse(const std::string& why) { return fail("{}: {}", name_, why); }

    void find_names(const pugi::xml_node& node, int depth) {
        if (const pugi::xml_attribute name = node.attribute("DEF"))
            named_.try_emplace(name.value(), node);
        if (depth < kDeepest)
            for (const pugi::xml_node child : node.children())
                find_names(child, depth + 1);
    }
    // The node itself, or the one that it uses; empty where there is none of that name.
    pugi::xml_node meant(const pugi::xml_node& node) const {
        const pugi::xml_attribute use = node.attribute("USE");
        if (!use)
            return node;
        const auto found = named_.find(use.value());
        return found == named_.end() ? pugi::xml_node() : found->second;
    }
    pugi::xml_node child(const pugi::xml_node& node, const char* name) const {
        for (const pugi::xml_node each : node.children(name))
            return meant(each);
        return {};
    }
    void skip(const pugi::xml_node& node) {
        const std::string name = node.name();
        if (std::find(scene_.skipped.begin(), scene_.skipped.end(), name) == scene_.skipped.end())
            scene_.skipped.push_back(name);
    }

    // `count` numbers, or the default where there is no such attribute.
    Result<std::vector<double>> numbers(const pugi::xml_node& node, const char* attribute,
                                        std::vector<double> otherwise) {
        if (!node.attribute(attribute))
            return otherwise;
        const auto found = io::x3d_numbers(node, attribute);
        if (!found || found->size() != otherwise.size())
            return fail("{}: {}: expected {} numbers in {}, found '{:.40}'", name_, node.name(),
                        otherwise.size(), attribute, printable(node.attribute(attribute).value()));
        return *found;
    }
    Result<glm::dvec3> vector(const pugi::xml_node& node, const char* attribute,
                              glm::dvec3 otherwise) {
        PALPATE_TRY(const std::vector<double> n,
                    numbers(node, attribute, {otherwise.x, otherwise.y, otherwise.z}));
        return glm::dvec3(n[0], n[1], n[2]);
    }
    Result<glm::dmat4> rotation(const pugi::xml_node& node, const char* attribute) {
        PALPATE_TRY(const std::vector<double> n, numbers(node, attribute, {0, 0, 1, 0}));
        const glm::dvec3 axis(n[0], n[1], n[2]);
        if (glm::length(axis) == 0.0)
            return glm::dmat4(1.0);
        return glm::rotate(glm::dmat4(1.0), n[3], glm::normalize(axis));
    }

    // ISO/IEC 19775-1, 10.4.4: T C R SR S -SR -C.
    Result<glm::dmat4> transform(const pugi::xml_node& node) {
        PALPATE_TRY(const glm::dvec3 move, vector(node, "translation", glm::dvec3(0.0)));
        PALPATE_TRY(const glm::dvec3 center, vector(node, "center", glm::dvec3(0.0)));
        PALPATE_TRY(const glm::dvec3 scale, vector(node, "scale", glm::dvec3(1.0)));
        PALPATE_TRY(const glm::dmat4 turn, rotation(node, "rotation"));
        PALPATE_TRY(const glm::dmat4 along, rotation(node, "scaleOrientation"));
        const glm::dmat4 one(1.0);
        return glm::translate(one, move) * glm::translate(one, center) * turn * along *
               glm::scale(one, scale) * glm::inverse(along) * glm::translate(one, -center);
    }

    Result<void> visit(const pugi::xml_node& parent, const glm::dmat4& place, int depth) {
        if (depth > kDeepest)
            return refuse(fmt::format("expected at most {} nodes in each other", kDeepest));
        for (const pugi::xml_node written : parent.children()) {
            if (written.type() != pugi::node_element)
                continue;
            if (++nodes_ > kMostNodes)
                return refuse(
                    fmt::format("expected at most {} nodes, those that are used again "
                                "among them, found more",
                                kMostNodes));
            const pugi::xml_node node = meant(written);
            if (!node)
                return refuse(fmt::format("expected a node of the name '{:.40}' that a {} uses",
                                          printable(written.attribute("USE").value()),
                                          written.name()));
            const std::string_view name = node.name();
            if (name == "head" || name == "component" || name == "meta")
                continue;
            if (name == "Scene" || name == "Group") {
                PALPATE_TRY(visit(node, place, depth + 1));
            } else if (name == "Transform") {
                PALPATE_TRY(const glm::dmat4 inner, transform(node));
                PALPATE_TRY(visit(node, place * inner, depth + 1));
            } else if (name == "Shape") {
                PALPATE_TRY(add_shape(node, place));
            } else if (name == "Viewpoint") {
                PALPATE_TRY(take_viewpoint(node, place));
            } else if (name == "Background") {
                if (const auto sky = io::x3d_numbers(node, "skyColor"); sky && sky->size() >= 3)
                    scene_.background = glm::clamp(glm::dvec3((*sky)[0], (*sky)[1], (*sky)[2]),
                                                   glm::dvec3(0.0), glm::dvec3(1.0));
            } else if (name == "ClipPlane") {
                PALPATE_TRY(add_clip(node, place));
            } else if (name == "StereoInfo") {
                StereoRig rig;
                PALPATE_TRY(const std::vector<double> eyes,
                            numbers(node, "interocularDistance", {0.06}));
                PALPATE_TRY(const std::vector<double> focus, numbers(node, "focalDistance", {0.6}));
                rig.eye_separation_mm = kMmPerUnit * eyes[0];
                rig.convergence_mm = kMmPerUnit * focus[0];
                if (!(rig.eye_separation_mm > 0.0 && rig.convergence_mm > 0.0))
                    return refuse("StereoInfo: expected distances above 0");
                scene_.stereo = rig;
            } else if (name == "VolumeData" || name == "IsoSurfaceVolumeData" ||
                       name == "SegmentedVolumeData") {
                PALPATE_TRY(take_volume(node));
            } else {
                skip(node);
            }
        }
        return {};
    }

    Result<uint16_t> label_of(const pugi::xml_node& shape) {
        SurfaceStyle style;
        style.color = glm::dvec3(0.8); // of a Material that says nothing
        if (const pugi::xml_node appearance = child(shape, "Appearance")) {
            for (const pugi::xml_node each : appearance.children())
                if (std::string_view(each.name()) != "Material")
                    skip(each);
            if (const pugi::xml_node material = child(appearance, "Material")) {
                PALPATE_TRY(style.color, vector(material, "diffuseColor", style.color));
                PALPATE_TRY(const std::vector<double> clear,
                            numbers(material, "transparency", {0.0}));
                style.color = glm::clamp(style.color, glm::dvec3(0.0), glm::dvec3(1.0));
                style.opacity = std::clamp(1.0 - clear[0], 0.0, 1.0);
            }
        }
        auto& styles = scene_.materials;
        const auto found = std::find(styles.begin(), styles.end(), style);
        if (found == styles.end()) {
            if (styles.size() == 65535)
                return fail("{}: expected at most 65535 materials, found more", name_);
            styles.push_back(style);
            return static_cast<uint16_t>(styles.size());
        }
        return static_cast<uint16_t>(found - styles.begin() + 1);
    }

    Result<void> add_shape(const pugi::xml_node& shape, const glm::dmat4& place) {
        PALPATE_TRY(const uint16_t label, label_of(shape));
        for (const pugi::xml_node written : shape.children()) {
            const pugi::xml_node node = meant(written);
            const std::string_view name = node.name();
            if (name == "Appearance" || node.type() != pugi::node_element)
                continue;
            if (!io::is_x3d_geometry(name)) {
                skip(node);
                continue;
            }
            for (const pugi::xml_node each : node.children())
                if (std::string_view(each.name()) != "Coordinate")
                    skip(each);
            const Result<io::X3dGeometry> made = io::x3d_geometry(node, child(node, "Coordinate"));
            if (!made)
                return refuse(made.error().message);
            const uint64_t bytes =
                kMemoryOfPoint * (points_.size() + made->points.size()) +
                kMemoryOfTriangle * (scene_.mesh.triangles.size() + made->triangles.size());
            if (bytes > limit_bytes_)
                return refuse(fmt::format("expected a mesh of at most {} bytes, as memory allows",
                                          limit_bytes_));
            const auto first = static_cast<uint32_t>(points_.size());
            for (const glm::dvec3 point : made->points) {
                const glm::dvec3 at(place * glm::dvec4(point, 1.0));
                if (!(glm::length(at) < 1e12))
                    return refuse("expected points within 1e9 m of the origin");
                points_.push_back(at);
            }
            const bool mirrors = glm::determinant(glm::dmat3(place)) < 0.0;
            for (glm::uvec3 triangle : made->triangles) {
                if (mirrors)
                    std::swap(triangle.y, triangle.z);
                scene_.mesh.triangles.push_back(first + triangle);
                scene_.mesh.labels.push_back(label);
            }
        }
        return {};
    }

    Result<void> take_viewpoint(const pugi::xml_node& node, const glm::dmat4& place) {
        if (scene_.camera)
            return {};
        PALPATE_TRY(const glm::dvec3 eye, vector(node, "position", {0.0, 0.0, 10.0}));
        PALPATE_TRY(const glm::dvec3 center, vector(node, "centerOfRotation", glm::dvec3(0.0)));
        PALPATE_TRY(const glm::dmat4 turn, rotation(node, "orientation"));
        PALPATE_TRY(const std::vector<double> angle, numbers(node, "fieldOfView", {M_PI / 4.0}));
        if (!(angle[0] > 0.0 && angle[0] < M_PI))
            return refuse(
                fmt::format("Viewpoint: expected a fieldOfView of 0 .. pi, found {:g}", angle[0]));
        const glm::dvec3 forward(turn * glm::dvec4(0.0, 0.0, -1.0, 0.0));
        const double ahead = glm::dot(center - eye, forward);
        const glm::dvec3 target = eye + (ahead > 0.0 ? ahead : 1.0) * forward;
        Camera camera;
        camera.eye_mm = glm::dvec3(place * glm::dvec4(eye, 1.0));
        camera.target_mm = glm::dvec3(place * glm::dvec4(target, 1.0));
        camera.up = glm::dmat3(place) * glm::dvec3(turn * glm::dvec4(0.0, 1.0, 0.0, 0.0));
        camera.view_angle_deg = glm::degrees(angle[0]);
        const double away = glm::distance(camera.eye_mm, camera.target_mm);
        if (!(away > 0.0 && away < 1e12))
            return refuse("Viewpoint: expected an eye within 1e9 m of the origin");
        scene_.camera = camera;
        return {};
    }

    Result<void> add_clip(const pugi::xml_node& node, const glm::dmat4& place) {
        constexpr size_t kMost = 8;
        if (std::string_view(node.attribute("enabled").value()) == "false")
            return {};
        PALPATE_TRY(const std::vector<double> n, numbers(node, "plane", {0.0, 1.0, 0.0, 0.0}));
        const glm::dvec3 normal(n[0], n[1], n[2]);
        const double square = glm::dot(normal, normal);
        if (!(square > 0.0) || std::abs(glm::determinant(glm::dmat3(place))) == 0.0)
            return refuse("ClipPlane: expected a plane with a normal");
        if (scene_.clip_planes.size() == kMost)
            return refuse(fmt::format("expected at most {} clip planes, found more", kMost));
        ClipPlane plane;
        plane.point_mm = glm::dvec3(place * glm::dvec4(-n[3] / square * normal, 1.0));
        plane.normal = glm::normalize(glm::inverseTranspose(glm::dmat3(place)) * normal);
        scene_.clip_planes.push_back(plane);
        return {};
    }

    // The first file in "a" "b", or the whole text where it has no quotes.
    static std::string first_file(const std::string& text) {
        const size_t open = text.find('"');
        return open == text.npos ? text
                                 : text.substr(open + 1, text.find('"', open + 1) - open - 1);
    }

    Result<void> take_volume(const pugi::xml_node& node) {
        if (std::string_view(node.name()) == "IsoSurfaceVolumeData") {
            const auto values = io::x3d_numbers(node, "surfaceValues");
            if (!values || values->empty())
                return refuse("IsoSurfaceVolumeData: expected surfaceValues, found none");
            scene_.mode = RayMode::iso;
            scene_.isos = *values;
        }
        for (const pugi::xml_node written : node.children()) {
            const pugi::xml_node each = meant(written);
            const std::string_view name = each.name();
            if (each.attribute("url")) {
                const bool is_labels =
                    std::string_view(written.attribute("containerField").value()) ==
                    "segmentIdentifiers";
                (is_labels ? scene_.labels : scene_.volume) =
                    first_file(each.attribute("url").value());
            } else if (name == "ProjectionVolumeStyle" &&
                       std::string_view(each.attribute("type").as_string("MAX")) == "MAX") {
                scene_.mode = RayMode::mip;
            } else if (name != "OpacityMapVolumeStyle" || each.first_child()) {
                skip(each);
            }
        }
        return {};
    }

    std::string name_;
    uint64_t limit_bytes_, nodes_ = 0;
    std::map<std::string, pugi::xml_node> named_;
    std::vector<glm::dvec3> points_;
    X3dScene scene_;
};

Result<X3dScene> parse(std::string_view text, const std::string& name, uint64_t limit_bytes) {
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
    if (!parsed)
        return fail("{}: expected XML, found at byte {}: {}", name, parsed.offset,
                    parsed.description());
    const pugi::xml_node root = document.child("X3D");
    if (!root)
        return fail("{}: expected the element X3D, found '{:.40}'", name,
                    printable(document.document_element().name()));
    return Reader(name, limit_bytes).read(root);
}

} // namespace

bool is_x3d_file(const std::filesystem::path& path) {
    return path.extension() == ".x3d";
}

Result<LoadedMesh> io::parse_x3d(std::string_view text, const std::string& name,
                                 uint64_t limit_bytes) {
    PALPATE_TRY(X3dScene scene, parse(text, name, limit_bytes));
    LoadedMesh loaded{std::move(scene.mesh), {}};
    std::string list;
    for (const std::string& skipped : scene.skipped)
        list += (list.empty() ? "" : ", ") + skipped;
    if (!list.empty())
        loaded.warnings.push_back(fmt::format("{}: left out: {}", name, list));
    return loaded;
}

Result<X3dScene> load_x3d(const std::filesystem::path& path, const MeshReadOptions& options) {
    PALPATE_TRY(const std::string text, load_text(path, options.max_memory_bytes));
    return parse(text, path.string(), options.max_memory_bytes - text.size());
}

Result<SceneFile> load_x3d_scene(const std::filesystem::path& path) {
    PALPATE_TRY(const X3dScene read, load_x3d(path));
    if (read.volume.empty())
        return fail(
            "{}: expected a VolumeData with the file of a volume, found none; its shapes are shown "
            "over another volume by {} {}",
            path.string(), Option{"surface"}, path.string());
    SceneFile file;
    file.folder = std::filesystem::absolute(path).parent_path();
    file.volume = read.volume;
    file.labels = read.labels;
    Scene& scene = file.scene;
    if (!read.labels.empty())
        scene.labels.emplace();
    if (!read.mesh.triangles.empty()) {
        file.surfaces.push_back({.mesh = path.filename().string()});
        SurfaceLayer& layer = scene.surfaces.emplace_back();
        layer.label_styles.push_back({}); // of no label
        layer.label_styles.insert(layer.label_styles.end(), read.materials.begin(),
                                  read.materials.end());
    }
    scene.ray_cast.emplace();
    scene.ray_cast->mode = read.mode;
    for (const double iso : read.isos)
        scene.ray_cast->isos.push_back({iso});
    std::sort(scene.ray_cast->isos.begin(), scene.ray_cast->isos.end(),
              [](const IsoSurface& a, const IsoSurface& b) { return a.value < b.value; });
    scene.clip_planes = read.clip_planes;
    if (read.background)
        scene.background = *read.background;
    if (read.stereo) {
        scene.stereo.emplace();
        scene.stereo->rig = *read.stereo;
    }
    if (read.camera)
        scene.camera = *read.camera;
    else
        file.framing = Framing{};
    return file;
}

} // namespace palpate
