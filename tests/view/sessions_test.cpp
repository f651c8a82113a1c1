// Short sessions of a person: what is done in words, and what must hold then in the state that
// `palpate view --state` writes.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

// Steps are words with arguments, apart by semicolons:
//     at PANEL DX DY     the pointer, pixels from the panel's middle
//     press, release, click, double BUTTON
//     drag BUTTON DX DY  from where the pointer is
//     wheel N; key NAME; hold NAME; let NAME (a key, or shift, ctrl)
//     widget ID [SHARE]  a click on a widget, at a share of its width
//     resize W H; drop FILE; idle
struct Session {
    const char* name;
    const char* steps;
    const char* expected; // a part of the state, JSON; numbers within 1e-6
};

// The phantom: 24 samples of 200 / 23 mm (8.69..) each way about 0. The crosshair begins at sample
// 12 (11.5 rounded up), 4.347826 mm. In a window of 800 x 600 a view of 267 x 288 pixels shows 24
// samples and 4 % of them across 267 pixels.
const Session kSessions[] = {
    {"opens", "idle",
     R"({"layout": "four", "alone": "", "crosshair_sample": [12, 12, 12], "window": [-160, 240],
         "tool": {"hand": "crosshair", "radius_mm": 3, "label": 1}, "undo_steps": 0,
         "redo_steps": 0, "refusal": "", "stroke_is_down": false, "help_open": false})"},
    {"wheel_axial", "at axial 0 0; wheel 1", R"({"crosshair_sample": [12, 12, 13]})"},
    {"wheel_axial_back", "at axial 0 0; wheel -3", R"({"crosshair_sample": [12, 12, 9]})"},
    {"wheel_coronal", "at coronal 0 0; wheel 1", R"({"crosshair_sample": [12, 13, 12]})"},
    {"wheel_sagittal", "at sagittal 0 0; wheel 2", R"({"crosshair_sample": [10, 12, 12]})"},
    {"wheel_ends", "at axial 0 0; wheel 900", R"({"crosshair_sample": [12, 12, 23]})"},
    {"wheel_begins", "at sagittal 0 0; wheel 900", R"({"crosshair_sample": [0, 12, 12]})"},
    {"wheel_of_the_tools_pages_nothing", "at tools 0 0; wheel 3",
     R"({"crosshair_sample": [12, 12, 12]})"},
    {"up_key", "at coronal 0 0; key up", R"({"crosshair_sample": [12, 13, 12]})"},
    {"down_key", "at coronal 0 0; key down; key down", R"({"crosshair_sample": [12, 10, 12]})"},
    {"up_key_over_3d", "at 3d 0 0; key up", R"({"crosshair_sample": [12, 12, 12]})"},
    {"click_axial", "at axial 53 -32; click left", R"({"crosshair_sample": [16, 9, 12]})"},
    {"click_coronal", "at coronal -53 -32; click left", R"({"crosshair_sample": [7, 12, 14]})"},
    {"click_sagittal", "at sagittal 53 32; click left", R"({"crosshair_sample": [12, 16, 8]})"},
    {"crosshair_follows_a_drag", "at axial 0 30; drag left 53 -62",
     R"({"crosshair_sample": [16, 9, 12]})"},
    {"shift_and_a_move", "hold shift; at axial 53 -32; let shift",
     R"({"crosshair_sample": [16, 9, 12]})"},
    {"click_beyond_the_volume", "at axial 130 -140; click left",
     R"({"crosshair_sample": [23, 0, 12]})"},
    {"zoom_by_control_and_wheel", "at axial 0 0; hold ctrl; wheel 1; let ctrl",
     R"({"slices": {"axial": {"zoom": 1.15}, "coronal": {"zoom": 1}}})"},
    {"zoom_by_the_right_button", "at coronal 40 40; drag right 0 -10",
     R"({"slices": {"coronal": {"zoom": 1.1046221254112045}, "axial": {"zoom": 1}},
         "crosshair_sample": [12, 12, 12]})"},
    {"pan_leaves_the_crosshair", "at axial 10 10; drag middle 30 20; at axial 200 0",
     R"({"crosshair_sample": [12, 12, 12], "slices": {"axial": {"zoom": 1}}})"},
    {"pan_and_reset", "at axial 10 10; drag middle 30 20; key r",
     R"({"slices": {"axial": {"center_mm": [0, 0, 0]}}})"},
    {"window_by_drag", "at axial 0 30; hold w; drag left 0 -25; let w",
     R"({"window": [-120, 280], "crosshair_sample": [12, 12, 12]})"},
    {"window_width_by_drag", "at axial 0 30; hold w; drag left 250 0; let w",
     R"({"window": [-503.6563656918091, 583.6563656918091]})"},
    {"window_of_all_values", "key 2", R"({"window": [-1041, 1130]})"},
    {"window_and_back", "key 2; key 1", R"({"window": [-160, 240]})"},
    {"window_by_widget", "widget window/2", R"({"window": [-1041, 1130]})"},
    {"window_reset", "key 2; key r", R"({"window": [-160, 240]})"},
    {"maximise", "at coronal 0 30; double left", R"({"alone": "coronal"})"},
    {"maximise_and_back", "at coronal 0 30; double left; idle; double left", R"({"alone": ""})"},
    {"maximise_3d", "at 3d 0 0; double left", R"({"alone": "3d"})"},
    {"maximise_by_key", "at sagittal 0 0; key f", R"({"alone": "sagittal"})"},
    {"maximise_by_key_and_escape", "at sagittal 0 0; key f; key escape", R"({"alone": ""})"},
    {"layout_3d", "key l", R"({"layout": "3d"})"},
    {"layout_slice", "key l; key l", R"({"layout": "slice"})"},
    {"layout_round", "key l; key l; key l", R"({"layout": "four"})"},
    {"another_slice", "key l; key l; key tab; at coronal 0 0; wheel 1",
     R"({"crosshair_sample": [12, 13, 12]})"},
    {"help", "hold shift; key /; let shift", R"({"help_open": true})"},
    {"help_closed_by_escape", "hold shift; key /; let shift; key escape",
     R"({"help_open": false})"},
    {"tools_closed", "key t", R"({"tools_open": false, "panels": {"axial": [0, 0, 399, 288]}})"},
    {"tools_open_again", "key t; key t",
     R"({"tools_open": true, "panels": {"axial": [0, 0, 267, 288]}})"},
    {"tool_keys", "key b", R"({"tool": {"hand": "draw"}})"},
    {"tool_keys_erase", "key e", R"({"tool": {"hand": "erase"}})"},
    {"tool_keys_cut", "key x", R"({"tool": {"hand": "cut"}})"},
    {"tool_keys_crosshair", "key x; key c", R"({"tool": {"hand": "crosshair"}})"},
    {"tool_size", "key =; key =; key -", R"({"tool": {"radius_mm": 3.75}})"},
    {"tool_by_widget", "widget tool/erase", R"({"tool": {"hand": "erase"}})"},
    {"label_by_widget", "widget tool/label 0.8", R"({"tool": {"label": 2}})"},
    {"labels_hidden", "key s", R"({"labels": {"shown": false, "opacity": 0.4}})"},
    {"labels_faded", "key a; key a", R"({"labels": {"shown": true, "opacity": 0.2}})"},
    {"labels_not_below_0", "key a; key a; key a; key a; key a; key a",
     R"({"labels": {"opacity": 0}})"},
    {"labels_by_widget", "widget labels/shown", R"({"labels": {"shown": false}})"},
    {"draw", "key b; at axial 0 20; drag left 40 0",
     R"({"undo_steps": 2, "stroke_is_down": false})"},
    {"draw_and_undo", "key b; at axial 0 20; drag left 40 0; hold ctrl; key z; let ctrl",
     R"({"undo_steps": 1, "redo_steps": 1})"},
    {"draw_undo_redo", "key b; at axial 0 20; drag left 40 0; hold ctrl; key z; key y; let ctrl",
     R"({"undo_steps": 2, "redo_steps": 0})"},
    {"undo_by_widget", "key x; at axial 0 20; click left; widget tool/undo",
     R"({"undo_steps": 0, "redo_steps": 1})"},
    {"redo_by_widget", "key x; at axial 0 20; click left; widget tool/undo; widget tool/redo",
     R"({"undo_steps": 1, "redo_steps": 0})"},
    {"undo_of_nothing", "hold ctrl; key z; key y; let ctrl",
     R"({"undo_steps": 0, "redo_steps": 0})"},
    {"stroke_under_way", "key b; at axial 0 20; press left", R"({"stroke_is_down": true})"},
    {"stroke_cancelled", "key x; at axial 0 20; press left; key escape; release left",
     R"({"stroke_is_down": false, "undo_steps": 0})"},
    {"stroke_in_3d_is_a_turn", "key b; at 3d 0 0; press left", R"({"stroke_is_down": false})"},
    {"keys_wait_for_a_stroke", "key b; at axial 0 20; press left; key c; release left",
     R"({"tool": {"hand": "draw"}, "undo_steps": 2})"},
    {"view_from_above", "key home", R"({"camera": {"up": [0, -1, 0]}})"},
    {"view_from_the_left", "key page_down", R"({"camera": {"up": [0, 0, 1]}})"},
    {"resized", "resize 1000 700",
     R"({"size": [1000, 700], "panels": {"axial": [0, 0, 367, 338]}})"},
    {"resized_too_small", "resize 100 90", R"({"size": [480, 320]})"},
    {"dropped", "drop synthetic:ball?size=17", R"({"crosshair_sample": [8, 8, 8]})"},
    {"dropped_what_cannot_be_read", "drop nothing.nii", R"({"crosshair_sample": [12, 12, 12]})"},
    {"dropped_after_a_stroke", "key x; at axial 0 20; click left; drop synthetic:ball?size=16",
     R"({"undo_steps": 0})"},
};

