#include "apps/view/panels/widget_help.h"

#include <algorithm>

namespace palpate::view {

namespace {

constexpr WidgetHelp kHelp[] = {
    {"tool/radius", "brush size",
     "radius of the brush, the eraser, the seeds and the burr, 0.1 to 100 mm", "radius burr disc"},
    {"tool/label", "label to draw", "number of the label that brush and fill write, 1 to 65535",
     "segment number"},
    {"tool/undo", "undo", "takes the last step back", "revert"},
    {"tool/redo", "redo", "does again what was undone last", ""},
    {"tool/save", "save", "writes a project folder", "", false},

    {"bar/picture", "picture", "writes a PNG of the window into the current folder", "", false},

    {"window/black", "black of the window",
     "value that slices show as black; higher makes slices darker", "window level contrast"},
    {"window/white", "white of the window",
     "value that slices show as white; lower makes slices brighter",
     "window level width brightness"},

    {"volume/mode", "mode of the volume in 3D",
     "shaded by opacity, the largest value along a ray, or a surface of one value",
     "rendering MIP maximum intensity projection iso-surface alpha"},
    {"volume/colours", "presets of colour and opacity", "colours and opacity of values in 3D",
     "transfer function vessels skin bone", false},
    {"volume/as_window", "3D as the slices' window",
     "the maximum is shown with the window of the slices", "", false},
    {"volume/iso", "iso-value of the surface in 3D", "the surface lies where values pass this one",
     "threshold surface", false},
    {"volume/slices", "slices in 3D", "draws the three planes among the volume", "planes"},
    {"volume/orthographic", "orthographic 3D",
     "parallel rays: things far away are not drawn smaller", "perspective projection camera"},

    {"labels/shown", "labels shown", "draws labels over slices and in 3D",
     "hide segmentation mask overlay"},
    {"labels/opacity", "opacity of labels",
     "0: the grey values alone, 1: the colours of labels alone", "transparency mask fill"},
    {"labels/in_3d", "labels in 3D",
     "the smooth surface of each label in the 3D view, beside the rays; off: labels tint the rays",
     "segment organ surface mesh smooth"},
    {"labels/outline", "outline of labels", "width of the lines around labels in slices, 0 to 5 px",
     "contour border"},

    {"layout/views", "layout of views", "three slices and 3D, 3D alone, or one slice",
     "four up single view"},
    {"layout/slice", "slice shown alone", "axial, coronal or sagittal", "", false},
    {"layout/crosshair", "crosshair lines", "draws lines through the chosen place in all views",
     "cursor"},
    {"layout/notes", "letters in views",
     "draws names, sides of the patient, windows, places and scale bars over views",
     "annotations orientation text"},

    {"slices/thickness", "thickness of slices",
     "a slice shows the maximum, mean or minimum over this many mm", "slab MIP thick average"},
    {"slices/mode", "thick slices show", "maximum, mean or minimum over the thickness", "slab MIP",
     false},
    {"slices/outline", "outline in slices",
     "width of the lines around labels in slices, 0 to 5 px; 0: none", "contour"},
    {"slices/open", "volume over slices",
     "opens a second volume, which is laid over the slices in colour",
     "fusion PET overlay second image layer register"},
    {"slices/fused", "opacity of the second volume", "0: the first alone, 1: the second alone",
     "fusion", false},
    {"slices/overlay", "opacity of the second labels", "0: not seen, 1: their colours alone",
     "overlay", false},

    {"stereo/on", "both eyes in 3D", "draws the 3D view in stereo", "stereoscopic VR anaglyph"},
    {"stereo/layout", "stereo layout", "how the pictures of both eyes lie on the screen", "",
     false},
    {"stereo/swap", "swap eyes", "gives each eye the picture of the other", "", false},
    {"stereo/mirror", "mirror one eye", "for screens that are seen by a mirror", "", false},
    {"stereo/depth", "depth of stereo",
     "distance between the eyes, in percent of the camera's distance; more is deeper", "", false},

    {"transfer/plot", "curve of opacity and colour",
     "opacity over values: a click adds a point, a drag moves it, a right click removes it",
     "transfer function histogram"},
    {"transfer/log", "counts on a logarithmic scale",
     "shows rare values of the histogram beside frequent ones", "histogram"},
    {"transfer/values", "values of the plot", "the least and the largest value of the plot",
     "zoom histogram"},
    {"transfer/all_values", "all values in the plot", "the plot shows the whole range again", "",
     false},
    {"transfer/presets", "presets of the curve", "colours and opacity of values in 3D",
     "transfer function vessels skin bone"},
    {"transfer/felt", "the hand feels the curve",
     "matter is what is more opaque than half of the highest opacity", "touch haptic"},
    {"transfer/value", "value of the point", "place of the chosen point among the values", "",
     false},
    {"transfer/opacity", "opacity of the point", "0: not seen, 1: opaque", "", false},
    {"transfer/colour", "colour of the point", "red, green and blue of the chosen point", "",
     false},
    {"transfer/remove", "remove the point", "takes the chosen point out of the curve", "", false},

    {"labels/only", "paint only where values are",
     "brush, eraser and the hand's tools change no samples with other values",
     "threshold paint masking editable intensity range"},
    {"labels/from", "least value to paint", "samples with lower values stay as they are", "",
     false},
    {"labels/to", "largest value to paint", "samples with higher values stay as they are", "",
     false},
    {"labels/all", "see all labels", "shows every label", "visible"},
    {"labels/one", "see one label", "shows the chosen label alone", "solo isolate visible"},
    {"labels/new", "new label", "takes the next free number, with the brush in the hand",
     "add segment create"},
    {"labels/find", "find a label", "lists the labels whose names have these letters",
     "filter search names"},
    {"labels/name", "name of the label", "goes with the project and with exported files",
     "rename segment"},
    {"labels/largest", "largest piece", "takes all other pieces of the label away",
     "island connected component keep largest", false},
    {"labels/fill", "fill holes", "gives the label the holes that it encloses on all sides", "",
     false},
    {"labels/between", "between slices", "fills the slices between those that were drawn",
     "interpolate fill between", false},
    {"labels/by", "distance of a change", "by how far the label is smoothed, grown or shrunk, mm",
     "", false},
    {"labels/smooth", "smooth", "evens the surface out; the volume stays", "smoothing gaussian",
     false},
    {"labels/grow", "grow", "adds what lies so near; other labels keep theirs",
     "margin dilate expand", false},
    {"labels/shrink", "shrink", "takes away what lies so near its surface", "margin erode", false},
    {"labels/middle", "go to the label's middle", "moves the crosshair there", "center", false},
    {"labels/open", "labels of a file", "reads a label map in the place of the one that is there",
     "load import segmentation"},
    {"labels/file", "file of exported labels",
     "all labels as .nii.gz, .nrrd or .mha; the surface of the chosen one as .stl, .ply, .obj or "
     ".vtp",
     ""},

    {"labels/file/choose", "folder of exported labels", "chooses where the file is written", "",
     false},
    {"segment/radius", "size of the seed brush", "radius of seeds, 0.1 to 100 mm", ""},
    {"segment/label", "label to segment", "number of the label that a segmentation writes", ""},
    {"segment/clear", "clear seeds", "takes all seeds away", "reset"},
    {"segment/methods", "method of segmentation", "how an object is found from seeds",
     "grow from seeds region growing random walker level set snake threshold"},
    {"segment/run", "segment", "runs the chosen method", "apply start grow"},
    {"segment/bound", "bound of the result",
     "how far the object goes: drag it and let it go; more is larger", "strength", false},
    {"segment/inside", "seeds inside", "seeds of the label that is to be found", "foreground"},
    {"segment/outside", "seeds outside", "seeds of what is not the label", "background"},
    {"segment/erase", "erase seeds", "takes seeds away under the brush", ""},
    {"segment/wire", "contour along edges", "clicks that follow edges and enclose a label",
     "live-wire intelligent scissors magnetic lasso"},
    {"mesh/make", "pull the surface of a label", "makes a mesh whose faces are dragged",
     "deform sculpt simplex mesh"},
    {"mesh/reach", "patch that is pulled", "faces about the one in the hand that move with it", "",
     false},

    {"measure/ruler", "ruler", "two points: their distance in mm", "length distance line measure"},
    {"measure/angle", "angle", "three points: the angle at the second", "measure"},
    {"measure/polygon", "polygon", "area, perimeter and the statistics of values inside",
     "region ROI area measure"},
    {"measure/sphere", "sphere", "volume and the statistics of values inside", "ROI ball measure"},
    {"measure/name", "name of the measure", "goes with the project and into the table", "", false},
    {"measure/delete", "delete the measure", "takes the chosen measure away", "remove", false},
    {"measure/file", "file of measures", "name of the table (CSV)", ""},
    {"measure/file/choose", "folder of measures", "chooses where the table is written", "", false},
    {"measure/export", "measures to a table", "writes all measures: points in LPS, mm",
     "CSV spreadsheet save statistics"},

    {"clip/box", "crop box", "six planes along the samples: drag their discs in any view",
     "crop volume region of interest ROI"},
    {"clip/add", "add a clip plane", "a plane through the crosshair that looks at the eye",
     "cut plane scissors"},
    {"clip/none", "no clip planes", "shows the whole volume again", "remove uncrop"},
    {"clip/mm", "place of the plane", "along its normal from the volume's middle, mm", "", false},
    {"clip/flip", "other side of the plane", "keeps what was cut away", "", false},
    {"clip/here", "plane through the crosshair", "moves the chosen plane there", "", false},
    {"clip/remove", "remove the plane", "takes the chosen plane away", "", false},

    {"file/open", "open a file, a folder or a project",
     "a volume, a scene, a project, or a folder of DICOM files", "load import DICOM"},
    {"file/save", "save to a project folder", "volume, labels, names, measures and steps", "store"},
    {"file/picture", "picture of the window", "writes a PNG into the current folder",
     "screenshot snapshot capture"},
    {"file/hide", "hide names", "leaves out whatever may hold a patient's name",
     "anonymous privacy patient"},
    {"file/light", "light colours", "white panels and dark letters", "dark theme appearance"},
    {"file/text", "size of letters", "1 to 2 times; all of the window grows with it",
     "font scale zoom text"},

    {"touch/device", "device of the hand", "a haptic device, or the mouse in its place",
     "stylus phantom haply touch"},
    {"touch/algorithm", "algorithm of touch", "how the force follows from the volume", "haptic"},
    {"touch/start", "start or stop the hand", "connects the device, at first without force", "",
     false},
    {"touch/arm", "arm the hand", "lets the force come; Esc takes it away at any time", "", false},
    {"touch/scale", "scale of the hand", "mm in the volume for a mm of the device", "", false},
    {"touch/align", "turn the hand to the view", "left of the hand is left in the 3D view", "",
     false},
    {"touch/on_surface", "as deep as what is seen",
     "the mouse's tool lies on the surface under the pointer", "", false},
    {"touch/deeper", "depth of the mouse's tool", "mm below where the pointer's ray ends", "",
     false},
    {"touch/first", "first button of the hand", "the tool that it uses", "drill burr cut draw"},
    {"touch/second", "second button of the hand", "the tool that it uses", "drill burr cut draw"},
    {"touch/shape", "shape of the tool", "of what the hand holds", "burr ball cylinder cone"},
    {"touch/rate", "speed of drilling", "how fast the burr takes matter away; more is faster",
     "feed burr", false},
    {"touch/arrow", "touch: force as an arrow", "draws the force at the tool in 3D", ""},
    {"touch/sound", "sound of milling", "is heard while the burr takes matter away", "noise"},
    {"touch/dust", "dust of milling", "grains that leave the burr", "chips particles"},
    {"touch/seen_as", "3D by rays or surface",
     "draws the volume by rays, by the surface that the hand feels, or both", ""},
    {"touch/palette", "touch: widgets in 3D", "buttons that the hand presses in the 3D view", ""},
    {"touch/grey", "feel grey values", "the hand feels the volume", "", false},
    {"touch/labels", "feel labels", "the hand feels the labels", "", false},
    {"touch/iso", "solid from", "the hand feels values from this one on as matter", "iso", false},
};

// The panels whose ids begin with a word.
constexpr std::pair<std::string_view, Tab> kPanelOfGroup[] = {
    {"tool", Tab::view},         {"window", Tab::view},     {"volume", Tab::view},
    {"layout", Tab::view},       {"slices", Tab::view},     {"stereo", Tab::view},
    {"transfer", Tab::transfer}, {"labels", Tab::labels},   {"segment", Tab::segment},
    {"mesh", Tab::segment},      {"measure", Tab::measure}, {"clip", Tab::clip},
    {"figure", Tab::file},       {"file", Tab::file},
};

} // namespace

std::span<const WidgetHelp> widget_help() {
    return kHelp;
}

const WidgetHelp* help_of(std::string_view id) {
    const auto* found = std::find_if(std::begin(kHelp), std::end(kHelp),
                                     [&](const WidgetHelp& one) { return id == one.id; });
    return found == std::end(kHelp) ? nullptr : found;
}

void open_panel_of(ViewState& state, std::string_view id) {
    const std::string_view group = id.substr(0, id.find('/'));
    if (group == "touch")
        state.touch_open = true;
    for (const auto& [name, tab] : kPanelOfGroup)
        if (name == group) {
            state.tools_open = true;
            state.tab = tab;
        }
}

} // namespace palpate::view
