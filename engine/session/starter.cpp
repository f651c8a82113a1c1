#include "engine/session/starter.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/edit/stroke.h"
#include "engine/volume/extent.h"
#include "engine/volume/sample.h"

namespace palpate {

namespace {

constexpr int kLines = 9; // a side of the square of lines through one face

const glm::dvec3 kWays[] = {{0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}, {0, 0, 1}};

// Walks lines through a volume.
class LineSearch {
 public:
    LineSearch(const Volume& volume, double iso)
        : grid_(volume.grid()),
          box_(world_box(grid_)),
          cursor_(volume),
          iso_(iso),
          step_mm_(0.5 * smallest_spacing_mm(grid_)) {}

    const WorldBox& box() const { return box_; }

    // The first place of the line through `at_mm` that is solid, as are the `thick_mm` behind it;
    // nothing where the line begins in the material.
    std::optional<glm::dvec3> first_on_line(glm::dvec3 at_mm, glm::dvec3 way, double thick_mm) {
        const glm::dvec3 ends = box_.high - box_.low;
        const double length_mm = std::abs(glm::dot(ends, way));
        const glm::dvec3 face = glm::mix(box_.low, box_.high, glm::lessThan(way, glm::dvec3(0.0)));
        // From the face that the line enters by.
        const glm::dvec3 begin = at_mm + way * glm::dot(face - at_mm, way);
        const auto count = static_cast<int64_t>(std::ceil(length_mm / step_mm_));
        bool was_solid = is_solid(begin);
        for (int64_t i = 1; i <= count; ++i) {
            const double far = std::min(step_mm_ * static_cast<double>(i), length_mm);
            const bool solid = is_solid(begin + far * way);
            if (solid && !was_solid) {
                const glm::dvec3 hit = refined(begin + (far - step_mm_) * way, begin + far * way);
                if (is_thick(hit, way, thick_mm))
                    return hit;
            }
            was_solid = solid;
        }
        return {};
    }

 private:
    bool is_solid(glm::dvec3 world_mm) {
        return cursor_.value(index_point(grid_, world_mm)) >= iso_; // false of NaN
    }
    glm::dvec3 refined(glm::dvec3 free_mm, glm::dvec3 solid_mm) {
        for (int i = 0; i < 40; ++i) {
            const glm::dvec3 middle = 0.5 * (free_mm + solid_mm);
            (is_solid(middle) ? solid_mm : free_mm) = middle;
        }
        return solid_mm;
    }
    bool is_thick(glm::dvec3 hit, glm::dvec3 way, double thick_mm) {
        for (double deep = step_mm_; deep <= thick_mm; deep += step_mm_)
            if (!is_solid(hit + deep * way))
                return false;
        return true;
    }

