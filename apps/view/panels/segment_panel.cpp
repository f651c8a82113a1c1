// Segmentation: seeds, a method, and what it found.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/document/net_method.h"
#include "apps/view/document/stroke_edit.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/click_tools.h"
#include "apps/view/tools/mesh_tool.h"
#include "apps/view/tools/scissors_tool.h"
#include "apps/view/tools/wire_tool.h"

namespace palpate::view {

namespace {

// The value that the last run found; for a threshold, the bound that a person
// has given its result.
std::optional<double> value_found(const MethodParameter& parameter, const SegmentMethod& method,
                                  const Work& work) {
    const auto& strength = work.segmentation().strength();
    if (strength && strength->method == &method && !strength->is_unbounded &&
        std::string_view(parameter.name) == "threshold")
        return strength->bound;
    return work.segmentation().found(method, parameter.name);
}

// The value that a parameter has when a person begins to give it.
double first_value(const MethodParameter& parameter, std::optional<double> found,
                   const ViewState& state, Work& work) {
    const std::string_view name = parameter.name;
    double value = parameter.fallback;
    if (found)
        value = *found;
    else if (std::isnan(value) && (name == "low" || name == "high"))
        value = name == "low" ? state.window.low : state.window.high; // what is seen
    if (std::isnan(value)) {
        value = 0.0;
        work.tell(
            fmt::format("{} begins at {:g}: once `segment` has run without it, at what that "
                        "has found",
                        name, std::clamp(value, parameter.least, parameter.most)));
    }
    return std::clamp(value, parameter.least, parameter.most);
}

// One line a parameter: a box that says whether a person gives it, and its
// value.
void draw_parameters(Widgets& ui, ViewState& state, Work& work, const SegmentMethod& method) {
    ParameterValues& given = state.segmenting.given[method.name];
    for (const MethodParameter& parameter : method.parameters) {
        ImGui::PushID(parameter.name);
        ImGui::BeginGroup(); // all of the line has the tooltip
        const auto found = given.find(parameter.name);
        bool is_given = found != given.end();
        const std::optional<double> found_before = value_found(parameter, method, work);
        if (ImGui::Checkbox("##given", &is_given)) {
            if (is_given)
                given[parameter.name] = first_value(parameter, found_before, state, work);
            else
                given.erase(parameter.name);
        }
        ui.note(fmt::format("segment/give/{}", parameter.name));
        ImGui::SameLine();
        if (is_given) {
            double& value = given[parameter.name];
            if (ImGui::InputDouble(named(parameter.name).c_str(), &value, 0.0, 0.0, "%.6g"))
                value = std::clamp(value, parameter.least, parameter.most);
            ui.note(fmt::format("segment/value/{}", parameter.name));
        } else {
            ImGui::TextUnformatted(parameter.name);
            ImGui::SameLine();
            std::string now = found_before ? fmt::format("{:.4g}", *found_before)
                                           : fmt::format("{:g}", parameter.fallback);
            if (std::string_view(method.name) == "threshold" && given.empty() &&
                std::string_view(parameter.name) == "low")
                now = fmt::format("{:.5g}, the surface's", work.session().parameters().iso);
            else if (parameter.fallback_text)
                now = fmt::format("{}{}{}", parameter.fallback_text, found_before ? ": " : "",
                                  found_before ? now : "");
            ImGui::TextDisabled("%s", now.c_str());
        }
        ImGui::EndGroup();
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s%s%s", parameter.purpose, *parameter.unit ? "; " : "",
                              parameter.unit);
        ImGui::PopID();
    }
}

// The bound of what the last method left behind: seen while it is dragged, and
// taken when it is let go. Times lie octaves apart, so that the slider moves
// over their logarithm.
void draw_strength(Widgets& ui, bool& bound_held, ViewState& state, Work& work) {
    const auto& strength = work.segmentation().strength();
    Segmenting& segmenting = state.segmenting;
    if (!strength || segmenting.method != strength->method->name ||
        !(strength->least < strength->most))
        return;
    ImGui::TextDisabled("%s", strength->method->strength->text);
    std::string of;
    for (const uint16_t label : strength->of)
        of += fmt::format("{} {}", of.empty() ? "of label" : ",", label);
    ImGui::TextDisabled("%s", of.c_str());
    const bool by_octaves = is_object_below(*strength->method);
    double bound =
        std::max(segmenting.preview.value_or(strength->bound), by_octaves ? strength->least : 0.0);
    ImGui::BeginDisabled(work.segmentation().share().has_value());
    if (slide("bound", bound, strength->least, strength->most, "%.4g", by_octaves))
        segmenting.preview = bound;
    ImGui::EndDisabled();
    ui.note("segment/bound");
    bound_held = ImGui::IsItemActive();
    const bool is_let_go = ImGui::IsItemDeactivatedAfterEdit();
    if (strength->is_unbounded) // below the slider, which stays where it is
        hint(
            "the front met no boundary: drag `bound` to where the yellow is the "
            "object, and let "
            "it go");
    if (!is_let_go || !segmenting.preview)
        return;
    bound_held = true; // until it is taken
    ui.order(order::Bound{});
}

// The server of a net, and a person's agreement that it is sent the volume.
void draw_net(Widgets& ui, ViewState& state) {
    NetWish wish = state.own.of<NetWish>();
    const auto field = [&](const char* id, const char* is_empty, std::string& text) {
        std::array<char, 256> typed{};
        text.copy(typed.data(), typed.size() - 1);
        ImGui::SetNextItemWidth(-1.0f);
        if (ImGui::InputTextWithHint(fmt::format("##{}", id).c_str(), is_empty, typed.data(),
                                     typed.size()))
            text = typed.data();
        ui.note(fmt::format("segment/net/{}", id));
    };
    field("server", "server: host:port", wish.server);
    field("model", "model, of MONAI Label", wish.model);
    bool is_agreed = wish.is_agreed();
    ImGui::BeginDisabled(wish.server.empty());
    if (ImGui::Checkbox("send", &is_agreed))
        wish.agreed = is_agreed ? wish.server : "";
    ImGui::EndDisabled();
    ui.note("segment/net/send");
    hint(fmt::format("the whole volume and the seeds leave this machine{}{}",
                     wish.server.empty() ? "" : " for " + wish.server,
                     wish.server.starts_with("https:") ? "" : ", not encrypted")
             .c_str());
    if (wish != state.own.of<NetWish>())
        state.own.of<NetWish>() = wish;
}

} // namespace

