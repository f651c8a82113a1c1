// Seeds, methods and thresholds in the window.

#include "apps/view/document/stroke_edit.h"
#include "engine/segment/label_merge.h"
#include "engine/volume/builder.h"
#include "tests/view/recorded_session.h"

namespace palpate::view {
namespace {

// The phantom of sessions_test.cpp: the brain of 35 HU about its middle, bone of 1100 HU round it.
// Pixels: 267 / 24 / 1.04 = 10.7 a sample.
const RecordedSteps kSegmentSessions[] = {
    {"segment_tab", "section method", R"({"task": "segment"})"},
    {"seed_key", "key q", R"({"tool": {"hand": "seed"}, "segment": {"brush": "inside"}})"},
    {"seed_brush_outside", "section seeds; widget segment/outside 0.05",
     R"({"tool": {"hand": "seed"}, "segment": {"brush": "outside"}})"},
    {"segment_without_seeds_says_so", "section method; widget segment/run",
     R"({"undo_steps": 0, "segment": {"runs": false}})"},
    {"segment_by_fast_marching",
     "key q; at axial 0 20; drag left 20 0; section method; widget segment/run",
     R"({"segment": {"method": "fast-marching", "runs": false}, "undo_steps": 2})"},
};

class SegmentSessions : public RecordedSession {};
TEST_P(SegmentSessions, End) {
    expect_end();
}
INSTANTIATE_TEST_SUITE_P(View, SegmentSessions, ::testing::ValuesIn(kSegmentSessions),
                         [](const auto& test) { return std::string(test.param.name); });

class Segmentation : public ViewerTest {
 protected:
    void SetUp() override {
        ViewerTest::SetUp();
        open("synthetic:phantom?size=24");
    }
    const Volume& volume(const char* name) {
        document_.emplace(viewer().work().edited().document);
        return *document_->find(name);
    }
    // A stroke of seeds across the brain, in the axial slice.
    void paint_seeds() {
        key("q");
        move(middle(Panel::axial) + glm::dvec2(-15, 15));
        button(true);
        move(middle(Panel::axial) + glm::dvec2(15, 15));
        button(false);
        frame({});
    }
    void paint_outside() { // a dab in the air
        show("method");
        click_widget("segment/outside", 0.05);
        move(middle(Panel::axial) + glm::dvec2(100, 0));
        button(true);
        button(false);
        frame({});
    }
    void choose(const char* method) {
        show("method");
        click_widget("segment/methods");
        click_widget(fmt::format("segment/method/{}", method));
    }
    void type_over(const char* text) { // into the field that has the keys
        frame({{.kind = Event::Kind::key, .modifiers = {.ctrl = true}, .down = true, .key = "a"}});
        frame({{.kind = Event::Kind::key, .modifiers = {.ctrl = true}, .key = "a"}});
        frame({{.kind = Event::Kind::text, .text = text}});
    }
    size_t count_of(const char* name, float label) {
        const Volume& map = volume(name);
        size_t count = 0;
        for (uint32_t z = 0; z < 24; ++z)
            for (uint32_t y = 0; y < 24; ++y)
                for (uint32_t x = 0; x < 24; ++x)
                    count += map.value({x, y, z}) == label;
        return count;
    }

