#include "apps/view/document/stroke_edit.h"

#include <algorithm>
#include <cmath>

#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

// The edit of a tool on a volume. A ball of labels between samples still draws the one that its
// middle is in; cuts are by the tool's surface.
EditSetup tool_edit(const OpenDocument& document, Carve carve, TipShape shape, uint16_t label,
                    const std::string& on, const ViewState& state, bool disc = false) {
    const Grid& grid = document.subject().grid;
    const ValueRange range = document.subject().range;
    Json json = disc ? Json{{"kind", "cylinder"},
                            {"radius_mm", state.radius_mm},
                            {"length_mm", disc_thickness_mm(grid)}}
                     : shape_json(shape, state.radius_mm);
    if (row_of(carve).on_labels && state.radius_mm < largest_spacing_mm(grid))
        json = Json{{"kind", "union"}, {"of", Json::array({json, {{"kind", "point"}}})}};
    EditSetup setup{json, tool_of(json), {}, on, {}};
    Operation& operation = setup.operation;
    operation.kind = row_of(carve).stroke.value_or(OperationKind::draw);
    operation.label = label;
    if (carve == Carve::smooth)
        operation.radius_mm = std::max(state.radius_mm, largest_spacing_mm(grid));
    if (mills(carve)) {
        const double width = std::max(1e-6, double{range.max} - range.min);
        operation.rates = {{0.0, state.stylus.rate_per_s * width}};
        operation.falloff_mm = 0.5 * smallest_spacing_mm(grid);
    }
    if (carve == Carve::add) // well into the values that are solid
        operation.to_value = std::round(0.5 * (document.session().parameters().iso + range.max));
    return setup;
}

std::optional<EditSetup> seed_edit(OpenDocument& document, TipShape shape, const ViewState& state) {
    const SeedBrush brush = state.segmenting.brush;
    if (brush == SeedBrush::inside && state.label > kLastSeeded) {
        document.tell(
            fmt::format("seeds are of labels 1 .. {}, found {}", kLastSeeded, state.label));
        return std::nullopt;
    }
    if (!document.make_seeds())
        return std::nullopt;
    const uint16_t label = brush != SeedBrush::inside    ? kOutsideSeed
                           : state.label == kOutsideSeed ? kSeedOf255
                                                         : state.label;
    return tool_edit(document, brush == SeedBrush::erase ? Carve::erase : Carve::draw, shape, label,
                     OpenDocument::kSeeds, state);
}

} // namespace

EditMask edit_mask(const ViewState& state) {
    using Area = Masking::Area;
    const Masking& masking = state.masking;
    EditMask mask;
    const bool is_inside = masking.area == Area::inside_label || masking.area == Area::inside_all;
    if (masking.area != Area::everywhere)
        mask.area.kind = is_inside ? EditArea::Kind::inside : EditArea::Kind::outside;
    if (masking.area == Area::inside_label || masking.area == Area::outside_label)
        mask.area.labels = {masking.area_label};
    if (state.only_values)
        mask.values = {state.only_values->low, state.only_values->high};
    if (masking.overwrite == Masking::Overwrite::unlabelled)
        mask.over = {0};
    if (masking.overwrite == Masking::Overwrite::label)
        mask.over = {0, masking.over_label};
    return mask;
}

std::optional<EditSetup> stroke_edit(OpenDocument& document, Carve carve, TipShape shape,
                                     const ViewState& state, bool disc) {
    if (carve == Carve::seed)
        return seed_edit(document, shape, state);
    // Locked labels stay, and so do the grey values under them.
    const std::vector<uint16_t>& locked = state.notes.locked_labels;
    if (!row_of(carve).on_labels) {
        EditSetup setup =
            tool_edit(document, carve, shape, state.label, document.grey_name(), state);
        if (!locked.empty() && document.labels()) {
            setup.operation.spared = locked;
            setup.guide = document.labels_name();
        }
        return setup;
    }
    EditSetup setup =
        tool_edit(document, carve, shape, state.label, document.labels_name(), state, disc);
    Result<Operation> masked = within_mask(std::move(setup.operation), edit_mask(state));
    if (!masked) {
        document.tell(masked.error().message);
        return std::nullopt;
    }
    setup.operation = std::move(*masked);
    setup.operation.spared = locked;
    if (state.brush_keeps_to_edges && (carve == Carve::draw || carve == Carve::erase))
        setup.operation.alike = state.alike_deviations;
    if (setup.operation.needs_guide())
        setup.guide = document.grey_name();
    return setup;
}

} // namespace palpate::view
