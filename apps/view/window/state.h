#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/document/figure_setup.h"
#include "apps/view/document/live_surface.h"
#include "apps/view/document/masking.h"
#include "apps/view/document/message.h"
#include "apps/view/document/segmenting.h"
#include "apps/view/panels/transfer_editor.h"
#include "apps/view/script/event.h"
#include "apps/view/tools/clipping.h"
#include "apps/view/tools/measuring.h"
#include "apps/view/tools/stylus.h"
#include "apps/view/tools/tool_states.h"
#include "apps/view/window/panel.h"
#include "apps/view/window/sections.h"
#include "apps/view/window/slice_view.h"
#include "apps/view/window/stereo_view.h"
#include "engine/program/mesh_export.h"
#include "engine/scene/scene.h"
#include "engine/session/iso_list.h"
#include "engine/session/notes.h"

namespace palpate::view {

struct Tool; // of the left button: tools/tool.h
extern const Tool kCrosshairTool;

// Values shown as black and as white in slices.
struct GreyWindow {
    double low = 0.0, high = 1.0; // low < high

    friend bool operator==(const GreyWindow&, const GreyWindow&) = default;
};

// The nearest window that can be shown of values of this range: finite, its ends apart, and not so
// far away that a person would not find the values again.
GreyWindow limited(GreyWindow window, ValueRange range);
// The window with its lower, or its upper, end at a value that was typed. Where that end passes the
// other one, the other one moves too and the width stays; the width is `least` or more. Both ends
// stay within `limits`, if they were: the typed one is the nearest value with room for the other.
// NaN changes nothing.
GreyWindow with_low(GreyWindow window, double low, double least, GreyWindow limits);
GreyWindow with_high(GreyWindow window, double high, double least, GreyWindow limits);
// Whether a person wants values of this range without fractions.
bool are_whole_enough(ValueRange range);

// A move of the mouse with a button pressed, from its press on.
struct Drag {
    enum class Kind {
        window,
        pan,
        zoom,
        rotate,
        roll,
        clip,
        tool,   // that of the left button
        turn,   // of planes, by the crosshair's tool
        nothing // the rest of a click
    };
    Kind kind = Kind::pan;
    Button button = Button::left; // whose release ends it
    Panel panel = Panel::axial;
    glm::dvec2 last_px{0.0};
    const Tool* tool = nullptr; // that has begun a drag of the left button

    friend bool operator==(const Drag&, const Drag&) = default;
};

enum class Browsing {
    documents, // in the place of the one that is open
    labels,    // of its volume
    fused,     // another volume over its slices
    name       // of a file that is written, for the field ViewState::naming
};

// Scripts of input; paths, empty: none.
struct Scripting {
    std::string recording, playing;

    friend bool operator==(const Scripting&, const Scripting&) = default;
};

// An action that waits until a person has said what becomes of edits that are not saved.
struct Leaving {
    bool closes = false;          // the window; else a file is opened
    std::string path{}, series{}; // of it, as of order::Open
    bool saving = false;          // they are being saved, or it is asked where
    bool applying = false;        // first a pulled mesh is put into its label

    friend bool operator==(const Leaving&, const Leaving&) = default;
};

// A question about a file that was read.
struct FileQuestion {
    enum class About {
        label_map,   // shall it lie over the volume that is open, or be opened in its place?
        one_of_many, // shall the whole series be opened?
    };
    About about = About::label_map;
    std::string path{};    // of the label map, or of the folder
    size_t images = 0;     // of the folder
    bool replaces = false; // labels that are there

    friend bool operator==(const FileQuestion&, const FileQuestion&) = default;
};

// The work of a person with the list of iso-surfaces.
struct IsoEditing {
    IsoList list;
    bool pointing = false;        // the next press in a slice gives the value of one more
    std::optional<double> picked; // that value

    friend bool operator==(const IsoEditing&, const IsoEditing&) = default;
};

// A surface that is to be written.
struct ExportSetup {
    MeshExport made{.decimate_mm = 0.1};
    bool of_label = false; // the one that is drawn
    bool is_cut = true;    // by the clip planes

