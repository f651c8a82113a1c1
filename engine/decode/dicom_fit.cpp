#include "engine/decode/dicom_fit.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate::io {

namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kOutlier = 3.0; // times the median
constexpr double kOfStep = 0.05; // of micrometres, kPositionRoundingMm is much

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

template <class Get>
double median_of(const std::vector<const DicomFrame*>& images, const Get& get) {
    std::vector<double> values;
    values.reserve(images.size());
    for (const DicomFrame* image : images)
        values.push_back(get(*image));
    return median(std::move(values));
}

struct Plane {
    std::optional<glm::dmat2x3> axes;
    std::optional<glm::dvec2> spacing_mm;
};

double axes_distance(const glm::dmat2x3& a, const glm::dmat2x3& b) {
    return std::max(glm::distance(a[0], b[0]), glm::distance(a[1], b[1]));
}

double spacing_difference(glm::dvec2 a, glm::dvec2 b) {
    const glm::dvec2 share = glm::abs(a - b) / b;
    return std::max(share.x, share.y);
}

bool is_near(const DicomFrame& image, const Plane& plane, double tolerance) {
    return (!image.axes || !plane.axes || axes_distance(*image.axes, *plane.axes) <= tolerance) &&
           (!image.spacing_mm || !plane.spacing_mm ||
            spacing_difference(*image.spacing_mm, *plane.spacing_mm) <= tolerance);
}

Plane median_plane(const std::vector<const DicomFrame*>& images) {
    Plane plane{images.front()->axes, images.front()->spacing_mm};
    for (int axis = 0; plane.axes && axis < 2; ++axis)
        for (int i = 0; i < 3; ++i)
            (*plane.axes)[axis][i] =
                median_of(images, [=](const DicomFrame& f) { return (*f.axes)[axis][i]; });
    for (int axis = 0; plane.spacing_mm && axis < 2; ++axis)
        (*plane.spacing_mm)[axis] =
            median_of(images, [=](const DicomFrame& f) { return (*f.spacing_mm)[axis]; });
    return plane;
}

std::vector<const DicomFrame*> pointers(const std::vector<DicomFrame>& images) {
    std::vector<const DicomFrame*> all;
    all.reserve(images.size());
    for (const DicomFrame& image : images)
        all.push_back(&image);
    return all;
}

// The pair of orthonormal vectors nearest to two that are almost so: their bisectors are at right
// angles.
glm::dmat2x3 orthonormal(const glm::dmat2x3& axes) {
    const glm::dvec3 x = glm::normalize(axes[0]), y = glm::normalize(axes[1]);
    const glm::dvec3 sum = glm::normalize(x + y), difference = glm::normalize(x - y);
    return {glm::normalize(sum + difference), glm::normalize(sum - difference)};
}

// The angle of the rotation that takes one pair of axes, each made orthonormal, to another. The
// squared differences of three axes add up to 8 sin^2 of half of it, which is exact for small ones.
double turned_degrees(const glm::dmat2x3& a, const glm::dmat2x3& b) {
    const glm::dmat2x3 from = orthonormal(a), to = orthonormal(b);
    const glm::dvec3 x = from[0] - to[0], y = from[1] - to[1];
    const glm::dvec3 z = glm::cross(from[0], from[1]) - glm::cross(to[0], to[1]);
    const double squares = glm::dot(x, x) + glm::dot(y, y) + glm::dot(z, z);
    return 2 * std::asin(std::min(1.0, std::sqrt(squares / 8))) * kDegrees;
}

glm::dmat2x3 mean_axes(const std::vector<DicomFrame>& images, const glm::dmat2x3& middle) {
    std::vector<double> off;
    for (const DicomFrame& image : images)
        off.push_back(axes_distance(*image.axes, middle));
    const double most = std::max(kEqualDirection, kOutlier * median(off));
    glm::dmat2x3 sum(0.0);
    for (size_t i = 0; i < images.size(); ++i)
        if (off[i] <= most)
            sum += *images[i].axes;
    return orthonormal(sum);
}

// How far a sample in a corner of an image lies from where `plane` puts it.
double corner_mm(const DicomFrame& image, const FittedPlane& plane) {
    const glm::dmat2x3 axes = image.axes.value_or(plane.axes);
    const glm::dvec2 one(1.0), last = glm::max(glm::dvec2(image.size) - 1.0, 0.0);
    const glm::dvec2 own = image.spacing_mm.value_or(one), used = plane.spacing_mm.value_or(one);
    double most = 0;
    for (const glm::dvec2 corner : {last, glm::dvec2(last.x, 0), glm::dvec2(0, last.y)})
        most = std::max(most, glm::distance(axes * (own * corner), plane.axes * (used * corner)));
    return most;
}

} // namespace

