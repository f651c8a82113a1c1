// Sessions of the side panel and of measuring.

#include "tests/view/recorded_session.h"

namespace palpate::view {
namespace {

// See sessions_test.cpp for the phantom. A pixel of a slice is 2.08 * 12 * 200 / 23 / 267 mm =
// 0.8128969 mm. The plot of the transfer function is 248 pixels wide and 150 high, for values from
// -1041 to 1130.
const RecordedSteps kSessions[] = {
    {"task_of_the_transfer_function", "section colours", R"({"task": "look"})"},
    {"task_and_back", "widget task/measure; widget task/look; widget tool/cut",
     R"({"task": "look", "tool": {"hand": "cut"}})"},
    {"tasks", "widget task/segment; widget task/drill; widget task/export",
     R"({"task": "export", "sections_open": ["files", "label_files", "steps"]})"},
    {"section_folded", "widget section/volume; widget section/layout; widget section/layout",
     R"({"sections_open": ["window", "labels_shown", "layout", "slices"],
         "widgets": {"volume/mode": null}})"},
    {"sections_of_a_task_stay_as_they_were",
     "section clips; widget section/window; widget task/measure; widget task/look",
     R"({"sections_open": ["volume", "labels_shown", "layout", "slices", "clips"]})"},
    {"a_task_shows_the_hidden_panel", "key t; widget task/measure",
     R"({"task": "measure", "tools_open": true})"},
    {"panel_hidden_and_shown_by_the_bar", "widget panel/toggle; idle; widget panel/toggle",
     R"({"tools_open": true})"},
    {"panel_hidden_by_the_bar", "widget panel/toggle", R"({"tools_open": false})"},
    {"panel_dragged", "at panel/width 3 200; drag left -60 0",
     R"({"panels": {"axial": [46, 40, 237, 288]}})"},
    {"drilling_is_found", "widget task/drill; widget drill/start",
     R"({"hand": {"on": true, "armed": false, "first": "drill"}, "task": "drill"})"},
    {"name_opens_another_work", "widget top/open", R"({"browser_open": true})"},