    friend bool operator==(const ExportSetup&, const ExportSetup&) = default;
};

// Hints at the first start of the program.
struct Hints {
    bool open = false;
    bool seen = false;              // all were followed, or closed: they never come again
    std::array<bool, 4> followed{}; // slices, tools, search, tasks

    friend bool operator==(const Hints&, const Hints&) = default;
};

// All that a person can change about how a document is seen, and what the hand is doing. A value.
struct ViewState {
    Notes notes; // of the document, as a person is changing them (document/notes_link.h)
    glm::uvec2 size_px{1280, 800};
    double text_scale = 1.0;
    Layout layout = Layout::four;
    Panel slice = Panel::axial; // of Layout::slice
    std::optional<Panel> alone; // fills the room of all views
    bool tools_open = true, help_open = false, notes_shown = true, crosshair_shown = true;
    bool status_open = true;     // the line at the bottom
    bool bars_open = true;       // beside the views: of tasks and of tools
    bool saving_open = false;    // the question where to; keys are for it alone
    bool saving_typing = false;  // its text field takes the keys from the next frame on
    bool saving_entered = false; // Enter was pressed, and not in a text field
    std::string saving_folder;   // where to in vain; empty: not tried yet
    Message saving_failed;       // why
    std::optional<Leaving> leaving;
    std::optional<FileQuestion> file_question;
    bool search_open = false;      // the search box (Ctrl+K)
    bool touch_open = false;       // the window of touch
    bool palette_shown = false;    // widgets in 3D (palette.h)
    bool slices_in_volume = false; // the three planes are drawn among the rays

    glm::dvec3 crosshair_mm{0.0};
    std::array<SliceView, kSlicePanels> slices;
    Camera camera; // of the volume
    GreyWindow window;
    bool window_inverted = false;        // black and white are exchanged (DICOM's MONOCHROME1)
    StereoView stereo;                   // of the volume's view
    std::optional<glm::dvec3> cursor_mm; // in stereo: where the pointer is in 3D

    double slab_mm = 0.0; // thickness of slices; 0: plain ones
    SlabMode slab_mode = SlabMode::maximum;
    double fusion_opacity = 0.5, overlay_opacity = 0.4; // Scene::fusion, Scene::overlay
    double outline_px = 1.0;                            // of labels and overlay; 0: none

    const Tool* tool = &kCrosshairTool; // of the left button
    ToolStates own;                     // of tools
    double radius_mm = 3.0;
    bool brush_keeps_to_edges = false; // of brush and eraser: Operation::alike, and its value
    double alike_deviations = 3.0;
    bool brush_is_disc = false; // of one layer of a slice, of brush and eraser; else it is a ball
    uint16_t label = 1;         // that is drawn
    // Values of the samples that tools on labels change; none: all.
    std::optional<GreyWindow> only_values;
    Masking masking;
    double change_label_mm = 1.0; // by how far a label is smoothed, grown, ..
    bool labels_shown = true;
    double label_opacity = 0.4;
    bool labels_in_3d = true;                    // their surfaces lie among the rays
    LabelEdges label_edges = LabelEdges::smooth; // in slices, of labels and overlay
    SeenAs seen_as = SeenAs::rays;               // of the volume in 3D
    Stylus stylus;

    WindowTask task = WindowTask::look;
    OpenSections sections;
    double panel_px = kPanel_px; // width of the side panel at a text scale of 1
    TransferEditing transfer;
    IsoEditing iso;
    ExportSetup exporting;
    Segmenting segmenting;
    Measuring measuring;
    Clipping clipping;
    FigureSetup figure;
    Scripting scripts;
    double play_speed = 1.0;                 // times as fast as it was recorded
    Browsing browsing = Browsing::documents; // what is chosen in the browser
    std::string naming;
    std::string pointed_file; // in the browser, for a while: its picture is wanted; empty: none
    bool browser_open = false, series_open = false, names_hidden = false, light = false,
         indices_shown = false; // of samples, in the line at the bottom
    bool hand_put_down = false; // the mouse, which is the hand, was given another tool
    bool welcome_open = false;  // no file was named: it offers some
    Hints hints;
    size_t recovered_steps = 0; // a person is asked whether these are wanted; 0: is not asked
    std::string opening;        // that is being read; empty: none
    double opening_since_s = 0.0, opening_share = 0.0; // of its voxels; 0: its headers are read

