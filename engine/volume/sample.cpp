#include "engine/volume/sample.h"

#include <cmath>
#include <limits>

namespace palpate {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Cell {
    glm::uvec3 low;
    glm::dvec3 fraction; // 0 .. 1
    bool inside;
};

// The last cell of an axis includes its upper face, so that index == size - 1 is inside.
Cell locate(glm::uvec3 size, glm::dvec3 index) {
    Cell cell{};
    cell.inside = true;
    for (int axis = 0; axis < 3; ++axis) {
        const double last = static_cast<double>(size[axis]) - 1.0;
        if (!(index[axis] >= 0.0 && index[axis] <= last)) {
            cell.inside = false;
            return cell;
        }
        const double low = std::min(std::floor(index[axis]), std::max(last - 1.0, 0.0));
        cell.low[axis] = static_cast<uint32_t>(low);
        cell.fraction[axis] = index[axis] - low;
    }
    return cell;
}

double interpolate(const std::array<float, 8>& c, glm::dvec3 f) {
    const auto lerp = [](double a, double b, double t) { return a + t * (b - a); };
    return lerp(lerp(lerp(c[0], c[1], f.x), lerp(c[2], c[3], f.x), f.y),
                lerp(lerp(c[4], c[5], f.x), lerp(c[6], c[7], f.x), f.y), f.z);
}

template <class Value>
glm::dvec3 differences(glm::uvec3 size, glm::dvec3 index, const Value& value) {
    const glm::dvec3 last = glm::dvec3(size) - 1.0;
    glm::dvec3 gradient{};
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 step{};
        step[axis] = 1.0;
        gradient[axis] = 0.5 * (value(glm::clamp(index + step, glm::dvec3(0.0), last)) -
                                value(glm::clamp(index - step, glm::dvec3(0.0), last)));
    }
    return gradient;
}

} // namespace

std::array<float, 8> cell_corners(const Volume& volume, glm::uvec3 cell) {
    std::array<float, 8> corners{};
    const glm::uvec3 last = volume.size() - 1u;
    for (uint32_t i = 0; i < 8; ++i)
        corners[i] = volume.value(glm::min(cell + glm::uvec3(i & 1, i >> 1 & 1, i >> 2), last));
    return corners;
}

double trilinear(const Volume& volume, glm::dvec3 index) {
    const Cell cell = locate(volume.size(), index);
    return cell.inside ? interpolate(cell_corners(volume, cell.low), cell.fraction) : kNaN;
}

glm::dvec3 central_gradient(const Volume& volume, glm::dvec3 index) {
    return differences(volume.size(), index, [&](glm::dvec3 at) { return trilinear(volume, at); });
}

SampleCursor::SampleCursor(Volume volume) : volume_(std::move(volume)) {}

float SampleCursor::at(glm::uvec3 index) {
    const glm::uvec3 position = index / kBrickSide;
    if (position != brick_position_) {
        brick_position_ = position;
        brick_ = &volume_.brick(position);
        pinned_ = brick_->pin();
    }
    return brick_->value(pinned_, offset_in_brick(index % kBrickSide));
}

double SampleCursor::value(glm::dvec3 index) {
    const Cell cell = locate(volume_.size(), index);
    if (!cell.inside)
        return kNaN;
    if (cell.low != cell_) {
        cell_ = cell.low;
        const glm::uvec3 last = volume_.size() - 1u, local = cell_ % kBrickSide;
        corners_[0] = at(cell_);
        const bool in_brick = glm::all(glm::lessThan(local, glm::uvec3(kBrickSide - 1))) &&
                              glm::all(glm::lessThan(cell_, last));
        for (uint32_t i = 1; i < 8; ++i) {
            const glm::uvec3 step(i & 1, i >> 1 & 1, i >> 2);
            corners_[i] = in_brick ? brick_->value(pinned_, offset_in_brick(local + step))
                                   : at(glm::min(cell_ + step, last));
        }
    }
    return interpolate(corners_, cell.fraction);
}

glm::dvec3 SampleCursor::gradient(glm::dvec3 index) {
    return differences(volume_.size(), index, [&](glm::dvec3 at) { return value(at); });
}

} // namespace palpate