    {"measure_by_key", "key m", R"({"tool": {"hand": "measure"}, "measuring": {"kind": "ruler"}})"},
    {"measure_kinds_by_key", "key m; key m; key m", R"({"measuring": {"kind": "polygon"}})"},
    {"measure_kind_is_told", "key m; key m",
     R"({"message": "measure: angle; click end, vertex, end, or drag the first arm", "task": "look"})"},
    {"measure_kind_is_told_in_the_panel", "widget tool/measure",
     R"({"message": "measure: ruler; click or drag both ends"})"},
    {"measure_kind_by_widget", "section measures; widget measure/sphere",
     R"({"tool": {"hand": "measure"}, "measuring": {"kind": "sphere"}})"},
    {"ruler", "key m; at axial -40 20; drag left 80 0",
     R"({"measures": [{"kind": "ruler", "length_mm": 65.03175378602833}], "undo_steps": 1,
         "crosshair_sample": [12, 12, 12], "measuring": {"selected": 0}})"},
    {"ruler_by_two_clicks", "key m; at axial -40 20; click left; at axial 40 20; click left",
     R"({"measures": [{"kind": "ruler", "length_mm": 65.03175378602833}]})"},
    {"ruler_half_placed", "key m; at axial -40 20; click left",
     R"({"measures": [], "measuring": {"begun": 1}})"},
    {"ruler_cancelled", "key m; at axial -40 20; click left; key escape; at axial 9 9",
     R"({"measures": [], "measuring": {"begun": 0}})"},
    {"ruler_through_slices", "key m; at axial 0 30; click left; wheel 3; at axial 0 30; click left",
     R"({"measures": [{"length_mm": 26.08695652173913}]})"},
    {"angle",
     "key m; key m; at axial 60 0; click left; at axial 0 0; click left; at axial 0 -50; "
     "click left",
     R"({"measures": [{"kind": "angle", "angle_deg": 90}]})"},
    {"polygon",
     "key m; key m; key m; at coronal -20 -15; click left; at coronal 20 -15; click "
     "left; at coronal 20 15; click left; at coronal -20 15; click left; key enter",
     R"({"measures": [{"kind": "polygon", "area_mm2": 792.9616875912395,
                       "length_mm": 113.80556912554958}]})"},
    {"polygon_that_crosses_itself",
     "key m; key m; key m; at axial -20 -20; click left; at axial 20 20; click left; at axial 20 "
     "-20; click left; at axial -20 21; click left; key enter",
     R"({"measures": [{"note": "edges cross: no area"}]})"},
    {"sphere", "key m; key m; key m; key m; at sagittal 10 10; drag left 20 0",
     R"({"measures": [{"kind": "sphere", "radius_mm": 16.257938446507083,
                       "volume_mm3": 18000.519293890597}]})"},
    {"sphere_outside", "key m; key m; key m; key m; at axial 0 136; drag left 6 0",
     R"({"measures": [{"kind": "sphere", "values": {"count": 0},
                       "note": "no sample lies inside"}]})"},
    {"handle_dragged", "key m; at axial -40 20; drag left 80 0; at axial 40 20; drag left -40 0",
     R"({"measures": [{"length_mm": 32.515876893014165}]})"},
    {"deleted_by_key", "key m; at axial -40 20; drag left 80 0; key delete",
     R"({"measures": [], "measuring": {"selected": null}})"},
    {"deleted_by_widget",
     "key m; at axial -40 20; drag left 80 0; section measures; widget "
     "measure/delete",
     R"({"measures": []})"},
    {"selected_in_the_list",
     "key m; at axial -40 20; drag left 80 0; at axial -40 60; drag left 80 0; section measures; "
     "widget measure/row/0; widget measure/delete",
     R"({"measures": [{"length_mm": 65.03175378602833}]})"},
    {"measure_in_3d_is_a_click", "key m; at 3d 0 0; click left; at 3d 12 9; click left",
     R"({"measures": [{"kind": "ruler"}]})"},
    {"measure_in_3d_turns_by_drags", "key m; at 3d 0 0; drag left 40 0", R"({"measures": []})"},
    {"measure_exports_nothing_in_a_script", "section measures; widget measure/export",
     R"({"task": "measure"})"},

    {"labels_export_nothing_in_a_script",
     "key b; at axial 10 20; click left; section label_files; widget labels/export",
     R"({"task": "export", "label_counts": {"1": 1}})"},
    {"ruler_undone", "key m; at axial -40 20; drag left 80 0; hold ctrl; key z; let ctrl; idle",
     R"({"measures": [], "undo_steps": 0, "redo_steps": 1, "message": "undone: measures",
         "measuring": {"selected": null}})"},
    {"ruler_undone_and_redone",
     "key m; at axial -40 20; drag left 80 0; hold ctrl; key z; key y; let ctrl; idle",
     R"({"measures": [{"kind": "ruler", "length_mm": 65.03175378602833}], "undo_steps": 1})"},
    {"labels_listed", "section labels", R"({"task": "segment", "label_counts": {}})"},
    {"label_counted", "key b; at axial 10 20; click left; section labels",
     R"({"label_counts": {"1": 1}})"},
    {"label_hidden", "section labels; widget labels/visible/1",
     R"({"label_styles": {"1": {"visible": false}, "2": {"visible": true}}})"},
    {"label_seen_alone", "section brush; widget tool/label 0.95; section labels; widget labels/one",
     R"({"label_styles": {"2": {"visible": true}}})"},
    {"label_found_by_its_name",
     "key b; at axial 10 20; click left; section brush; widget tool/label 0.95; at axial 40 20; "
     "click left; section labels; widget labels/find; type 2; widget labels/row/2; key delete; "
     "widget "
     "labels/lock/2",
     R"({"tool": {"label": 2}, "locked_labels": [2]})"},
    {"label_not_found_by_another_name",
     "key b; at axial 10 20; click left; section labels; widget labels/find; type x",
     R"({"tool": {"label": 1}, "widgets": {"labels/row/1": null}})"},
    {"new_label_is_listed_while_another_name_is_sought",
     "key b; at axial 10 20; click left; section labels; widget labels/find; type x; widget "
     "labels/new; widget labels/row/2; widget labels/lock/2",
     R"({"tool": {"label": 2, "hand": "draw"}, "locked_labels": [2]})"},
    {"label_locked", "section labels; widget labels/lock/1", R"({"locked_labels": [1]})"},
    {"label_locked_and_undone",
     "section labels; widget labels/lock/1; hold ctrl; key z; let ctrl; idle",
     R"({"locked_labels": [], "redo_steps": 1, "message": "undone: label locks"})"},
    {"label_hidden_and_undone",
     "section labels; widget labels/visible/1; hold ctrl; key z; let ctrl; idle",
     R"({"label_styles": {"1": {"visible": true}}, "message": "undone: labels shown or hidden"})"},
    {"labels_looked_at_one_after_the_other_are_one_step",
     "key b; at axial 10 20; click left; section labels; widget labels/new; idle; widget "
     "labels/one; "
     "idle; widget labels/visible/1; idle; widget labels/visible/2; idle",
     R"({"label_styles": {"1": {"visible": true}, "2": {"visible": false}}, "undo_steps": 2,
         "steps": ["draw 1 on labels", "labels shown or hidden"]})"},
    {"one_undo_takes_all_of_the_looking_back",
     "key b; at axial 10 20; click left; section labels; widget labels/new; idle; widget "
     "labels/one; "
     "idle; widget labels/visible/1; idle; widget labels/visible/2; idle; hold ctrl; key z; let "
     "ctrl; idle",
     R"({"label_styles": {"1": {"visible": true}, "2": {"visible": true}}, "undo_steps": 1})"},
    {"see_one_and_see_all_leave_no_step",
     "key b; at axial 10 20; click left; section labels; widget labels/new; idle; widget "
     "labels/one; "
     "idle; widget labels/all; idle; hold ctrl; key z; let ctrl; idle",
     R"({"label_counts": {"1": null}, "undo_steps": 0})"},
    {"a_stroke_between_keeps_them_apart",
     "section labels; widget labels/visible/1; idle; key b; at axial 10 20; click left; idle; "
     "widget "
     "labels/visible/1; idle",
     R"({"undo_steps": 3, "label_counts": {"1": 1}})"},
    {"the_window_closes_by_a_key", "hold ctrl; key q; let ctrl", R"({"leaving": ""})"},
    {"the_key_that_closes_asks_before_edits_are_lost",
     "key b; at axial 10 20; click left; hold ctrl; key q; let ctrl", R"({"leaving": "close"})"},
    {"no_key_counts_while_it_is_asked",
     "key b; at axial 10 20; click left; hold ctrl; key q; let ctrl; key m",
     R"({"leaving": "close", "tool": {"hand": "draw"}})"},
    {"a_window_that_is_not_there_says_so", "key 7",
     R"({"message": "window 7: this volume has windows 1 to 6"})"},
    {"labels_that_are_not_there_say_so", "key a",
     R"({"message": "no labels are there yet: draw some (B), or open a file of them"})"},
    {"paging_beside_a_slice_says_what_it_needs", "at 3d 0 0; key up",
     R"({"message": "Up and Down go through the slice under the pointer: point at one"})"},
    {"a_key_without_a_meaning_says_so", "key '",
     R"({"message": "' does nothing: ? lists all keys"})"},
    {"label_unlocked", "section labels; widget labels/lock/1; widget labels/lock/1",
     R"({"locked_labels": []})"},
    {"locked_label_is_not_added_to",
     "section labels; widget labels/lock/1; key b; at axial 10 20; click left",
     R"({"label_counts": {"1": null}, "undo_steps": 1, "message": "draw: label 1 is locked"})"},
    {"locked_label_is_named_by_a_stroke_that_meets_it",
     "key b; at axial 10 20; click left; section labels; widget labels/name; type skull; widget "
     "labels/lock/1; section brush; widget tool/label 0.95; at axial 10 20; click left; idle",
     R"({"label_counts": {"1": 1, "2": null}, "message": "label 1 skull is locked and stays"})"},
    {"locked_label_is_not_painted_over",
     "key b; at axial 10 20; click left; section labels; widget labels/lock/1; "
     "section brush; widget tool/label 0.95; at axial 10 20; click left; at axial 40 20; click "
     "left",
     R"({"label_counts": {"1": 1, "2": 1}})"},
    {"locked_label_is_not_erased",
     "key b; at axial 10 20; click left; section labels; widget labels/lock/1; key e; at axial "
     "10 "
     "20; click left",
     R"({"label_counts": {"1": 1}})"},
    {"unlocked_label_is_painted_over",
     "key b; at axial 10 20; click left; section brush; widget tool/label 0.95; at axial 10 20; "
     "click left",
     R"({"label_counts": {"2": 1}})"},
    {"label_above_255_is_drawn",
     "section brush; widget tool/label 0.2; hold ctrl; key a; let ctrl; type 300; key enter; "
     "widget tool/draw; at "
     "axial 10 20; click left",
     R"({"tool": {"label": 300}, "label_counts": {"300": 1}, "undo_steps": 1})"},
    {"label_above_255_is_taken_back",
     "section brush; widget tool/label 0.2; hold ctrl; key a; let ctrl; type 300; key enter; "
     "widget tool/draw; at "
     "axial 10 20; click left; hold ctrl; key z; let ctrl",
     R"({"tool": {"label": 300}, "label_counts": {"300": null}, "undo_steps": 0})"},
    {"label_65535_is_the_last",
     "section brush; widget tool/label 0.2; hold ctrl; key a; let ctrl; type 70000; key enter",
     R"({"tool": {"label": 65535}})"},
    {"label_above_255_beside_a_locked_one",
     "key b; at axial 10 20; click left; section labels; widget labels/lock/1; "
     "section brush; widget tool/label 0.2; hold ctrl; key a; let ctrl; type 65535; key enter; "
     "widget tool/draw; "
     "at axial 10 20; click left; at axial 40 20; click left",
     R"({"label_counts": {"1": 1, "65535": 1}})"},
    {"label_named",
     "key b; at axial 10 20; click left; section labels; widget labels/name; type Liver",
     R"({"label_names": {"1": "Liver"}, "label_counts": {"1": 1}, "tool": {"hand": "draw"}})"},
    {"label_named_in_one_step_and_undone",
     "key b; at axial 10 20; click left; section labels; widget labels/name; type Liver; key "
     "enter; at axial 40 20; hold ctrl; key z; let ctrl; idle",
     R"({"label_names": {"1": null}, "undo_steps": 1, "message": "undone: label names"})"},
    {"label_named_and_found_by_it",
     "key b; at axial 10 20; click left; section brush; widget tool/label 0.95; at axial 40 20; "
     "click left; section labels; widget labels/name; type spleen; widget labels/find; type SPL",
     R"({"widgets": {"labels/row/1": null}, "label_names": {"2": "spleen"}})"},
    {"label_in_its_largest_piece",
     "key b; at axial 10 20; click left; at axial 40 20; drag left 40 0; section labels; widget "
     "labels/largest",
     R"({"label_counts": {"1": 5}, "undo_steps": 3})"},
    {"label_in_its_largest_piece_and_back",
     "key b; at axial 10 20; click left; at axial 40 20; drag left 40 0; section labels; widget "
     "labels/largest; hold ctrl; key z; let ctrl",
     R"({"label_counts": {"1": 6}, "undo_steps": 2})"},
    {"label_split_into_its_pieces",
     "key b; at axial 10 20; click left; at axial 40 20; drag left 40 0; section labels; widget "
     "labels/more; widget labels/split",
     R"({"label_counts": {"1": 5, "2": 1}, "undo_steps": 3})"},
    {"locked_label_keeps_its_pieces",
     "key b; at axial 10 20; click left; at axial 40 20; drag left 40 0; section labels; widget "
     "labels/lock/1; widget labels/largest",
     R"({"label_counts": {"1": 6}, "undo_steps": 3})"},
    {"label_with_a_hole",
     "key b; key =; key =; key =; key =; key =; key =; key =; key =; at axial 10 20; click left; "
     "key e; key -; key -; key -; key -; key -; key -; key -; key -; click left; section labels",
     R"({"label_counts": {"1": 36}, "undo_steps": 2})"},
    {"label_with_its_hole_filled",
     "key b; key =; key =; key =; key =; key =; key =; key =; key =; at axial 10 20; click left; "
     "key e; key -; key -; key -; key -; key -; key -; key -; key -; click left; section labels; "
     "widget labels/fill",
     R"({"label_counts": {"1": 37}, "undo_steps": 3})"},
    {"label_without_a_hole_stays",
     "key b; at axial 10 20; click left; section labels; widget labels/fill; widget "
     "labels/largest",
     R"({"label_counts": {"1": 1}, "undo_steps": 1})"},
    {"label_counts_follow_undo",
     "key b; at axial 10 20; click left; hold ctrl; key z; let ctrl; section labels",
     R"({"label_counts": {}})"},
    {"middle_of_a_label",
     "key b; at axial 40 20; click left; section labels; widget "
     "labels/middle",
     R"({"crosshair_sample": [15, 13, 12]})"},

    {"crop_box", "section clips; widget clip/box", R"({"clips": [{}, {}, {}, {}, {}, {}]})"},
    {"crop_box_removed", "section clips; widget clip/box; widget clip/none", R"({"clips": []})"},
    {"clip_plane_added", "section clips; widget clip/add", R"({"clips": [{}]})"},
    {"clip_plane_removed", "section clips; widget clip/add; widget clip/remove",
     R"({"clips": []})"},
    {"clip_planes_undone_step_by_step",
     "section clips; widget clip/box; widget clip/none; hold ctrl; key z; let ctrl; idle",
     R"({"clips": [{}, {}, {}, {}, {}, {}], "undo_steps": 1, "redo_steps": 1})"},
    {"clip_plane_through_the_crosshair",
     "section clips; widget clip/box; widget clip/row/2; widget clip/here",
     R"({"clips": [{}, {}, {"point_mm": [4.3478260869565215, 4.3478260869565215,
                                         4.3478260869565215]}, {}, {}, {}]})"},
    {"browser_by_key", "hold ctrl; key o; let ctrl", R"({"browser_open": true})"},
    {"browser_closed_by_escape", "hold ctrl; key o; let ctrl; key escape",
     R"({"browser_open": false})"},
    {"browser_by_widget", "section files; widget file/open", R"({"browser_open": true})"},
    {"light", "section appearance; widget file/light", R"({"light": true})"},
    {"names_hidden", "section appearance; widget file/hide", R"({"names_hidden": true})"},
    {"text_scale", "section appearance; widget file/text; widget file/text/1.5; idle",
     R"({"text_scale": 1.5})"},
    {"steps_listed", "key x; at axial 10 20; click left; section steps",
     R"({"steps": ["cut on volume"]})"},
    {"step_back_by_the_list",
     "key x; at axial 10 20; click left; at axial 40 20; click left; section steps; widget "
     "file/step/0",
     R"({"undo_steps": 0, "redo_steps": 2})"},
    {"step_forth_by_the_list",
     "key x; at axial 10 20; click left; at axial 40 20; click left; section steps; widget "
     "file/step/0; widget file/step/1",
     R"({"undo_steps": 1, "redo_steps": 1})"},

    {"brush_in_the_labels_tab", "section labels; widget tool/draw",
     R"({"task": "segment", "tool": {"hand": "draw"}})"},
    {"outline_in_the_labels_tab", "section labels; widget labels/outline",
     R"({"overlays": {"outline_px": 0}})"},
    {"values_that_the_brush_is_confined_to", "section mask; widget labels/only",
     R"({"tool": {"only_values": [-160, 240]}})"},
    {"values_of_the_brush_are_dragged",
     "section mask; widget labels/only; at labels/to 20 8; drag left 100 0; widget "
     "labels/only",
     R"({"tool": {"only_values": null}})"},
    {"mask_area_is_chosen",
     "section mask; widget mask/area; idle; widget mask/area/inside_all_labels",
     R"({"mask": {"area": "inside all labels", "overwrite": "all labels"}})"},
    {"mask_overwrite_is_chosen",
     "section mask; widget mask/overwrite; idle; widget mask/overwrite/no_label",
     R"({"mask": {"area": "everywhere", "overwrite": "no label"}})"},
    {"brush_keeps_to_edges", "section brush; widget tool/edges", R"({"tool": {"alike": 3}})"},
    {"black_typed_above_white_keeps_the_width",
     "at window/black 12 8; double left; hold ctrl; key a; let ctrl; type 500; key enter",
     R"({"window": [500, 900], "message": ""})"},
    {"black_typed_below_white_leaves_white",
     "at window/black 12 8; double left; hold ctrl; key a; let ctrl; type 100; key enter",
     R"({"window": [100, 240]})"},
    {"white_typed_below_black_keeps_the_width",
     "at window/white 12 8; double left; hold ctrl; key a; let ctrl; type -500; key enter",
     R"({"window": [-900, -500], "message": ""})"},
    {"black_typed_beyond_the_limits_is_told",
     "at window/black 12 8; double left; hold ctrl; key a; let ctrl; type 9999; key enter",
     R"({"window": [3300, 3301], "message": "black 9999 is beyond -3212 .. 3301, the limits of this )"
     R"(volume: 3300 is taken"})"},
    {"an_end_that_stops_at_the_limits_is_told",
     "at window/black 12 8; double left; hold ctrl; key a; let ctrl; type 3100; key enter",
     R"({"window": [3100, 3301], "message": "white stops at 3301: the limits of this volume are )"
     R"(-3212 .. 3301"})"},
    {"values_of_the_brush_typed_past_each_other",
     "section mask; widget labels/only; at labels/from 12 8; double left; hold ctrl; key a; "
     "let ctrl; type 300; key enter",
     R"({"tool": {"only_values": [300, 700]}})"},
    {"figure_setup",
     "section figure; idle; widget figure/letters; widget figure/note; widget "
     "figure/color_bar",
     R"({"figure": {"panel": "3d", "size": [1600, 1200], "paper": "white", "letters": false,
                    "scale_bar": true, "color_bar": true, "note": true}})"},
    {"figure_as_typed",
     "section figure; idle; at figure/size 12 8; double left; "
     "hold ctrl; key a; let ctrl; type 800; key enter",
     R"({"figure": {"size": [800, 1200]}})"},
    {"figure_that_goes_round",
     "section figure; idle; at figure/pictures 12 8; double left; "
     "hold ctrl; key a; let ctrl; type 36; key enter",
     R"({"figure": {"pictures": 36}})"},
    {"a_script_writes_no_figure", "section figure; idle; widget figure/write",
     R"({"task": "export", "undo_steps": 0})"},

    {"transfer_of_the_hand", "section colours; widget transfer/felt",
     R"({"task": "look", "touch": {"opacity_points": 4}})"},
};