bool same_kind(const DicomFrame& a, const DicomFrame& b) {
    return a.size == b.size && a.axes.has_value() == b.axes.has_value() &&
           a.position.has_value() == b.position.has_value() &&
           a.spacing_mm.has_value() == b.spacing_mm.has_value();
}

std::vector<std::vector<DicomFrame>> split_planes(std::vector<DicomFrame> images) {
    std::vector<std::vector<DicomFrame>> planes;
    while (!images.empty()) {
        // The first may lie at one end of a cloud whose middle is the median.
        const Plane first{images.front().axes, images.front().spacing_mm};
        std::vector<const DicomFrame*> cloud;
        for (const DicomFrame& image : images)
            if (is_near(image, first, 2 * kSameDirection))
                cloud.push_back(&image);
        const Plane middle = median_plane(cloud);
        auto rest = std::stable_partition(
            images.begin(), images.end(),
            [&](const DicomFrame& image) { return is_near(image, middle, kSameDirection); });
        if (rest == images.begin())
            ++rest; // the first, which is like no other
        planes.emplace_back(std::make_move_iterator(images.begin()), std::make_move_iterator(rest));
        images.erase(images.begin(), rest);
    }
    return planes;
}

std::string difference_words(const DicomFrame& image, const DicomFrame& other) {
    std::string words;
    const auto add = [&](const std::string& text) { words += (words.empty() ? "" : ", ") + text; };
    if (image.size != other.size)
        add(fmt::format("another size ({} x {}, not {} x {})", image.size.x, image.size.y,
                        other.size.x, other.size.y));
    if (image.position.has_value() != other.position.has_value())
        add(image.position ? "a position" : "no position");
    if (image.axes.has_value() != other.axes.has_value())
        add(image.axes ? "an orientation" : "no orientation");
    else if (image.axes && axes_distance(*image.axes, *other.axes) > kSameDirection)
        add(fmt::format("another orientation (turned by {:.3g} degrees)",
                        turned_degrees(*image.axes, *other.axes)));
    if (image.spacing_mm.has_value() != other.spacing_mm.has_value())
        add(image.spacing_mm ? "a pixel spacing" : "no pixel spacing");
    else if (image.spacing_mm &&
             spacing_difference(*image.spacing_mm, *other.spacing_mm) > kSameDirection)
        add(fmt::format("another pixel spacing ({:.5g} x {:.5g} mm, not {:.5g} x {:.5g} mm)",
                        image.spacing_mm->x, image.spacing_mm->y, other.spacing_mm->x,
                        other.spacing_mm->y));
    return words.empty() ? "another orientation or pixel spacing" : words;
}

FittedPlane fit_plane(const std::vector<DicomFrame>& images) {
    PALPATE_ASSERT(!images.empty());
    const DicomFrame& first = images.front();
    FittedPlane plane;
    plane.axes = first.axes.value_or(plane.axes);
    plane.spacing_mm = first.spacing_mm;
    const bool equal = std::all_of(images.begin(), images.end(), [&](const DicomFrame& image) {
        return is_near(image, {first.axes, first.spacing_mm}, kEqualDirection);
    });
    if (equal)
        return plane;
    const Plane middle = median_plane(pointers(images));
    plane.spacing_mm = middle.spacing_mm;
    if (!middle.axes)
        return plane;
    plane.axes = mean_axes(images, *middle.axes);
    double directions = 0;
    for (const DicomFrame& image : images) {
        directions = std::max(directions, axes_distance(*image.axes, plane.axes));
        plane.degrees = std::max(plane.degrees, turned_degrees(*image.axes, plane.axes));
    }
    plane.from_noise = directions > kEqualDirection;
    if (!plane.from_noise)
        plane.axes = *middle.axes;
    return plane;
}

void turn_to_line(FittedPlane& plane, glm::dvec3 step) {
    const glm::dvec3 normal = glm::cross(plane.axes[0], plane.axes[1]);
    const glm::dvec3 line = glm::normalize(step);
    if (!plane.from_noise ||
        !(std::acos(std::min(1.0, glm::dot(line, normal))) * kDegrees <= plane.degrees))
        return;
    const glm::dvec3 x = plane.axes[0] - line * glm::dot(line, plane.axes[0]);
    const glm::dvec3 y = plane.axes[1] - line * glm::dot(line, plane.axes[1]);
    plane.axes = orthonormal({x, y});
}

