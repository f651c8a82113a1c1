// The section of the mask: where tools on labels and methods may change samples.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

// choose(), for names of several words: the ids of its rows have none of the blanks.
template <class Choice>
void choose_in_words(Widgets& ui, const std::string& id, const char* title, Choice& now,
                     std::initializer_list<std::pair<const char*, Choice>> all) {
    const auto* const shown = std::ranges::find(all, now, &std::pair<const char*, Choice>::second);
    if (ImGui::BeginCombo(named(title).c_str(), shown->first)) {
        for (const auto& [name, value] : all) {
            if (ImGui::Selectable(name, value == now))
                now = value;
            std::string row = name;
            std::ranges::replace(row, ' ', '_');
            ui.note(id + "/" + row);
        }
        ImGui::EndCombo();
    }
    ui.note(id);
}

void draw_mask_label(Widgets& ui, const std::string& id, const char* name, uint16_t& label) {
    int typed = label;
    if (ImGui::InputInt(named(name).c_str(), &typed))
        label = static_cast<uint16_t>(std::clamp(typed, 1, 65535));
    ui.note(id);
}

// The values that tools on labels are confined to: at first those of the window.
void draw_editable_values(Widgets& ui, WindowEnds& ends, ViewState& state, Work& work) {
    bool only = state.only_values.has_value();
    if (ImGui::Checkbox("editable values", &only))
        state.only_values = only ? std::optional(state.window) : std::nullopt;
    ui.note("labels/only");
    if (!state.only_values)
        return;
    const ValueRange range = work.subject().range;
    const double low = range.min, high = std::max(low + 1e-3, double{range.max});
    drag_ends(ui, ends, "labels", {"from", "to"}, *state.only_values, 0.0, {low, high}, work);
}

} // namespace

void draw_mask_section(Widgets& ui, WindowEnds& ends, ViewState& state, Work& work) {
    using Area = Masking::Area;
    using Overwrite = Masking::Overwrite;
    Masking& mask = state.masking;
    choose_in_words<Area>(ui, "mask/area", "editable area", mask.area,
                          {{"everywhere", Area::everywhere},
                           {"inside one label", Area::inside_label},
                           {"outside one label", Area::outside_label},
                           {"inside all labels", Area::inside_all},
                           {"outside all labels", Area::outside_all}});
    if (mask.area == Area::inside_label || mask.area == Area::outside_label)
        draw_mask_label(ui, "mask/area_label", "its label", mask.area_label);
    draw_editable_values(ui, ends, state, work);
    choose_in_words<Overwrite>(ui, "mask/overwrite", "overwrite", mask.overwrite,
                               {{"all labels", Overwrite::all},
                                {"no label", Overwrite::unlabelled},
                                {"one label", Overwrite::label}});
    if (mask.overwrite == Overwrite::label)
        draw_mask_label(ui, "mask/over_label", "this label", mask.over_label);
}

} // namespace palpate::view
