#include "apps/palpate/mask_options.h"

namespace palpate {

void add_mask_options(CLI::App& app, MaskOptions& options) {
    auto* inside = app.add_option(
        "--inside", options.inside,
        "Mask of all strokes: samples of these labels alone change; N,.. or any (default: all)");
    inside->type_name("LABELS");
    app.add_option("--outside", options.outside,
                   "Mask of all strokes: samples of these labels do not change; N,.. or any "
                   "(default: all change)")
        ->type_name("LABELS")
        ->excludes(inside);
    app.add_option("--only-values", options.only_values,
                   "Mask of all strokes: samples change where the grey value lies in this range "
                   "alone; strokes on labels then need --guide (default: all)")
        ->type_name("LOW HIGH")
        ->expected(2);
    app.add_option("--over", options.over,
                   "Mask of all strokes: samples of these labels alone get another label; N,.., 0 "
                   "for samples without a label (default: all)")
        ->type_name("LABELS");
}

Result<EditMask> mask_of(const MaskOptions& o) {
    EditMask mask;
    if (!o.inside.empty() || !o.outside.empty()) {
        const bool is_inside = !o.inside.empty();
        Result<EditArea> area =
            area_named(is_inside ? EditArea::Kind::inside : EditArea::Kind::outside,
                       is_inside ? o.inside : o.outside);
        if (!area)
            return fail("--{}: {}", is_inside ? "inside" : "outside", area.error().message);
        mask.area = std::move(*area);
    }
    if (o.only_values.size() == 2) {
        if (!(o.only_values[0] <= o.only_values[1]))
            return fail("--only-values: expected LOW <= HIGH, found {} {}", o.only_values[0],
                        o.only_values[1]);
        mask.values = {o.only_values[0], o.only_values[1]};
    }
    if (!o.over.empty()) {
        Result<std::vector<uint16_t>> over = labels_between_commas(o.over, 0);
        if (!over)
            return fail("--over: {}", over.error().message);
        mask.over = std::move(*over);
    }
    return mask;
}

} // namespace palpate