std::string noise_words(const std::vector<DicomFrame>& images, const FittedPlane& plane) {
    const DicomFrame* worst = &images.front();
    double directions = 0, degrees = 0, spacings = 0, spacing_mm = 0, most_mm = 0;
    for (const DicomFrame& image : images) {
        if (image.axes) {
            directions = std::max(directions, axes_distance(*image.axes, plane.axes));
            degrees = std::max(degrees, turned_degrees(*image.axes, plane.axes));
        }
        if (image.spacing_mm) {
            const glm::dvec2 off = glm::abs(*image.spacing_mm - *plane.spacing_mm);
            spacings = std::max(spacings, spacing_difference(*image.spacing_mm, *plane.spacing_mm));
            spacing_mm = std::max({spacing_mm, off.x, off.y});
        }
        if (const double off = corner_mm(image, plane); off > most_mm) {
            most_mm = off;
            worst = &image;
        }
    }
    std::string what;
    if (directions > kEqualDirection)
        what =
            fmt::format("direction cosines differ by up to {:.2g} ({:.2g} degrees) from their mean",
                        directions, degrees);
    if (spacings > kEqualDirection)
        what += fmt::format("{}pixel spacings differ by up to {:.2g} mm from their median",
                            what.empty() ? "" : ", ", spacing_mm);
    if (what.empty())
        return {};
    return fmt::format(
        "the images' {}, which is taken for all: samples are moved by at most "
        "{:.2g} mm ({})",
        what, most_mm, leaf(*worst));
}

namespace {

glm::dvec3 median_vector(const std::vector<glm::dvec3>& vectors) {
    glm::dvec3 middle;
    for (int i = 0; i < 3; ++i) {
        std::vector<double> values;
        values.reserve(vectors.size());
        for (const glm::dvec3& vector : vectors)
            values.push_back(vector[i]);
        middle[i] = median(std::move(values));
    }
    return middle;
}

void measure(const std::vector<glm::dvec3>& points, const std::vector<double>& at,
             FittedLine& line) {
    line.off_mm.clear();
    for (size_t k = 0; k < points.size(); ++k)
        line.off_mm.push_back(glm::distance(points[k], line.first + at[k] * line.step));
    line.farthest_mm = *std::max_element(line.off_mm.begin(), line.off_mm.end());
}

// Fits a line to the points that lie within `most_mm` of the line as it is.
void least_squares(const std::vector<glm::dvec3>& points, const std::vector<double>& at,
                   double most_mm, FittedLine& line) {
    double count = 0, mean_at = 0, square = 0;
    glm::dvec3 mean(0.0), product(0.0);
    for (size_t k = 0; k < points.size(); ++k)
        if (line.off_mm[k] <= most_mm) {
            ++count;
            mean_at += at[k];
            mean += points[k];
        }
    mean_at /= count;
    mean /= count;
    for (size_t k = 0; k < points.size(); ++k)
        if (line.off_mm[k] <= most_mm) {
            square += (at[k] - mean_at) * (at[k] - mean_at);
            product += (at[k] - mean_at) * (points[k] - mean);
        }
    if (square > 0) {
        line.step = product / square;
        line.first = mean - mean_at * line.step;
    }
    measure(points, at, line);
}

} // namespace

FittedLine fit_line(const std::vector<glm::dvec3>& points, const std::vector<double>& at) {
    PALPATE_ASSERT_CMP(points.size(), >=, size_t{2});
    PALPATE_ASSERT_CMP(points.size(), ==, at.size());
    FittedLine line;
    line.step = (points.back() - points.front()) / (at.back() - at.front());
    line.first = points.front() - at.front() * line.step;
    measure(points, at, line);
    const double rounding = std::min(kPositionRoundingMm, kOfStep * glm::length(line.step));
    if (points.size() == 2 || line.farthest_mm <= rounding)
        return line;
    // Theil-Sen, with pairs half of the line apart alone.
    const size_t half = points.size() / 2;
    std::vector<glm::dvec3> vectors;
    for (size_t k = 0; k + half < points.size(); ++k)
        vectors.push_back((points[k + half] - points[k]) / (at[k + half] - at[k]));
    line.step = median_vector(vectors);
    vectors.clear();
    for (size_t k = 0; k < points.size(); ++k)
        vectors.push_back(points[k] - at[k] * line.step);
    line.first = median_vector(vectors);
    measure(points, at, line);
    least_squares(points, at, std::max(kPositionRoundingMm, kOutlier * median(line.off_mm)), line);
    return line;
}

FittedLine least_squares_line(const std::vector<glm::dvec3>& points,
                              const std::vector<double>& at) {
    FittedLine line;
    line.off_mm.resize(points.size(), 0.0);
    least_squares(points, at, 1.0, line);
    return line;
}

double rounding_mm(const std::vector<glm::dvec3>& points) {
    for (double unit = 1.0; unit > 0.5e-4; unit /= 10) {
        const bool whole = std::all_of(points.begin(), points.end(), [&](const glm::dvec3& point) {
            const glm::dvec3 units = point / unit;
            // A decimal string is read to within a few units of the last place.
            return glm::distance(units, glm::round(units)) <= 1e-6;
        });
        if (whole)
            return unit / 2;
    }
    return 0;
}

} // namespace palpate::io
