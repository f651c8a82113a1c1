#include "haptics/field/patch.h"

#include <algorithm>
#include <cmath>

#include "haptics/field/samples.h"

namespace palpate::haptics {

namespace {

constexpr double kBulge = 0.25; // of the lattice, at most

} // namespace

glm::dmat4 Patch::mesh_from_world(const Volume& volume) {
    return glm::inverse(world_from_mesh(volume.grid()));
}

void Patch::extract(const Volume& volume, glm::dvec3 world_mm, const TouchParameters& p) {
    const glm::dvec3 index = glm::clamp(index_point(volume.grid(), world_mm), -1e6, 1e6);
    const glm::ivec3 first = glm::ivec3(glm::round(index - 0.5 * (side_ - 1.0)));
    const float lowest = std::min(volume.range().empty() ? 0.0f : volume.range().min,
                                  static_cast<float>(p.iso) - 1.0f);
    copy_resident(volume, first, glm::ivec3(side_), lowest, samples_.data());
    const size_t count = size_t(side_) * size_t(side_) * size_t(side_);
    const bool labels = p.source == TouchSource::labels;
    for (size_t i = 0; i < count; ++i) {
        if (labels)
            samples_[i] = samples_[i] > 0.0f ? 1.0f : 0.0f;
        else if (p.opacity.point_count > 0)
            samples_[i] = static_cast<float>(strength_n(p.opacity, double{samples_[i]}));
    }
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    low_ = glm::dvec3(first) * spacing;
    high_ = low_ + (side_ - 1.0) * spacing;
    const LocalSurface::Patch made =
        surface_.extract(std::span<const float>(samples_.data(), count), glm::vec3(spacing),
                         glm::vec3(low_), labels ? 0.5f : static_cast<float>(p.iso));
    span_ = {made.positions, made.normals, made.triangles};
    is_solid_amid_ = samples_[count / 2] >= (labels ? 0.5f : static_cast<float>(p.iso));
}

int64_t Patch::extract(FineSamples& samples, const Volume& volume, glm::dvec3 world_mm,
                       const RigidSpace& space) {
    const double finer = samples.finer();
    const glm::dvec3 index = glm::clamp(index_point(volume.grid(), world_mm), -1e6, 1e6) * finer;
    const glm::ivec3 first = glm::ivec3(glm::round(index - 0.5 * (side_ - 1.0)));
    const glm::dvec3 spacing = spacing_mm(volume.grid()) / finer;
    low_ = glm::dvec3(first) * spacing;
    high_ = low_ + (side_ - 1.0) * spacing;
    span_ = {};
    is_solid_amid_ = false;
    const FineSamples::Matter matter = samples.matter(first, first + side_ - 1);
    is_solid_amid_ = matter == FineSamples::Matter::solid;
    if (matter != FineSamples::Matter::unknown)
        return 0;
    const size_t count = size_t(side_) * size_t(side_) * size_t(side_);
    const FineSamples::Box sharp = samples.sharp(first, side_);
    is_solid_amid_ = sharp.values[count / 2] >= samples.threshold();
    made_ = surface_.extract(std::span<const float>(sharp.values, count), glm::vec3(spacing),
                             glm::vec3(low_), samples.threshold());
    first_point_ = first;
    spacing_ = spacing;
    span_ = {
        made_.positions, {}, made_.triangles, kBulge * std::max({spacing.x, spacing.y, spacing.z})};
    if (made_.positions.empty())
        return static_cast<int64_t>(count);
    span_.cells = sort_into_cells(made_.positions, spacing, glm::inverse(space.from_mesh));
    span_.triangles = {sorted_.data(), made_.triangles.size()};
    if (!space.is_mesh_space) {
        const glm::mat3 from_mesh(space.from_mesh);
        const size_t vertices = made_.positions.size();
        for (size_t i = 0; i < vertices; ++i)
            filtered_[i] = from_mesh * made_.positions[i];
        span_.positions = {filtered_.data(), vertices};
    }
    return static_cast<int64_t>(count);
}

int64_t Patch::shade(FineSamples& samples, const RigidSpace& space) {
    if (span_.positions.empty() || !span_.normals.empty())
        return 0;
    const int read = side_ + 4; // two points more on every side
    const FineSamples::Box smooth = samples.smooth(first_point_ - 2, read);
    // Every vertex lies on an edge of the lattice: means of the differences at its ends, which are
    // exact for polynomials of the fourth degree.
    const int last = side_ - 1;
    const auto slope = [&](glm::ivec3 p) {
        const float* v = smooth.values + (p.x + 2 + read * (p.y + 2 + read * (p.z + 2)));
        const auto d = [&](int s) { return 8.0f * (v[s] - v[-s]) - (v[2 * s] - v[-2 * s]); };
        return glm::vec3(d(1), d(read), d(read * read)) / glm::vec3(spacing_);
    };
    const size_t vertices = made_.positions.size();
    for (size_t i = 0; i < vertices; ++i) {
        const glm::vec3 place((glm::dvec3(made_.positions[i]) - low_) / spacing_);
        const glm::vec3 off = glm::abs(place - glm::round(place));
        const int axis = off.x > off.y ? (off.x > off.z ? 0 : 2) : off.y > off.z ? 1 : 2;
        glm::ivec3 a = glm::clamp(glm::ivec3(glm::round(place)), glm::ivec3(0), glm::ivec3(last));
        a[axis] = std::clamp(static_cast<int>(std::floor(place[axis])), 0, last - 1);
        glm::ivec3 b = a;
        ++b[axis];
        const float share = std::clamp(place[axis] - static_cast<float>(a[axis]), 0.0f, 1.0f);
        const glm::vec3 mean = glm::mix(slope(a), slope(b), share);
        const float length = glm::length(mean);
        normals_[i] = length > 0.0f ? -mean / length : made_.normals[i]; // a NaN is not above 0
    }
    if (!space.is_mesh_space) {
        const glm::mat3 normal_from_mesh(space.normal_from_mesh);
        for (size_t i = 0; i < vertices; ++i)
            normals_[i] = glm::normalize(normal_from_mesh * normals_[i]);
    }
    span_.normals = {normals_.data(), vertices};
    return int64_t{read} * read * read;
}

TriangleCells Patch::sort_into_cells(std::span<const glm::vec3> positions, glm::dvec3 spacing,
                                     const glm::dmat3& mesh_from) {
    const int last = side_ - 2;
    const size_t cells = size_t(side_ - 1) * size_t(side_ - 1) * size_t(side_ - 1);
    const glm::vec3 per_mm(1.0 / (3.0 * spacing)), low(3.0 * low_);
    std::fill_n(first_.begin(), cells + 1, 0u);
    for (size_t i = 0; i < span_.triangles.size(); ++i) {
        const glm::uvec3 t = span_.triangles[i];
        const glm::vec3 sum = positions[t.x] + positions[t.y] + positions[t.z];
        const glm::ivec3 at =
            glm::clamp(glm::ivec3((sum - low) * per_mm), glm::ivec3(0), glm::ivec3(last));
        cell_[i] = static_cast<uint16_t>(at.x + (side_ - 1) * (at.y + (side_ - 1) * at.z));
        ++first_[cell_[i] + size_t{1}];
    }
    for (size_t c = 0; c < cells; ++c)
        first_[c + 1] += first_[c];
    // Filled from the end of each cell, which becomes its beginning.
    for (size_t i = span_.triangles.size(); i-- > 0;)
        sorted_[--first_[cell_[i] + size_t{1}]] = span_.triangles[i];
    std::copy_n(first_.begin() + 1, cells, first_.begin());
    first_[cells] = static_cast<uint32_t>(span_.triangles.size());
    TriangleCells made;
    for (int column = 0; column < 3; ++column)
        made.cells_from_mm[column] = mesh_from[column] / spacing;
    made.offset = -low_ / spacing;
    made.count = glm::ivec3(side_ - 1);
    made.to = glm::ivec3(last);
    made.first = {first_.data(), cells + 1};
    return made;
}

void Patch::mean_filter() {
    const size_t count = span_.positions.size();
    std::copy(span_.positions.begin(), span_.positions.end(), filtered_.begin());
    std::fill(weights_.begin(), weights_.begin() + static_cast<long>(count), 1.0f);
    for (const glm::uvec3 t : span_.triangles)
        for (int k = 0; k < 3; ++k) {
            const uint32_t a = t[k], b = t[(k + 1) % 3];
            // Each inner edge is met twice, once from either side: once for either end.
            filtered_[a] += span_.positions[b];
            weights_[a] += 1.0f;
        }
    for (size_t i = 0; i < count; ++i)
        filtered_[i] /= weights_[i];
    span_.positions = {filtered_.data(), count};
}

} // namespace palpate::haptics