INSTANTIATE_TEST_SUITE_P(Panels, RecordedSession, ::testing::ValuesIn(kSessions), name_of_session);

// In the plot: value v lies at 247 (v + 1041) / 2171 pixels from its left, opacity o at 149 (1 - o)
// from its head.
class TransferPanel : public ViewerTest {
 protected:
    void SetUp() override {
        ViewerTest::SetUp();
        open("synthetic:phantom?size=24");
        show("colours");
        low_ = viewer().work().subject().range.min;
        high_ = viewer().work().subject().range.max;
    }
    TransferFunction function() {
        return viewer().work().session().scene().ray_cast.value().transfer;
    }
    glm::dvec2 place(double value, double opacity) {
        const Box box = viewer().interface().widgets().at("transfer/plot");
        return glm::dvec2(box.low_px) +
               glm::round(glm::dvec2((value - low_) / (high_ - low_) * (box.size_px.x - 1),
                                     (1.0 - opacity) * 149.0));
    }
    double value_at(glm::dvec2 px) {
        const Box box = viewer().interface().widgets().at("transfer/plot");
        return low_ + (px.x - box.low_px.x) / (box.size_px.x - 1) * (high_ - low_);
    }
    double low_ = 0, high_ = 0;
};

TEST_F(TransferPanel, AClickAddsADragMovesAndARightClickRemoves) {
    const TransferFunction before = function();
    const glm::dvec2 at = place(700.0, 0.9);
    move(at);
    button(true);
    ASSERT_EQ(function().opacities.size(), before.opacities.size() + 1);
    const auto chosen = state().transfer.chosen.value();
    ASSERT_EQ(chosen.of, TransferPoint::Of::opacity);
    EXPECT_NEAR(function().opacities[chosen.number].value, value_at(at), 1e-9);
    const glm::dvec2 to = at + glm::dvec2(4, 30);
    move(to);
    EXPECT_NEAR(function().opacities[chosen.number].value, value_at(to), 1e-9);
    EXPECT_NEAR(function().opacities[chosen.number].opacity,
                1.0 - (to.y - viewer().interface().widgets().at("transfer/plot").low_px.y) / 149.0,
                1e-9);
    button(false);
    move(to + glm::dvec2(30, 0)); // nothing is held any more
    EXPECT_NEAR(function().opacities[chosen.number].value, value_at(to), 1e-9);
    move(to);
    button(true, Button::right);
    button(false, Button::right);
    EXPECT_EQ(function(), before);
}

