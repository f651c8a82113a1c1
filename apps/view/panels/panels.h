#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "apps/view/document/order.h"
#include "apps/view/document/work.h"
#include "apps/view/drawing/icons.h"
#include "apps/view/panels/file_browser.h"
#include "apps/view/window/state.h"

// The panels: each is a function of the state and the document in a source of its name. It changes
// the state, or orders. What it remembers from frame to frame is a struct.
namespace palpate::view {

class SeriesPreviews;
struct FilePreview;
struct Welcome;

// The widgets of a frame, while panels draw them.
struct Widgets {
    double time_s = 0.0; // of the frame
    std::vector<Order> orders{};
    std::map<std::string, Box> places{};         // by their ids: "tool/draw"
    std::map<std::string, Box> seen{};           // the parts of them that are not scrolled away
    std::string pointed_out{};                   // the id of one that is framed
    bool scrolls_to = false;                     // and scrolled to, until it is seen
    bool presses = false;                        // and pressed in this frame: by Enter
    std::pair<std::string, std::string> named{}; // the id of a field, and what the browser gives it
    std::map<std::string, std::string> proposed{}; // names of files, by the ids of their fields

    void order(Order one) { orders.push_back(std::move(one)); }
    // Keeps the last widget's place. Under the pointer it has the tooltip of widget_help().
    void note(const std::string& id);
    bool button(const char* text, const std::string& id, Order one); // whether it was pressed
    // A filled button, the one of a section that is pressed most.
    bool primary(const char* text, const std::string& id, const ViewState& state);
    void check(const char* text, const std::string& id, bool& is_on);
    // A bar of a share, 0 .. 1, with what is done, and how long it will take from when it was first
    // seen: "segment 34 %, about 40 s left". Leaves `room` for a button behind it.
    void progress(const std::string& id, double share, const std::string& what, const char* room);

    // How long the work of this id has been shown.
    double seconds_since_begun(const std::string& id);

    struct Progress { // of a bar that was drawn in the last frame
        double began_s, seen_s;
    };
    std::map<std::string, Progress> under_way{};
};

// How long work still takes that has come so far in so many seconds, in words; empty as long as
// nobody can say.
std::string time_left_text(double share, double seconds);
std::string about_text(double seconds); // "about 40 s"

using TypedText = std::array<char, 1024>;
void type(TypedText& typed, const std::string& text); // in the place of what is there

struct WindowEnds {        // of drag_ends()
    GreyWindow before{};   // a field was taken hold of
    std::string clamped{}; // that a typed end was beyond its limits; empty: it was not
};
struct LabelPanel {
    TypedText file{};
    bool each = false;             // a surface of each label
    std::array<char, 64> sought{}; // a part of the names of labels
};
struct FilesPanel {
    std::vector<std::string> recent{}, listed{}; // listed: as they were when the pointer came
    TypedText figure_file{}, mesh_file{}, session_file{};
    size_t shown_step = 0; // to which the list of steps was scrolled
};
struct TouchPanel {
    std::vector<std::string> devices{}; // as they were at a time
    double devices_at_s = -1e9;
};
struct SidePanel {
    WindowEnds ends{};
    LabelPanel labels{};
    TypedText measures_file{};
    FilesPanel files{};
    TouchPanel touch{};
    bool bound_held = false; // of a segmentation, in this frame
};
struct Browser {
    std::string folder{}, error{};
    std::vector<BrowserEntry> entries{}; // of the folder
    std::vector<BrowserPlace> places{};
    TypedText typed{};
    EntryOrder order = EntryOrder::name;
    bool falls = false, all_files = false;
    bool was_open = false;     // in the last frame
    std::string opened_last{}; // when it was opened
    std::string pointed{};     // a file's row, and since when
    double pointed_s = 0.0;
    double entered_s = -1e9;    // when the folder was gone into
    glm::vec2 pressed_px{};     // where the button was pressed last
    bool entered_again = false; // by the second press of a double click
};
struct SearchBox {
    std::array<char, 128> typed{};
    size_t row = 0;        // of what is found
    bool was_open = false; // in the last frame
};
struct HintsPanel { // as it was in the last frame
    bool was_open = false;
    const Tool* tool = nullptr;
    WindowTask task = WindowTask::look;
};
struct StatusLine {
    std::string place{}; // of the pointer or the crosshair, and the values there
    std::string message{};
    double told_s = -1e9; // when it came
    std::string how_to{}; // use the tool that was in the hand in the last frame

