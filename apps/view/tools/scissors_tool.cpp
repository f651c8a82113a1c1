#include "apps/view/tools/scissors_tool.h"

#include <utility>

namespace palpate::view {

namespace {

constexpr double kStep_px = 2.0; // between corners of the outline
constexpr size_t kFewestCorners = 3;

std::optional<Drag::Kind> press_scissors(const ToolEvent& at) {
    const Modifiers& held = at.event.modifiers;
    if (!is_slice(at.panel) && (held.shift || held.ctrl || at.state().stylus.by_pointer))
        return std::nullopt; // the camera's
    at.state().own.of<Cutting>().drawn_px = {at.state().pointer_px};
    return Drag::Kind::tool;
}

void drag_scissors(const ToolEvent& at) {
    std::vector<glm::dvec2>& drawn = at.state().own.of<Cutting>().drawn_px;
    if (drawn.empty() || glm::distance(drawn.back(), at.state().pointer_px) >= kStep_px)
        drawn.push_back(at.state().pointer_px);
}

// As a slice shows the outline.
void look_at_slice(Scissors& cut, const ToolEvent& at, const std::vector<glm::dvec2>& drawn) {
    const ViewState& state = at.state();
    cut.towards = state.slices[static_cast<size_t>(at.panel)].towards;
    for (const glm::dvec2 px : drawn)
        cut.outline_mm.push_back(point_under(state, at.subject.grid, at.panel, px));
}

// As the camera sees it: as far away as the crosshair, or else as what is looked at.
void look_in_3d(Scissors& cut, const ToolEvent& at, const std::vector<glm::dvec2>& drawn) {
    const ViewState& state = at.state();
    const Camera& camera = state.camera;
    cut.towards = glm::normalize(camera.target_mm - camera.eye_mm);
    if (camera.projection == Projection::perspective)
        cut.eye_mm = camera.eye_mm;
    const glm::dvec3 from = cut.eye_mm.value_or(camera.eye_mm);
    double ahead_mm = glm::dot(state.crosshair_mm - from, cut.towards);
    if (!(ahead_mm > 0.0))
        ahead_mm = glm::distance(camera.target_mm, from);
    for (const glm::dvec2 px : drawn) {
        const Ray ray = ray_under(state, px);
        cut.outline_mm.push_back(ray.origin_mm +
                                 ahead_mm / glm::dot(ray.direction, cut.towards) * ray.direction);
    }
}

void release_scissors(const ToolEvent& at) {
    const ViewState& state = at.state();
    Cutting& cutting = at.state().own.of<Cutting>();
    const std::vector<glm::dvec2> drawn = std::exchange(cutting.drawn_px, {});
    if (!box_of(state, at.panel)) // the layout changed meanwhile
        return;
    if (drawn.size() < kFewestCorners)
        return at.tell("scissors: drag round a part of the label");
    const bool in_slice = is_slice(at.panel);
    const bool fills = cutting.action == ScissorsAction::fill_inside;
    if (cutting.depth == CutDepth::seen_first && (in_slice || fills))
        return at.tell(
            fmt::format("scissors: what is seen first is {}: choose all depths or a slab",
                        fills ? "not filled" : "known in 3D alone"));
    if (cutting.depth == CutDepth::seen_first && !state.notes.clip_planes.empty())
        return at.tell(
            "scissors: what is seen first is not known while there are clip planes: "
            "choose all depths or a slab, or remove the planes");
    Scissors cut{.action = cutting.action,
                 .label = state.label,
                 .all_labels = cutting.all_labels,
                 .seen_first = cutting.depth == CutDepth::seen_first};
    if (cutting.depth == CutDepth::slab)
        cut.depths_mm = {-0.5 * cutting.slab_mm, 0.5 * cutting.slab_mm};
    (in_slice ? look_at_slice : look_in_3d)(cut, at, drawn);
    cutting.cut = std::move(cut);
    at.order(order::ChangeLabel{fills ? &kFillByScissors : &kEraseByScissors});
}

void take_scissors(ViewState& state, bool again) {
    ScissorsAction& action = state.own.of<Cutting>().action;
    if (again)
        action = static_cast<ScissorsAction>((static_cast<int>(action) + 1) % 3);
}

std::string kind_of_scissors(const ViewState& state) {
    constexpr const char* kinds[] = {"erase inside", "erase outside", "fill inside"};
    return kinds[static_cast<size_t>(state.own.of<Cutting>().action)];
}

std::string how_to_cut(const ViewState& state) {
    const Cutting& cutting = state.own.of<Cutting>();
    const std::string depth = cutting.depth == CutDepth::all ? "through all depths"
                              : cutting.depth == CutDepth::slab
                                  ? fmt::format("within {:.3g} mm", cutting.slab_mm)
                                  : "what is seen first";
    return fmt::format("scissors: {}, {}; drag an outline in a slice or in 3D",
                       kind_of_scissors(state), depth);
}

} // namespace

constinit const LabelChange kEraseByScissors{
    .id = "scissors",
    .title = "scissors",
    .told = "left by the scissors",
    .unchanged = "has no sample that would go",
    .takes_mm = false,
    .changes_others = true,
    .change = nullptr, // with what a person has drawn: MeshPulling
};
constinit const LabelChange kFillByScissors{
    .id = "scissors",
    .title = "scissors",
    .told = "with the outline filled",
    .unchanged = "has the whole outline",
    .takes_mm = false,
    .changes_others = true,
    .change = nullptr,
};

constinit const Tool kScissorsTool{
    .name = "scissors",
    .title = "scissors",
    .key = ",",
    .help = "a drawn outline erases the label inside or outside, or fills it, by turns",
    .icon = Icon::vector_circle,
    .group = ToolGroup::paint,
    .press = press_scissors,
    .drag = drag_scissors,
    .release = release_scissors,
    .abort = [](const ToolEvent& at) { at.state().own.of<Cutting>().drawn_px.clear(); },
    .take = take_scissors,
    .marks = draw_scissors,
    .how_to = how_to_cut,
    .kind = kind_of_scissors,
};

} // namespace palpate::view
