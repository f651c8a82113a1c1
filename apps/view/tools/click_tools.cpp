#include "apps/view/tools/click_tools.h"

#include <algorithm>
#include <cmath>

#include "apps/view/tools/region_preview.h"
#include "apps/view/tools/wire_tool.h"

namespace palpate::view {

namespace {

constexpr double kTimesPerKey = 1.15;
constexpr uint64_t kMostOutlined = 4'000'000; // samples in reach

std::optional<RegionClick> local_click(const ViewState& state, const Grid& grid, Panel panel) {
    const auto at = sample_at(grid, point_under(state, grid, panel, state.pointer_px));
    const Clicking& clicking = state.own.of<Clicking>();
    return at && axis_across(grid, state.slices[static_cast<size_t>(panel)])
               ? std::optional<RegionClick>(LocalThreshold{
                     .at = *at, .reach_mm = clicking.reach_mm, .times = clicking.times})
               : std::nullopt;
}

std::optional<RegionClick> trace_click(const ViewState& state, const Grid& grid, Panel panel) {
    const glm::dvec3 point_mm = point_under(state, grid, panel, state.pointer_px);
    const auto axis = axis_across(grid, state.slices[static_cast<size_t>(panel)]);
    return axis && sample_at(grid, point_mm)
               ? std::optional<RegionClick>(LevelTrace{index_point(grid, point_mm), *axis})
               : std::nullopt;
}

std::optional<RegionClick> click_in(const ViewState& state, const Grid& grid, Panel panel) {
    return (state.tool == &kLevelTraceTool ? trace_click : local_click)(state, grid, panel);
}

void hover_region(ViewState& state, const Subject& subject) {
    std::shared_ptr<RegionPreview>& preview = state.own.of<Previewing>().preview;
    if (!preview)
        preview = std::make_shared<RegionPreview>();
    Clicking& clicking = state.own.of<Clicking>();
    clicking.under = state.under && is_slice(*state.under)
                         ? click_in(state, subject.grid, *state.under)
                         : std::nullopt;
    const auto* const local =
        clicking.under ? std::get_if<LocalThreshold>(&*clicking.under) : nullptr;
    clicking.is_outlined =
        !local || samples_in_reach(subject.grid, local->at, local->reach_mm) <= kMostOutlined;
}

void take_region(const ToolEvent& at, const RegionClick& click) {
    at.state().own.of<Clicking>().clicked = click;
    at.order(order::ChangeLabel{std::holds_alternative<LocalThreshold>(click) ? &kLocalChange
                                                                              : &kTraceChange});
}

std::optional<Drag::Kind> press_region(const ToolEvent& at) {
    if (!is_slice(at.panel))
        return std::nullopt;
    if (const auto click = click_in(at.state(), at.subject.grid, at.panel))
        take_region(at, *click);
    else if (!axis_across(at.subject.grid, at.state().slices[static_cast<size_t>(at.panel)]))
        at.tell(fmt::format("{} needs a slice along the samples: R turns planes back",
                            at.state().tool->title));
    return Drag::Kind::nothing;
}

bool use_local_key(Outcome& next, const Event& event, const Subject& subject) {
    const bool widens = event.key == "=" || event.key == "+";
    if (next.state.tool != &kLocalThresholdTool || (!widens && event.key != "-"))
        return false;
    double& times = next.state.own.of<Clicking>().times;
    times = std::clamp(widens ? times * kTimesPerKey : times / kTimesPerKey, 0.1, 100.0);
    hover_region(next.state, subject);
    return true;
}

std::string how_to_threshold(const ViewState& state) {
    const Clicking& clicking = state.own.of<Clicking>();
    return fmt::format(
        "local threshold: {:.2g} deviations, within {:.3g} mm; click: takes what is {}; "
        "+ -: more, less",
        clicking.times, clicking.reach_mm,
        clicking.is_outlined ? "outlined" : "alike (no outline: over 4 million samples in reach)");
}

} // namespace

constinit const LabelChange kLocalChange{
    .id = "local",
    .title = "local threshold",
    .told = "with what is alike",
    .unchanged = "has all of it already",
    .takes_mm = false,
    .changes_others = true,
    .change = nullptr, // with what a person has clicked: MeshPulling
};
constinit const LabelChange kTraceChange{
    .id = "trace",
    .title = "level tracing",
    .told = "with the contour's inside",
    .unchanged = "has all of it already",
    .takes_mm = false,
    .changes_others = true,
    .change = nullptr,
};

constinit const Tool kLocalThresholdTool{
    .name = "local",
    .title = "local threshold",
    .key = ".",
    .help = "a click takes what is joined to the pointer and alike; + -: more, less",
    .icon = Icon::auto_fix,
    .group = ToolGroup::paint,
    .press = press_region,
    .hover = hover_region,
    .use_key = use_local_key,
    .marks = draw_region,
    .how_to = how_to_threshold,
};

constinit const Tool kLevelTraceTool{
    .name = "trace",
    .title = "level tracing",
    .key = "0",
    .help = "a click fills the contour of the grey value under the pointer, in a slice",
    .icon = Icon::vector_curve,
    .group = ToolGroup::paint,
    .press = press_region,
    .hover = hover_region,
    .how_to = [](const ViewState&) -> std::string {
        return "level tracing: click: fills what is outlined with the label";
    },
};

bool takes_regions(const Tool& tool) {
    return &tool == &kLocalThresholdTool || &tool == &kLevelTraceTool;
}

} // namespace palpate::view