// What is left out in `expected` may be anything.
void expect_part(const nlohmann::json& is, const nlohmann::json& expected,
                 const std::string& where) {
    if (expected.is_object()) {
        for (const auto& [key, value] : expected.items()) {
            ASSERT_TRUE(is.is_object() && is.contains(key)) << where << "/" << key;
            expect_part(is[key], value, where + "/" + key);
        }
    } else if (expected.is_array()) {
        ASSERT_EQ(is.size(), expected.size()) << where;
        for (size_t i = 0; i < expected.size(); ++i)
            expect_part(is[i], expected[i], where + "/" + std::to_string(i));
    } else if (expected.is_number()) {
        EXPECT_NEAR(is.get<double>(), expected.get<double>(), 1e-6) << where;
    } else {
        EXPECT_EQ(is, expected) << where;
    }
}

class RecordedSession : public ViewerTest, public ::testing::WithParamInterface<Session> {
 protected:
    void step(const std::string& text) {
        std::istringstream in(text);
        std::string word, first;
        in >> word;
        const auto number = [&] {
            double value = 0;
            in >> value;
            return value;
        };
        const auto button_of = [&] {
            in >> first;
            return first == "left"    ? Button::left
                   : first == "right" ? Button::right
                                      : Button::middle;
        };
        if (word == "at") {
            in >> first;
            glm::dvec2 from(0.0);
            if (first == "tools")
                from = glm::dvec2(places_of(state()).tools.low_px) + 20.0;
            for (const Panel panel : kPanels)
                if (first == name_of(panel))
                    from = middle(panel);
            const double x = number();
            pointer_ = from + glm::dvec2(x, number());
            move(pointer_, held_);
        } else if (word == "press") {
            button(true, button_of(), held_);
        } else if (word == "release") {
            button(false, button_of(), held_);
        } else if (word == "click") {
            const Button which = button_of();
            button(true, which, held_);
            button(false, which, held_);
        } else if (word == "double") {
            const Button which = button_of();
            for (const bool down : {true, false, true, false})
                frame({{.kind = Event::Kind::button, .button = which, .down = down}}, 0.05);
        } else if (word == "drag") {
            const Button which = button_of();
            button(true, which, held_);
            const double x = number();
            pointer_ += glm::dvec2(x, number());
            move(pointer_, held_);
            button(false, which, held_);
        } else if (word == "wheel") {
            frame({{.kind = Event::Kind::wheel, .modifiers = held_, .wheel = {0.0, number()}}});
        } else if (word == "key") {
            in >> first;
            key(first, held_);
        } else if (word == "hold" || word == "let") {
            in >> first;
            held_.shift = first == "shift" ? word == "hold" : held_.shift;
            held_.ctrl = first == "ctrl" ? word == "hold" : held_.ctrl;
            frame({{.kind = Event::Kind::key,
                    .modifiers = held_,
                    .down = word == "hold",
                    .key = first}});
        } else if (word == "widget") {
            in >> first;
            click_widget(first, number());
        } else if (word == "resize") {
            const auto x = static_cast<uint32_t>(number());
            frame({{.kind = Event::Kind::resize, .size_px = {x, static_cast<uint32_t>(number())}}});
        } else if (word == "drop") {
            in >> first;
            frame({{.kind = Event::Kind::drop, .paths = {first}}});
        } else {
            ASSERT_EQ(word, "idle");
            frame({}, 1.0);
        }
    }

 private:
    glm::dvec2 pointer_{0.0};
    Modifiers held_;
};

TEST_P(RecordedSession, EndsAsItMust) {
    open("synthetic:phantom?size=24");
    std::istringstream steps(GetParam().steps);
    for (std::string text; std::getline(steps, text, ';');)
        step(text);
    frame({});
    expect_part(nlohmann::json::parse(json_line(viewer().dump())),
                nlohmann::json::parse(GetParam().expected), "");
}

INSTANTIATE_TEST_SUITE_P(All, RecordedSession, ::testing::ValuesIn(kSessions),
                         [](const auto& each) { return std::string(each.param.name); });

} // namespace
} // namespace palpate::view