void draw_method_section(Widgets& ui, bool& bound_held, ViewState& state, Work& work) {
    // All methods are seen, as many as there are.
    if (ImGui::BeginCombo("##method", state.segmenting.method.c_str(),
                          ImGuiComboFlags_HeightLarge)) {
        for (const SegmentMethod& method : segment_methods()) {
            if (method.takes_curves)
                continue; // the window has none
            if (ImGui::Selectable(method.name, state.segmenting.method == method.name))
                state.segmenting.method = method.name;
            ui.note(fmt::format("segment/method/{}", method.name));
            if (ImGui::IsItemHovered())
                ImGui::SetTooltip("%s", method.purpose);
        }
        const SegmentMethod& net = net_method();
        if (ImGui::Selectable(net.name, state.segmenting.method == net.name))
            state.segmenting.method = net.name;
        ui.note(fmt::format("segment/method/{}", net.name));
        ImGui::EndCombo();
    }
    ui.note("segment/methods");
    const SegmentMethod* method = find_method_or_net(state.segmenting.method);
    if (!method)
        return;
    hint(method->purpose);
    draw_parameters(ui, state, work, *method);
    if (method == &net_method())
        return draw_net(ui, state);
    ImGui::BeginDisabled(state.notes.clip_planes.empty());
    ui.check("in the crop box only", "segment/in_box", state.segmenting.in_box);
    ImGui::EndDisabled();
    draw_strength(ui, bound_held, state, work);
}

// The part of the panel that is always seen: the method is run from there.
void draw_segment_foot(Widgets& ui, ViewState& state, Work& work) {
    if (const auto share = work.segmentation().share()) {
        ui.progress("segment/share", *share, "", "cancel");
        ImGui::SameLine();
        ui.button("cancel", "segment/cancel", order::StopSegmenting{});
        return;
    }
    if (ui.primary("segment##run", "segment/run", state))
        ui.order(order::Segment{});
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    constexpr double kSlow_s = 3.0; // what takes longer is told before it begins
    const double expected_s = work.segmentation().expected_s(state);
    const std::string how = expected_s < kSlow_s ? "from seeds, " + state.segmenting.method
                                                 : fmt::format("{}, {}", about_text(expected_s),
                                                               state.segmenting.method);
    ImGui::TextDisabled("%s", fitted(how, ImGui::GetContentRegionAvail().x).c_str());
    if (expected_s >= kSlow_s && ImGui::IsItemHovered())
        ImGui::SetTooltip("%s",
                          "on all samples that it works on; `in the crop box "
                          "only` makes it faster");
    ui.note("segment/how");
}