TEST_F(TransferPanel, ColoursLieOnTheBarBelow) {
    const TransferFunction before = function();
    const glm::dvec2 at = place(-700.0, 0.0) + glm::dvec2(0, 10);
    click(at);
    ASSERT_EQ(function().colors.size(), before.colors.size() + 1);
    EXPECT_EQ(state().transfer.chosen->of, TransferPoint::Of::color);
    EXPECT_NEAR(function().colors[state().transfer.chosen->number].value, value_at(at), 1e-9);
    click_widget("transfer/remove");
    EXPECT_EQ(function(), before);
}

TEST_F(TransferPanel, WhatTheHandFeelsFollows) {
    click_widget("transfer/felt");
    click(place(700.0, 0.9));
    const auto felt = viewer().work().session().parameters().opacity;
    const TransferFunction seen = function();
    ASSERT_LE(seen.opacities.size(), haptics::HapticTransfer::kMostPoints);
    ASSERT_EQ(felt.point_count, seen.opacities.size());
    for (uint32_t i = 0; i < felt.point_count; ++i) {
        EXPECT_NEAR(felt.values[i], seen.opacities[i].value, 1e-9);
        EXPECT_EQ(felt.forces_n[i], seen.opacities[i].opacity);
    }
}

class IsoPanel : public TransferPanel {
 protected:
    std::vector<double> shown() {
        std::vector<double> values;
        for (const IsoSurface& iso : viewer().work().session().scene().ray_cast->isos)
            values.push_back(iso.value);
        return values;
    }
};

