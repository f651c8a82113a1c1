// Steps that no project has, after a window that ended without a word.

#include "apps/view/document/kept_steps.h"

#include <thread>

#include "engine/volume/content_hash.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class KeepingSteps : public TemporaryFolder {
 protected:
    Source source(const char* name = "synthetic:ball?size=24") {
        Source made{open_synthetic(name)};
        made.steps.emplace(keep_steps(fresh_document(made.scene.loaded.data), file("steps")));
        return made;
    }
    static void draw(Work& work, double x_mm) {
        ViewState state = work.subject().home;
        state.tool = &kDrawTool;
        state.radius_mm = 6.0;
        work.obey(order::StrokeDown{{x_mm, 0, 0}, 1.0}, state);
        work.obey(order::StrokeUp{{x_mm, 5, 0}, 1.1}, state);
        work.session().settle();
    }
    static uint64_t labels(Work& work) {
        return content_hash(*work.edited().document.find(Work::kLabels));
    }
    size_t files() const {
        const auto all = std::filesystem::directory_iterator(file("steps"));
        return static_cast<size_t>(std::distance(begin(all), end(all)));
    }
};

TEST_F(KeepingSteps, ComeBackWithTheirUndo) {
    uint64_t before = 0, after = 0;
    {
        Work work(source(), {800, 600}, 1.0, false);
        before = labels(work);
        draw(work, -10.0);
        draw(work, 10.0);
        after = labels(work);
        draw(work, 0.0);
        work.session().undo();
        work.session().settle();
    } // as one that is killed: nobody has said that they are not wanted
    EXPECT_EQ(source("synthetic:ball?size=25").steps->recovered, 0u) << "of other samples";
    Source again = source();
    EXPECT_EQ(again.steps->recovered, 2u);
    EXPECT_EQ(again.steps->note, "");
    {
        Work work(std::move(again), {800, 600}, 1.0, false);
        EXPECT_EQ(work.steps_file().recovered(), 2u);
        EXPECT_EQ(labels(work), after);
        EXPECT_EQ(work.edited().redo_steps, 1u);
        EXPECT_TRUE(work.leaving_loses_edits());
        for (int i = 0; i < 2; ++i)
            work.obey(order::Undo{}, work.subject().home);
        work.session().settle();
        EXPECT_EQ(labels(work), before);
        EXPECT_FALSE(work.leaving_loses_edits());
        work.steps_file().drop();
        EXPECT_EQ(files(), 2u); // as long as it is open; the other is of 25 samples
    }
    EXPECT_EQ(files(), 1u);
}

// Removed material is counted from before the steps that came back, also under a step that was
// undone.
TEST_F(KeepingSteps, RemovedVolumeComesBackWithThem) {
    const auto cut = [](Work& work, double x_mm) {
        ViewState state = work.subject().home;
        state.tool = &kCutTool;
        state.radius_mm = 4.0;
        work.obey(order::StrokeDown{{x_mm, 0, 0}, 1.0}, state);
        work.obey(order::StrokeUp{{x_mm, 3, 0}, 1.1}, state);
        work.session().settle();
    };
    double one_mm3 = 0.0, both_mm3 = 0.0;
    {
        Work work(source(), {800, 600}, 1.0, false);
        cut(work, -5.0);
        one_mm3 = work.removed().now()->all_mm3;
        cut(work, 5.0);
        both_mm3 = work.removed().now()->all_mm3;
        work.session().undo();
        work.session().settle();
        EXPECT_EQ(work.removed().now()->all_mm3, one_mm3);
    }
    EXPECT_GT(one_mm3, 100.0); // of a ball of 268
    EXPECT_GT(both_mm3, one_mm3);
    Work work(source(), {800, 600}, 1.0, false);
    EXPECT_EQ(work.removed().now()->all_mm3, one_mm3);
    work.session().redo();
    work.session().settle();
    EXPECT_EQ(work.removed().now()->all_mm3, both_mm3);
    for (int i = 0; i < 2; ++i)
        work.session().undo();
    work.session().settle();
    EXPECT_EQ(work.removed().now()->all_mm3, 0.0);
}

// Names, colours, locks, measures, planes and the window come back as strokes do; undo takes each
// back but the window.
TEST_F(KeepingSteps, NotesComeBackWithThem) {
    Notes at_first, after;
    {
        Work work(source(), {800, 600}, 1.0, false);
        ViewState state = work.subject().home;
        at_first = state.notes;
        const auto keep = [&] {
            work.follow_notes(state, false);
            work.session().settle();
        };
        state.notes.measures = {{MeasureKind::ruler, {{0, 0, 0}, {1, 2, 3}}, "a"}};
        keep();
        name_label(state.notes, 3, "liver");
        keep();
        state.notes.label_styles[3] = {{0.5, 0.25, 1.0}, false};
        state.notes.locked_labels = {3};
        keep();
        state.window = {-100.0, 150.0};
        keep();
        state.notes.clip_planes = {{{1, 2, 3}, {0, 0, 1}}};
        work.follow_notes(state, true); // a drag that goes on is no step yet
        work.session().settle();
        EXPECT_EQ(work.edited().undo_steps, 3u);
        keep();
        after = state.notes;
        EXPECT_EQ(work.edited().undo_steps, 4u);
    } // as one that is killed
    Source again = source();
    EXPECT_EQ(again.steps->recovered, 4u);
    Work work(std::move(again), {800, 600}, 1.0, false);
    ViewState state = work.subject().home;
    EXPECT_EQ(state.notes, after);
    EXPECT_EQ(state.window, (GreyWindow{-100.0, 150.0}));
    work.watch(state);
    EXPECT_EQ(work.session().scene().clip_planes, after.clip_planes);
    EXPECT_FALSE(style_of(*work.session().scene().labels, 3).visible);
    for (int i = 0; i < 4; ++i) {
        work.obey(order::Undo{}, state);
        work.session().settle();
        work.follow_notes(state, false);
    }
    at_first.window = after.window;
    EXPECT_EQ(state.notes, at_first);
    EXPECT_EQ(work.edited().undo_steps, 0u);
    EXPECT_EQ(work.edited().redo_steps, 4u);
}

