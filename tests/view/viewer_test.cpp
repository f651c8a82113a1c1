// The program without its window: documents, widgets, pictures.

#include <gtest/gtest.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "apps/view/panels/widgets.h"
#include "engine/image/png.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "tests/support/paths.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

// ViewerTest takes over 5 s of a processor: whole windows are drawn at full quality by a CPU driver
// under validation.
TEST_F(ViewerTest, WidgetsDoWhatTheirNamesSay) {
    open("synthetic:phantom?size=40", {800, 700});
    click_widget("tool/draw");
    EXPECT_EQ(state().tool, &kDrawTool);
    click_widget("tool/cut");
    EXPECT_EQ(state().tool, &kCutTool);
    click_widget("tool/crosshair");
    EXPECT_EQ(state().tool, &kCrosshairTool);
    const bool shown = state().labels_shown;
    click_widget("labels/shown");
    EXPECT_NE(state().labels_shown, shown);
    click_widget("volume/slices");
    EXPECT_TRUE(state().slices_in_volume);
    click_widget("volume/orthographic");
    EXPECT_EQ(state().camera.projection, Projection::orthographic);
    click_widget("layout/notes");
    EXPECT_FALSE(state().notes_shown);
    // A click in a view that lies beside the widgets still reaches the view.
    const glm::dvec3 before = state().crosshair_mm;
    click(middle(Panel::axial) + glm::dvec2(50, 30));
    EXPECT_NE(state().crosshair_mm, before);
}

// A ball of the brush: exactly the samples that lie in it.
TEST_F(ViewerTest, AClickOfTheBrushDrawsTheSamplesOfItsBall) {
    open();
    ASSERT_EQ(volume(Work::kLabels)->range().max, 0.0f); // there from the start, as no edit
    key("b");
    for (int i = 0; i < 7; ++i)
        key("=");
    const double radius = state().radius_mm;
    const glm::dvec2 at = middle(Panel::coronal) + glm::dvec2(21, -13);
    const glm::dvec3 center = point_under(state(), grid(), Panel::coronal, at);
    click(at);
    const Volume* labels = volume(Work::kLabels);
    ASSERT_NE(labels, nullptr);
    size_t inside = 0;
    for (uint32_t z = 0; z < 40; ++z)
        for (uint32_t y = 0; y < 40; ++y)
            for (uint32_t x = 0; x < 40; ++x) {
                const glm::uvec3 index(x, y, z);
                const double distance =
                    glm::distance(world_point(grid(), glm::dvec3(index)), center);
                if (std::abs(distance - radius) < 1e-9)
                    continue;
                inside += distance < radius;
                ASSERT_EQ(labels->value(index), distance < radius ? 1.0f : 0.0f);
            }
    EXPECT_GT(inside, 10u);
    const std::string drawn = viewer().dump()["document"]["labels"].string;
    EXPECT_EQ(drawn, fmt::format("{:016x}", content_hash(*labels)));
}

TEST_F(ViewerTest, UndoAndRedoGiveTheBytesBack) {
    open();
    const auto documents = [&] { return viewer().dump()["document"]; };
    const auto begin = documents();
    key("x");
    const glm::dvec2 at = middle(Panel::axial);
    move(at);
    button(true);
    move(at + glm::dvec2(30, 0));
    move(at + glm::dvec2(30, 40));
    button(false);
    const auto cut = documents();
    EXPECT_NE(cut, begin);
    key("z", {.ctrl = true});
    EXPECT_EQ(documents(), begin);
    key("y", {.ctrl = true});
    EXPECT_EQ(documents(), cut);
    click_widget("tool/undo");
    EXPECT_EQ(documents(), begin);
    move(at); // Esc in the middle of a stroke leaves nothing of it
    button(true);
    move(at + glm::dvec2(30, 0));
    key("escape");
    button(false);
    EXPECT_EQ(documents(), begin);
}

TEST_F(ViewerTest, TheEraserTakesLabelsAwayAndLeavesGreyValues) {
    open();
    const glm::dvec2 at = middle(Panel::sagittal);
    key("b");
    click(at);
    const auto grey = viewer().dump()["document"]["volume"];
    ASSERT_EQ(volume(Work::kLabels)->range().max, 1.0f);
    key("e");
    for (int i = 0; i < 5; ++i)
        key("=");
    click(at);
    EXPECT_EQ(volume(Work::kLabels)->range().max, 0.0f);
    EXPECT_EQ(viewer().dump()["document"]["volume"], grey);
}