void draw_seeds_section(Widgets& ui, ViewState& state) {
    constexpr std::pair<const char*, SeedBrush> brushes[] = {{"inside", SeedBrush::inside},
                                                             {"outside", SeedBrush::outside},
                                                             {"erase", SeedBrush::erase}};
    for (const auto& [name, brush] : brushes) {
        const float width = ImGui::CalcTextSize(name).x + 2.0f * ImGui::GetFrameHeight();
        const float end = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
        if (brush != SeedBrush::inside && ImGui::GetItemRectMax().x + width < end)
            ImGui::SameLine(); // else in a line of its own
        const bool is_it = state.tool == &kSeedTool && state.segmenting.brush == brush;
        if (ImGui::RadioButton(name, is_it)) {
            choose_tool(state, kSeedTool);
            state.segmenting.brush = brush;
        }
        ui.note(fmt::format("segment/{}", name));
    }
    ui.button("clear seeds", "segment/clear", order::ClearSeeds{});
}

// The mesh of a label, whose faces are pulled, and which becomes the label
// again.
void draw_mesh_section(Widgets& ui, ViewState& state, Work& work) {
    if (const auto share = work.mesh_pulling().share()) {
        ui.progress("mesh/share", *share, "", "cancel");
        ImGui::SameLine();
        ui.button("cancel##mesh", "mesh/cancel", order::DropMesh{});
        return;
    }
    if (!work.mesh_pulling().mesh()) {
        const std::string name = fmt::format("mesh of label {}", state.label);
        if (ui.button(name.c_str(), "mesh/make", order::MakeMesh{}))
            choose_tool(state, kPullTool);
        return;
    }
    if (ImGui::RadioButton("pull faces", state.tool == &kPullTool))
        choose_tool(state, kPullTool);
    ui.note("mesh/pull");
    Pulling& pulling = state.own.of<Pulling>();
    double reach = pulling.reach;
    if (slide("patch", reach, 0.0, 12.0, "%.0f faces"))
        pulling.reach = static_cast<uint32_t>(std::lround(reach));
    ui.note("mesh/reach");
    ui.button(fmt::format("into label {}", work.mesh_pulling().mesh()->label()).c_str(),
              "mesh/apply", order::ApplyMesh{});
    ImGui::SameLine();
    ui.button("drop", "mesh/drop", order::DropMesh{});
    hint("drag it in 3D or where a slice cuts it");
}

static void draw_scissors_settings(Widgets& ui, Cutting& cutting) {
    using Action = std::pair<const char*, ScissorsAction>;
    using Depth = std::pair<const char*, CutDepth>;
    choose(ui, "scissors/action", "action", cutting.action,
           {Action("erase inside", ScissorsAction::erase_inside),
            Action("erase outside", ScissorsAction::erase_outside),
            Action("fill inside", ScissorsAction::fill_inside)});
    choose(ui, "scissors/depth", "depth", cutting.depth,
           {Depth("all", CutDepth::all), Depth("slab", CutDepth::slab),
            Depth("seen first", CutDepth::seen_first)});
    if (cutting.depth == CutDepth::slab) {
        slide("slab", cutting.slab_mm, 0.1, 500.0, "%.3g mm", true);
        ui.note("scissors/slab");
    }
    ui.check("all labels", "scissors/all", cutting.all_labels);
}

void draw_wire_section(Widgets& ui, ViewState& state) {
    const auto tool = [&](const char* title, const char* id, const Tool& one) {
        if (ImGui::RadioButton(title, state.tool == &one))
            choose_tool(state, one);
        ui.note(id);
    };
    tool("scissors", "segment/scissors", kScissorsTool);
    if (state.tool == &kScissorsTool)
        draw_scissors_settings(ui, state.own.of<Cutting>());
    tool("what is alike", "segment/local", kLocalThresholdTool);
    if (state.tool == &kLocalThresholdTool) {
        Clicking& clicking = state.own.of<Clicking>();
        slide("reach", clicking.reach_mm, 1.0, 200.0, "%.3g mm", true);
        ui.note("click/reach");
        slide("range", clicking.times, 0.1, 100.0, "%.2g sd", true);
        ui.note("click/times");
    }
    tool("level tracing", "segment/trace", kLevelTraceTool);
    tool("contour along edges", "segment/wire", kWireTool);
    if (state.tool == &kWireTool)
        hint("click in a slice: freeze; Enter or double click: fill with the label");
}

} // namespace palpate::view
