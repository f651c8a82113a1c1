#include "engine/segment/morphology.h"

#include "engine/segment/label_samples.h"
#include "engine/segment/rows.h"
#include "engine/segment/signed_distance.h"

namespace palpate {

namespace {

// Rows of a ball, and steps along them; larger balls are thresholds of a distance, which is as fast
// for any radius.
constexpr double kMostRows = 512.0;

Result<BitMask> by_distance(const BitMask& mask, const Grid& grid, double reach, bool grow,
                            const Task& task) {
    PALPATE_TRY(const Volume object, volume_of(mask, grid, task.part(0.0, 0.1)));
    // Farther than the limit is beyond reach: the value there need not be exact.
    PALPATE_TRY(const Volume away,
                signed_distance(object, {.max_mm = 2.0 * reach}, task.part(0.1, 0.9)));
    BitMask out(mask.size());
    const bool all = run_all(mask.size().z, task.part(0.9, 1.0), [&](size_t z) {
        std::vector<float> row(mask.size().x);
        for (uint32_t y = 0; y < mask.size().y; ++y) {
            read_row(away, {0, y, z}, mask.size().x, row.data());
            uint64_t* to = out.row(y, z);
            for (size_t x = 0; x < row.size(); ++x) {
                const bool in = grow ? double{row[x]} <= reach : double{row[x]} < -reach;
                to[x / 64] |= uint64_t{in} << x % 64;
            }
        }
    });
    if (!all)
        return stopped();
    return out;
}

Result<BitMask> steps(BitMask mask, const Grid& grid, const MorphologyOptions& options, bool grow,
                      const Task& task) {
    std::vector<ElementRow> element = element_of(options.neighbours);
    if (options.radius_mm) {
        const double reach = *options.radius_mm * kOnTheBall;
        const glm::dvec3 wide = reach / spacing_mm(grid);
        if (wide.x + 3.0 * wide.y * wide.z > kMostRows)
            return by_distance(mask, grid, reach, grow, task);
        element = ball_of(spacing_mm(grid), reach);
    }
    const uint32_t times = options.radius_mm ? 1 : options.times;
    for (uint32_t i = 0; i < times; ++i) {
        const Task part = task.part(double(i) / times, double(i + 1) / times);
        std::optional<BitMask> next =
            grow ? dilated(mask, element, part) : eroded(mask, element, part);
        if (!next)
            return stopped();
        mask = std::move(*next);
    }
    return mask;
}

// The label map with the label where the mask is.
Result<Volume> with_label(const Volume& labels, const BitMask& mask, uint16_t label, bool overwrite,
                          const Task& task) {
    return visit_scalar(labels.type(), [&]<class T>(T) {
        return make_rows<T>(labels.grid(), task, [&](uint32_t y, uint32_t z, std::span<T> row) {
            std::vector<uint16_t> before(row.size());
            read_labels(labels, {0, y, z}, {int(row.size()), 1, 1}, before.data());
            for (size_t x = 0; x < row.size(); ++x) {
                const bool in = mask.has({x, y, z}), was = before[x] == label;
                const bool may = overwrite || before[x] == 0 || was;
                row[x] = in && may ? T(label) : was ? T(0) : T(before[x]);
            }
        });
    });
}

} // namespace

Result<Volume> morphology(const Volume& labels, const MorphologyOptions& options,
                          const Task& task) {
    PALPATE_TRY(check_labels(labels, "morphology"));
    if (options.label == uint16_t{0})
        return fail("morphology: expected a label 1 .. 65535, found 0, which is the background");
    if (options.radius_mm) {
        if (!(*options.radius_mm > 0.0))
            return fail("morphology: expected a radius above 0 mm, found {:g}", *options.radius_mm);
        PALPATE_TRY(check_perpendicular(labels.grid(), "morphology with a ball"));
    }
    std::optional<BitMask> mask = mask_of(labels, options.label, task.part(0.0, 0.1));
    if (!mask)
        return stopped();
    const bool first_grows =
        options.step == MorphologyStep::dilate || options.step == MorphologyStep::close;
    const bool twice =
        options.step == MorphologyStep::open || options.step == MorphologyStep::close;
    PALPATE_TRY(BitMask made, steps(std::move(*mask), labels.grid(), options, first_grows,
                                    task.part(0.1, twice ? 0.5 : 0.9)));
    if (twice) {
        PALPATE_TRY(made, steps(std::move(made), labels.grid(), options, !first_grows,
                                task.part(0.5, 0.9)));
    }
    return options.label
               ? with_label(labels, made, *options.label, options.overwrite, task.part(0.9, 1.0))
               : volume_of(made, labels.grid(), task.part(0.9, 1.0));
}

} // namespace palpate
