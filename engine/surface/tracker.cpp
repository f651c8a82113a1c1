#include "engine/surface/tracker.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <deque>

#include "engine/base/assert.h"
#include "engine/surface/cell_tables.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/sample.h"

namespace palpate {

namespace {

// Facts about each configuration that need no look at a volume.
struct Cases {
    std::array<uint8_t, 256> connectivity{}; // bit f: the surface goes on through face f
    std::array<uint16_t, 256> edges{};       // bit e: edge e is crossed

    Cases() {
        for (int c = 0; c < 256; ++c) {
            for (int f = 0; f < 6; ++f) {
                int inside = 0;
                for (const uint8_t corner : face_corners(f))
                    inside += c >> corner & 1;
                if (inside != 0 && inside != 4)
                    connectivity[c] |= static_cast<uint8_t>(1 << f);
            }
            for (int e = 0; e < 12; ++e) {
                const CellEdge edge = cell_edge(e);
                if ((c >> edge.corner & 1) != (c >> (edge.corner + (1 << edge.axis)) & 1))
                    edges[c] |= static_cast<uint16_t>(1 << e);
            }
        }
    }
};

const Cases& cases() {
    static const Cases made;
    return made;
}

glm::uvec3 corner_offset(int corner) {
    return {corner & 1, corner >> 1 & 1, corner >> 2 & 1};
}

// The sum of the unit normals of a cell's triangles at each of its midway vertices, for one
// spacing.
struct NormalTable {
    std::array<std::array<glm::vec3, 12>, 256> sum{};

    explicit NormalTable(glm::dvec3 spacing_mm) {
        const ClassicTable& table = classic_table();
        const auto midway = [&](uint8_t e) {
            const CellEdge edge = cell_edge(e);
            glm::dvec3 at(corner_offset(edge.corner));
            at[edge.axis] += 0.5;
            return at * spacing_mm;
        };
        for (int c = 0; c < 256; ++c)
            for (int t = 0; t < table.triangle_count[c]; ++t) {
                const uint8_t* e = &table.edges[c][3 * t];
                const glm::dvec3 normal =
                    glm::cross(midway(e[1]) - midway(e[0]), midway(e[2]) - midway(e[0]));
                for (int i = 0; i < 3; ++i)
                    sum[c][e[i]] += glm::vec3(glm::normalize(normal));
            }
    }
};

// Samples of a volume of T beside one another, mostly in one brick.
template <class T>
class Reader {
 public:
    explicit Reader(const Volume& volume) : volume_(volume) {}

    T at(glm::uvec3 sample) {
        if (const glm::uvec3 position = sample / kBrickSide; position != position_) {
            position_ = position;
            const Brick& brick = volume_.brick(position);
            pinned_ = brick.pin();
            stride_ = brick.stride();
        }
        return reinterpret_cast<const T*>(
            pinned_.bytes)[stride_ * offset_in_brick(sample % kBrickSide)];
    }

 private:
    const Volume& volume_;
    glm::uvec3 position_{~0u};
    Brick::Pinned pinned_;
    uint32_t stride_ = 0;
};

// Which samples carry the label, a bit each, for rows of a volume and of the border round it.
class Rows {
 public:
    Rows(const Volume& volume, uint16_t label, uint32_t border)
        : volume_(volume),
          label_(label),
          border_(border),
          words_((volume.size().x + 2 * border + 64) / 64) {}

    size_t words() const { return words_; } // one bit more than a row at least

    // Row (y, z), counted with the border.
    template <class T>
    void read(uint32_t y, uint32_t z, uint64_t* out) const {
        std::fill_n(out, words_, uint64_t{0});
        const glm::uvec3 size = volume_.size();
        if (y < border_ || z < border_ || y - border_ >= size.y || z - border_ >= size.z)
            return;
        const glm::uvec3 start(0, y - border_, z - border_);
        for (uint32_t b = 0; b < volume_.brick_count().x; ++b) {
            const Brick& brick = volume_.brick({b, start.y / kBrickSide, start.z / kBrickSide});
            const ValueRange range = brick.range();
            if (!(range.min <= float(label_) && float(label_) <= range.max))
                continue;
            const Brick::Pinned pinned = brick.pin();
            const auto* samples = reinterpret_cast<const T*>(pinned.bytes);
            const uint32_t first = offset_in_brick({0, start.y % kBrickSide, start.z % kBrickSide});
            const uint32_t count = std::min(kBrickSide, size.x - b * kBrickSide);
            uint64_t bits = 0;
            for (uint32_t x = 0; x < count; ++x)
                bits |= uint64_t{float(samples[brick.stride() * (first + x)]) == float(label_)}
                        << x;
            const uint32_t at = b * kBrickSide + border_;
            out[at / 64] |= bits << at % 64;
            if (at % 64 > 32)
                out[at / 64 + 1] |= bits >> (64 - at % 64);
        }
    }