// The views in a picture of the window are what the renderer draws of their scenes.
TEST_F(ViewerTest, ThePictureOfTheWindowHoldsThePicturesOfTheViews) {
    open();
    key("n");
    key("h");                     // no marks
    click_widget("layout/views"); // an open list lies over the views, and is closed by Esc
    key("escape");
    click(middle(Panel::volume));
    const Image shot = viewer().shot().value();
    EXPECT_EQ(shot.size_px, with_bars({800, 600}));
    Renderer renderer(device());
    for (const Panel panel : kPanels) {
        const Scene scene =
            scene_of(state(), grid(), panel, viewer().work().session().scene(), false);
        const Frame frame =
            renderer.render(scene, {viewer().work().loaded().data.volume, {}, {}}).value();
        const Box box = box_of(state(), panel).value();
        float most = 0.0f;
        for (int y = 0; y < box.size_px.y; ++y)
            for (int x = 0; x < box.size_px.x; ++x)
                for (size_t c = 0; c < 3; ++c) {
                    const float is = shot.at(static_cast<uint32_t>(box.low_px.x + x),
                                             static_cast<uint32_t>(box.low_px.y + y), c);
                    const float expected = std::clamp(
                        frame.eyes[0].at(static_cast<uint32_t>(x), static_cast<uint32_t>(y), c),
                        0.0f, 1.0f);
                    most = std::max(most, std::abs(is - expected));
                }
        // Rounded to 8 bits, and once more where a texel is filtered at its middle.
        EXPECT_LE(most, 1.01f / 255.0f) << name_of(panel);
    }
}

TEST_F(ViewerTest, AStrokeAppearsInSlicesAndInTheVolume) {
    open();
    key("h");
    // On the forehead, which the eye sees.
    const glm::dvec2 at =
        glm::round(pixel_of(state(), grid(), Panel::axial, glm::dvec3(0.0, -70.0, 0.0)).value());
    click(at);
    key("x");
    for (int i = 0; i < 10; ++i)
        key("=");
    move(glm::dvec2(1.0)); // no tool is drawn
    const Image before = viewer().shot().value();
    click(at);
    move(glm::dvec2(1.0));
    const Image after_cut = viewer().shot().value();
    for (const Panel panel : kPanels) {
        const Box box = box_of(state(), panel).value();
        size_t changed = 0;
        for (int y = 0; y < box.size_px.y; ++y)
            for (int x = 0; x < box.size_px.x; ++x) {
                const glm::uvec2 p(box.low_px + glm::ivec2(x, y));
                changed += std::abs(before.at(p.x, p.y, 0) - after_cut.at(p.x, p.y, 0)) > 0.1f;
            }
        EXPECT_GT(changed, 200u) << name_of(panel);
    }
}

// A label that is hidden is not drawn, and the grey values under it are.
TEST_F(ViewerTest, HiddenLabelsTakeNothingAwayIn3D) {
    set_beside([this](const std::string&, bool) {
        return Result<LoadedVolume>(
            LoadedVolume{make_volume(grid(), ScalarType::u8, [](glm::uvec3) { return 1.0; }),
                         {},
                         {},
                         {},
                         {},
                         {}});
    });
    open();
    key("h");
    move(glm::dvec2(1.0));
    const Image before = viewer().shot().value();
    show("labels");
    click_widget("labels/open");
    frame({});
    frame({{.kind = Event::Kind::text, .text = "/map.nii"}});
    frame({});
    key("enter");
    frame({});
    const auto mean_difference = [&] { // of the 3D view's colours
        move(glm::dvec2(1.0));
        frame({}, 60.0); // messages have been read
        const Image after = viewer().shot().value();
        const Box box = box_of(state(), Panel::volume).value();
        double sum = 0.0;
        for (int y = 0; y < box.size_px.y; ++y)
            for (int x = 0; x < box.size_px.x; ++x)
                for (size_t c = 0; c < 3; ++c) {
                    const glm::uvec2 p(box.low_px + glm::ivec2(x, y));
                    sum += std::abs(double{before.at(p.x, p.y, c)} - after.at(p.x, p.y, c));
                }
        return sum / (3.0 * box.size_px.x * box.size_px.y);
    };
    ASSERT_TRUE(viewer().work().has_labels());
    EXPECT_GT(mean_difference(), 0.02); // the label's surface hides all of the volume
    click_widget("labels/visible/1");
    frame({});
    // Rays that end at surfaces are another kernel: half a step of a byte, for each colour.
    EXPECT_LT(mean_difference(), 0.5 / 255.0);
}

