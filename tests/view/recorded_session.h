#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/view/viewer_fixture.h"

// Short sessions of a person: what is done in words, and what must hold then in the state that
// `palpate view --state` writes.
namespace palpate::view {

// Steps are words with arguments, apart by semicolons:
//     at PANEL DX DY     the pointer, pixels from the panel's middle
//     at WIDGET X Y      the same, pixels from a widget's upper left corner
//     press, release, click, double BUTTON
//     drag BUTTON DX DY  from where the pointer is
//     wheel N; type TEXT; key NAME; hold NAME; let NAME (a key, or shift, ctrl)
//     widget ID [SHARE]  a click on a widget, at a share of its width
//     section NAME       its task is taken, and it is opened
//     resize W H (so much more than the bars take, with_bars()); drop FILE; close; idle
struct RecordedSteps {
    const char* name;
    const char* steps;
    const char* expected; // a part of the state, JSON; numbers within 1e-6
};

// Members that `expected` leaves out may be anything.
inline void expect_part(const nlohmann::json& is, const nlohmann::json& expected,
                        const std::string& where) {
    if (expected.is_object()) {
        for (const auto& [key, value] : expected.items()) {
            if (value.is_null() && is.is_object() && !is.contains(key))
                continue; // null: is not there
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

class RecordedSession : public ViewerTest, public ::testing::WithParamInterface<RecordedSteps> {
 public:
    // A program that wants something else of sessions does this with each.
    static inline void (*instead_of_end)(RecordedSession&) = nullptr;

 protected:
    friend class MemorySession;
    void expect_end() {
        if (instead_of_end)
            return instead_of_end(*this);
        open("synthetic:phantom?size=24");
        std::istringstream steps(GetParam().steps);
        for (std::string text; std::getline(steps, text, ';');)
            step(text);
        frame({});
        expect_part(nlohmann::json::parse(json_line(viewer().dump())),
                    nlohmann::json::parse(GetParam().expected), "");
    }

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
            const auto& widgets = viewer().interface().widgets();
            if (const auto widget = widgets.find(first); widget != widgets.end())
                from = glm::dvec2(widget->second.low_px);
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
        } else if (word == "type") {
            in >> first;
            frame({{.kind = Event::Kind::text, .text = first}});
            frame({});
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
        } else if (word == "section") {
            in >> first;
            show(first);
        } else if (word == "resize") {
            const auto x = static_cast<uint32_t>(number());
            const glm::uvec2 size(x, static_cast<uint32_t>(number()));
            frame({{.kind = Event::Kind::resize, .size_px = with_bars(size)}});
        } else if (word == "drop") {
            in >> first;
            frame({{.kind = Event::Kind::drop, .paths = {first}}});
        } else if (word == "close") {
            frame({{.kind = Event::Kind::close}});
        } else {
            ASSERT_EQ(word, "idle");
            frame({}, 1.0);
        }
    }

 private:
    glm::dvec2 pointer_{0.0};
    Modifiers held_;
};

inline std::string name_of_session(const ::testing::TestParamInfo<RecordedSteps>& each) {
    return each.param.name;
}

} // namespace palpate::view
