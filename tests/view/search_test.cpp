// The search box, and tooltips: what is found, what it does, and that tables and panels agree.

#include <algorithm>
#include <set>

#include "apps/view/panels/search.h"
#include "apps/view/panels/widget_help.h"
#include "apps/view/window/keys.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class SearchTest : public ViewerTest {
 protected:
    void ask(const std::string& text) {
        key("k", {.ctrl = true});
        frame({});
        frame({{.kind = Event::Kind::text, .text = text}});
        frame({});
    }
    // By name, with Enter.
    void find(const std::string& text) {
        ask(text);
        key("enter");
        for (int i = 0; i < 4; ++i) // the panel is drawn, scrolled to the widget, and drawn again
            frame({});
    }
    const haptics::AlgorithmEntry* algorithm() {
        return haptics::find_algorithm(viewer().work().hand().touch().options().algorithm);
    }
    bool has_widget(const std::string& id) { return viewer().interface().widgets().count(id) > 0; }
};

std::string first_found(const Subject& subject, const std::string& text) {
    const std::vector<Findable> all = findables(subject, nullptr);
    const std::vector<size_t> places = found(all, text);
    return places.empty() ? "" : all[places.front()].title;
}

TEST_F(SearchTest, AToolIsTakenIntoTheHand) {
    open("synthetic:phantom?size=24");
    find("ruler");
    EXPECT_FALSE(state().search_open);
    find("draw");
    EXPECT_EQ(state().tool, &kDrawTool);
}

TEST_F(SearchTest, AKeyIsPressed) {
    open("synthetic:phantom?size=24");
    find("3D from the right");
    EXPECT_GT(glm::dot(state().camera.eye_mm - state().camera.target_mm,
                       view_direction("right").value().towards),
              0.0);
    find("show or hide labels");
    EXPECT_FALSE(state().labels_shown);
}

TEST_F(SearchTest, AWindowIsTaken) {
    open("synthetic:phantom?size=24");
    const Subject& subject = viewer().work().subject();
    ASSERT_GT(subject.window_names.size(), 1u);
    find("window: " + subject.window_names[1]);
    EXPECT_EQ(state().window, subject.windows[1]);
}

TEST_F(SearchTest, AMethodIsChosenWhereItIsRun) {
    open("synthetic:phantom?size=24");
    find("random-walker");
    EXPECT_EQ(state().segmenting.method, "random-walker");
    EXPECT_TRUE(has_widget("segment/run"));
}

// A setting that was found is scrolled to once: the wheel then moves the panel freely.
TEST_F(SearchTest, TheWheelScrollsAwayFromWhatWasFound) {
    open("synthetic:phantom?size=24", {1280, 720});
    find("stereo");
    find("both eyes in 3D");
    const auto top = [&] { return viewer().interface().widgets().at("stereo/on").low_px.y; };
    const int found_at = top();
    const Box panel = places_of(state()).tools;
    ASSERT_TRUE(panel.holds({panel.low_px.x + 1, found_at}));
    for (int i = 0; i < 3; ++i)
        frame({});
    EXPECT_EQ(top(), found_at);
    move(glm::dvec2(panel.low_px + panel.size_px / 2));
    for (int i = 1; i <= 3; ++i) {
        const int before = top();
        frame({{.kind = Event::Kind::wheel, .wheel = {0.0, 1.0}}});
        frame({});
        const int after = top();
        EXPECT_GT(after, before) << "the panel moves down by a notch, " << i;
        frame({});
        frame({});
        EXPECT_EQ(top(), after) << "and stays, " << i;
    }
}

// The first Enter shows the widget, and the second one does what a click on it does.
TEST_F(SearchTest, EnterTwicePresses) {
    open("synthetic:phantom?size=24", {1280, 720});
    find("crop box");
    EXPECT_TRUE(state().notes.clip_planes.empty());
    key("enter");
    frame({});
    EXPECT_EQ(state().notes.clip_planes.size(), 6u);
    key("enter"); // and no more than once
    frame({});
    EXPECT_EQ(state().notes.clip_planes.size(), 6u);
    find("light colours");
    key("enter");
    frame({});
    EXPECT_TRUE(state().light);
}

TEST_F(SearchTest, OneEscapeClosesIt) {
    open("synthetic:phantom?size=24");
    ask("dra");
    EXPECT_TRUE(state().search_open);
    key("escape");
    EXPECT_FALSE(state().search_open);
    EXPECT_NE(state().tool, &kDrawTool);
}

TEST_F(SearchTest, LettersAreForItAlone) {
    open("synthetic:phantom?size=24");
    key("k", {.ctrl = true});
    frame({});
    key("x"); // that would take the tool that cuts
    EXPECT_EQ(state().tool, &kCrosshairTool);
    EXPECT_TRUE(state().search_open);
}

TEST_F(SearchTest, ArrowsChooseAmongRows) {
    open("synthetic:phantom?size=24");
    const std::vector<Findable> all = findables(viewer().work().subject(), algorithm());
    const std::vector<size_t> places = found(all, "3d from");
    ASSERT_EQ(places.size(), 6u);
    ask("3d from");
    for (int i = 0; i < 9; ++i)
        key("down"); // to the last
    key("up");
    key("enter");
    EXPECT_EQ(all[places[4]].title, "3D from the left");
    EXPECT_GT(glm::dot(state().camera.eye_mm - state().camera.target_mm,
                       view_direction("left").value().towards),
              0.0);
}