TEST_F(ViewerTest, TheSameInputGivesTheSamePictureAndDocument) {
    std::vector<std::vector<float>> pictures;
    std::vector<std::string> states;
    for (int i = 0; i < 2; ++i) {
        open();
        key("b");
        const glm::dvec2 at = middle(Panel::axial);
        move(at);
        button(true);
        move(at + glm::dvec2(40, 10));
        button(false);
        states.push_back(json_line(viewer().dump()));
        pictures.push_back(viewer().shot().value().samples);
    }
    EXPECT_EQ(states[0], states[1]);
    EXPECT_EQ(pictures[0], pictures[1]);
}

TEST_F(ViewerTest, ACtThatIsStoredWithAnOffsetIsTold) {
    open("synthetic:ball?size=24"); // values 0 .. 1000
    EXPECT_FALSE(viewer().interface().widgets().count("file/zero_hu"));
    Source source{open_synthetic("synthetic:ball?size=24")};
    source.scene.loaded.modality = "CT";
    source.scene.loaded.data.volume =
        make_volume(make_grid({24, 24, 24}, {1, 1, 1}), ScalarType::f32,
                    [](glm::uvec3 i) { return 900.0 + 20.0 * i.x; });
    open_scene(std::move(source), {800, 600});
    EXPECT_EQ(viewer().work().zero_hu(), 1024.0);
    EXPECT_TRUE(viewer().interface().widgets().count("file/zero_hu"));
}

// The values here run from air to bone at least, and no file says what they are. The default window
// of two values shows all of them, and of equal ones one is listed.
// A key gives the same window, whether or not a file says that the volume is a CT.
TEST_F(ViewerTest, WindowsOfACtAreOfferedWhereValuesMayBeHu) {
    const auto names_of = [&](double low, double high, const char* modality) {
        Source source{open_synthetic("synthetic:ball?size=24")};
        source.scene.loaded.modality = modality;
        source.scene.loaded.data.volume =
            make_volume(make_grid({24, 24, 24}, {1, 1, 1}), ScalarType::f32,
                        [=](glm::uvec3 i) { return i.x < 12 ? low : high; });
        open_scene(std::move(source), {800, 600});
        return viewer().work().subject().window_names;
    };
    const std::vector<std::string> of_ct{"soft tissue", "lung",  "liver",
                                         "bone",        "brain", "all values"};
    EXPECT_EQ(names_of(-1000, 700, "CT"), of_ct);
    EXPECT_EQ(names_of(-1000, 700, ""), of_ct);
    EXPECT_EQ(names_of(-1000, 700, "MR").size(), 1u);
    EXPECT_EQ(names_of(-1000, 200, "").size(), 2u);
    EXPECT_EQ(names_of(0, 3000, "").size(), 1u);
    EXPECT_EQ(names_of(0, 3000, "CT").size(), 6u);
}

// Two rows with one window would both look chosen.
TEST_F(ViewerTest, NoWindowIsListedTwice) {
    Source source{open_synthetic("synthetic:ball?size=24")};
    source.scene.loaded.modality.clear();
    // A fifth air, the rest soft tissue and some bone: values like those of a CT, whose default is
    // the window of soft tissue.
    source.scene.loaded.data.volume =
        make_volume(make_grid({24, 24, 24}, {1, 1, 1}), ScalarType::f32, [](glm::uvec3 i) {
            return i.x < 5    ? -1000.0
                   : i.x < 22 ? -60.0 + 5.0 * ((i.x + 2 * i.y + 3 * i.z) % 30)
                              : 700.0 + 20.0 * (i.y % 20);
        });
    open_scene(std::move(source), {800, 600});
    const Subject& subject = viewer().work().subject();
    EXPECT_EQ(subject.window_names.front(), "soft tissue");
    for (size_t i = 0; i < subject.windows.size(); ++i)
        for (size_t j = 0; j < i; ++j)
            EXPECT_NE(subject.windows[i], subject.windows[j]) << subject.window_names[i];
}

