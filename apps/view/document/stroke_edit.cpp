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
    setup.operation.spared = locked;
    if (state.only_values) {
        setup.operation.only_values = {state.only_values->low, state.only_values->high};
        setup.guide = document.grey_name();
    }
    return setup;
}

} // namespace palpate::view