 private:
    const Volume& volume_;
    uint16_t label_;
    uint32_t border_;
    size_t words_;
};

} // namespace

SurfaceTracker::SurfaceTracker(Volume labels, uint16_t label, TrackerOptions options)
    : labels_(std::move(labels)),
      label_(label),
      options_(std::move(options)),
      border_(options_.closed ? 1 : 0),
      cells_(labels_.size() - 1u + 2 * border_) {
    PALPATE_ASSERT(!options_.grey || options_.grey->size() == labels_.size());
    PALPATE_ASSERT(options_.grey || !(options_.interpolate || options_.gradient_normals));
    index_.assign(size_t{cells_.x} * cells_.y * cells_.z, 0);
    first_.assign(size_t{cells_.y} * cells_.z, cells_.x);
    end_.assign(first_.size(), 0);
}

void SurfaceTracker::cover(glm::uvec3 at) {
    const size_t line = at.y + size_t{cells_.y} * at.z;
    first_[line] = std::min(first_[line], at.x);
    end_[line] = std::max(end_[line], at.x + 1);
}

// The configuration of one cell, straight from the samples.
template <class T>
static uint8_t configuration(Reader<T>& reader, glm::uvec3 size, glm::uvec3 at, uint32_t border,
                             uint16_t label) {
    unsigned found = 0;
    for (int c = 0; c < 8; ++c) {
        const glm::uvec3 sample = at + corner_offset(c) - border; // wraps below 0, beyond size
        const bool is_within = sample.x < size.x && sample.y < size.y && sample.z < size.z;
        found |= unsigned{is_within && float(reader.at(sample)) == float(label)} << c;
    }
    return static_cast<uint8_t>(found);
}

template <class T>
void SurfaceTracker::track_surface(glm::uvec3 seed) {
    Reader<T> reader(labels_);
    std::deque<glm::uvec3> cells{seed};
    while (!cells.empty()) {
        const glm::uvec3 at = cells.front();
        cells.pop_front();
        uint8_t& index = index_[offset(at)];
        if (index != 0)
            continue;
        index = configuration(reader, labels_.size(), at, border_, label_);
        cover(at);
        for_each_next(at, [&](glm::uvec3 next) { cells.push_back(next); });
    }
}

template <class Visit>
void SurfaceTracker::for_each_next(glm::uvec3 at, const Visit& visit) {
    const uint8_t connectivity = cases().connectivity[index_[offset(at)]];
    for (int f = 0; f < 6; ++f) {
        if (!(connectivity >> f & 1))
            continue;
        glm::uvec3 next = at;
        next[f / 2] += f % 2 == 0 ? ~0u : 1u;
        if (next[f / 2] < cells_[f / 2] && index_[offset(next)] == 0)
            visit(next);
    }
}

template <class T>
void SurfaceTracker::follow(glm::uvec3 at) {
    for_each_next(at, [&](glm::uvec3 next) { track_surface<T>(next); });
}

bool SurfaceTracker::track(glm::uvec3 seed) {
    PALPATE_ASSERT(glm::all(glm::lessThan(seed, cells_)));
    return visit_scalar(labels_.type(), [&](auto t) {
        using T = decltype(t);
        Reader<T> reader(labels_);
        const uint8_t found = configuration(reader, labels_.size(), seed, border_, label_);
        if (found == 0 || found == 255)
            return false;
        track_surface<T>(seed);
        return true;
    });
}

template <class T>
void SurfaceTracker::search() {
    const Rows rows(labels_, label_, border_);
    const size_t words = rows.words();
    const uint32_t lines = cells_.y + 1;
    // The bits of two slices, and from them those of each line of cells.
    std::vector<uint64_t> slices[2], any(words + 1), all(words + 1);
    const auto read_slice = [&](uint32_t z) {
        std::vector<uint64_t>& slice = slices[z % 2];
        slice.resize(words * lines);
        for (uint32_t y = 0; y < lines; ++y)
            rows.read<T>(y, z, &slice[words * y]);
    };
    read_slice(0);
    for (uint32_t z = 0; z < cells_.z; ++z) {
        read_slice(z + 1);
        for (uint32_t y = 0; y < cells_.y; ++y) {
            for (size_t w = 0; w < words; ++w) {
                const uint64_t a = slices[0][words * y + w], b = slices[0][words * (y + 1) + w];
                const uint64_t c = slices[1][words * y + w], d = slices[1][words * (y + 1) + w];
                any[w] = a | b | c | d;
                all[w] = a & b & c & d;
            }
            for (size_t w = 0; w < words; ++w) {
                const uint64_t next_any = any[w] >> 1 | any[w + 1] << 63;
                const uint64_t next_all = all[w] >> 1 | all[w + 1] << 63;
                uint64_t crossed = (any[w] | next_any) & ~(all[w] & next_all);
                for (; crossed != 0; crossed &= crossed - 1) {
                    const auto x = static_cast<uint32_t>(64 * w) +
                                   static_cast<uint32_t>(std::countr_zero(crossed));
                    if (x < cells_.x && index_[offset({x, y, z})] == 0)
                        track_surface<T>({x, y, z});
                }
            }
        }
    }
}

void SurfaceTracker::find_all() {
    std::fill(index_.begin(), index_.end(), uint8_t{0});
    std::fill(first_.begin(), first_.end(), cells_.x);
    std::fill(end_.begin(), end_.end(), 0u);
    if (index_.empty())
        return;
    visit_scalar(labels_.type(), [&](auto t) { search<decltype(t)>(); });
}

void SurfaceTracker::update(const Volume& edited, glm::uvec3 low, glm::uvec3 high) {
    PALPATE_ASSERT(edited.size() == labels_.size() && edited.type() == labels_.type());
    labels_ = edited;
    if (index_.empty())
        return;
    // A cell has a changed corner if one of its two samples on each axis lies in the box.
    const glm::uvec3 from = glm::max(low + border_, glm::uvec3(1)) - 1u;
    const glm::uvec3 to = glm::min(high + border_, cells_ - 1u);
    visit_scalar(labels_.type(), [&](auto t) {
        Reader<decltype(t)> reader(labels_);
        for (uint32_t z = from.z; z <= to.z; ++z)
            for (uint32_t y = from.y; y <= to.y; ++y) {
                uint8_t* line = &index_[offset({0, y, z})];
                for (uint32_t x = from.x; x <= to.x; ++x) {
                    const uint8_t found =
                        configuration(reader, labels_.size(), {x, y, z}, border_, label_);
                    line[x] = found == 255 ? uint8_t{0} : found;
                }
                uint32_t first = 0, end = cells_.x;
                while (first < end && line[first] == 0)
                    ++first;
                while (end > first && line[end - 1] == 0)
                    --end;
                const size_t at = y + size_t{cells_.y} * z;
                first_[at] = first;
                end_[at] = first < end ? end : 0;
            }
        // Surfaces that were never tracked may have come into sight: then whole.
        for (uint32_t z = from.z; z <= to.z; ++z)
            for (uint32_t y = from.y; y <= to.y; ++y)
                for (uint32_t x = from.x; x <= to.x; ++x)
                    follow<decltype(t)>({x, y, z});
    });
}

Mesh SurfaceTracker::triangulate() const {
    const glm::dvec3 spacing = spacing_mm(labels_.grid());
    Mesh mesh{.world_from_mesh = world_from_mesh(labels_.grid())};
    const ClassicTable& table = classic_table();
    const NormalTable normals(spacing);
    std::optional<SampleCursor> gradient;
    if (options_.gradient_normals)
        gradient.emplace(*options_.grey);

    // The place of a crossing, in index space.
    const auto crossing = [&](glm::uvec3 at, CellEdge edge) {
        const glm::uvec3 sample = at + corner_offset(edge.corner) - border_;
        glm::dvec3 point(glm::ivec3{sample}); // -1 in the border
        double fraction = 0.5;
        glm::uvec3 other = sample;
        ++other[edge.axis];
        const glm::uvec3 size = labels_.size();
        if (options_.interpolate && glm::all(glm::lessThan(sample, size)) &&
            glm::all(glm::lessThan(other, size))) {
            const float a = options_.grey->value(sample), b = options_.grey->value(other);
            if ((a >= options_.iso) != (b >= options_.iso) && std::isfinite(b - a))
                fraction =
                    std::clamp((options_.iso - a) / (b - a), kLeastFraction, 1.0f - kLeastFraction);
        }
        point[edge.axis] += fraction;
        return point;
    };

    // Index caches: x and y edges of the two planes of samples that a layer of cells lies between,
    // z edges of the layer itself.
    const size_t width = cells_.x + 1, plane = width * (cells_.y + 1);
    std::array<std::vector<uint32_t>, 5> cache;
    for (std::vector<uint32_t>& c : cache)
        c.resize(plane);
    const auto cached = [&](glm::uvec3 at, CellEdge edge) -> uint32_t& {
        const glm::uvec3 sample = at + corner_offset(edge.corner);
        const size_t which = edge.axis == 2 ? 4 : 2 * edge.axis + sample.z % 2;
        return cache[which][sample.x + width * sample.y];
    };

    for (uint32_t z = 0; z < cells_.z; ++z)
        for (uint32_t y = 0; y < cells_.y; ++y)
            for (uint32_t x = first(y, z); x < end(y, z); ++x) {
                const glm::uvec3 at(x, y, z);
                const uint8_t c = cell(at);
                std::array<uint32_t, 12> vertex;
                for (unsigned crossed = cases().edges[c]; crossed != 0; crossed &= crossed - 1) {
                    const int e = std::countr_zero(crossed);
                    const CellEdge edge = cell_edge(e);
                    // New are the three edges at the upper corner, and at the volume's lower sides
                    // those that no earlier cell has.
                    bool is_new = true;
                    const glm::uvec3 upper = corner_offset(edge.corner);
                    for (int axis = 0; axis < 3; ++axis)
                        is_new = is_new && (axis == edge.axis || upper[axis] == 1 || at[axis] == 0);
                    uint32_t& index = cached(at, edge);
                    if (is_new) {
                        index = static_cast<uint32_t>(mesh.positions.size());
                        mesh.positions.emplace_back(crossing(at, edge) * spacing);
                        mesh.normals.emplace_back(0.0f);
                    }
                    vertex[static_cast<size_t>(e)] = index;
                    mesh.normals[index] += normals.sum[c][static_cast<size_t>(e)];
                }
                for (int i = 0; i < table.triangle_count[c]; ++i) {
                    const uint8_t* e = &table.edges[c][3 * static_cast<size_t>(i)];
                    mesh.triangles.emplace_back(vertex[e[0]], vertex[e[1]], vertex[e[2]]);
                }
            }
    for (size_t v = 0; v < mesh.normals.size(); ++v) {
        glm::dvec3 normal(mesh.normals[v]);
        if (gradient) {
            const glm::dvec3 index = glm::dvec3(mesh.positions[v]) / spacing;
            const glm::dvec3 against = -gradient->gradient(index) / spacing;
            if (glm::length(against) > 0.0) // not where there is no data
                normal = against;
        }
        const double length = glm::length(normal);
        mesh.normals[v] = length > 0.0 ? glm::vec3(normal / length) : glm::vec3(0.0f);
    }
    mesh.labels.assign(mesh.triangles.size(), label_);
    return mesh;
}

std::vector<Mesh> track_labels(const Volume& labels, const TrackerOptions& options) {
    std::vector<bool> is_there(65536, false);
    std::vector<float> row(labels.size().x);
    for (uint32_t z = 0; z < labels.size().z; ++z)
        for (uint32_t y = 0; y < labels.size().y; ++y) {
            read_row(labels, {0, y, z}, labels.size().x, row.data());
            for (const float value : row)
                is_there[static_cast<uint16_t>(value)] = true;
        }
    std::vector<Mesh> meshes;
    for (uint32_t label = 1; label < is_there.size(); ++label) {
        if (!is_there[label])
            continue;
        if (options.stop.stop_requested())
            return {};
        SurfaceTracker tracker(labels, static_cast<uint16_t>(label), options);
        tracker.find_all();
        meshes.push_back(tracker.triangulate());
    }
    return meshes;
}

} // namespace palpate