// A mesh for print is of skin or bone by name, also where 3D shows neither.
TEST_F(IsoPanel, SkinAndBoneOfACtCanBePrinted) {
    ASSERT_FALSE(is_listed(state().iso.list, -300.0));
    show("print");
    click_widget("export/of");
    frame({});
    EXPECT_FALSE(viewer().interface().widgets().contains("export/of/2"));
    click_widget("export/of/1"); // after what the hand feels: bone
    EXPECT_EQ(state().exporting.made.iso, -300.0);
    EXPECT_FALSE(state().exporting.of_label);
}

TEST_F(IsoPanel, SkinAndBoneAreOneClickAndARowEach) {
    show("volume");
    click_widget("iso/skin_and_bone");
    const Scene& scene = viewer().work().session().scene();
    ASSERT_EQ(scene.ray_cast->mode, RayMode::iso);
    EXPECT_EQ(shown(), (std::vector<double>{-300.0, 300.0}));
    EXPECT_LT(scene.ray_cast->isos[0].opacity, 1.0);
    EXPECT_EQ(viewer().work().session().parameters().iso, 300.0) << "the hand feels bone, still";
    EXPECT_EQ(state().iso.list[0].name, "skin");

    frame({});
    click_widget("iso/row/0/shown");
    EXPECT_EQ(shown(), (std::vector<double>{300.0}));
    frame({});
    click_widget("iso/row/1/shown"); // one stays
    EXPECT_EQ(shown(), (std::vector<double>{300.0}));
    click_widget("iso/row/0/shown");
    EXPECT_EQ(shown(), (std::vector<double>{-300.0, 300.0}));
    click_widget("iso/row/1/remove");
    EXPECT_EQ(shown(), (std::vector<double>{-300.0}));
}

