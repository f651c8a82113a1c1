// Texts over the views of windows that have little room for them.

#include <gtest/gtest.h>
#include <imgui/imgui.h>

#include <algorithm>

#include "engine/volume/builder.h"
#include "tests/view/drawn_text.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class SmallWindow : public ViewerTest {
 protected:
    // A volume whose places have many digits: "S 537.8 mm, 57 of 112".
    void open_far_away(glm::uvec2 size_px) {
        Source source{open_synthetic("synthetic:ball?size=24")};
        source.scene.loaded.data.volume =
            make_volume(make_grid({122, 101, 112}, {3, 3, 3}, {-471.3, 271.3, 371.3}),
                        ScalarType::i16, [](glm::uvec3 i) { return 20.0 * i.x - 1000.0; });
        open_window(std::move(source), size_px);
    }
    size_t count(Panel panel, const char* begin) {
        const auto& texts = viewer().interface().texts();
        return static_cast<size_t>(
            std::count_if(texts.begin(), texts.end(), [&](const ViewText& one) {
                return one.panel == panel && one.text.starts_with(begin);
            }));
    }
    void expect_apart() {
        const auto& texts = viewer().interface().texts();
        for (size_t i = 0; i < texts.size(); ++i) {
            const Box view = box_of(state(), texts[i].panel).value(), box = texts[i].box;
            const glm::ivec2 high = box.low_px + box.size_px;
            EXPECT_TRUE(glm::all(glm::greaterThanEqual(box.low_px, view.low_px)) &&
                        glm::all(glm::lessThanEqual(high, view.low_px + view.size_px)))
                << texts[i].text;
            for (size_t j = 0; j < i; ++j) {
                const Box other = texts[j].box;
                EXPECT_FALSE(glm::all(glm::lessThan(box.low_px, other.low_px + other.size_px)) &&
                             glm::all(glm::lessThan(other.low_px, high)))
                    << texts[i].text << " covers " << texts[j].text;
            }
        }
    }
    // Expected in every size: which view it is, where its slice lies, and the sides of the patient.
    void expect_what_matters() {
        for (const auto& [panel, place, sides] :
             {std::tuple(Panel::axial, "S ", "RLAP"), std::tuple(Panel::coronal, "P ", "RLSI"),
              std::tuple(Panel::sagittal, "R ", "APSI")}) {
            EXPECT_EQ(count(panel, title_of(panel)), 1u);
            EXPECT_EQ(count(panel, place), 1u) << name_of(panel);
            for (const char* side = sides; *side; ++side)
                EXPECT_GE(count(panel, std::string(1, *side).c_str()), 1u) << *side;
        }
        EXPECT_EQ(count(Panel::volume, "3D"), 1u);
    }
};

TEST_F(SmallWindow, NoTextOfAViewCoversAnother) {
    for (const glm::uvec2 size :
         {kSmallestWindow_px, glm::uvec2(640, 480), glm::uvec2(800, 600), glm::uvec2(1280, 800)}) {
        SCOPED_TRACE(size.x);
        open_far_away(size);
        expect_apart();
        expect_what_matters();
    }
    for (const Panel panel : {Panel::axial, Panel::coronal, Panel::sagittal})
        EXPECT_EQ(count(panel, "W "), 1u); // where there is room
}

// Windows of several sizes, letters of several sizes, and all sections of the side panel open.
class Layouts : public ViewerTest {
 protected:
    template <class Each>
    void in_all(const Each& each) {
        Settings settings;
        for (const SectionEntry& section : sections())
            settings.sections.set(section.section, true);
        set_settings(settings);
        for (const glm::uvec2 size : {kSmallestWindow_px, glm::uvec2(1280, 720),
                                      glm::uvec2(1920, 1080), glm::uvec2(3840, 2160)})
            for (const double text_scale : {1.0, 1.5, 2.0}) {
                SCOPED_TRACE(fmt::format("{} x {} at {}", size.x, size.y, text_scale));
                open_window(Source{open_synthetic("synthetic:phantom?size=8")}, size, {}, {},
                            text_scale);
                each();
            }
    }
    Box box(const std::string& id) { return viewer().interface().widgets().at(id); }
    static bool overlap(const Box& a, const Box& b) {
        const glm::ivec2 low = glm::max(a.low_px, b.low_px),
                         high = glm::min(a.low_px + a.size_px, b.low_px + b.size_px);
        return low.x < high.x && low.y < high.y;
    }
    static bool lies_within(const Box& inner, const Box& outer) {
        return outer.holds(glm::dvec2(inner.low_px)) &&
               outer.holds(glm::dvec2(inner.low_px + inner.size_px - 1));
    }
};

