// Saves: as another project, of a session, beside a stroke, and by themselves.

#include <gmock/gmock.h>

#include <atomic>
#include <thread>

#include "engine/base/json.h"
#include "engine/base/profile.h"
#include "engine/session/kept.h"
#include "tests/unit/session/project_fixture.h"

namespace palpate {
namespace {

using testing::HasSubstr;

// The text of one alone, and of all of them, gives the same again.
TEST(Kept, ComesBackFromItsText) {
    std::vector<Kept> all(4);
    all[0].crosshair_mm = glm::dvec3(-1.5, 0.0, 1e6);
    all[1].tool_radius_mm = 3.25;
    all[2].tool_label = 300;
    all[3].isos = {{{-300.0, {0.9, 0.625, 0.5}, 0.35}, "skin"}, {{1e-3}, "", false}};
    all.push_back({all[0].crosshair_mm, all[1].tool_radius_mm, all[2].tool_label, all[3].isos});
    for (const Kept& kept : all) {
        const std::string text = json_line(kept_json(kept));
        const Result<Json> json = parse_json(text, "kept");
        ASSERT_TRUE(json) << text;
        JsonErrors errors{"kept", {}};
        EXPECT_EQ(read_kept(JsonValue(*json, "", errors)), kept) << text;
        EXPECT_FALSE(errors.first) << text;
        EXPECT_NE(kept, Kept());
    }
}

// From then on the session's steps are kept in the new folder; the old one stays as it was left.
TEST_F(ProjectTest, IsSavedAsAnother) {
    make();
    {
        Result<Project::Opened> opened = Project::open(file("p"));
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        act(session, 0);
        act(session, 1);
        EXPECT_FALSE(opened->project.is_saved(session));
        ASSERT_FALSE(opened->project.save_as(file("p"), session)); // it is there
        ASSERT_FALSE(opened->project.save_as(file("none/q"), session));
        act(session, 2); // an undo, kept in the old one still
        EXPECT_EQ(all_of(Project::look(file("p"))->contents.document), expected()[3]);
        const Result<void> moved = opened->project.save_as(file("q"), session);
        ASSERT_TRUE(moved) << moved.error().message;
        EXPECT_EQ(opened->project.folder(), file("q"));
        EXPECT_TRUE(opened->project.is_saved(session));
        act(session, 3);
        act(session, 4);
        EXPECT_EQ(all_of(Project::look(file("q"))->contents.document), expected()[5]);
        ASSERT_TRUE(opened->project.save(session));
    }
    EXPECT_EQ(what_is_there(), expected()[3]);
    EXPECT_EQ(all_of(Project::open(file("q"))->setup.document), expected()[5]);
}

// A session goes on while it is saved as another; its steps meanwhile are kept in both.
TEST_F(ProjectTest, IsSavedAsAnotherInTheBackground) {
    make();
    {
        Result<Project::Opened> opened = Project::open(file("p"));
        opened->setup.edit.threaded = false;
        Project& project = opened->project;
        Session session(std::move(opened->setup));
        const auto poll = [&] {
            std::optional<Result<void>> ended;
            while (project.is_saving() && !ended)
                ended = project.poll(session, 0);
            return ended;
        };
        act(session, 0);
        ASSERT_TRUE(project.begin_save_as(file("none/q"), session));
        auto ended = poll();
        ASSERT_TRUE(ended);
        EXPECT_THAT(ended->error().message, HasSubstr("none/q"));
        EXPECT_EQ(project.folder(), file("p"));

        ASSERT_TRUE(project.begin_save_as(file("q"), session));
        EXPECT_FALSE(project.begin_save(session));
        EXPECT_FALSE(project.begin_save_as(file("r"), session));
        act(session, 1);
        EXPECT_EQ(all_of(Project::look(file("p"))->contents.document), expected()[2]);
        ended = poll();
        ASSERT_TRUE(ended);
        ASSERT_TRUE(*ended) << ended->error().message;
        EXPECT_EQ(project.folder(), file("q"));
        EXPECT_FALSE(project.poll(session, 0));  // once
        EXPECT_FALSE(project.is_saved(session)); // but for the step meanwhile
        act(session, 2);
        ASSERT_TRUE(project.save(session));
    }
    EXPECT_EQ(what_is_there(), expected()[2]);
    EXPECT_EQ(all_of(Project::open(file("q"))->setup.document), expected()[3]);
    EXPECT_FALSE(fs::exists(file("r")));
}

// A session that no project was opened for.
TEST_F(ProjectTest, IsMadeOfASession) {
    Session session({.document = head_and_organs(),
                     .grey = "head",
                     .labels = "organs",
                     .scene = {},
                     .touch = {},
                     .parameters = {.iso = 77.0},
                     .mesh_iso = {},
                     .edit = {}});
    ASSERT_TRUE(session.undo()); // refused
    {
        Result<Project> made = Project::create_from(file("p"), session, {}, "CT");
        ASSERT_TRUE(made) << made.error().message;
        ASSERT_TRUE(session.put({"mask", VolumeKind::labels, *head_and_organs().find("organs")},
                                "threshold"));
        session.settle();
    }
    const auto seen = Project::look(file("p"));
    ASSERT_TRUE(seen) << seen.error().message;
    EXPECT_EQ(all_of(seen->contents.document), all_of(session.state().document));
    EXPECT_EQ(seen->contents.touch.iso, 77.0);
    EXPECT_EQ(seen->contents.modality, "CT");
    EXPECT_EQ(seen->contents.labels, "organs");
    ASSERT_EQ(seen->unsaved.size(), 1u);
    EXPECT_EQ(seen->unsaved[0].entry.change.title, "threshold");
}

// A stroke that does not end bounds a save, and takes part in the next one.
TEST_F(ProjectTest, ASaveWaitsForAStrokeNoLongerThanItsLimit) {
    make();
    Result<Project::Opened> opened = Project::open(file("p"));
    Session session(std::move(opened->setup));
    const Stroke cut = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 3})", ""),
                                    {.kind = OperationKind::cut, .to_value = 5}, {{}});
    ASSERT_TRUE(session.use({cut.shape, cut.tool, cut.operation, "head", ""}));
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    haptics::RecordedDevice device(
        {.workspace_m = glm::dvec3(1)},
        records_of_path(haptics::HandPath({{.buttons = 1}, {.time_s = 600, .buttons = 1}}),
                        workspace, 1'000'000),
        profile::now_ns());
    ASSERT_TRUE(session.start({device, *haptics::find_algorithm("none"), workspace, {}, {}, {}}));
    while (session.state().inputs_done < 3) // the stroke has begun
        std::this_thread::yield();
    const Result<void> late = opened->project.save(session, Project::Limit(30));
    ASSERT_FALSE(late);
    EXPECT_THAT(late.error().message, HasSubstr("lift the tool"));
    EXPECT_EQ(opened->project.saves(), 1u);
    EXPECT_FALSE(files().contains("journal-2"));
    session.stop(); // ends the stroke
    const Result<void> saved = opened->project.save(session, std::chrono::hours(1));
    ASSERT_TRUE(saved) << saved.error().message;
    session.settle();
    EXPECT_EQ(opened->project.saves(), 2u);
    EXPECT_EQ(all_of(Project::look(file("p"))->contents.document),
              all_of(session.state().document));
}