TEST_F(IsoPanel, TheNextClickInASliceAddsTheValueThere) {
    show("volume");
    click_widget("iso/skin_and_bone");
    frame({});
    click_widget("iso/point");
    const glm::dvec3 before = state().crosshair_mm;
    click(middle(Panel::axial) + glm::dvec2(11.0, 7.0));
    frame({});
    EXPECT_EQ(state().crosshair_mm, before);
    EXPECT_FALSE(state().iso.pointing);
    const auto value = viewer().work().subject().value_at(
        point_under(state(), grid(), Panel::axial, middle(Panel::axial) + glm::dvec2(11.0, 7.0)));
    ASSERT_TRUE(value);
    ASSERT_EQ(state().iso.list.size(), 3u);
    EXPECT_EQ(state().iso.list[2].surface.value, *value);
    EXPECT_EQ(shown().size(), 3u);
    click(middle(Panel::axial) + glm::dvec2(20.0, 7.0)); // the one after is the crosshair's again
    EXPECT_NE(state().crosshair_mm, before);
    EXPECT_EQ(shown().size(), 3u);
}

TEST_F(TransferPanel, AnIsoValueIsDraggedByItsGrip) {
    Scene scene = viewer().work().session().scene();
    scene.ray_cast = default_ray_cast(RayMode::iso, viewer().work().loaded());
    const double iso = scene.ray_cast->isos.front().value;
    viewer().work().session().show(std::move(scene));
    frame({});
    const glm::dvec2 grip = place(iso, 1.0) + glm::dvec2(0, 3), to = grip + glm::dvec2(25, 40);
    move(grip);
    button(true);
    move(to);
    button(false);
    EXPECT_NEAR(viewer().work().session().scene().ray_cast->isos.front().value, value_at(to), 1e-9);
    EXPECT_NEAR(viewer().work().session().parameters().iso, value_at(to), 1e-9);
    // Another one, and it is gone again.
    click(place(-200.0, 0.5));
    EXPECT_EQ(viewer().work().session().scene().ray_cast->isos.size(), 2u);
    click_widget("transfer/remove");
    EXPECT_EQ(viewer().work().session().scene().ray_cast->isos.size(), 1u);
}

// The bins of the plot hold every sample once.
TEST_F(TransferPanel, TheHistogramCountsEverySample) {
    uint64_t sum = 0;
    for (const uint64_t count : viewer().work().figures().known()->histogram)
        sum += count;
    EXPECT_EQ(sum, 24u * 24u * 24u);
}

} // namespace
} // namespace palpate::view
