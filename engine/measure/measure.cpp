#include "engine/measure/measure.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {

namespace {

constexpr double kFarthest_mm = 1e7;
constexpr size_t kMostPoints = 10000;
constexpr double kOffPlane = 1e-4; // of the extent
constexpr std::initializer_list<std::pair<const char*, MeasureKind>> kKinds{
    {"ruler", MeasureKind::ruler},
    {"angle", MeasureKind::angle},
    {"polygon", MeasureKind::polygon},
    {"sphere", MeasureKind::sphere}};

using Points = std::vector<glm::dvec3>;

// Half the sum of cross products: its length is the area (Newell).
glm::dvec3 vector_area(const Points& corners) {
    glm::dvec3 sum(0.0);
    for (size_t i = 1; i + 1 < corners.size(); ++i)
        sum += glm::cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
    return 0.5 * sum;
}

double extent(const Points& points) {
    double most = 0.0;
    for (const glm::dvec3 p : points)
        most = std::max(most, glm::distance(p, points.front()));
    return most;
}

glm::dvec3 middle(const Points& points) {
    glm::dvec3 sum(0.0);
    for (const glm::dvec3 p : points)
        sum += p - points.front();
    return points.front() + sum / static_cast<double>(points.size());
}

// A polygon in the coordinates of its plane.
struct Flat {
    glm::dvec3 origin, u, v, normal;
    std::vector<glm::dvec2> corners;

    explicit Flat(const Points& points) : origin(middle(points)), normal(plane_normal(points)) {
        const glm::dvec3 a = glm::abs(normal);
        const glm::dvec3 other = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                                 : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                          : glm::dvec3(0, 0, 1);
        u = glm::normalize(glm::cross(other, normal));
        v = glm::cross(normal, u);
        for (const glm::dvec3 p : points)
            corners.push_back(flat(p));
    }
    glm::dvec2 flat(glm::dvec3 p) const {
        return {glm::dot(p - origin, u), glm::dot(p - origin, v)};
    }
    // Edges count upwards from their lower end (included) to the upper one.
    bool holds(glm::dvec2 p) const {
        bool inside = false;
        for (size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
            const glm::dvec2 a = corners[i], b = corners[j];
            if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x)
                inside = !inside;
        }
        return inside;
    }
    // The area of the points that an odd number of turns goes round, by slabs between the heights
    // of corners, in which no edges cross.
    double even_odd_area() const {
        struct Edge {
            glm::dvec2 low, high;
            double at(double y) const {
                return low.x + (high.x - low.x) * ((y - low.y) / (high.y - low.y));
            }
        };
        std::vector<Edge> edges;
        std::vector<double> heights, crossings;
        for (size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
            const glm::dvec2 a = corners[i], b = corners[j];
            heights.push_back(a.y);
            if (a.y != b.y)
                edges.push_back(a.y < b.y ? Edge{a, b} : Edge{b, a});
        }
        std::ranges::sort(heights);
        std::ranges::sort(edges, {}, [](const Edge& e) { return e.low.y; });
        std::vector<const Edge*> here;
        size_t next = 0;
        double area = 0.0;
        for (size_t i = 0; i + 1 < heights.size(); ++i) {
            const double low = heights[i], high = heights[i + 1];
            for (; next < edges.size() && edges[next].low.y <= low; ++next)
                here.push_back(&edges[next]);
            std::erase_if(here, [&](const Edge* e) { return e->high.y <= low; });
            crossings.clear();
            for (const Edge* e : here)
                crossings.push_back(e->at(0.5 * (low + high)));
            std::ranges::sort(crossings);
            for (size_t c = 0; c + 1 < crossings.size(); c += 2)
                area += (crossings[c + 1] - crossings[c]) * (high - low);
        }
        return area;
    }
    static double side(glm::dvec2 a, glm::dvec2 b, glm::dvec2 p) {
        return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    }
    // Whether two edges cross, or touch so that the path round the corners turns about some points
    // in the other direction or twice: without an edge that crosses another, the area by the turns
    // is that of the points inside if and only if it does not.
    bool crosses_itself() const {
        const size_t n = corners.size();
        for (size_t i = 0; i < n; ++i)
            for (size_t j = i + 2; j < n; ++j) {
                if (i == 0 && j == n - 1)
                    continue; // neighbours
                const glm::dvec2 a = corners[i], b = corners[i + 1], c = corners[j],
                                 d = corners[(j + 1) % n];
                if (side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0)
                    return true;
            }
        double by_turns = 0.0, scale = 0.0;
        for (size_t i = 0, j = n - 1; i < n; j = i++) {
            by_turns += 0.5 * (corners[j].x * corners[i].y - corners[i].x * corners[j].y);
            scale = std::max(scale, glm::length(corners[i]));
        }
        // Each sum has at most 2 n terms of at most scale^2.
        return std::abs(std::abs(by_turns) - even_odd_area()) >
               1e-14 * static_cast<double>(n) * scale * scale;
    }
};