TEST_F(ProjectTest, SavesByItselfWhereSomethingHasChanged) {
    make();
    Result<Project::Opened> opened = Project::open(file("p"));
    Project& project = opened->project;
    Session session(std::move(opened->setup));
    int64_t now_ns = 0;
    const auto wait_s = [&](double s) -> std::optional<Result<void>> {
        now_ns += std::llround(1e9 * s);
        std::optional<Result<void>> saved = project.poll(session, now_ns);
        while (!saved && project.is_saving())
            saved = project.poll(session, now_ns);
        return saved;
    };
    session.set_iso(200.0);
    EXPECT_FALSE(wait_s(1000)); // never
    project.autosave_every(std::chrono::minutes(1));
    EXPECT_FALSE(wait_s(59));
    const auto saved = wait_s(2);
    ASSERT_TRUE(saved);
    ASSERT_TRUE(*saved) << saved->error().message;
    EXPECT_EQ(project.saves(), 2u);
    EXPECT_EQ(Project::look(file("p"))->contents.touch.iso, 200.0);
    EXPECT_FALSE(wait_s(100)); // nothing has changed
    session.remove("organs");
    session.settle();
    EXPECT_FALSE(wait_s(30));
    EXPECT_TRUE(wait_s(31));
    EXPECT_TRUE(project.is_saved(session));
    EXPECT_EQ(Project::look(file("p"))->contents.document.volumes.size(), 1u);
    EXPECT_EQ(Project::look(file("p"))->unsaved.size(), 0u);
    project.autosave_every({});
    session.set_iso(100.0);
    EXPECT_FALSE(wait_s(1000));
    // By hand, the same way.
    ASSERT_TRUE(project.begin_save(session));
    EXPECT_TRUE(wait_s(0));
    EXPECT_EQ(project.saves(), 4u);
}

} // namespace
} // namespace palpate
