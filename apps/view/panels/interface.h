#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/series_previews.h"

struct ImDrawData;
struct ImDrawList;

namespace palpate::view {

// The pictures that views show now, for their notes.
struct PictureState {
    bool there = false, complete = true;
    double ms = 0, error_estimate = 0;
    double waited_s = 0; // for a picture of another scene than the one that is seen
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

    void set_recent(std::vector<std::string> paths) { side_.files.recent = std::move(paths); }
    // The message in the line at the bottom; empty: nothing, or it has been shown long enough.
    std::string message() const { return status_.shown(ui_.time_s); }
    // The place in the line at the bottom.
    const std::string& place() const { return status_.place; }
    // Whether a person is in the middle of a drag or of a word in a widget.
    bool is_busy() const { return busy_; }
    // Offers of a window without a file; their pictures are kWelcomeTexture. Null: none.
    void show_welcome(const Welcome* welcome) { welcome_ = welcome; }
    static constexpr uint32_t kWelcomeTexture = 2 + static_cast<uint32_t>(kPanels.size());
    // Forgets messages and searches of the document before.
    void begin_document();
    // The pictures of the chooser of series, in the texture of this number; null: none.
    void show_previews(const SeriesPreviews* previews) { previews_ = previews; }
    static constexpr uint32_t kPreviewsTexture = 1 + static_cast<uint32_t>(kPanels.size());
    // The picture of the file that is pointed at in the browser, in the texture of this number.
    void show_file_preview(const FilePreview* preview) { file_preview_ = preview; }
    static constexpr uint32_t kFileTexture = 3 + static_cast<uint32_t>(kPanels.size());
    const ImDrawData& lists() const; // of the last frame
    // Where the widgets of the last frame lie, by their ids: "tool/draw".
    const std::map<std::string, Box>& widgets() const { return ui_.places; }
    // The parts of them that are seen: empty where a widget is scrolled out of its panel.
    const std::map<std::string, Box>& seen_widgets() const { return ui_.seen; }
    const std::vector<ViewText>& texts() const { return texts_; } // of the last frame
    static uint32_t texture_of(Panel panel) { return 1 + static_cast<uint32_t>(panel); }

 private:
    void feed(const Event& event);
    void draw(const std::vector<Event>& events, ViewState& state, Work& work,
              const std::array<PictureState, kPanels.size()>& pictures);

    Widgets ui_;
    SidePanel side_;
    StatusLine status_;
    TypedText save_folder_{};
    Browser browser_;
    SearchBox search_;
    const SeriesPreviews* previews_ = nullptr;
    const Welcome* welcome_ = nullptr;
    const FilePreview* file_preview_ = nullptr;
    HintsPanel hints_;
    std::vector<ViewText> texts_;
    bool is_light_ = false, busy_ = false;
};

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