// The indices [low, high] that a box about points in index space holds; low > high: none.
struct IndexBox {
    glm::i64vec3 low, high;
    IndexBox(const Grid& grid, glm::dvec3 least, glm::dvec3 most) {
        const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
        low = glm::i64vec3(glm::ceil(glm::clamp(least, glm::dvec3(0.0), last + 1.0)));
        high = glm::i64vec3(glm::floor(glm::clamp(most, glm::dvec3(-1.0), last)));
    }
};

// Nothing: stopped.
std::optional<std::vector<float>> values_in_sphere(const Volume& volume, glm::dvec3 center,
                                                   double radius, const std::stop_token& stop) {
    const Grid& grid = volume.grid();
    const glm::dmat4 to_index = index_from_world(grid);
    const glm::dvec3 at = index_point(grid, center);
    glm::dvec3 reach;
    for (int i = 0; i < 3; ++i)
        reach[i] =
            1.0 + radius * glm::length(glm::dvec3(to_index[0][i], to_index[1][i], to_index[2][i]));
    const IndexBox box(grid, at - reach, at + reach);
    std::vector<float> values;
    for (int64_t z = box.low.z; z <= box.high.z; ++z)
        for (int64_t y = box.low.y; y <= box.high.y; ++y) {
            if (stop.stop_requested())
                return std::nullopt;
            const auto holds = [&](int64_t x) {
                return glm::distance(world_point(grid, glm::dvec3(x, y, z)), center) <= radius;
            };
            int64_t first = box.low.x, last = box.high.x; // a ball cuts a row in one piece
            while (first <= last && !holds(first))
                ++first;
            while (last >= first && !holds(last))
                --last;
            if (first > last)
                continue;
            const auto count = static_cast<uint32_t>(last - first + 1);
            const size_t begin = values.size();
            values.resize(begin + count);
            read_row(volume, glm::uvec3(first, y, z), count, values.data() + begin);
        }
    return values;
}

std::optional<std::vector<float>> values_in_polygon(const Volume& volume, const Flat& polygon,
                                                    const Points& corners,
                                                    const std::stop_token& stop) {
    const Grid& grid = volume.grid();
    const glm::dmat3 axes(grid.world_from_index);
    // The distance from the plane, mm, as a function of the index.
    const glm::dvec3 slope = glm::transpose(axes) * polygon.normal;
    const double begin =
        glm::dot(polygon.normal, world_point(grid, glm::dvec3(0.0)) - polygon.origin);
    int a = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(slope[i]) > std::abs(slope[a]))
            a = i;
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    // A sample lies off its foot by half a step along `a` at most.
    const glm::dvec3 off = 1.0 + 0.5 * std::abs(slope[a]) *
                                     glm::abs(glm::dmat3(index_from_world(grid)) * polygon.normal);
    glm::dvec3 least(INFINITY), most(-INFINITY);
    for (const glm::dvec3 p : corners) {
        least = glm::min(least, index_point(grid, p));
        most = glm::max(most, index_point(grid, p));
    }
    const IndexBox box(grid, least - off, most + off);
    std::vector<float> values;
    glm::dvec3 index;
    for (int64_t j = box.low[c]; j <= box.high[c]; ++j) {
        if (stop.stop_requested())
            return std::nullopt;
        for (int64_t i = box.low[b]; i <= box.high[b]; ++i) {
            index[b] = static_cast<double>(i);
            index[c] = static_cast<double>(j);
            index[a] = 0.0;
            index[a] = std::floor(-(begin + glm::dot(slope, index)) / slope[a] + 0.5);
            if (index[a] >= 0.0 && index[a] < static_cast<double>(grid.size[a]) &&
                polygon.holds(polygon.flat(world_point(grid, index))))
                values.push_back(volume.value(glm::uvec3(index)));
        }
    }
    return values;
}

} // namespace

const char* name_of(MeasureKind kind) {
    return std::data(kKinds)[static_cast<size_t>(kind)].first;
}

std::string listed_name(const Measure& measure, size_t row) {
    return measure.name.empty() ? fmt::format("{} {}", name_of(measure.kind), row + 1)
                                : measure.name;
}

size_t points_needed(MeasureKind kind) {
    constexpr std::array<size_t, 4> counts{2, 3, 0, 2};
    return counts[static_cast<size_t>(kind)];
}