TEST(SeriesPreviews, APreviewIsFittedByItsSizeInMm) {
    // 40 mm across and 20 mm down: values rise from left to right.
    const Grid grid = make_grid({20, 40, 3}, {2.0, 0.5, 1.0});
    const Volume volume =
        make_volume(grid, ScalarType::f32, [](glm::uvec3 i) { return double(i.x); });
    const std::vector<std::byte> rgba = preview_of({volume, {}, {}, "MR", {}, {}}, 40);
    ASSERT_EQ(rgba.size(), size_t{4} * 40 * 40);
    const auto grey = [&](size_t x, size_t y) { return int(rgba[4 * (40 * y + x)]); };
    EXPECT_EQ(grey(39, 9), 0); // beyond it
    EXPECT_EQ(grey(39, 30), 0);
    EXPECT_EQ(grey(0, 20), 0);
    EXPECT_EQ(grey(39, 20), 255);
    EXPECT_NEAR(grey(20, 20), 255.0 * 10 / 19, 1.0);
}

// Whatever the order of the samples: the brightest corner is the patient's right front.
TEST(SeriesPreviews, APreviewLiesAsTheAxialViewDoes) {
    const glm::dmat3 lps(1.0), ras(-1, 0, 0, 0, -1, 0, 0, 0, 1),
        turned(0, 0, -1, -1, 0, 0, 0, 1, 0);
    for (const glm::dmat3& axes : {lps, ras, turned}) {
        Grid grid = make_grid({16, 16, 16}, {1, 1, 1});
        grid.world_from_index = glm::dmat4(axes);
        const glm::dvec3 middle = axes * glm::dvec3(7.5);
        const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            const glm::dvec3 to = axes * glm::dvec3(i) - middle; // left, back, up
            return to.x < 0.0 && to.y < 0.0 ? 100.0 : 0.0;
        });
        const std::vector<std::byte> rgba = preview_of({volume, {}, {}, "MR", {}, {}}, 16);
        const auto grey = [&](size_t x, size_t y) { return int(rgba[4 * (16 * y + x)]); };
        EXPECT_EQ(grey(2, 2), 255);
        EXPECT_EQ(grey(13, 2), 0);
        EXPECT_EQ(grey(2, 13), 0);
        EXPECT_EQ(grey(13, 13), 0);
    }
}

// The chooser pictures each series, says where there is none, and opens the one that is clicked.
TEST_F(ViewerTest, SeriesOfAFolderHavePictures) {
    int read = 0;
    set_preview(
        [&](const std::string&, uint32_t series, const std::stop_token&) -> Result<LoadedVolume> {
            ++read;
            if (series == 2)
                return fail("no picture");
            return LoadedVolume{
                open_synthetic("synthetic:ball?size=24").loaded.data.volume, {}, {}, "", {}, {}};
        });
    Source source{open_synthetic("synthetic:ball?size=24")};
    source.scene.loaded.series = {{1, 2, "CT", "head", "9 images of 8 x 8", "1.2.3", true},
                                  {2, 2, "CT", "leg", "7 images of 8 x 8", "1.2.4", false}};
    open_scene(std::move(source), {800, 600});
    show("files");
    EXPECT_EQ(read, 0); // the chooser is closed
    click_widget("file/pictures");
    frame({});
    ASSERT_TRUE(state().series_open);
    EXPECT_EQ(read, 2);
    const auto widgets = viewer().interface().widgets();
    ASSERT_TRUE(widgets.count("series/picture/1"));
    EXPECT_FALSE(widgets.count("series/picture/2"));
    const Box box = widgets.at("series/picture/1");
    EXPECT_EQ(box.size_px, glm::ivec2(SeriesPreviews::kSide_px));
    const Image shot = viewer().shot().value();
    const glm::uvec2 middle(box.low_px + box.size_px / 2), corner(box.low_px + 1);
    EXPECT_GT(shot.at(middle.x, middle.y, 0), 0.9f); // the ball
    EXPECT_LT(shot.at(corner.x, corner.y, 0), 0.1f); // and beside it
    click_widget("series/1", 0.5);
    EXPECT_FALSE(state().series_open);
    EXPECT_EQ(viewer().work().title(), "synthetic:ball?size=24");
}