// All buttons of the bars can be pressed.
TEST_F(Layouts, ButtonsOfTheBarsLieWithinThemAndApart) {
    in_all([&] {
        const Places places = places_of(state());
        std::vector<std::string> tools_ids{"bar/picture"},
            top_ids{"tool/undo", "tool/redo", "tool/save", "panel/toggle"};
        for (const Tool* tool : tools())
            if (tool->title)
                tools_ids.push_back(fmt::format("tool/{}", tool->name));
        for (const char* maybe : {"top/open", "task", "task/look", "task/segment", "task/measure",
                                  "task/drill", "task/export"})
            if (viewer().interface().widgets().count(maybe))
                top_ids.emplace_back(maybe);
        for (const auto& [ids, bar] :
             {std::pair(tools_ids, places.bar), std::pair(top_ids, places.top)})
            for (size_t i = 0; i < ids.size(); ++i) {
                EXPECT_TRUE(lies_within(box(ids[i]), bar)) << ids[i];
                EXPECT_GE(box(ids[i]).size_px.x, 18) << ids[i]; // a mouse meets it
                EXPECT_GE(box(ids[i]).size_px.y, 16) << ids[i];
                for (size_t j = 0; j < i; ++j)
                    EXPECT_FALSE(overlap(box(ids[i]), box(ids[j]))) << ids[i] << " " << ids[j];
            }
    });
}

// No widget of a task covers another one, or is cut off at the right, with its words.
TEST_F(Layouts, WidgetsOfThePanelLieWithinItAndApart) {
    in_all([&] {
        for (const WindowTask task : kTasks) {
            take_task(task);
            frame({});
            const Places places = places_of(state());
            // Double letters in the smallest window leave less than the narrowest panel.
            if (places.tools.size_px.x < kNarrowestPanel_px * state().text_scale)
                continue;
            std::vector<std::pair<std::string, Box>> all;
            for (const auto& [id, place] : viewer().interface().widgets())
                if (place.low_px.x >= places.tools.low_px.x && place.low_px.y > 0 &&
                    !lies_within(place, places.top) && !lies_within(place, places.status) &&
                    id != "panel/width" && (id == "segment/run" || !overlap(place, places.foot)))
                    all.emplace_back(id, place); // not those that are scrolled below the foot
            EXPECT_GE(all.size(), 5u) << name_of(task);
            const int right = places.tools.low_px.x + places.tools.size_px.x -
                              static_cast<int>(ImGui::GetStyle().ScrollbarSize);
            for (size_t i = 0; i < all.size(); ++i) {
                const auto& [id, place] = all[i];
                EXPECT_LE(place.low_px.x + place.size_px.x, right) << id;
                for (size_t j = 0; j < i; ++j)
                    EXPECT_FALSE(overlap(place, all[j].second)) << id << " " << all[j].first;
            }
        }
    });
}

