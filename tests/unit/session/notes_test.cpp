// Notes: one text, one document's steps, and projects that earlier versions wrote.

#include "engine/session/notes.h"

#include <gmock/gmock.h>

#include "engine/base/json.h"
#include "tests/support/paths.h"
#include "tests/unit/session/project_fixture.h"

namespace palpate {
namespace {

using testing::HasSubstr;

std::vector<Notes> all_notes() {
    std::vector<Notes> all(8);
    all[0].measures = {{MeasureKind::ruler, {{1, 2, 3}, {4, 5, 6.5}}, "width \"\u00e4\"\n"}};
    all[1].label_names = {{7, "liver", glm::dvec3(0.5, 0.25, 1.0)}, {9, "spleen", {}}};
    all[2].locked_labels = {2, 65535};
    all[3].label_styles = {{3, {{0.1, 0.2, 0.3}, true}}, {300, {{1.0, 0.0, 0.0}, false, 0.25}}};
    all[4].clip_planes = {{{1.0 / 3.0, -2.0, 1e-7}, {0.0, 0.6, 0.8}}};
    all[5].bound = {"fast-marching", "00112233445566ff", 0.1};
    all[6].window = {-160.5, 240.0, true};
    all[7] = {all[1].label_names, all[3].label_styles, all[2].locked_labels, all[0].measures,
              all[4].clip_planes, all[5].bound,        all[6].window};
    return all;
}

// Each alone, and all of them, to the bit.
TEST(Notes, ComeBackFromTheirPages) {
    for (const Notes& notes : all_notes()) {
        EXPECT_NE(notes, Notes());
        const Result<Notes> read = notes_of(pages_of(notes));
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(*read, notes);
    }
    EXPECT_EQ(notes_of(NotePages()).value(), Notes());
    EXPECT_EQ(pages_of(Notes()).texts().size(), pages_of(all_notes()[7]).texts().size());
}

TEST(Notes, PagesThatAreNotOursAreRefusedByName) {
    const auto error = [](const char* page, const char* text) {
        const Result<Notes> read = notes_of(NotePages(NotePages::Texts{{page, text}}));
        return read ? std::string() : read.error().message;
    };
    EXPECT_THAT(error("measures", "[{]"), HasSubstr("measures"));
    EXPECT_THAT(error("locked_labels", "[70000]"), HasSubstr("locked_labels[0]"));
    EXPECT_THAT(error("window", R"({"low": 1, "high": 1})"), HasSubstr("window.high"));
    EXPECT_THAT(error("clip_planes", R"([{"point_mm": [0, 0, 0], "normal": [0, 0, 0]}])"),
                HasSubstr("normal"));
}

TEST(Notes, ANameIsOneEntryAndAnEmptyOneIsNone) {
    Notes notes;
    name_label(notes, 7, "");
    EXPECT_EQ(notes, Notes());
    name_label(notes, 7, "liver");
    EXPECT_EQ(numbered_name(notes, 7), "7 liver");
    EXPECT_EQ(numbered_name(notes, 8), "8");
    name_label(notes, 7, "spleen");
    EXPECT_EQ(notes.label_names.size(), 1u);
    name_label(notes, 7, "");
    EXPECT_EQ(notes, Notes());
}

// Through a scene go clip planes and styles; a style like the generated one is none of its own.
TEST(Notes, OfASceneAreTheScenesAgain) {
    const Notes all = all_notes()[7];
    Scene scene;
    scene.labels.emplace();
    show_in_scene(all, scene);
    EXPECT_EQ(style_of(*scene.labels, 300), all.label_styles.at(300));
    EXPECT_EQ(style_of(*scene.labels, 4), style_of(LabelLayer{}, 4));
    Notes taken;
    take_from_scene(taken, scene);
    EXPECT_EQ(taken.label_styles, all.label_styles);
    EXPECT_EQ(taken.clip_planes.size(), 1u);
    show_in_scene(Notes(), scene);
    EXPECT_TRUE(scene.labels->styles.size() <= 1);
    EXPECT_TRUE(scene.clip_planes.empty());
}

Notes notes_in(Session& session) {
    return notes_of(session.state().document.notes).value();
}

// Each is a step: undone, redone, saved, and there after a process that ended without a word.
TEST_F(ProjectTest, KeepsNotesAsItKeepsStrokes) {
    make();
    const std::vector<Notes> all = all_notes();
    const Notes at_first;
    {
        Result<Project::Opened> opened = Project::open(file("p"));
        ASSERT_TRUE(opened) << opened.error().message;
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        const NotePages first = session.state().document.notes;
        EXPECT_EQ(notes_in(session), at_first);
        for (const Notes& notes : all) {
            session.note(changes_between(session.state().document.notes, pages_of(notes)), "note");
            session.settle();
            EXPECT_EQ(notes_in(session), notes);
        }
        ASSERT_TRUE(opened->project.save(session)); // undo reaches back past it
        EXPECT_TRUE(opened->project.is_saved(session));
        for (size_t i = all.size() - 1; i-- > 0;) {
            session.undo();
            session.settle();
            EXPECT_EQ(notes_in(session), all[i]) << i;
        }
        session.undo();
        session.settle();
        EXPECT_EQ(notes_in(session), at_first);
        EXPECT_FALSE(opened->project.is_saved(session));
        for (size_t i = 0; i < 4; ++i)
            session.redo();
        session.settle();
        EXPECT_EQ(notes_in(session), all[3]);
    } // as one that is killed
    {
        const Result<Project::Seen> seen = Project::look(file("p"));
        ASSERT_TRUE(seen) << seen.error().message;
        EXPECT_EQ(notes_of(seen->contents.document.notes).value(), all[3]);
        EXPECT_EQ(style_of(*seen->contents.scene.scene.labels, 300), all[3].label_styles.at(300));
        Result<Project::Opened> opened = Project::open(file("p"));
        ASSERT_TRUE(opened) << opened.error().message;
        EXPECT_EQ(notes_of(opened->setup.document.notes).value(), all[3]);
        EXPECT_EQ(style_of(*opened->setup.scene.labels, 300), all[3].label_styles.at(300));
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        session.note(changes_between(session.state().document.notes, pages_of(all[7])), "note");
        session.settle();
        ASSERT_TRUE(opened->project.save(session));
    }
    const Result<Project::Opened> opened = Project::open(file("p"), {.unsaved = false});
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ(notes_of(opened->setup.document.notes).value(), all[7]);
}

// Undo reaches back past saves, after a kill and after opening, too; what it did is kept.
TEST_F(ProjectTest, UndoReachesBackPastASave) {
    make();
    std::vector<std::string> states;
    const auto open = [&] {
        Result<Project::Opened> opened = Project::open(file("p"));
        EXPECT_TRUE(opened) << opened.error().message;
        opened->setup.edit.threaded = false;
        return std::move(*opened);
    };
    {
        Project::Opened opened = open();
        Session session(std::move(opened.setup));
        states.push_back(all_of(session.state().document));
        for (const int n : {0, 5, 1, 6}) {
            act(session, n);
            states.push_back(all_of(session.state().document));
            ASSERT_TRUE(opened.project.save(session));
        }
        act(session, 4);
    } // as one that is killed
    Project::Opened opened = open();
    EXPECT_EQ(opened.unsaved, 1u);
    std::optional<Session> session(std::in_place, std::move(opened.setup));
    EXPECT_EQ(session->state().undo_steps, 5u);
    EXPECT_EQ(session->step_titles().back(), "cut on head");
    for (size_t i = states.size(); i-- > 2;) {
        session->undo();
        session->settle();
        EXPECT_EQ(session->take_refusal(), "");
        EXPECT_EQ(all_of(session->state().document), states[i]) << i;
    }
    session.reset(); // killed again, two steps before the save
    EXPECT_EQ(what_is_there(), states[2]);
    fs::remove(
        file("p/steps-5")); // without it the project is what it is, and undo ends at the save
    EXPECT_EQ(what_is_there(), states[2]);
}

// One step changes labels and what is noted of them.
TEST_F(ProjectTest, AStepIsADifferenceOfVolumesAndNotes) {
    make();
    const auto open = [&] {
        Result<Project::Opened> opened = Project::open(file("p"));
        opened->setup.edit.threaded = false;
        return std::move(*opened);
    };
    std::string before, after;
    {
        Project::Opened opened = open();
        Session session(std::move(opened.setup));
        before = all_of(session.state().document);
        Notes notes;
        notes.bound = {"fast-marching", "00", 2.5};
        session.put(
            {"organs", VolumeKind::labels,
             VolumeBuilder(head_and_organs().volumes[1].volume.grid(), ScalarType::u8).finish()},
            "fast-marching", Json::object(),
            changes_between(session.state().document.notes, pages_of(notes)));
        session.settle();
        after = all_of(session.state().document);
        EXPECT_EQ(session.state().undo_steps, 1u);
        EXPECT_THAT(after, HasSubstr("fast-marching"));
    }
    Project::Opened opened = open();
    Session session(std::move(opened.setup));
    EXPECT_EQ(all_of(session.state().document), after);
    session.undo();
    session.settle();
    EXPECT_EQ(all_of(session.state().document), before);
    session.redo();
    session.settle();
    EXPECT_EQ(all_of(session.state().document), after);
}

// Written at 8137680: measures, names and locks in project.json, planes and styles in the scene,
// and a journal of two strokes, the second undone.
TEST_F(ProjectTest, OfAnEarlierVersionOpens) {
    fs::copy(fs::path(kSourceDir) / "tests/unit/session/written/8137680.palpate", file("p"));
    Notes wanted;
    wanted.label_names = {{1, "liver", glm::dvec3(1.0, 0.5, 0.25)}, {2, "spleen", {}}};
    wanted.label_styles = {{1, {{1.0, 0.5, 0.25}, true}}, {2, {{0.25, 0.5, 1.0}, false}}};
    wanted.locked_labels = {2};
    wanted.measures = {{MeasureKind::ruler, {{1, 2, 3}, {4, 5, 6.5}}, "width"}};
    wanted.clip_planes = {{{1, 2, 3}, {0, 0, 1}}};
    Result<Project::Opened> opened = Project::open(file("p"));
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ(notes_of(opened->setup.document.notes).value(), wanted);
    EXPECT_EQ(opened->setup.kept.tool_radius_mm, 3.25);
    EXPECT_EQ(opened->setup.kept.crosshair_mm, glm::dvec3(1, 0, 0));
    opened->setup.edit.threaded = false;
    Session session(std::move(opened->setup));
    EXPECT_EQ(session.state().undo_steps, 1u);
    EXPECT_EQ(session.state().redo_steps, 1u);
    EXPECT_TRUE(session.redo());
    session.settle();
    ASSERT_TRUE(opened->project.save(session));
    EXPECT_EQ(notes_in(session), wanted);
}

} // namespace
} // namespace palpate