glm::dvec3 plane_normal(const Points& polygon) {
    const glm::dvec3 area = vector_area(polygon);
    const double size = extent(polygon);
    if (glm::length(area) > 1e-6 * size * size)
        return glm::normalize(area);
    // Turns in both directions cancel, or the corners are nearly on a line: the plane is that of
    // the two longest ways from a corner, and its side that of the area, if there is one.
    const auto far = std::ranges::max_element(
        polygon, {}, [&](glm::dvec3 p) { return glm::distance(p, polygon.front()); });
    glm::dvec3 most(0.0);
    for (const glm::dvec3 p : polygon)
        if (const glm::dvec3 one = glm::cross(*far - polygon.front(), p - polygon.front());
            glm::length(one) > glm::length(most))
            most = one;
    if (!(glm::length(most) > 1e-12 * size * size))
        return glm::dvec3(0.0);
    return glm::normalize(glm::dot(most, area) < 0.0 ? -most : most);
}

Result<void> check(const Measure& measure) {
    const size_t needed = points_needed(measure.kind), found = measure.points_mm.size();
    if (needed > 0 ? found != needed : found < 3 || found > kMostPoints)
        return fail("{}: expected {} points, found {}", name_of(measure.kind),
                    needed > 0 ? std::to_string(needed) : fmt::format("3 to {}", kMostPoints),
                    found);
    for (const glm::dvec3 p : measure.points_mm)
        for (int i = 0; i < 3; ++i)
            if (!(std::abs(p[i]) <= kFarthest_mm))
                return fail("{}: expected places within {:g} mm, found {:g}", name_of(measure.kind),
                            kFarthest_mm, p[i]);
    if (measure.kind != MeasureKind::polygon)
        return {};
    const glm::dvec3 normal = plane_normal(measure.points_mm), at = middle(measure.points_mm);
    for (const glm::dvec3 p : measure.points_mm)
        if (const double off = std::abs(glm::dot(p - at, normal));
            off > kOffPlane * extent(measure.points_mm))
            return fail("polygon: expected corners in one plane, found one {:g} mm off it", off);
    return {};
}

std::optional<Measured> measure(const Measure& measure, const Volume& volume,
                                const std::stop_token& stop) {
    const Points& p = measure.points_mm;
    Measured out;
    std::optional<std::vector<float>> values;
    switch (measure.kind) {
        case MeasureKind::ruler:
            out.length_mm = glm::distance(p[0], p[1]);
            return out;
        case MeasureKind::angle: {
            const glm::dvec3 a = p[0] - p[1], b = p[2] - p[1];
            if (glm::length(a) > 0.0 && glm::length(b) > 0.0) // exact for small and large angles
                out.angle_deg =
                    glm::degrees(std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)));
            else
                out.note = "an end lies on the vertex: no angle";
            return out;
        }
        case MeasureKind::sphere: {
            const double r = glm::distance(p[0], p[1]);
            out.radius_mm = r;
            out.volume_mm3 = 4.0 / 3.0 * M_PI * r * r * r;
            values = values_in_sphere(volume, p[0], r, stop);
            break;
        }
        case MeasureKind::polygon: {
            double round = 0.0;
            for (size_t i = 0; i < p.size(); ++i)
                round += glm::distance(p[i], p[(i + 1) % p.size()]);
            out.length_mm = round;
            if (plane_normal(p) == glm::dvec3(0.0)) {
                out.area_mm2 = 0.0;
                out.note = "all corners lie on a line: no samples";
                return out;
            }
            const Flat flat(p);
            if (flat.crosses_itself()) {
                out.note = "edges cross: no area";
                return out;
            }
            out.area_mm2 = glm::length(vector_area(p));
            values = values_in_polygon(volume, flat, p, stop);
            break;
        }
    }
    if (!values)
        return std::nullopt;
    out.values = statistics_of(std::move(*values));
    if (out.values->count == 0)
        out.note =
            out.values->no_data == 0 ? "no sample lies inside" : "the samples inside hold no data";
    return out;
}

Json measure_json(const Measure& measure) {
    Json points = Json::array();
    for (const glm::dvec3 p : measure.points_mm)
        points.push_back(p);
    Json json{{"kind", name_of(measure.kind)}, {"points_mm", std::move(points)}};
    if (!measure.name.empty())
        json["name"] = measure.name;
    return json;
}

Measure read_measure(const JsonValue& in) {
    in.only_keys({"kind", "points_mm", "name"});
    Measure measure;
    measure.kind = in.at("kind").choice(kKinds);
    for (const JsonValue& point : in.at("points_mm").items(1, kMostPoints))
        measure.points_mm.push_back(point.vector(-kFarthest_mm, kFarthest_mm));
    in.take("name", measure.name);
    if (const Result<void> good = check(measure); !good)
        in.complain(good.error().message);
    return measure;
}

} // namespace palpate
