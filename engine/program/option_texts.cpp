#include "engine/program/option_texts.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

namespace palpate {

namespace {

Result<std::vector<double>> numbers(std::string_view text, size_t count) {
    std::optional<std::vector<double>> values = numbers_of(text, ',');
    if (!values || values->size() != count)
        return fail("expected {} number{} separated by commas, found '{}'", count,
                    count == 1 ? "" : "s", text);
    return std::move(*values);
}

struct Plane {
    glm::dvec3 point_mm, normal;
};

Result<Plane> read_plane(const std::string& text) {
    PALPATE_TRY(const std::vector<double> v, numbers(text, 6));
    const Plane plane{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    if (glm::length(plane.normal) == 0.0)
        return fail("expected a normal that is not 0, found '{}'", text);
    return plane;
}

} // namespace

std::optional<std::vector<double>> numbers_of(std::string_view text, char separator) {
    std::vector<double> numbers;
    for (;;) {
        const size_t end = std::min(text.find(separator), text.size());
        double number = NAN;
        const auto [rest, error] = std::from_chars(text.data(), text.data() + end, number);
        if (error != std::errc{} || rest != text.data() + end || !std::isfinite(number))
            return {};
        numbers.push_back(number);
        if (end == text.size())
            return numbers;
        text.remove_prefix(end + 1);
    }
}

Result<SliceLayer> read_slice(const std::string& text, glm::dvec3 center_mm) {
    SliceLayer slice;
    slice.point_mm = center_mm;
    constexpr std::pair<const char*, int> planes[] = {
        {"sagittal", 0}, {"coronal", 1}, {"axial", 2}};
    for (const auto& [name, axis] : planes) {
        if (!text.starts_with(name))
            continue;
        slice.normal = glm::dvec3(0.0);
        slice.normal[axis] = 1.0;
        const std::string rest = text.substr(std::string_view(name).size());
        if (rest.empty())
            return slice;
        const auto at = rest.front() == ':' ? numbers_of(rest.substr(1), ',') : std::nullopt;
        if (!at || at->size() != 1)
            return fail("expected {0} or {0}:MM, found '{1}'", name, text);
        slice.point_mm[axis] = at->front();
        return slice;
    }
    if (text.find(',') == std::string::npos)
        return fail(
            "expected axial, coronal or sagittal, optionally with :MM, or px,py,pz,nx,ny,nz; found "
            "'{}'",
            text);
    PALPATE_TRY(const Plane plane, read_plane(text));
    slice.point_mm = plane.point_mm;
    slice.normal = plane.normal;
    return slice;
}

Result<ClipPlane> read_clip(const std::string& text) {
    PALPATE_TRY(const Plane plane, read_plane(text));
    return ClipPlane{plane.point_mm, plane.normal};
}

Result<glm::dvec3> read_color(const std::string& text) {
    PALPATE_TRY(const std::vector<double> c, numbers(text, 3));
    if (!std::all_of(c.begin(), c.end(), [](double v) { return v >= 0.0 && v <= 1.0; }))
        return fail("expected numbers from 0 to 1, found '{}'", text);
    return glm::dvec3(c[0], c[1], c[2]);
}

Result<glm::dvec3> read_background(const std::string& text) {
    if (text == "black" || text == "transparent")
        return glm::dvec3(0.0);
    if (text == "white")
        return glm::dvec3(1.0);
    Result<glm::dvec3> color = read_color(text);
    if (!color)
        return fail("expected black, white, transparent or a colour r,g,b, 0 .. 1, found '{}'",
                    text);
    return color;
}

Result<SurfaceSource> read_surface(const std::string& text) {
    if (text == "labels")
        return SurfaceSource{.mesh = {}, .iso = {}, .labels = true};
    if (text.starts_with("iso=")) {
        const auto value = numbers_of(std::string_view(text).substr(4), ',');
        if (!value || value->size() != 1)
            return fail("expected iso=VALUE, found '{}'", text);
        return SurfaceSource{.mesh = {}, .iso = value->front(), .labels = false};
    }
    return SurfaceSource{.mesh = std::filesystem::absolute(text).string(), .iso = {}};
}

} // namespace palpate