// Descriptions of series may hold names: while names are hidden a window looks the same whatever
// they are.
TEST_F(ViewerTest, DescriptionsOfSeriesAreHiddenWithTheNames) {
    const auto shot = [&](const std::string& description, bool hidden, const char* list) {
        Source source{open_synthetic("synthetic:ball?size=24")};
        source.scene.loaded.series = {{1, 2, "CT", description, "9 images of 8 x 8", "1.2.3", true},
                                      {2, 2, "CT", "leg", "7 images of 8 x 8", "1.2.4", false}};
        open_scene(std::move(source), {800, 600});
        if (hidden) {
            show("appearance");
            click_widget("file/hide");
        }
        show("files");
        click_widget(list);
        frame({});
        return viewer().shot().value().samples;
    };
    for (const char* list : {"file/pictures", "task/export"}) {
        EXPECT_EQ(shot("Doe, John", true, list), shot("o' brain', 2 images of", true, list));
        EXPECT_NE(shot("Doe, John", false, list), shot("o' brain', 2 images of", false, list));
    }
    shot("o' brain', 2 images of", false, "task/export");
    const SeriesInfo& first = viewer().work().series()[0];
    EXPECT_EQ(series_text(first, false), "CT 'o' brain', 2 images of', 9 images of 8 x 8");
    EXPECT_EQ(series_text(first, true), "CT, 9 images of 8 x 8");
    SeriesInfo nameless = first;
    nameless.description.clear();
    EXPECT_EQ(series_text(nameless, false), "CT, 9 images of 8 x 8");
}

TEST_F(ViewerTest, WhatReadersSayIsToldOnceTheVolumeIsOpen) {
    const auto told = [&](std::vector<std::string> warnings, std::vector<std::string> notes) {
        Source source{open_synthetic("synthetic:ball?size=24")};
        source.scene.loaded.warnings = std::move(warnings);
        source.scene.loaded.notes = std::move(notes);
        open_scene(std::move(source), {800, 600});
        return viewer().interface().message();
    };
    EXPECT_EQ(told({"f/no_meta.dcm: is passed over"}, {"f: 3 files are no DICOM"}),
              "f/no_meta.dcm: is passed over; f: 3 files are no DICOM");
    const std::string one(200, 'a');
    EXPECT_EQ(told({one, one, one}, {}), one + "; and 2 more on standard error");
    const Message said = said_of(viewer().work().loaded(), one, "head.nii");
    EXPECT_EQ(said.shown(false), "head.nii; head.nii; head.nii");
    // Names of other files of the folder may tell who the patient is.
    EXPECT_EQ(said.shown(true), "(notes about the files are hidden)");
    frame({}, 60.0);
    frame({});
    EXPECT_EQ(viewer().interface().message(), ""); // once
}

// Nor do messages or offered folders tell names.
TEST_F(ViewerTest, MessagesTellNoHiddenNames) {
    open("synthetic:ball?size=24");
    const Work& work = viewer().work();
    const Message saved = "saved to " + Message::name("/data/doe^john.palpate") + "; and more";
    EXPECT_EQ(saved.shown(false), "saved to /data/doe^john.palpate; and more");
    EXPECT_EQ(saved.shown(true), "saved to (name hidden); and more");
    const Message failed = Message::why({"/data/doe^john: no such file"});
    EXPECT_EQ(failed.shown(false), "/data/doe^john: no such file");
    EXPECT_EQ(failed.shown(true), "not done, for a reason that names files");
    EXPECT_EQ(Message("nothing").shown(true), "nothing");
    EXPECT_TRUE(Message("").empty());
    EXPECT_EQ(work.saving().new_folder(true),
              (std::filesystem::current_path() / "work.palpate").string());
}

// Patients are told in mm; the sample's indices come when they are asked for.
TEST_F(ViewerTest, TheLineAtTheBottomHasThePlaceInMm) {
    open("synthetic:phantom?size=24", {1280, 800});
    const std::string mm = patient_text(state().crosshair_mm);
    const auto has = [&](const std::string& part) {
        return viewer().interface().place().find(part) != std::string::npos;
    };
    EXPECT_TRUE(has("crosshair  " + mm)) << viewer().interface().place();
    EXPECT_FALSE(has("sample"));
    const glm::dvec2 at = middle(Panel::axial) + glm::dvec2(30.0, 10.0);
    move(at);
    frame({});
    EXPECT_TRUE(has("pointer  " + patient_text(point_under(state(), grid(), Panel::axial, at))));
    show("appearance");
    click_widget("file/indices");
    frame({});
    const glm::uvec3 sample = sample_at(grid(), state().crosshair_mm).value();
    EXPECT_TRUE(has(fmt::format("sample ({}, {}, {})", sample.x, sample.y, sample.z)))
        << viewer().interface().place();
}

