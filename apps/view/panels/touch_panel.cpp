// The window of touch: the device, how it feels, and what it does.

#include <imgui/imgui.h>

#include <algorithm>
#include <string_view>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/hand_pointer.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/safety/chain.h"

namespace palpate::view {

namespace {

using namespace haptics;
using view::slide; // beside the one below

template <class Choice, class Choices>
bool choose_named(const char* id, Choice& now, const Choices& all) {
    bool changed = false;
    if (ImGui::BeginCombo(named(id).c_str(), name_of(now))) {
        for (const Choice value : all)
            if (ImGui::Selectable(name_of(value), value == now)) {
                now = value;
                changed = true;
            }
        ImGui::EndCombo();
    }
    return changed;
}

// A slider of a setting, with what it does as its tooltip; whether it changed.
bool slide(const Setting<TouchParameters>& setting, TouchParameters& parameters) {
    const Slider& slider = setting.use.slider;
    double value = value_of(setting, parameters);
    const std::string format =
        fmt::format("%.{}f{}{}", slider.decimals, *setting.unit ? " " : "", setting.unit);
    const bool changed = slide(slider.label, value, 0.0, slider.most, format.c_str());
    if (changed)
        set(setting, parameters, value);
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("%s", setting.help);
    return changed;
}

void draw_device(Widgets& ui, TouchPanel& panel, ViewState& state, Work& work) {
    Touch& touch = work.hand().touch();
    HandOptions options = touch.options();
    bool changed = false;
    const std::string device = options.device.empty() ? kMouse : options.device;
    if (ImGui::BeginCombo(named("device").c_str(), device.c_str())) {
        constexpr double kFresh_s = 1.0; // asking USB takes longer than a frame has
        if (ImGui::IsWindowAppearing() || !(ui.time_s - panel.devices_at_s < kFresh_s)) {
            panel.devices = touch.devices();
            panel.devices_at_s = ui.time_s;
        }
        for (const std::string& name : panel.devices)
            if (ImGui::Selectable(name.c_str(), name == device)) {
                options.device = name;
                changed = true;
            }
        ImGui::EndCombo();
    }
    ui.note("touch/device");
    if (ImGui::BeginCombo(named("algorithm").c_str(), options.algorithm.c_str())) {
        for (const AlgorithmEntry& entry : algorithms())
            if (follows_edits(entry)) {
                if (ImGui::Selectable(entry.name, entry.name == options.algorithm)) {
                    options.algorithm = entry.name;
                    changed = true;
                }
                if (ImGui::IsItemHovered())
                    ImGui::SetTooltip("%s", entry.purpose);
            }
        ImGui::EndCombo();
    }
    ui.note("touch/algorithm");
    if (changed) {
        touch.set_up(options);
        if (touch.running()) // disarmed again
            ui.order(order::StartHand{});
    }
    if (ImGui::Button(touch.running() ? "stop" : "start")) {
        if (!touch.running())
            begin_hand(state, work.subject());
        ui.order(touch.running() ? Order(order::StopHand{}) : order::StartHand{});
    }
    ui.note("touch/start");
    ImGui::SameLine();
    ImGui::BeginDisabled(!touch.running());
    const bool armed = touch.armed();
    const Theme& theme = theme_of(state.light);
    if (armed) {
        ImGui::PushStyleColor(ImGuiCol_Button, rgb_color(theme.danger));
        ImGui::PushStyleColor(ImGuiCol_Text, rgb_color(theme.panel));
    }
    if (ImGui::Button(armed ? "disarm" : "arm"))
        ui.order(armed ? Order(order::DisarmHand{}) : order::ArmHand{});
    ui.note("touch/arm");
    if (armed)
        ImGui::PopStyleColor(2);
    ImGui::EndDisabled();
    ImGui::SameLine();
    if (!touch.running()) {
        ImGui::TextDisabled("no hand");
        return;
    }
    const DeviceReport report = work.session().device_report();
    constexpr const char* modes[] = {"no force (Space arms)", "waits until free", "force comes",
                                     "force (Esc ends it)"};
    if (report.faults & kFaultLatched)
        ImGui::TextColored(rgb_color(theme.danger), "fault: %s", fault_text(report.faults).c_str());
    else
        ImGui::TextColored(
            rgb_color(report.force == SoftStart::Mode::running ? theme.good : theme.text), "%s",
            modes[static_cast<size_t>(report.force)]);
    if (report.faults & kFaultDamped)
        ImGui::TextColored(rgb_color(theme.warning), "the handle swings: damped");
    if (!touch.by_pointer()) {
        WorkspaceSettings settings = work.session().workspace();
        if (slide("scale", settings.scale, 0.1, 20.0, "%.2f mm/mm", true))
            work.session().move_workspace(settings);
        ui.note("touch/scale");
        if (ImGui::Button("turn to the view"))
            work.session().align_workspace(state.camera);
        ui.note("touch/align");
    } else {
        ui.check("as deep as what is seen", "touch/on_surface", state.stylus.on_surface);
        slide("deeper", state.stylus.push_mm, -50.0, 50.0, "%.2f mm");
        ui.note("touch/deeper");
    }
}

void draw_buttons(Widgets& ui, ViewState& state, const Work& work) {
    Stylus& stylus = state.stylus;
    const bool is_mouse = stylus.by_pointer || !stylus.on;
    choose_named(is_mouse ? "left button" : "button 0", stylus.first, kCarves);
    ui.note("touch/first");
    choose_named(is_mouse ? "right button" : "button 1", stylus.second, kCarves);
    ui.note("touch/second");
    if (is_mouse)
        hint("in 3D wheel up: deeper; the middle button rotates");
    choose_named("shape", stylus.shape, kTipShapes);
    ui.note("touch/shape");
    if (mills(stylus.first) || mills(stylus.second)) {
        slide("feed", stylus.rate_per_s, 0.1, 100.0, "%.2g /s", true);
        ui.note("touch/rate");
    }
    ui.check("force as an arrow", "touch/arrow", stylus.arrow_shown);
    ui.check("sound", "touch/sound", stylus.sound_on);
    if (stylus.sound_on && !work.hand().sound().why_silent().empty() && ImGui::IsItemHovered())
        ImGui::SetTooltip("%s", work.hand().sound().why_silent().c_str());
    ImGui::SameLine();
    ui.check("dust", "touch/dust", stylus.dust_shown);
    if (stylus.sound_on && !work.hand().sound().why_silent().empty())
        hint("no sound: point at the box to see why");
    choose_named("3D by", state.seen_as, kSeenAs);
    ui.note("touch/seen_as");
    ui.check("widgets in 3D", "touch/palette", state.palette_shown);
}

void draw_feel(Widgets& ui, Work& work) {
    TouchParameters p = work.session().parameters();
    const AlgorithmEntry* algorithm = find_algorithm(work.hand().touch().options().algorithm);
    if (!algorithm)
        return; // and no hand starts
    bool changed = false;
    const bool has_source = algorithm->takes(kTakesSource);
    if (has_source && work.has_labels()) {
        int source = p.source == TouchSource::labels;
        changed |= ImGui::RadioButton("grey values", &source, 0);
        ui.note("touch/grey");
        ImGui::SameLine();
        changed |= ImGui::RadioButton("labels", &source, 1);
        ui.note("touch/labels");
        p.source = source ? TouchSource::labels : TouchSource::grey;
    }
    for (const Setting<TouchParameters>& setting : kTouchSettings)
        if (setting.use.slider.label && algorithm->feels() &&
            is_read_by(setting, algorithm->bits)) {
            changed |= slide(setting, p);
            ui.note(fmt::format("touch/{}", setting.use.slider.label));
        }
    // A static coefficient below the dynamic one has no meaning.
    p.friction_static = std::max(p.friction_static, p.friction_dynamic);
    if (algorithm->takes(kTakesTransfer)) {
        const Subject& subject = work.subject();
        const double low = subject.range.min, high = subject.range.max;
        constexpr const char* axes[] = {"along", "across"};
        for (size_t axis = 0; axis < (algorithm->takes(kTakesAcross) ? 2u : 1u); ++axis) {
            HapticTransfer& t = p.transfer[axis];
            ImGui::PushID(static_cast<int>(axis));
            ImGui::TextUnformatted(axes[axis]);
            const auto amount = [&](const char* id, double& value, double least, double most,
                                    const char* format) {
                changed |= slide(id, value, least, most, format);
                ui.note(fmt::format("touch/{}/{}", axes[axis], id));
            };
            amount("A", t.strength_n, 0.0, 6.0, "%.2f N");
            amount("beta", t.center, low, high, "%.5g");
            amount("alpha", t.width, 0.0, 0.25 * (high - low), "%.4g");
            ImGui::PopID();
        }
    }
    if (changed)
        work.session().feel(p);
    const bool has_iso = has_source && p.source == TouchSource::grey;
    if (has_iso) {
        const ValueRange range = work.subject().range;
        if (double iso = p.iso; slide("solid from", iso, range.min, range.max, "%.5g"))
            work.session().set_iso(iso);
        ui.note("touch/iso");
        if (ImGui::IsItemDeactivatedAfterEdit()) {
            TouchParameters tuned = work.session().parameters();
            if (const TouchScene felt = work.session().felt(); felt.grey)
                tune(tuned, *felt.grey);
            work.session().feel(tuned);
        }
    }
}

void draw_plots(Widgets& ui, const ViewState& state, Work& work) {
    const Touch& touch = work.hand().touch();
    if (!state.stylus.on)
        return;
    const auto plot = [&](const char* id, const std::vector<float>& values, float least, float most,
                          const char* format) {
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        ImGui::PlotLines(named(id).c_str(), values.data(), static_cast<int>(values.size()), 0,
                         fmt::format(fmt::runtime(format), values.back()).c_str(),
                         std::min(least, *low), std::max(most, *high),
                         ImVec2(0.0f, 3.0f * ImGui::GetTextLineHeight()));
        ui.note(fmt::format("touch/plot/{}", id));
    };
    plot("force", touch.forces_n(), 0.0f, 1.0f, "{:.2f} N");
    plot("energy", touch.energies_mj(), -1.0f, 1.0f, "{:.1f} mJ");
    const Telemetry& t = *touch.telemetry();
    const auto us = [](const haptics::Histogram& h, double share) {
        return static_cast<double>(h.percentile(share)) / 1e3;
    };
    const uint64_t ticks = t.ticks;
    hint(fmt::format("{} ticks, {} missed", ticks, t.skipped.load()).c_str());
    const HandLink::Backlog& backlog = work.hand().backlog();
    hint(fmt::format("edits: {} inputs wait, {:.2f} s behind", backlog.inputs, backlog.seconds)
             .c_str());
    if (const std::string text = touch.servo_text(); !text.empty()) {
        hint(fmt::format("p99: tick {:.0f} us, woken after {:.0f} us", us(t.whole_ns, 0.99),
                         us(t.wake_ns, 0.99))
                 .c_str());
        hint(text.c_str());
    }
}

} // namespace

void draw_hand_section(Widgets& ui, TouchPanel& panel, ViewState& state, Work& work) {
    const bool runs = work.hand().touch().running();
    if (!runs) {
        if (ui.primary("drill", "drill/start", state)) {
            state.stylus.first = Carve::drill;
            begin_hand(state, work.subject());
            ui.order(order::StartHand{});
        }
        hint("the left button, or the hand's first one, will drill");
    }
    draw_device(ui, panel, state, work);
}

void draw_burr_section(Widgets& ui, ViewState& state, Work& work) {
    slide("burr radius", state.radius_mm, 0.1, 100.0, "%.3g mm", true);
    ui.note("drill/burr");
    draw_buttons(ui, state, work);
}

void draw_feel_section(Widgets& ui, Work& work) {
    draw_feel(ui, work);
}

void draw_forces_section(Widgets& ui, ViewState& state, Work& work) {
    if (!state.stylus.on)
        hint("they are drawn while a hand runs");
    draw_plots(ui, state, work);
}

void draw_touch_panel(Widgets& ui, TouchPanel& panel, ViewState& state, Work& work) {
    if (!has_touch_panel(state))
        return;
    const Box box = places_of(state).touch;
    place_window(box);
    if (ImGui::Begin("Touch", &state.touch_open,
                     ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                         ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                         ImGuiWindowFlags_NoBringToFrontOnFocus |
                         ImGuiWindowFlags_NoFocusOnAppearing |
                         ImGuiWindowFlags_AlwaysVerticalScrollbar)) { // as the side panel
        ImGui::PushItemWidth(-std::min(ImGui::CalcTextSize("right button_").x,
                                       0.6f * ImGui::GetContentRegionAvail().x));
        draw_device(ui, panel, state, work);
        ImGui::Separator();
        draw_buttons(ui, state, work);
        ImGui::TextDisabled("removed");
        draw_removed_panel(ui, work);
        ImGui::Separator();
        draw_feel(ui, work);
        if (state.stylus.on)
            ImGui::Separator();
        draw_plots(ui, state, work);
        ImGui::PopItemWidth();
    }
    ImGui::End();
}

} // namespace palpate::view