TEST_F(SearchTest, AClickOnARowChoosesIt) {
    open("synthetic:phantom?size=24");
    ask("erase");
    const auto& widgets = viewer().interface().widgets();
    ASSERT_TRUE(widgets.count("search/row/0"));
    const Box row = widgets.at("search/row/0");
    click(glm::dvec2(row.low_px) + 0.5 * glm::dvec2(row.size_px));
    EXPECT_EQ(state().tool, &kEraseTool);
    EXPECT_FALSE(state().search_open);
}

TEST_F(SearchTest, AClickBesideItClosesIt) {
    open("synthetic:phantom?size=24");
    ask("erase");
    click(middle(Panel::coronal) + glm::dvec2(0.0, 30.0));
    EXPECT_FALSE(state().search_open);
    EXPECT_NE(state().tool, &kEraseTool);
}

// Each setting that is offered leads to its widget, which is there and can be seen.
TEST_F(SearchTest, EachSettingIsShown) {
    open("synthetic:phantom?size=24", {1280, 800});
    const std::vector<Findable> all = findables(viewer().work().subject(), algorithm());
    for (const Findable& one : all) {
        if (one.kind != "setting")
            continue;
        find(one.title);
        ASSERT_TRUE(has_widget(one.widget)) << one.title << ": " << one.widget;
        const Box box = viewer().interface().widgets().at(one.widget);
        EXPECT_GE(box.low_px.y, 0) << one.title;
        EXPECT_LE(box.low_px.y + box.size_px.y, static_cast<int>(state().size_px.y)) << one.title;
    }
}

// By the words of other programs, people find what ours is called. The answer is one of ours that
// does what they look for; which of several comes first is the rule of found().
TEST_F(SearchTest, WordsOfOtherProgramsFindOurs) {
    open("synthetic:phantom?size=24");
    const Subject& subject = viewer().work().subject();
    const std::pair<const char*, const char*> words[] = {
        {"brush", "brush size"},
        {"threshold paint", "mask: editable values"},
        {"editable area", "mask: editable area"},
        {"slab", "thickness of slices"},
        {"crop", "crop box"},
        {"roi crop", "crop box"},
        {"cut plane", "add a clip plane"},
        {"screenshot", "picture of the window"},
        {"dark", "light colours"},
        {"font", "size of letters"},
        {"fusion", "volume over slices"},
        {"PET", "volume over slices"},
        {"island", "label: largest piece"},
        {"live wire", "live-wire"},
        {"lasso", "outline that cuts"},
        {"csv", "measures to a table"},
        {"distance", "ruler"},
        {"length", "ruler"},
        {"volume", "volume of a label in ml"},
        {"ml", "volume of a label in ml"},
        {"dicom seg", "file of exported labels"},
        {"rtstruct", "file of exported labels"},
        {"transfer function", "curve of opacity and colour"},
        {"orthographic", "orthographic 3D"},
        {"anonymous", "hide names"},
        {"dicom", "open a file, a folder or a project"},
        {"add segment", "new label"},
        {"rename", "name of the label"},
        {"transparency", "opacity of labels"},
        {"undo", "undo"},
        {"solo", "see one label"},
        {"mip", "mode of the volume in 3D"},
        {"stereoscopic", "both eyes in 3D"},
        {"UNDO", "undo"},
        {"quux", ""}};
    for (const auto& [typed, title] : words)
        EXPECT_EQ(first_found(subject, typed), title) << typed;
}

TEST_F(SearchTest, EachTitleFindsItselfFirst) {
    open("synthetic:phantom?size=24");
    const std::vector<Findable> all = findables(viewer().work().subject(), algorithm());
    for (const Findable& one : all) {
        const std::vector<size_t> places = found(all, one.title);
        ASSERT_FALSE(places.empty()) << one.title;
        EXPECT_EQ(all[places.front()].title, one.title);
    }
}

// A widget of the panels has a tooltip of the table, or is one of those that have their own or
// none: rows of lists, whose text says what they are.
TEST_F(SearchTest, EachWidgetHasAnExplanation) {
    open("synthetic:phantom?size=24", {1280, 2000});
    const char* const lists[] = {
        "tool/",           "window/",      "preset/",         "file/recent/",
        "file/step/",      "figure/",      "segment/method/", "segment/give/",
        "status/",         "labels/lock/", "labels/row/",     "labels/color/",
        "labels/visible/", "task/",        "search/",         "bar/",
        "section/",        "top/",         "panel/",          "touch/plot/",
        "iso/row/"};
    std::set<std::string> unexplained;
    const std::vector<Findable> all = findables(viewer().work().subject(), algorithm());
    for (const Findable& at : all) {
        if (at.kind != "setting")
            continue;
        find(at.title);
        for (const auto& [id, box] : viewer().interface().widgets())
            if (!help_of(id) && !id.ends_with("/field") && // its slider's is there
                std::none_of(std::begin(lists), std::end(lists),
                             [&](const char* list) { return id.starts_with(list); }))
                unexplained.insert(id);
    }
    // Those whose own tooltip or text says it.
    for (const char* id : {"file/figure", "file/zero_hu", "labels/export", "segment/how"})
        unexplained.erase(id);
    for (const auto& setting : haptics::kTouchSettings)
        if (setting.use.slider.label)
            unexplained.erase(fmt::format("touch/{}", setting.use.slider.label));
    EXPECT_TRUE(unexplained.empty()) << ::testing::PrintToString(unexplained);
}

TEST(WidgetHelpTest, EachIdAndTitleStandsOnce) {
    std::set<std::string> ids, titles;
    for (const WidgetHelp& one : widget_help()) {
        EXPECT_TRUE(ids.insert(one.id).second) << one.id;
        EXPECT_TRUE(!one.always || titles.insert(one.title).second) << one.title;
    }
}

} // namespace
} // namespace palpate::view