    glm::dvec2 pointer_px{-1.0};
    std::optional<Panel> under; // the view that the pointer is in
    std::optional<Drag> drag;
    bool w_held = false;
    double pressed_s = -1e9; // of the last press of the left button in a view, for double clicks
    glm::dvec2 pressed_px{-1.0};

    friend bool operator==(const ViewState&, const ViewState&) = default;
};

// The data that the state is about, and that it goes back to.
struct Subject {
    Grid grid;
    ValueRange range;                // of the grey values
    std::vector<GreyWindow> windows; // of keys 1 .. 9
    std::vector<std::string> window_names;
    ViewState home; // as it was opened
    // What a ray of the 3D view meets first, if anything: for Shift and a move, and for a hand that
    // the pointer is. While that presses a button, the volume is as it was before.
    std::function<std::optional<glm::dvec3>(const Ray&)> pick{};
    // The newest grey value and label of the sample at a point; none, and 0, where there is none.
    std::function<std::optional<double>(glm::dvec3 point_mm)> value_at{};
    std::function<uint16_t(glm::dvec3 point_mm)> label_at{};
    std::function<bool()> has_labels{}; // any samples of a label
    // The first point of the pulled mesh on a ray, and its place near a point; empty: no mesh.
    std::function<std::optional<glm::dvec3>(const Ray&)> mesh_met{};
    std::function<std::optional<glm::dvec3>(glm::dvec3 point_mm, double within_mm)> mesh_near{};
    // The path along edges between two samples of a slice across an axis, both included.
    std::function<std::vector<glm::uvec3>(glm::uvec3 from, glm::uvec3 to, int axis)> path{};
};

Places places_of(const ViewState& state);
// Whether the side panel shows what is in a section.
bool is_shown(const ViewState& state, Section section);
// The panel of touch stands beside the side panel, but for the task that has its parts.
bool has_touch_panel(const ViewState& state);
std::optional<Box> box_of(const ViewState& state,
                          Panel panel); // none where it is not shown

// The length of the volume's diagonal.
double extent_mm(const Grid& grid);

// The size of the volume's view, or what it would be.
glm::uvec2 volume_size_px(const ViewState& state);

// The point in the patient under a pixel of the window, in a slice.
glm::dvec3 point_under(const ViewState& state, const Grid& grid, Panel panel, glm::dvec2 at_px);
// The pixel of the window at which a point lies.
std::optional<glm::dvec2> pixel_of(const ViewState& state, const Grid& grid, Panel panel,
                                   glm::dvec3 point_mm);

// Moves the crosshair, not beyond the volume. Where all three slices lie along the samples it goes
// to the middle of the nearest one, so that slices show samples as they are.
void move_crosshair(ViewState& state, const Grid& grid, glm::dvec3 to_mm);

// The crosshair goes so many layers of samples away from the eye of a slice.
void page(ViewState& state, const Grid& grid, Panel panel, double layers);

// The sample nearest to a point; none outside the volume.
std::optional<glm::uvec3> sample_at(const Grid& grid, glm::dvec3 point_mm);

// The slices' window as a grey function.
TransferFunction grey_of(const ViewState& state);

// The scene of a view's picture: `base` is the document's scene, of which rays, colours of labels
// and clip planes are taken.
Scene scene_of(const ViewState& state, const Grid& grid, Panel panel, const Scene& base,
               bool has_labels);

} // namespace palpate::view