    Grid grid_;
    WorldBox box_;
    SampleCursor cursor_;
    double iso_, step_mm_;
};

// Places of a square from -1 to 1, the middle first.
std::vector<glm::dvec2> square() {
    std::vector<glm::dvec2> places;
    constexpr int kHalf = kLines / 2;
    for (int v = -kHalf; v <= kHalf; ++v)
        for (int u = -kHalf; u <= kHalf; ++u)
            places.push_back(glm::dvec2(u, v) / (kHalf + 0.5));
    std::stable_sort(places.begin(), places.end(),
                     [](glm::dvec2 a, glm::dvec2 b) { return glm::dot(a, a) < glm::dot(b, b); });
    return places;
}

// Two directions along the world's axes across a third.
std::pair<glm::dvec3, glm::dvec3> across(glm::dvec3 way) {
    const glm::dvec3 size = glm::abs(way);
    return {{size.z, size.x, size.y}, {size.y, size.z, size.x}};
}

double shortest_side_mm(const WorldBox& box) {
    const glm::dvec3 side = box.high - box.low;
    return std::min({side.x, side.y, side.z});
}

} // namespace

Result<Landing> find_landing(const Volume& volume, double iso) {
    LineSearch search(volume, iso);
    const glm::dvec3 middle = center_mm(volume.grid());
    const glm::dvec3 half = 0.5 * (search.box().high - search.box().low);
    for (const double thick_mm : {2.0 * largest_spacing_mm(volume.grid()), 0.0})
        for (const glm::dvec2 place : square())
            for (const glm::dvec3 way : kWays) {
                const auto [u, v] = across(way);
                const glm::dvec3 on_line = middle + half * (place.x * u + place.y * v);
                if (const auto hit = search.first_on_line(on_line, way, thick_mm))
                    return Landing{*hit, way};
            }
    const ValueRange range = volume.range();
    return fail("no straight line from outside meets a surface at {:g}; values are {:g} .. {:g}",
                iso, range.min, range.max);
}

std::string starter_path(const Landing& landing, const Volume& volume) {
    const WorldBox box = world_box(volume.grid());
    const double side = glm::length(box.high - box.low) / std::sqrt(3.0);
    const double away_mm = std::clamp(0.25 * side, 5.0, 20.0);
    // Less is lost in the play of a hand and a device. The first sample that is solid may lie as
    // deep as samples are apart, and a tool is to reach it.
    const glm::dvec3 steps = glm::dmat3(index_from_world(volume.grid())) * landing.into;
    const double apart_mm =
        1.0 / std::max({std::abs(steps.x), std::abs(steps.y), std::abs(steps.z)});
    const double deep_mm = std::max(2.0, apart_mm);
    const glm::dvec3 out = landing.at_mm - away_mm * landing.into;
    const glm::dvec3 in = landing.at_mm + deep_mm * landing.into;
    std::string text = fmt::format(
        "# A hand that comes from {:g} mm outside, lands on the surface, presses {:g} mm deep, "
        "with "
        "button 0\n# for half a second, and leaves. World millimetres, left-posterior-superior.\n"
        "time_s,x_mm,y_mm,z_mm,button\n",
        away_mm, deep_mm);
    const auto row = [&](double time_s, glm::dvec3 at, int button) {
        text += fmt::format("{:.2f},{:.4f},{:.4f},{:.4f},{}\n", time_s, at.x, at.y, at.z, button);
    };
    row(0.0, out, 0);
    row(1.0, in, 1);
    row(1.5, in, 0);
    row(2.5, out, 0);
    return text;
}

std::string starter_strokes(const Landing& landing, const Volume& volume, double iso) {
    LineSearch search(volume, iso);
    const double radius_mm =
        std::max(1.5 * largest_spacing_mm(volume.grid()), 0.05 * shortest_side_mm(search.box()));
    const auto stroke = [&](double radius, const Operation& operation,
                            std::vector<StrokePose> poses) {
        return stroke_text(
            make_stroke({{"kind", "ball"}, {"radius_mm", radius}}, operation, std::move(poses))
                .value());
    };
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.surface_value = iso;
    Operation mill = cut;
    mill.kind = OperationKind::mill;
    mill.falloff_mm = 0.1 * radius_mm;
    const ValueRange range = volume.range();
    mill.rates = {{0.0, 10.0 * (double{range.max} - double{range.min})}}; // through in 0.1 s
    // The groove leaves the bottom of the cut and follows the surface for four radii.
    const glm::dvec3 along = across(landing.into).first;
    std::vector<StrokePose> groove{{0.0, {landing.at_mm + radius_mm * landing.into}}};
    for (int i = 1; i <= 8; ++i) {
        const glm::dvec3 beside = landing.at_mm + 0.5 * i * radius_mm * along;
        const auto hit = search.first_on_line(beside, landing.into, 0.0);
        if (!hit || std::abs(glm::dot(*hit - groove.back().tool.position_mm, landing.into)) >
                        2.0 * radius_mm)
            break; // the surface ends here
        groove.push_back({0.2 * i, {*hit + 0.25 * radius_mm * landing.into}});
    }
    groove.push_back(groove.back());
    groove.back().time_s += 0.5; // time for the mill where there is but one place
    return stroke(radius_mm, cut, {{0.0, {landing.at_mm}}}) +
           stroke(0.75 * radius_mm, mill, std::move(groove));
}

} // namespace palpate
