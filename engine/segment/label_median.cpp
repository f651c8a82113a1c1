#include "engine/segment/label_median.h"

#include <algorithm>

#include "engine/segment/bit_mask.h"
#include "engine/segment/label_samples.h"

namespace palpate {

namespace {

constexpr double kMostReach = 8.0;

struct LabelVoter {
    Volume labels;
    std::vector<ElementRow> ball;
    glm::ivec3 reach{};
    std::vector<bool> locked;

    // The labels of a box about the brick's valid samples, x fastest, and what they become.
    BrickPtr brick(glm::uvec3 position) const {
        const glm::uvec3 valid = labels.valid_in_brick(position);
        const glm::ivec3 size = glm::ivec3(valid) + 2 * reach;
        std::vector<uint16_t> box(size_t(size.x) * size_t(size.y) * size_t(size.z));
        read_labels(labels, glm::ivec3(position * kBrickSide) - reach, size, box.data());
        std::vector<uint16_t> present = box;
        std::sort(present.begin(), present.end());
        present.erase(std::unique(present.begin(), present.end()), present.end());
        std::vector<uint16_t> made(kBrickSamples, 0);
        std::vector<int> most(kBrickSamples, 0);
        for_each_valid(
            valid, [&](uint32_t to, glm::ivec3 at) { made[to] = box[place(size, at + reach)]; });
        const std::vector<uint16_t> own = made;
        std::vector<int> before(box.size() + 1); // samples of the label in front of each place
        for (const uint16_t label : present) {
            if (present.size() == 1 || locked[label])
                continue;
            for (size_t i = 0; i < box.size(); ++i)
                before[i + 1] = before[i] + (box[i] == label);
            for_each_valid(valid, [&](uint32_t to, glm::ivec3 at) {
                if (locked[own[to]])
                    return;
                int count = 0;
                for (const ElementRow& row : ball) {
                    const size_t middle = place(size, at + reach + glm::ivec3(0, row.y, row.z));
                    count +=
                        before[middle + size_t(row.half) + 1] - before[middle - size_t(row.half)];
                }
                if (count > most[to] || (count == most[to] && own[to] == label)) {
                    most[to] = count;
                    made[to] = label;
                }
            });
        }
        return visit_scalar(labels.type(), [&]<class T>(T) -> BrickPtr {
            const std::vector<T> typed(made.begin(), made.end());
            return Brick::make(std::span<const T>(typed), valid);
        });
    }

 private:
    static size_t place(glm::ivec3 size, glm::ivec3 at) {
        return size_t(at.x) + size_t(size.x) * (size_t(at.y) + size_t(size.y) * size_t(at.z));
    }
    template <class Visit>
    static void for_each_valid(glm::uvec3 valid, const Visit& visit) {
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x)
                    visit(offset_in_brick({x, y, z}), glm::ivec3(x, y, z));
    }
};

} // namespace

Result<BrickMaker> label_median_bricks(const Volume& labels, const LabelMedianOptions& options) {
    PALPATE_TRY(check_labels(labels, "median of labels"));
    const glm::dvec3 spacing = spacing_mm(labels.grid());
    const glm::dvec3 reach = options.radius_mm * kOnTheBall / spacing;
    const double most = std::max({reach.x, reach.y, reach.z}) / kOnTheBall;
    if (!(options.radius_mm > 0.0) || most > kMostReach)
        return fail(
            "median of labels: expected a radius above 0 and at most {:g} mm here, found {:g}",
            kMostReach * std::min({spacing.x, spacing.y, spacing.z}), options.radius_mm);
    LabelVoter voter{labels, ball_of(spacing, options.radius_mm * kOnTheBall),
                     glm::ivec3(glm::floor(reach)), std::vector<bool>(65536)};
    for (const uint16_t label : options.locked)
        voter.locked[label] = label != 0;
    return BrickMaker{labels.grid(), labels.type(),
                      [voter](glm::uvec3 position) { return voter.brick(position); }};
}

} // namespace palpate