// Undo while a person changes something else leaves that to them, as a step after it.
TEST_F(KeepingSteps, UndoLeavesWhatIsBeingChanged) {
    Work work(source(), {800, 600}, 1.0, false);
    ViewState state = work.subject().home;
    state.notes.locked_labels = {3};
    work.follow_notes(state, false);
    work.session().settle();
    state.notes.measures = {{MeasureKind::ruler, {{0, 0, 0}, {1, 2, 3}}, "a"}};
    work.follow_notes(state, true); // the drag goes on
    work.session().undo();          // of the locks
    work.session().settle();
    work.follow_notes(state, true);
    EXPECT_TRUE(state.notes.locked_labels.empty());
    EXPECT_EQ(state.notes.measures.size(), 1u);
    work.follow_notes(state, false);
    work.session().settle();
    EXPECT_EQ(notes_of(work.edited().document.notes).value(), state.notes);
    EXPECT_EQ(work.edited().undo_steps, 1u);
}

TEST_F(KeepingSteps, EachWindowHasItsOwn) {
    Work first(source(), {800, 600}, 1.0, false);
    draw(first, 5.0);
    {
        Source other = source();
        EXPECT_EQ(other.steps->recovered, 0u);
        EXPECT_TRUE(other.steps->journal);
        EXPECT_EQ(files(), 2u);
    }
    // The second one, which holds nothing, is taken again; the first is still in use.
    EXPECT_EQ(source().steps->recovered, 0u);
    EXPECT_EQ(files(), 2u);
}

TEST_F(KeepingSteps, AreTheProjectsOnceTheyAreSaved) {
    Work work(source(), {800, 600}, 1.0, true);
    draw(work, 5.0);
    EXPECT_EQ(files(), 1u);
    work.saving().save(work.subject().home, file("work.palpate").string());
    while (work.saving().is_saving()) {
        work.poll();
        std::this_thread::yield();
    }
    ASSERT_TRUE(work.saving().has_project());
    EXPECT_EQ(files(), 0u);
    draw(work, -5.0);
    EXPECT_EQ(files(), 0u);
}

TEST_F(KeepingSteps, DamagedOnesAreToldAndPutAside) {
    source(); // an empty journal, closed
    for (const auto& entry : std::filesystem::directory_iterator(file("steps")))
        std::ofstream(entry.path(), std::ios::binary) << "no journal";
    const Source again = source();
    EXPECT_NE(again.steps->note.find("lost"), std::string::npos) << again.steps->note;
    EXPECT_TRUE(again.steps->journal);
    EXPECT_EQ(files(), 2u);
}

TEST_F(KeepingSteps, WithoutAFolderTheWindowOpensAndSaysSo) {
    write("steps", "a file where the folder should be");
    Source made = source();
    EXPECT_FALSE(made.steps->journal);
    EXPECT_NE(made.steps->note.find("not kept"), std::string::npos) << made.steps->note;
    Work work(std::move(made), {800, 600}, 1.0, false);
    draw(work, 5.0);
    EXPECT_EQ(work.edited().undo_steps, 1u);
}

// The question of the window.
class RecoveredSteps : public ViewerTest {
 protected:
    std::filesystem::path folder_ = std::filesystem::temp_directory_path() /
                                    ("palpate.recovered." + std::to_string(::getpid()));
    ~RecoveredSteps() override { std::filesystem::remove_all(folder_); }
    Source source() {
        Source made{open_synthetic("synthetic:phantom?size=24")};
        made.steps.emplace(keep_steps(fresh_document(made.scene.loaded.data), folder_));
        return made;
    }
};

TEST_F(RecoveredSteps, AreAskedFor) {
    open_scene(source(), {800, 600});
    EXPECT_EQ(state().recovered_steps, 0u);
    key("b");
    click(middle(Panel::axial));
    ASSERT_EQ(viewer().work().edited().undo_steps, 1u);
    for (const bool keeps : {true, false}) {
        open("synthetic:ball?size=8"); // the viewer before is gone as if it had been killed
        open_scene(source(), {800, 600});
        ASSERT_EQ(state().recovered_steps, 1u);
        frame({}); // the question has its size and place from its second frame on
        frame({});
        click_widget(keeps ? "recovered/keep" : "recovered/undo");
        frame({});
        EXPECT_EQ(state().recovered_steps, 0u);
        EXPECT_EQ(viewer().work().edited().undo_steps, keeps ? 1u : 0u);
    }
    frame({{.kind = Event::Kind::close}});
    EXPECT_TRUE(viewer().is_done()) << "nothing is lost";
    open("synthetic:ball?size=8");
    EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

} // namespace
} // namespace palpate::view