 private:
    std::optional<Document> document_;
};

// The result is what the library gives for the same seeds; one undo takes it back to the byte.
TEST_F(Segmentation, PutsTheMethodsResultIntoTheLabelsAsOneStep) {
    paint_seeds();
    ASSERT_GT(count_of(Work::kSeeds, 1.0f), 1u);
    EXPECT_EQ(count_of(Work::kLabels, 1.0f), 0u);
    choose("region-growing");
    const size_t steps = viewer().work().edited().undo_steps;
    click_widget("segment/run");
    frame({});
    EXPECT_EQ(viewer().work().edited().undo_steps, steps + 1);
    const Volume seeds = volume(Work::kSeeds), grey = volume(Work::kGrey);
    const auto expected =
        segment(*find_segment_method("region-growing"), {grey, seeds, {}, 0}, {}, {});
    ASSERT_TRUE(expected) << expected.error().message;
    const Volume labels = volume(Work::kLabels);
    for (uint32_t z = 0; z < 24; ++z)
        for (uint32_t y = 0; y < 24; ++y)
            for (uint32_t x = 0; x < 24; ++x)
                ASSERT_EQ(labels.value({x, y, z}), expected->labels.value({x, y, z}));
    EXPECT_GT(count_of(Work::kLabels, 1.0f), count_of(Work::kSeeds, 1.0f));
    key("z", {.ctrl = true});
    frame({});
    EXPECT_EQ(count_of(Work::kLabels, 1.0f), 0u);
}

// Also after a person has given the label another one, and where the label itself is hidden.
TEST_F(Segmentation, SeedsHaveTheColourOfTheirLabel) {
    paint_seeds();
    paint_outside();
    Session& session = viewer().work().session();
    const NotePages before = session.state().document.notes;
    Notes notes = notes_of(before).value();
    for (const uint32_t label : {1u, uint32_t{kOutsideSeed}})
        set_style(notes, label, {{0.125, 0.25, 0.5}, false});
    session.note(changes_between(before, pages_of(notes)), "looks of labels");
    for (int i = 0; i < 3; ++i)
        frame({});
    const LabelLayer seeds = session.scene().overlay.value();
    EXPECT_EQ(style_of(seeds, 1).color, glm::dvec3(0.125, 0.25, 0.5));
    EXPECT_TRUE(style_of(seeds, 1).visible);
    // Those outside have a colour of their own, that of none of the first labels.
    const glm::dvec3 outside = style_of(seeds, kOutsideSeed).color;
    for (uint32_t label = 1; label <= 6; ++label)
        EXPECT_GT(glm::distance(outside, style_of(LabelLayer{}, label).color), 0.3) << label;
}

// Seeds of what is no object keep the front out of it, and are no label themselves.
TEST_F(Segmentation, SeedsOutsideAreNoLabel) {
    paint_seeds();
    paint_outside();
    EXPECT_GT(count_of(Work::kSeeds, kOutsideSeed), 0u);
    choose("watershed");
    click_widget("segment/run");
    frame({});
    EXPECT_GT(count_of(Work::kLabels, 1.0f), 10u);
    EXPECT_EQ(count_of(Work::kLabels, kOutsideSeed), 0u);
    EXPECT_LT(count_of(Work::kLabels, 1.0f), 24u * 24u * 24u / 2u);
}

// A run after more seeds goes on from the run before, to what a run from the start gives; another
// method frees what was kept.
TEST_F(Segmentation, GrowsOnFromChangedSeeds) {
    paint_seeds();
    paint_outside();
    choose("grow-from-seeds");
    click_widget("segment/run");
    frame({});
    const size_t first = count_of(Work::kLabels, 1.0f);
    ASSERT_GT(first, 10u);
    move(middle(Panel::axial) + glm::dvec2(0, 70)); // outside is still in the hand
    button(true);
    button(false);
    frame({});
    click_widget("segment/run");
    frame({});
    const Volume gone_on = volume(Work::kLabels);
    EXPECT_NE(count_of(Work::kLabels, 1.0f), first);
    choose("watershed");
    click_widget("segment/run");
    frame({});
    choose("grow-from-seeds");
    click_widget("segment/run");
    frame({});
    const Volume anew = volume(Work::kLabels);
    for (uint32_t z = 0; z < 24; ++z)
        for (uint32_t y = 0; y < 24; ++y)
            for (uint32_t x = 0; x < 24; ++x)
                ASSERT_EQ(gone_on.value({x, y, z}), anew.value({x, y, z}));
}

// Bounds of a result: on the slider of the method.
class SegmentBound : public Segmentation {
 protected:
    // Leaves the button pressed.
    void drag_bound(double from_share, double to_share) {
        reveal("segment/bound");
        const Box slider = viewer().interface().widgets().at("segment/bound");
        const glm::dvec2 low(slider.low_px), size(slider.size_px);
        move(glm::floor(low + glm::dvec2(from_share, 0.5) * size));
        button(true);
        move(glm::floor(low + glm::dvec2(to_share, 0.5) * size));
        frame({});
    }
    const Strength& strength() { return viewer().work().segmentation().strength().value(); }
    size_t steps() { return viewer().work().edited().undo_steps; }
};

TEST_F(SegmentBound, IsSeenWhileItIsDraggedAndTakenWhenItIsLetGo) {
    paint_seeds();
    show("method");
    click_widget("segment/run");
    frame({});
    ASSERT_TRUE(viewer().work().segmentation().strength());
    const double found = strength().bound;
    EXPECT_GE(found, strength().least);
    EXPECT_LE(found, strength().most);
    const size_t before = count_of(Work::kLabels, 1.0f), steps_before = steps();
    ASSERT_GT(before, 0u);
    drag_bound(0.5, 0.02);
    ASSERT_TRUE(state().segmenting.preview);
    const double at = *state().segmenting.preview;
    EXPECT_LT(at, found);
    EXPECT_EQ(count_of(Work::kLabels, 1.0f), before);
    ASSERT_TRUE(viewer().work().session().scene().fusion);
    button(false);
    frame({});
    frame({});
    EXPECT_FALSE(state().segmenting.preview);
    EXPECT_FALSE(viewer().work().session().scene().fusion);
    EXPECT_EQ(strength().bound, at);
    const auto given = state().segmenting.given.find("fast-marching"); // the next run finds its own
    EXPECT_TRUE(given == state().segmenting.given.end() || given->second.empty());
    EXPECT_EQ(steps(), steps_before + 1);
    // The method gives this with that threshold.
    const auto expected =
        segment(*find_segment_method("fast-marching"),
                {volume(Work::kGrey), volume(Work::kSeeds), {}, 0}, {{"threshold", at}}, {});
    ASSERT_TRUE(expected) << expected.error().message;
    const Volume labels = volume(Work::kLabels);
    for (uint32_t z = 0; z < 24; ++z)
        for (uint32_t y = 0; y < 24; ++y)
            for (uint32_t x = 0; x < 24; ++x)
                ASSERT_EQ(labels.value({x, y, z}), expected->labels.value({x, y, z}));
    EXPECT_LT(count_of(Work::kLabels, 1.0f), before);
    // Words say how much it is, and a step of undo which one it was.
    EXPECT_TRUE(viewer().interface().message().starts_with("label 1: "));
    key("z", {.ctrl = true});
    frame({});
    EXPECT_EQ(count_of(Work::kLabels, 1.0f), before);
    EXPECT_EQ(viewer().interface().message(), "undone: fast-marching, bounded anew");
    EXPECT_EQ(strength().bound, found); // and so is the slider
    key("y", {.ctrl = true});
    frame({});
    EXPECT_EQ(strength().bound, at);
    click_widget("segment/give/threshold");
    EXPECT_EQ(state().segmenting.given.at("fast-marching").at("threshold"), at);
}

// A place on the slider is one value, however often the bound has been dragged.
TEST_F(SegmentBound, SliderKeepsItsEnds) {
    paint_seeds();
    show("method");
    click_widget("segment/run");
    frame({});
    const auto drag_from_a_third = [&](double to_share) {
        drag_bound(0.3, 0.3);
        const double at = state().segmenting.preview.value();
        button(false);
        frame({});
        drag_bound(0.5, to_share);
        button(false);
        frame({});
        return at;
    };
    const double first = drag_from_a_third(0.02);
    ASSERT_GT(first, 0.0);
    const double dragged = strength().bound;
    EXPECT_EQ(drag_from_a_third(0.2), first);
    EXPECT_NE(strength().bound, dragged);
    EXPECT_EQ(drag_from_a_third(0.1), first);
}

// A method that has no such parameter, as the random walker, is bounded, too.
TEST_F(SegmentBound, OfAMethodWithoutAThreshold) {
    paint_seeds();
    paint_outside();
    choose("random-walker");
    click_widget("segment/run");
    frame({});
    const size_t before = count_of(Work::kLabels, 1.0f);
    ASSERT_GT(before, 0u);
    drag_bound(0.5, 0.95);
    button(false);
    frame({});
    frame({});
    EXPECT_LT(count_of(Work::kLabels, 1.0f), before);
    EXPECT_GT(count_of(Work::kLabels, 1.0f), 0u);
    const auto given = state().segmenting.given.find("random-walker");
    EXPECT_TRUE(given == state().segmenting.given.end() || given->second.empty());
    click_widget("segment/run"); // runs as before
    frame({});
    EXPECT_EQ(count_of(Work::kLabels, 1.0f), before);
}

// A front among equal values meets no boundary: nothing is lost, and the bound is offered.
TEST_F(SegmentBound, IsOfferedWhereAFrontMeetsNoBoundary) {
    Source source{open_synthetic("synthetic:phantom?size=24")};
    source.scene.loaded.data.volume = make_volume(source.scene.loaded.data.volume.grid(),
                                                  ScalarType::i16, [](glm::uvec3) { return 35.0; });
    open_scene(std::move(source), {800, 600});
    key("b"); // a label that is there already
    move(middle(Panel::axial) + glm::dvec2(0, 40));
    button(true);
    button(false);
    frame({});
    const size_t drawn = count_of(Work::kLabels, 1.0f);
    ASSERT_GT(drawn, 0u);
    paint_seeds();
    const size_t steps_before = steps();
    show("method");
    click_widget("segment/give/rule");
    click_widget("segment/value/rule", 0.5);
    type_over("0"); // as printed: the cost, which is one
    click_widget("segment/run");
    frame({});
    EXPECT_NE(viewer().interface().message().find("the front met no boundary"), std::string::npos);
    EXPECT_NE(viewer().interface().message().find("10 % by "), std::string::npos);
    EXPECT_NE(viewer().interface().message().find("drag `bound`"), std::string::npos);
    EXPECT_EQ(count_of(Work::kLabels, 1.0f), drawn);
    EXPECT_EQ(steps(), steps_before);
    ASSERT_TRUE(viewer().work().segmentation().strength());
    EXPECT_TRUE(strength().is_unbounded);
    frame({});
    drag_bound(0.5, 0.6);
    button(false);
    frame({});
    frame({});
    EXPECT_FALSE(strength().is_unbounded);
    EXPECT_GT(count_of(Work::kLabels, 1.0f), count_of(Work::kSeeds, 1.0f));
    EXPECT_LT(count_of(Work::kLabels, 1.0f), 24u * 24u * 24u);
}

// Undo goes back over the bounds that were taken, and over runs to that of the run before.
TEST_F(SegmentBound, UndoTakesABoundWithItsRun) {
    paint_seeds();
    choose("fast-marching");
    click_widget("segment/run");
    frame({});
    const double found = strength().bound;
    drag_bound(0.5, 0.2);
    button(false);
    frame({});
    frame({});
    const double first = strength().bound;
    EXPECT_NE(first, found);
    drag_bound(0.5, 0.3);
    button(false);
    frame({});
    frame({});
    EXPECT_NE(strength().bound, first);
    const auto step = [&](const char* which) {
        key(which, {.ctrl = true});
        frame({});
        return strength().bound;
    };
    EXPECT_EQ(step("z"), first);
    EXPECT_EQ(step("z"), found);
    EXPECT_EQ(step("y"), first);
    choose("fuzzy-connectedness");
    click_widget("segment/run");
    frame({});
    const double other = strength().bound;
    EXPECT_NE(other, first);
    EXPECT_EQ(step("z"), first); // that of the fast marching again
    EXPECT_EQ(step("z"), found);
    key("z", {.ctrl = true});
    frame({});
    EXPECT_FALSE(viewer().work().segmentation().strength()); // as before the first segmentation
    EXPECT_EQ(step("y"), found);
    EXPECT_EQ(step("y"), first);
    EXPECT_EQ(step("y"), other);
}

// A parameter that a person begins to give has the value that the method found.
TEST_F(Segmentation, AParameterBeginsAtWhatWasFound) {
    paint_seeds();
    show("method");
    frame({});
    click_widget("segment/give/threshold");
    EXPECT_EQ(state().segmenting.given.at("fast-marching").at("threshold"), 0.0);
    EXPECT_NE(viewer().interface().message().find("threshold begins at 0"), std::string::npos);
    click_widget("segment/give/threshold");
    click_widget("segment/run");
    frame({});
    const auto found = [&] {
        return viewer().work().segmentation().found(*find_segment_method("fast-marching"),
                                                    "threshold");
    };
    const double by_front = found().value();
    click_widget("segment/give/threshold");
    EXPECT_EQ(state().segmenting.given.at("fast-marching").at("threshold"), by_front);
    click_widget("segment/value/threshold", 0.5);
    type_over("7");
    click_widget("segment/run"); // what a person gives is not what was found
    frame({});
    EXPECT_EQ(found(), by_front);
    choose("threshold"); // of values that are seen
    frame({});
    click_widget("segment/give/low");
    EXPECT_EQ(state().segmenting.given.at("threshold").at("low"), state().window.low);
}

TEST_F(Segmentation, EscapeClosesTheListOfMethods) {
    show("method");
    click_widget("segment/methods");
    ASSERT_TRUE(viewer().interface().widgets().contains("segment/method/watershed"));
    key("escape");
    frame({});
    EXPECT_FALSE(viewer().interface().widgets().contains("segment/method/watershed"));
    EXPECT_EQ(state().segmenting.method, "fast-marching");
    move(middle(Panel::axial));
    key("f"); // keys are the views' again
    EXPECT_EQ(state().alone, Panel::axial);
}

TEST_F(Segmentation, LockedLabelsStay) {
    key("b");
    move(middle(Panel::axial) + glm::dvec2(0, 15));
    button(true);
    button(false);
    frame({});
    const size_t drawn = count_of(Work::kLabels, 1.0f);
    ASSERT_GT(drawn, 0u);
    show("labels");
    click_widget("labels/lock/1");
    show("method");
    paint_seeds();
    choose("region-growing");
    click_widget("segment/run");
    frame({});
    EXPECT_EQ(count_of(Work::kLabels, 1.0f), drawn);
}

// A label's number is no matter to a method: what grows from the same seeds is of the same size and
// place, and of no other number. Label 255 is the one that stands for what is no object elsewhere,
// 300 does not fit into 8 bits, 65534 is the last with seeds.
TEST_F(Segmentation, ASeedKeepsTheNumberOfItsLabel) {
    std::map<int, Volume> found;
    for (const int label : {1, 255, 300, 65534}) {
        SCOPED_TRACE(label);
        open("synthetic:phantom?size=24");
        show("brush");
        click_widget("tool/label", 0.2);
        type_over(std::to_string(label).c_str());
        key("enter");
        frame({});
        ASSERT_EQ(state().label, label);
        paint_seeds();
        paint_outside();
        choose("watershed");
        click_widget("segment/run");
        frame({});
        found.emplace(label, volume(Work::kLabels));
        EXPECT_GT(count_of(Work::kLabels, static_cast<float>(label)), 10u);
        for (uint32_t z = 0; z < 24; ++z)
            for (uint32_t y = 0; y < 24; ++y)
                for (uint32_t x = 0; x < 24; ++x)
                    ASSERT_EQ(found.at(label).value({x, y, z}),
                              static_cast<float>(label) * found.at(1).value({x, y, z}));
    }
}

TEST_F(Segmentation, ClearsSeeds) {
    paint_seeds();
    show("method");
    click_widget("segment/clear");
    frame({});
    EXPECT_EQ(count_of(Work::kSeeds, 1.0f), 0u);
}

} // namespace
} // namespace palpate::view