    // The message; empty: nothing, or it has been shown for as long as a person reads it.
    std::string shown(double time_s) const;
};

void draw_side_panel(Widgets& ui, SidePanel& panel, ViewState& state, Work& work);
std::string samples_text(const Work& work); // how many samples, and how far apart

// Sections of the side panel (window/sections.h).
void draw_window_section(Widgets& ui, WindowEnds& ends, ViewState& state, Work& work);
void draw_volume_section(Widgets& ui, ViewState& state, Work& work);
void draw_transfer_panel(Widgets& ui, ViewState& state, Work& work);
void draw_layout_section(Widgets& ui, ViewState& state);
void draw_slices_section(Widgets& ui, ViewState& state, Work& work);
void draw_removed_panel(Widgets& ui, Work& work); // by the tools that take material away
void draw_clip_panel(Widgets& ui, ViewState& state, Work& work);
void draw_stereo_section(Widgets& ui, ViewState& state);
void draw_appearance_section(Widgets& ui, ViewState& state);
void draw_brush_section(Widgets& ui, ViewState& state);
void draw_mask_section(Widgets& ui, WindowEnds& ends, ViewState& state, Work& work);
void draw_label_panel(Widgets& ui, LabelPanel& panel, ViewState& state, Work& work);
void draw_label_files_section(Widgets& ui, LabelPanel& panel, ViewState& state, Work& work);
void draw_seeds_section(Widgets& ui, ViewState& state);
void draw_method_section(Widgets& ui, bool& bound_held, ViewState& state, Work& work);
void draw_segment_foot(Widgets& ui, ViewState& state, Work& work);
void draw_mesh_section(Widgets& ui, ViewState& state, Work& work);
void draw_wire_section(Widgets& ui, ViewState& state);
void draw_measure_panel(Widgets& ui, TypedText& file, ViewState& state, Work& work);
void draw_hand_section(Widgets& ui, TouchPanel& panel, ViewState& state, Work& work);
void draw_burr_section(Widgets& ui, ViewState& state, Work& work);
void draw_feel_section(Widgets& ui, Work& work);
void draw_forces_section(Widgets& ui, ViewState& state, Work& work);
void draw_files_section(Widgets& ui, FilesPanel& panel, ViewState& state, Work& work);
void draw_figure_panel(Widgets& ui, TypedText& file, ViewState& state);
void draw_session_panel(Widgets& ui, TypedText& file, ViewState& state);
void draw_steps_section(Widgets& ui, size_t& shown_step, Work& work);
void draw_series_list(Widgets& ui, ViewState& state, Work& work);

// Windows beside and over the views.
void draw_top_bar(Widgets& ui, ViewState& state, Work& work);
void draw_tool_bar(Widgets& ui, ViewState& state);
void draw_status(Widgets& ui, StatusLine& line, const ViewState& state, Work& work);
void draw_touch_panel(Widgets& ui, TouchPanel& panel, ViewState& state, Work& work);
void draw_help(ViewState& state);
void draw_search(Widgets& ui, SearchBox& box, ViewState& state, Work& work);
void draw_questions(Widgets& ui, TypedText& folder, ViewState& state, Work& work);
void draw_browser(Widgets& ui, Browser& panel, const std::vector<std::string>& recent,
                  const FilePreview& preview, ViewState& state);
void draw_series_chooser(Widgets& ui, const SeriesPreviews* previews, ViewState& state,
                         Work& work); // null: no pictures
void draw_opening(Widgets& ui, const ViewState& state);
void draw_welcome(Widgets& ui, const Welcome* welcome, ViewState& state); // null: none
void draw_hints(Widgets& ui, HintsPanel& panel, ViewState& state, bool has_paged);

// Parts that several panels have.
// A field for the name of a file that is written, a button that opens the browser for it, and room
// for the button that writes it. `name` is proposed, and as long as the field has a proposed name
// it follows; a folder before it stays.
void name_file(Widgets& ui, const std::string& id, TypedText& typed, const std::string& name,
               const char* button, ViewState& state);
// Opens the browser, which gives the field of this id a name in its place.
void browse_for_name(Widgets& ui, const std::string& id, const std::string& name, ViewState& state);
// What has become of the last long work of a section; nothing, while there was none.
void draw_result(Widgets& ui, const std::string& id, const Message& told, const ViewState& state);
struct IconButton {
    std::string id{};
    Icon icon = Icon::none;
    std::string letters{}, tip{}; // letters: where the build has found no icons
    float side_px = 0.0f;
    bool is_chosen = false, is_possible = true;
    bool is_faint = false; // as a hint: what it stands for is off
    float icon_px = 20.0f; // at a text scale of 1
};
// Draws it at the cursor; whether it was pressed.
bool draw_icon_button(Widgets& ui, const IconButton& button, const ViewState& state);
// A check box of a row of a list, drawn as one of two icons. `tips`: what each of them says; off
// and on. Whether it was pressed.
enum class RowSwitch { shown, locked };
bool draw_row_switch(Widgets& ui, const std::string& id, RowSwitch what,
                     std::array<const char*, 2> tips, bool& is_on, const ViewState& state);
// A swatch in a row of a list, which opens a picker; whether the colour changed. null: no opacity.
bool pick_color(Widgets& ui, const std::string& id, const char* tip, glm::dvec3& color,
                double* opacity);
// Whether and how labels are seen; `all`: in 3D and at their edges, too.
void draw_label_looks(Widgets& ui, ViewState& state, bool all);
void draw_presets(Widgets& ui, RayCastLayer& layer, Work& work, bool& changed);
void draw_values(const ValueStatistics& values, const std::string& unit); // a small table
// Two fields for the ends of a window. A drag stops at the other end; what is typed moves it along.
void drag_ends(Widgets& ui, WindowEnds& ends, const char* group, std::array<const char*, 2> names,
               GreyWindow& window, double least, GreyWindow limits, Work& work);

} // namespace palpate::view