// Lines at the bottom: none is cut, nor covers what stands at the right.
TEST_F(ViewerTest, ALongMessageHasSeveralLinesAndStaysForLonger) {
    const auto overlap = [](const Box& a, const Box& b) {
        return glm::all(glm::lessThan(a.low_px, b.low_px + b.size_px)) &&
               glm::all(glm::lessThan(b.low_px, a.low_px + a.size_px));
    };
    const std::string word = "a/folder/with_a_long_name: ",
                      words = word + word + word + word + word;
    for (const glm::uvec2 size : {glm::uvec2(1280, 800), glm::uvec2(800, 600), kSmallestWindow_px})
        for (const size_t letters : {size_t{12}, size_t{80}, size_t{120}}) {
            open("synthetic:phantom?size=24", size);
            viewer().work().tell(words.substr(0, letters));
            frame({});
            const auto& widgets = viewer().interface().widgets();
            ASSERT_TRUE(widgets.count("status/message") && widgets.count("status/steps"));
            const Box message = widgets.at("status/message");
            EXPECT_FALSE(overlap(message, widgets.at("status/steps"))) << size.x << " " << letters;
            EXPECT_GE(message.low_px.x, 0);
            EXPECT_GE(message.low_px.y, 0);
            EXPECT_LE(message.low_px.x + message.size_px.x, static_cast<int>(state().size_px.x));
            EXPECT_LE(message.low_px.y + message.size_px.y, static_cast<int>(state().size_px.y));
            const int foot = places_of(state()).status.low_px.y;
            if (letters == 12 && size.x > 480) {
                EXPECT_GE(message.low_px.y, foot); // in the line
            }
            if (letters == 120 && size.x < 1280) {
                EXPECT_LE(message.low_px.y + message.size_px.y, foot); // above it
                EXPECT_GE(message.size_px.y, 2 * 13);                  // lines
            }
        }
    open("synthetic:phantom?size=24");
    viewer().work().tell(words.substr(0, 120)); // 8 s at 15 letters a second
    frame({}, 7.9);
    frame({}, 0.2);
    EXPECT_EQ(viewer().interface().message(), words.substr(0, 120));
    frame({});
    EXPECT_EQ(viewer().interface().message(), "");
}

// Panels below the list of labels come nearer, so that they need not be scrolled to.
TEST_F(ViewerTest, TheListOfLabelsIsAsHighAsItsRows) {
    open("synthetic:phantom?size=24", {1280, 800});
    key("b");
    for (int i = 0; i < 7; ++i)
        key("="); // wider than a sample
    click(middle(Panel::axial) + glm::dvec2(10, 20));
    for (uint32_t label = 2; label <= 40; ++label)
        note_name(label, "organ");
    show("labels");
    const auto foot = [&] {
        const Box box = viewer().interface().widgets().at("labels/middle");
        return box.low_px.y + box.size_px.y;
    };
    const int of_all = foot();
    click_widget("labels/find");
    frame({{.kind = Event::Kind::text, .text = "40"}});
    frame({});
    frame({});
    EXPECT_FALSE(viewer().interface().widgets().count("labels/row/39"));
    EXPECT_EQ(of_all - foot(), (14 - 1) * (18 + 2 * 3 + 4)); // letters, padding, spacing
    EXPECT_LT(foot(), places_of(state()).status.low_px.y);
}

TEST_F(ViewerTest, ALongNameKeepsItsBeginningAndItsEnd) {
    open("synthetic:phantom?size=24");
    const auto width = [](const char* text) { return ImGui::CalcTextSize(text).x; };
    // In exactly the room of a shortened name; with a pixel less it is shorter.
    const auto expect_in = [&](const char* shown, const char* name) {
        EXPECT_EQ(fitted(name, width(shown)), shown);
        EXPECT_LT(width(fitted(name, width(shown) - 1.0f).c_str()), width(shown));
    };
    expect_in("kidney_cyst_left", "kidney_cyst_left");
    expect_in("kidne.._left", "kidney_cyst_left");
    expect_in("kidn.._left", "kidney_cyst_left");
    expect_in("gr\u00f6..nks", "gr\u00f6\u00dfe_links");
    EXPECT_EQ(fitted("abc", 0.0f), "..");
    EXPECT_EQ(fitted("", 0.0f), "");
}

