#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

namespace palpate::view {

// The views of a volume. The first three are slices, in this order in all lists.
enum class Panel { axial, coronal, sagittal, volume };
constexpr std::array<Panel, 4> kPanels{Panel::axial, Panel::coronal, Panel::sagittal,
                                       Panel::volume};
constexpr size_t kSlicePanels = 3;
const char* name_of(Panel panel);  // "axial", "coronal", "sagittal", "3d"
const char* title_of(Panel panel); // "Axial", "Coronal", "Sagittal", "3D"
constexpr bool is_slice(Panel panel) {
    return panel != Panel::volume;
}

enum class Layout { four, volume, slice }; // three slices and 3D; 3D alone; one slice
const char* name_of(Layout layout);        // "four", "3d", "slice"

// Pixels of the window.
struct Box {
    glm::ivec2 low_px{0}, size_px{0};

    bool holds(glm::dvec2 at) const {
        return at.x >= low_px.x && at.y >= low_px.y && at.x < low_px.x + size_px.x &&
               at.y < low_px.y + size_px.y;
    }
    friend bool operator==(const Box&, const Box&) = default;
};

// A window smaller than this has no room for its views.
constexpr glm::uvec2 kSmallestWindow_px{480, 320};

// The places of everything in the window. Views are kGap_px apart from each other and, where there
// are bars, from what is round them.
struct Places {
    struct View {
        Panel panel;
        Box box;
    };
    std::vector<View> views; // those that are shown
    // The side panel, the panel of touch (each is empty when it is closed) and the line at the
    // bottom. None covers another, nor a view.
    Box tools, touch, status;
    // Below the side panel, a part of it that is not scrolled; empty where the task has none.
    Box foot;
    // The bars of tasks at the top and of tools at the left; empty without bars.
    Box top, bar;
};
constexpr int kGap_px = 2;
// Widths of the side panel, at a text scale of 1: the first one, and those that it can be dragged
// to. It never takes more than half of the window.
constexpr double kPanel_px = 264.0, kNarrowestPanel_px = 200.0, kWidestPanel_px = 640.0;
constexpr double kFoot_px = 44.0; // height of the part that is not scrolled, where there is one
struct OpenPanels {
    bool tools = true, touch = false, bars = true;
    double panel_px = kPanel_px;
    double foot_px = 0.0; // at a text scale of 1
};
// The pixels that bars and the gaps round the views take of a window: it has as much room for views
// and panels as one without bars that is smaller by them.
glm::uvec2 bars_px(glm::uvec2 window_px, double text_scale);
// `alone`: a panel that fills the room of all views, whatever the layout. `slice` is the one of
// Layout::slice. text_scale: of letters, 1 is 13 pixels. The panel of touch lies beside the side
// panel, or below it where the views would else have less than half of the window's width.
Places places_of(glm::uvec2 window_px, Layout layout, Panel slice, std::optional<Panel> alone,
                 OpenPanels open, double text_scale);

} // namespace palpate::view
