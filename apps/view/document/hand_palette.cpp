#include "apps/view/document/hand_palette.h"

#include <cmath>

namespace palpate::view {

namespace {

haptics::TouchPlates plates_of(const std::vector<Widget3d>& widgets) {
    haptics::TouchPlates all;
    for (const Widget3d& widget : widgets)
        all.plates.push_back(widget.plate);
    return all;
}

} // namespace

void HandPalette::follow(ViewState& state, Touch& touch, Session& session) {
    std::vector<Widget3d> wanted = touch.running() ? palette_of(state) : std::vector<Widget3d>();
    const std::vector<haptics::PlateTouch> touches = touch.take_plates();
    for (const haptics::PlateTouch& touched : touches) {
        const auto number = static_cast<size_t>(touched.plate);
        if (touched.plate < 0 || number >= widgets_.size()) {
            is_pressed_ = false;
            continue;
        }
        const Widget3d& widget = widgets_[number];
        const double share = touched.depth_mm / widget.plate.travel_mm;
        const bool begins = !is_pressed_ && share > kPressed;
        is_pressed_ = share > (is_pressed_ ? kReleased : kPressed);
        const bool goes_on = is_pressed_ && is_dragged(widget.kind) && &touched == &touches.back();
        if ((begins || goes_on) && press_widget(state, widget, touched))
            session.undo();
    }
    const haptics::TouchPlates felt = plates_of(wanted);
    if (felt != plates_of(widgets_)) {
        SessionSources sources = session.sources();
        sources.touch.plates =
            wanted.empty() ? nullptr : std::make_shared<const haptics::TouchPlates>(felt);
        session.choose(std::move(sources));
    }
    // Drawn anew where it is seen to have moved.
    constexpr double kStill_mm = 0.1;
    const haptics::PlateTouch now =
        touch.running() && touch.now() ? touch.now()->plate : haptics::PlateTouch();
    if (wanted != widgets_ || now.plate != touched_.plate ||
        std::abs(now.depth_mm - touched_.depth_mm) > kStill_mm) {
        widgets_ = std::move(wanted);
        touched_ = now;
        mesh_ = std::make_shared<const Mesh>(palette_mesh(widgets_, touched_));
    }
}

} // namespace palpate::view
