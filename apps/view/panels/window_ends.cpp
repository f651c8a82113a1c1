// Two fields for the ends of a window.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

// Tells a person about a typed end: that it was beyond its limits, or that the other end, which it
// moved, stopped at its own, so that the width is less than before.
static std::string end_text(std::array<const char*, 2> names, bool upper, double typed,
                            GreyWindow before, GreyWindow now, GreyWindow limits) {
    if (std::isnan(typed))
        return "";
    const std::string of =
        fmt::format("{:g} .. {:g}, the limits of this volume", limits.low, limits.high);
    const double taken = upper ? now.high : now.low;
    if (taken != typed)
        return fmt::format("{} {:g} is beyond {}: {:g} is taken", names[upper ? 1 : 0], typed, of,
                           taken);
    const double moved = upper ? now.low : now.high, was = upper ? before.low : before.high;
    if (moved == was || now.high - now.low > (1.0 - 1e-9) * (before.high - before.low))
        return "";
    return fmt::format("{} stops at {:g}: the limits of this volume are {:g} .. {:g}",
                       names[upper ? 0 : 1], moved, limits.low, limits.high);
}

void drag_ends(Widgets& ui, WindowEnds& ends, const char* group, std::array<const char*, 2> names,
               GreyWindow& window, double least, GreyWindow limits, Work& work) {
    const ValueRange range = work.subject().range;
    const auto speed = static_cast<float>(std::max(1e-3, double{range.max} - range.min) / 2000.0);
    const std::string format = fmt::format("{}{}{}", are_whole_enough(range) ? "%.0f" : "%.5g",
                                           work.unit().empty() ? "" : " ", work.unit());
    for (const bool upper : {false, true}) {
        double value = upper ? window.high : window.low;
        const double from = upper ? window.low + least : limits.low;
        const double to = upper ? limits.high : window.high - least;
        const char* name = names[upper ? 1 : 0];
        const bool changed = ImGui::DragScalar(named(name).c_str(), ImGuiDataType_Double, &value,
                                               speed, &from, &to, format.c_str());
        if (ImGui::IsItemActivated())
            ends.before = window;
        if (changed) {
            // Uses the window before the first digit: those before the last one moved the other.
            window = upper ? with_high(ends.before, value, least, limits)
                           : with_low(ends.before, value, least, limits);
            ends.clamped = end_text(names, upper, value, ends.before, window, limits);
        }
        if (ImGui::IsItemDeactivated() && !ends.clamped.empty())
            work.tell(std::exchange(ends.clamped, {}));
        ui.note(fmt::format("{}/{}", group, name));
    }
}

} // namespace palpate::view
