// Tools as JSON.

#include <algorithm>
#include <cmath>

#include "engine/edit/stroke.h"

namespace palpate {

namespace {

constexpr double kLargest = 1e4; // mm
constexpr double kSmallest = 1e-3;
constexpr size_t kMostParts = 64, kMostVertices = size_t{1} << 20;

enum class Kind {
    ball,
    point,
    ellipsoid,
    capsule,
    cylinder,
    box,
    burr,
    mesh,
    any,
    all,
    difference
};

double length(const JsonValue& in, const char* key, double otherwise) {
    const auto found = in.find(key);
    if (!found && otherwise <= 0.0)
        in.complain(fmt::format("expected \"{}\"", key));
    return found ? found->number(kSmallest, kLargest) : otherwise;
}

glm::dvec3 lengths(const JsonValue& in, const char* key) {
    const auto found = in.find(key);
    if (!found) {
        in.complain(fmt::format("expected \"{}\"", key));
        return glm::dvec3(1.0);
    }
    return glm::max(found->vector(kSmallest, kLargest), glm::dvec3(kSmallest));
}

ShapePtr read_mesh(const JsonValue& in) {
    const auto positions = in.find("positions_mm"), triangles = in.find("triangles");
    if (!positions || !triangles) {
        in.complain("expected \"positions_mm\" and \"triangles\"");
        return make_ball(1.0);
    }
    Mesh mesh;
    for (const JsonValue& item : positions->items(4, kMostVertices))
        mesh.positions.push_back(glm::vec3(item.vector(-kLargest, kLargest)));
    for (const JsonValue& item : triangles->items(4, 2 * kMostVertices)) {
        const auto corners = item.items(3, 3);
        if (corners.size() < 3)
            return make_ball(1.0);
        glm::uvec3 t;
        for (int i = 0; i < 3; ++i)
            t[i] = corners[size_t(i)].whole_number(
                0, static_cast<uint32_t>(std::max<size_t>(mesh.positions.size(), 1) - 1));
        mesh.triangles.push_back(t);
    }
    const Result<ShapePtr> made = make_mesh_shape(mesh, length(in, "cell_mm", 0.25));
    if (made)
        return *made;
    in.complain(made.error().message);
    return make_ball(1.0);
}

Tool read_tool_at(const JsonValue& in, int depth) {
    const Tool fallback{make_ball(1.0)};
    const auto kind_in = in.find("kind");
    if (!kind_in) {
        in.complain("expected a shape with a \"kind\"");
        return fallback;
    }
    const Kind kind = kind_in->choice<Kind>({{"ball", Kind::ball},
                                             {"point", Kind::point},
                                             {"ellipsoid", Kind::ellipsoid},
                                             {"capsule", Kind::capsule},
                                             {"cylinder", Kind::cylinder},
                                             {"box", Kind::box},
                                             {"burr", Kind::burr},
                                             {"mesh", Kind::mesh},
                                             {"union", Kind::any},
                                             {"intersection", Kind::all},
                                             {"difference", Kind::difference}});
    Tool tool;
    switch (kind) {
        case Kind::point:
            in.only_keys({"kind"});
            return {nullptr, true};
        case Kind::ball:
            in.only_keys({"kind", "at_mm", "turn", "scale", "radius_mm"});
            tool.shape = make_ball(length(in, "radius_mm", 0.0));
            break;
        case Kind::ellipsoid:
            in.only_keys({"kind", "at_mm", "turn", "scale", "radii_mm"});
            tool.shape = make_ellipsoid(lengths(in, "radii_mm"));
            break;
        case Kind::capsule:
        case Kind::cylinder: {
            in.only_keys({"kind", "at_mm", "turn", "scale", "radius_mm", "length_mm"});
            const double r = length(in, "radius_mm", 0.0), l = length(in, "length_mm", 0.0);
            tool.shape = kind == Kind::capsule ? make_capsule(r, l) : make_cylinder(r, l);
            break;
        }
        case Kind::box:
            in.only_keys({"kind", "at_mm", "turn", "scale", "size_mm"});
            tool.shape = make_box(lengths(in, "size_mm"));
            break;
        case Kind::burr: {
            in.only_keys(
                {"kind", "at_mm", "turn", "scale", "radius_mm", "flutes", "flute_radius_mm"});
            const double r = length(in, "radius_mm", 0.0);
            const auto flutes = in.find("flutes");
            tool.shape = make_burr(r, flutes ? flutes->whole_number(0, 64) : 0,
                                   length(in, "flute_radius_mm", 0.2 * r));
            break;
        }
        case Kind::mesh:
            in.only_keys(
                {"kind", "at_mm", "turn", "scale", "positions_mm", "triangles", "cell_mm"});
            tool.shape = read_mesh(in);
            break;
        case Kind::any:
        case Kind::all:
        case Kind::difference: {
            in.only_keys({"kind", "at_mm", "turn", "scale", "of"});
            const auto of = in.find("of");
            if (!of || depth == 8) {
                in.complain(of ? "expected at most 8 levels of shapes within shapes, found more"
                               : "expected \"of\", a list of shapes");
                return fallback;
            }
            std::vector<ShapePtr> parts;
            for (const JsonValue& item : of->items(1, kMostParts)) {
                const Tool part = read_tool_at(item, depth + 1);
                if (part.marks_origin && (kind != Kind::any || depth > 0))
                    item.complain("expected a point by itself or in the outermost union");
                tool.marks_origin = tool.marks_origin || part.marks_origin;
                if (part.shape)
                    parts.push_back(part.shape);
            }
            if (parts.empty())
                return {tool.marks_origin ? nullptr : fallback.shape, tool.marks_origin};
            tool.shape = kind == Kind::any   ? make_union(parts)
                         : kind == Kind::all ? make_intersection(parts)
                                             : make_difference(parts);
            break;
        }
    }
    const auto at = in.find("at_mm"), turn = in.find("turn"), scale = in.find("scale");
    if (at || turn || scale) {
        glm::dquat q(1, 0, 0, 0);
        if (turn) {
            const auto items = turn->items(4, 4);
            if (items.size() == 4)
                q = glm::dquat(items[0].number(-1e3, 1e3), items[1].number(-1e3, 1e3),
                               items[2].number(-1e3, 1e3), items[3].number(-1e3, 1e3));
            if (glm::dot(q, q) < 1e-12) {
                turn->complain("expected a quaternion [w, x, y, z] that is not 0");
                q = glm::dquat(1, 0, 0, 0);
            }
            q = q / std::sqrt(glm::dot(q, q));
        }
        tool.shape =
            make_placed(tool.shape, at ? at->vector(-kLargest, kLargest) : glm::dvec3(0.0), q,
                        scale ? std::max(kSmallest, scale->number(kSmallest, kLargest)) : 1.0);
    }
    return tool;
}

} // namespace

Tool read_tool(const JsonValue& in) {
    return read_tool_at(in, 0);
}

} // namespace palpate