// Long names in the list of labels and in that of files.
TEST_F(ViewerTest, NamesThatDifferAtTheirEndsLookDifferent) {
    const auto labels = [&](const char* name) {
        open("synthetic:phantom?size=24");
        note_name(24, name);
        show("labels");
        EXPECT_TRUE(viewer().interface().widgets().count("labels/row/24"));
        return viewer().shot().value().samples;
    };
    EXPECT_NE(labels("kidney_cyst_left"), labels("kidney_cyst_right"));
    namespace fs = std::filesystem;
    const fs::path before = fs::current_path();
    const auto files = [&](const char* end) {
        const fs::path folder = fs::path(::testing::TempDir()) / "palpate_long_names";
        const std::string name = std::string(120, 'n') + end;
        fs::create_directory(folder);
        std::ofstream(folder / name) << "12345";
        fs::current_path(folder);
        open("synthetic:phantom?size=24");
        key("o", {.ctrl = true});
        frame({});
        EXPECT_TRUE(viewer().interface().widgets().count("browser/" + name));
        const auto samples = viewer().shot().value().samples;
        fs::current_path(before);
        fs::remove_all(folder);
        return samples;
    };
    EXPECT_NE(files("a.nii"), files("b.nii"));
}

// A picture of the whole window, kept beside this file. PALPATE_BLESS=1 writes it anew: the commit
// says what has changed in it. Widgets and letters are the same on every processor; views may
// differ where two drivers round a position differently.
TEST_F(ViewerTest, TheWindowLooksAsItDid) {
    open("synthetic:phantom?size=64", {1000, 640});
    key("b"); // a few strokes, so that there are labels
    move(middle(Panel::axial) + glm::dvec2(-40, 20));
    button(true);
    move(middle(Panel::axial) + glm::dvec2(40, 30));
    button(false);
    key("c");
    click(middle(Panel::coronal) + glm::dvec2(20, -10));
    move(middle(Panel::axial) + glm::dvec2(10, 70));
    const Image shot = viewer().shot().value();
    // Each version of ImGui places letters in its own way.
    const std::string path =
        fmt::format("{}/tests/view/window_imgui_{}.png", kSourceDir, IMGUI_VERSION);
    if (std::getenv("PALPATE_BLESS")) {
        ASSERT_TRUE(save_png(path, shot));
    }
    if (!std::filesystem::exists(path))
        GTEST_SKIP() << path << " is not there: PALPATE_BLESS=1 writes it, to be looked at";
    const Image golden = load_png(path).value();
    ASSERT_EQ(golden.size_px, shot.size_px);
    size_t interface = 0, views = 0, pixels = 0;
    const Places places = places_of(state());
    for (uint32_t y = 0; y < shot.size_px.y; ++y)
        for (uint32_t x = 0; x < shot.size_px.x; ++x) {
            float most = 0.0f;
            for (size_t c = 0; c < 3; ++c)
                most = std::max(most, std::abs(shot.at(x, y, c) - golden.at(x, y, c)));
            const bool in_view = std::any_of(
                places.views.begin(), places.views.end(),
                [&](const Places::View& view) { return view.box.holds(glm::dvec2(x, y)); });
            pixels += in_view;
            // One step of 8 bits: blending rounds a tie either way (3 pixels with AVX-512).
            interface += !in_view && most > 1.5f / 255.0f;
            views += in_view && most > 2.5f / 255.0f;
        }
    EXPECT_EQ(interface, 0u);
    EXPECT_LE(static_cast<double>(views), 0.001 * static_cast<double>(pixels));
}

TEST_F(ViewerTest, AResizedWindowKeepsItsViewsWhole) {
    open();
    frame({{.kind = Event::Kind::resize, .size_px = {1001, 703}}});
    EXPECT_EQ(viewer().shot().value().size_px, glm::uvec2(1001, 703));
    frame({{.kind = Event::Kind::resize, .size_px = {10, 10}}});
    EXPECT_EQ(state().size_px, kSmallestWindow_px);
    EXPECT_EQ(viewer().shot().value().size_px, kSmallestWindow_px);
}

} // namespace
} // namespace palpate::view
