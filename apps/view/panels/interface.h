#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "apps/view/document/work.h"
#include "apps/view/panels/file_browser.h"
#include "apps/view/panels/series_previews.h"
#include "apps/view/window/state.h"

struct ImDrawData;
struct ImDrawList;

namespace palpate::view {

// The pictures that views show now, for their notes.
struct PictureState {
    bool there = false, complete = true;
    double ms = 0, error_estimate = 0;
};

// A text among the marks over a view.
struct ViewText {
    Panel panel;
    std::string text;
    Box box;
};

// Widgets, and marks over the views, by Dear ImGui. Needs no window: input comes as events, and
// what comes out are lists of triangles. One at a time.
class Interface {
 public:
    explicit Interface(double text_scale);
    ~Interface();
    Interface(const Interface&) = delete;
    Interface& operator=(const Interface&) = delete;

    // Whether an event is for a widget, by what lay under the pointer in the last frame.
    bool takes(const Event& event) const;

    // One frame: the events that widgets take, then all widgets and marks, which change the state.
    // Returns what widgets ask for.
    std::vector<Order> frame(const std::vector<Event>& events, double time_s, ViewState& state,
                             Work& work, const std::array<PictureState, kPanels.size()>& pictures);

    void set_recent(std::vector<std::string> paths) { recent_ = std::move(paths); }
    // The message in the line at the bottom; empty: nothing, or it has been shown long enough.
    std::string message() const { return is_told() ? message_ : ""; }
    // Whether a person is in the middle of a drag or of a word in a widget.
    bool is_busy() const { return busy_; }
    // For when another document begins.
    void forget_message() { message_.clear(); }
    // The pictures of the chooser of series, in the texture of this number; null: none.
    void show_previews(const SeriesPreviews* previews) { previews_ = previews; }
    static constexpr uint32_t kPreviewsTexture = 1 + static_cast<uint32_t>(kPanels.size());
    const ImDrawData& lists() const; // of the last frame
    // Where the widgets of the last frame lie, by their ids: "tool/draw".
    const std::map<std::string, Box>& widgets() const { return widgets_; }
    const std::vector<ViewText>& texts() const { return texts_; } // of the last frame
    static uint32_t texture_of(Panel panel) { return 1 + static_cast<uint32_t>(panel); }

 private:
    void feed(const Event& event);
    void draw_tools(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_hands(ViewState& state);
    void draw_hand(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_window(ViewState& state, Work& work);
    void drag_ends(const char* group, std::array<const char*, 2> names, GreyWindow& window,
                   double least, GreyWindow limits, Work& work);
    void draw_volume(ViewState& state, Work& work);
    void draw_labels(ViewState& state);
    void draw_layout(ViewState& state);
    void draw_tabs(ViewState& state);
    void draw_transfer(ViewState& state, Work& work);
    void draw_chosen_point(ViewState& state, Work& work, TransferFunction& function,
                           std::vector<double>& isos, RayCastLayer& layer, bool& changed,
                           bool& isos_changed);
    void draw_presets(RayCastLayer& layer, Work& work, bool& changed);
    void draw_felt(Work& work, const TransferFunction& function);
    void draw_measures_panel(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_measure(ViewState& state, Work& work);
    void draw_clip_panel(ViewState& state, Work& work);
    void draw_files_panel(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_figure_panel(ViewState& state, std::vector<Order>& orders);
    void draw_series(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_series_chooser(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_history(Work& work, std::vector<Order>& orders);
    void draw_browser(ViewState& state, std::vector<Order>& orders);
    void browse(const std::filesystem::path& folder);
    void draw_opening(const ViewState& state, std::vector<Order>& orders);
    void draw_segment_panel(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_seed_brush(ViewState& state, std::vector<Order>& orders);
    void draw_parameters(ViewState& state, Work& work, const SegmentMethod& method);
    void draw_strength(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_mesh_pulling(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_method(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_labels_panel(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_label_files(ViewState& state, std::vector<Order>& orders);
    void draw_only_values(ViewState& state, Work& work);
    void draw_label_row(ViewState& state, Work& work, uint32_t label);
    void draw_label_figures(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_slices(ViewState& state, Work& work);
    void draw_stereo(ViewState& state);
    void tell_tool(const ViewState& state, Work& work);
    void draw_status(const ViewState& state, Work& work);
    void draw_long_message(const ViewState& state, const std::string& told);
    void draw_help(ViewState& state);
    void draw_questions(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_touch(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_touch_device(ViewState& state, Work& work, std::vector<Order>& orders);
    void draw_touch_buttons(ViewState& state, const Work& work);
    void draw_touch_feel(Work& work);
    void draw_touch_plots(const ViewState& state, Work& work);
    void note(const char* id); // where the last widget lies
    bool is_told() const {     // for as long as a person reads it
        return time_s_ - told_s_ <
               std::max(kTold_s, static_cast<double>(message_.size()) / kLettersPer_s);
    }

    double time_s_ = 0;
    bool is_light_ = false;
    bool busy_ = false;
    std::map<std::string, Box> widgets_;
    std::vector<ViewText> texts_;
    std::string message_;
    double told_s_ = -1e9;                                       // when it came
    static constexpr double kTold_s = 6.0, kLettersPer_s = 15.0; // at least
    std::array<char, 1024> folder_{}, export_{}, labels_file_{}, figure_file_{},
        typed_{};                         // that are typed
    std::string browsed_, browser_error_; // the folder that is shown
    bool browser_was_open_ = false;       // in the last frame
    std::vector<BrowserEntry> entries_;   // of it
    std::vector<std::string> recent_;
    const SeriesPreviews* previews_ = nullptr;
    std::vector<std::string> devices_; // of hands, as they were at a time
    double devices_at_s_ = -1e9;
    std::array<char, 64> sought_{}; // a part of the names of labels
    std::string how_to_;            // use the tool that was in the hand in the last frame
    bool bound_held_ = false;       // of a segmentation, in this frame
    GreyWindow ends_before_;        // of drag_ends(), before a field was taken hold of
    std::string clamped_;           // that a typed end was beyond its limits; empty: it was not
};

// A small table.
void draw_values(const ValueStatistics& values, const std::string& unit);

// The marks over a view: letters, crosshair, notes, scale bar, tool. Of two texts that would cover
// each other the less important one is moved or left out. `texts` gets those that are drawn.
void draw_marks(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box,
                const PictureState& picture, std::vector<ViewText>& texts);

// Clip planes over a view.
void draw_clips(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box);

// The tool of a hand over a view, at the proxy: its outline, the probe and the force.
void draw_hand_marks(ImDrawList& list, const ViewState& state, Work& work, Panel panel,
                     const Box& box);

} // namespace palpate::view