// A row of the list of labels has its name whole, in lines of its own where it is long, and below
// it comes the next row.
TEST_F(Layouts, ALongNameOfALabelTakesMoreLines) {
    for (const double text_scale : {1.0, 1.5, 2.0}) {
        open_window(Source{open_synthetic("synthetic:phantom?size=8")}, {1280, 1400}, {}, {},
                    text_scale);
        note_name(1, "liver");
        note_name(2, "portal vein and splenic vein");
        note_name(3, "spleen");
        show("labels");
        const Box panel = places_of(state()).tools;
        for (int label = 1; label <= 3; ++label) {
            int end = panel.low_px.x;
            for (const char* part : {"visible", "color", "row", "lock"}) { // from left to right
                const Box one = box(fmt::format("labels/{}/{}", part, label));
                EXPECT_TRUE(lies_within(one, panel)) << part << label;
                EXPECT_GE(one.low_px.x, end) << part << label;
                end = one.low_px.x + one.size_px.x;
            }
        }
        const Box one = box("labels/row/1"), two = box("labels/row/2"), three = box("labels/row/3");
        EXPECT_GE(two.size_px.y, one.size_px.y + static_cast<int>(ImGui::GetTextLineHeight()));
        EXPECT_EQ(three.size_px.y, one.size_px.y);
        EXPECT_GE(three.low_px.y, two.low_px.y + two.size_px.y);
    }
}

// The button that does what a task is for can be pressed in a small window, without a turn of the
// wheel: as a new window is, and after a click on the head of its section, where it is folded.
TEST_F(Layouts, TheButtonOfATaskIsSeenWithoutScrolling) {
    for (const glm::uvec2 size : {glm::uvec2(1280, 800), glm::uvec2(1280, 720)})
        for (const auto& [task, section, id] :
             {std::tuple(WindowTask::segment, "", "segment/run"),
              {WindowTask::drill, "", "drill/start"},
              {WindowTask::measure, "", "measure/export"},
              {WindowTask::exporting, "", "labels/export"},
              {WindowTask::exporting, "print", "export/write"},
              {WindowTask::exporting, "figure", "figure/write"}}) {
            open_window(Source{open_synthetic("synthetic:phantom?size=8")}, size);
            for (uint32_t label = 1; label <= 40; ++label)
                note_name(label, "organ");
            take_task(task);
            if (*section)
                click_widget(std::string("section/") + section);
            frame({});
            const Places places = places_of(state());
            EXPECT_TRUE(lies_within(box(id), places.tools) || lies_within(box(id), places.foot))
                << id << " " << size.y;
        }
}

// The name of a setting stands at its left, at the panel's edge, and the sliders of a task are
// below each other.
TEST_F(Layouts, NamesOfSettingsStandAtTheirLeft) {
    Settings settings;
    for (const SectionEntry& section : sections())
        settings.sections.set(section.section, true);
    set_settings(settings);
    for (const double text_scale : {1.0, 1.5, 2.0}) {
        open_window(Source{open_synthetic("synthetic:phantom?size=8")}, {1920, 4000}, {}, {},
                    text_scale);
        for (const auto& [task, ids] :
             {std::pair(WindowTask::look,
                        std::vector{"labels/opacity", "slices/thickness", "slices/outline"}),
              {WindowTask::segment, {"tool/radius", "labels/opacity", "labels/outline"}},
              {WindowTask::drill, {"drill/burr", "touch/stiffness"}},
              {WindowTask::exporting, {"export/decimate", "export/scale", "export/wall"}}}) {
            take_task(task);
            frame({});
            const std::vector<DrawnLetter> letters = letters_of(viewer().interface().lists());
            const Box panel = places_of(state()).tools;
            for (const char* id : ids) {
                const Box track = box(id);
                EXPECT_EQ(track.low_px.x, box(ids.front()).low_px.x) << id;
                const auto names = [&](const DrawnLetter& one) {
                    return one.middle().x > static_cast<float>(panel.low_px.x) &&
                           one.high.x <= static_cast<float>(track.low_px.x) &&
                           track.holds({track.low_px.x, one.middle().y});
                };
                EXPECT_GE(std::count_if(letters.begin(), letters.end(), names), 4) << id;
            }
        }
    }
}

TEST_F(SmallWindow, NorDoLargeLetters) {
    open_far_away({1280, 800});
    show("appearance");
    click_widget("file/text");
    click_widget("file/text/2");
    frame({});
    frame({});
    ASSERT_EQ(state().text_scale, 2.0);
    expect_apart();
    expect_what_matters();
}

} // namespace
} // namespace palpate::view
