#include "apps/view/document/stroke_edit.h"

#include <algorithm>

namespace palpate::view {

namespace {

ToolFor tool_for(OpenDocument& document, const std::string& labels) {
    const Subject& subject = document.subject();
    return {subject.grid, subject.range, document.session().parameters().iso, document.grey_name(),
            labels};
}

// The labels that an operation on labels may change; nothing where none is locked.
std::optional<std::vector<uint16_t>> free_labels(OpenDocument& document, const ViewState& state) {
    if (state.notes.locked_labels.empty())
        return std::nullopt;
    const std::optional<Volume> labels = document.labels();
    // Strokes that are under way may still bring the label of the hand.
    const float highest = labels && !labels->range().empty() ? labels->range().max : 0.0f;
    std::vector<uint16_t> free;
    const uint32_t last = std::max(static_cast<uint32_t>(highest), uint32_t{state.label});
    for (uint32_t label = 0; label <= std::max(last, 255u); ++label)
        if (!is_locked(state, static_cast<uint16_t>(label)))
            free.push_back(static_cast<uint16_t>(label));
    return free;
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
    return make_tool(brush == SeedBrush::erase ? Carve::erase : Carve::draw, shape, state.radius_mm,
                     label, 0.0, tool_for(document, OpenDocument::kSeeds));
}

} // namespace

std::optional<EditSetup> stroke_edit(OpenDocument& document, Carve carve, TipShape shape,
                                     const ViewState& state) {
    if (carve == Carve::seed)
        return seed_edit(document, shape, state);
    EditSetup setup = make_tool(carve, shape, state.radius_mm, state.label, state.stylus.rate_per_s,
                                tool_for(document, document.labels_name()));
    if (!is_on_labels(carve))
        return setup;
    setup.operation.over = free_labels(document, state);
    if (state.only_values) {
        setup.operation.only_values = {state.only_values->low, state.only_values->high};
        setup.guide = document.grey_name();
    }
    return setup;
}

} // namespace palpate::view
