#include "engine/segment/label_samples.h"

#include <cmath>
#include <vector>

namespace palpate {

namespace {

size_t samples_of(glm::ivec3 size) {
    return size_t(size.x) * size_t(size.y) * size_t(size.z);
}

} // namespace

Result<void> check_labels(const Volume& labels, const char* name) {
    const ValueRange range = labels.range();
    if (!range.empty() && (range.min < 0.0f || range.max > 65535.0f))
        return fail("{}: expected labels 0 .. 65535, found values {:g} .. {:g}", name, range.min,
                    range.max);
    return {};
}

void read_labels(const Volume& labels, glm::ivec3 first, glm::ivec3 size, uint16_t* out) {
    if (labels.type() != ScalarType::f32) {
        read_box(labels, first, size, packed(glm::uvec3(size)), out);
        return;
    }
    std::vector<float> values(samples_of(size));
    read_box(labels, first, size, packed(glm::uvec3(size)), values.data());
    for (size_t i = 0; i < values.size(); ++i)
        out[i] = std::isnan(values[i]) ? uint16_t{0} : static_cast<uint16_t>(values[i]);
}

void read_labels_in_background(const Volume& labels, glm::ivec3 first, glm::ivec3 size,
                               uint16_t* out) {
    read_labels(labels, first, size, out);
    const glm::ivec3 last = first + size, end(labels.size());
    if (glm::all(glm::greaterThanEqual(first, glm::ivec3(0))) &&
        glm::all(glm::lessThanEqual(last, end)))
        return;
    for (int z = first.z; z < last.z; ++z)
        for (int y = first.y; y < last.y; ++y)
            for (int x = first.x; x < last.x; ++x, ++out)
                if (x < 0 || y < 0 || z < 0 || x >= end.x || y >= end.y || z >= end.z)
                    *out = 0;
}

} // namespace palpate
