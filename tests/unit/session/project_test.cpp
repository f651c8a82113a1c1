// Projects are opened again to the byte, and bad ones are refused in a sentence.

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "engine/base/profile.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "tests/unit/session/project_fixture.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// ProjectTest takes over 5 s of a processor: projects are written and read again, one of them while
// a thread saves it, and processes are killed meanwhile.
TEST_F(ProjectTest, IsOpenedAgainToTheByte) {
    make();
    EXPECT_FALSE(Project::create(file("p"), contents())); // it is there
    Result<Project::Opened> opened = Project::open(file("p"));
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_TRUE(opened->notes.empty());
    EXPECT_EQ(all_of(opened->setup.document), all_of(head_and_organs()));
    EXPECT_EQ(opened->setup.grey, "head");
    EXPECT_EQ(opened->setup.labels, "organs");
    EXPECT_EQ(opened->setup.scene,
              resolved_scene(contents().scene, head_and_organs().first().grid()));
    const haptics::TouchParameters touch = opened->setup.parameters, wanted = contents().touch;
    EXPECT_EQ(touch.iso, wanted.iso);
    EXPECT_EQ(touch.stiffness_n_per_m, wanted.stiffness_n_per_m);
    EXPECT_EQ(touch.source, wanted.source);
    EXPECT_EQ(touch.transfer, wanted.transfer);
    EXPECT_EQ(touch.label_count, wanted.label_count);
    EXPECT_EQ(touch.labels, wanted.labels);
    EXPECT_EQ(files(),
              (std::set<std::string>{"project.json", "journal-1", "head-1.pbv", "organs-1.pbv"}));
}

// A map that is added to a project is there when it is opened again, and no step leads to it.
TEST_F(ProjectTest, AnAddedVolumeIsNoStep) {
    make();
    const Grid grid = head_and_organs().first().grid();
    const NamedVolume map{"seeds", VolumeKind::labels,
                          VolumeBuilder(grid, ScalarType::u8).finish()};
    {
        Result<Project::Opened> opened = Project::open(file("p"));
        ASSERT_TRUE(opened);
        const Result<void> added = opened->add(map);
        ASSERT_TRUE(added) << added.error().message;
        EXPECT_FALSE(opened->add(map)); // it is there
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        EXPECT_EQ(session.state().undo_steps, 0u);
        act(session, 0);
    }
    EXPECT_TRUE(files().contains("seeds-1.pbv"));
    Result<Project::Opened> again = Project::open(file("p"));
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->unsaved, 1u);
    ASSERT_TRUE(again->setup.document.find("seeds"));
    EXPECT_EQ(again->setup.document.find("seeds")->grid(), grid);
    const Result<void> refused = again->add({"more", VolumeKind::labels, map.volume});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("expected no unsaved steps, found 1"));
    again->setup.edit.threaded = false;
    Session session(std::move(again->setup));
    ASSERT_TRUE(again->project.save(session));
    EXPECT_TRUE(files().contains("seeds-1.pbv")); // it has not changed
    session.undo();
    session.settle();
    EXPECT_TRUE(session.state().document.find("seeds"));
}

TEST_F(ProjectTest, GoesOnFromWhereItWasLeftWithOrWithoutASave) {
    for (int step = 1; step < kActs; ++step) {
        make();
        for (int from = 0; from < kActs; from += step) {
            const int to = std::min(from + step, kActs);
            const Result<void> done = work(file("p"), from, to, [](int) {});
            ASSERT_TRUE(done) << done.error().message;
            ASSERT_EQ(what_is_there(), expected()[size_t(to)]) << from << " to " << to;
        }
        // Only the files that the last of four saves needs are there.
        EXPECT_TRUE(files().contains("journal-4"));
        for (const std::string& name : files())
            EXPECT_TRUE(name == "journal-4" || !name.starts_with("journal")) << name;
    }
}

// Steps from before a save can be taken back after it, in the session and from the journal.
TEST_F(ProjectTest, UndoGoesBeyondASave) {
    make();
    {
        Result<Project::Opened> opened = Project::open(file("p"));
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        act(session, 0);
        act(session, 1);
        ASSERT_TRUE(opened->project.save(session));
        session.undo();
        session.undo();
        session.redo();
        session.settle();
        EXPECT_EQ(all_of(session.state().document), expected()[1]);
        EXPECT_EQ(session.state().undo_steps, 1u);
    }
    EXPECT_EQ(what_is_there(), expected()[1]);
}

TEST_F(ProjectTest, KeepsWhatAnUnchangedVolumeLiesInAndFilesOfOthers) {
    make();
    write("p/notes.txt", "mine");
    write("p/scan-1.pbv", "mine, too");
    const auto before = fs::last_write_time(file("p/organs-1.pbv"));
    {
        Result<Project::Opened> opened = Project::open(file("p"));
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        stroke(session, 2); // of the head
        haptics::TouchParameters softer = session.parameters();
        softer.stiffness_n_per_m = 55.0;
        session.feel(softer);
        ASSERT_TRUE(opened->project.save(session));
    }
    EXPECT_EQ(files(), (std::set<std::string>{"project.json", "journal-2", "steps-2", "head-2.pbv",
                                              "organs-1.pbv", "notes.txt", "scan-1.pbv"}));
    EXPECT_EQ(fs::last_write_time(file("p/organs-1.pbv")), before);
    EXPECT_EQ(Project::open(file("p"))->setup.parameters.stiffness_n_per_m, 55.0);
}

// Seen before it is opened, its unsaved steps can be kept, or put aside and lost by nobody.
TEST_F(ProjectTest, UnsavedStepsAreOfferedAndCanBePutAside) {
    for (const bool cut : {false, true}) {
        make();
        ASSERT_TRUE(work(file("p"), 0, 6, [](int) {})); // saves after 4 acts, then one more
        if (cut) {                                      // of a save that was begun and killed
            ASSERT_TRUE(Journal::create(file("p/journal-3"), {.save = 3}));
        }
        const Result<Project::Seen> seen = Project::look(file("p/project.json"));
        ASSERT_TRUE(seen) << seen.error().message;
        EXPECT_EQ(all_of(seen->contents.document), expected()[6]);
        EXPECT_EQ(seen->saves, 2u);
        EXPECT_EQ(seen->unsaved.size(), 1u);
        {
            const auto opened = Project::open(file("p"));
            EXPECT_EQ(opened->unsaved, 1u);
            EXPECT_TRUE(Project::look(file("p"))); // while another has it open
            const auto refused = Project::open(file("p"), {.unsaved = false, .stop = {}});
            ASSERT_FALSE(refused);
            EXPECT_THAT(
                refused.error().message,
                HasSubstr("p: the project is open already, in a window or in another program"));
        }
        {
            auto opened = Project::open(file("p"), {.unsaved = false, .stop = {}});
            ASSERT_TRUE(opened) << opened.error().message;
            EXPECT_EQ(opened->unsaved, 0u);
            EXPECT_EQ(all_of(opened->setup.document), expected()[5]);
            opened->setup.edit.threaded = false;
            Session session(std::move(opened->setup));
            EXPECT_TRUE(opened->project.is_saved(session));
            act(session, 5);
            EXPECT_EQ(all_of(session.state().document), expected()[6]);
        }
        EXPECT_EQ(what_is_there(), expected()[6]);
        EXPECT_EQ(Journal::peek(file("p/journal-2.set-aside"))->entries.size(), 1u);
        EXPECT_EQ(files().contains("journal-3.set-aside"), cut);
    }
}

// A journal whose first bytes are zeros is named, and stays; the last save opens beside it.
TEST_F(ProjectTest, AJournalThatLostItsBeginningIsToldAndKept) {
    for (const size_t zeros : {18u, 30u}) { // of the first line, and of what it belongs to
        make();
        ASSERT_TRUE(work(file("p"), 0, 3, [](int) {}));
        std::string damaged = bytes_of("p/journal-1");
        std::fill_n(damaged.begin(), std::min(zeros, damaged.size()), '\0');
        write("p/journal-1", damaged);
        for (const std::string& why :
             {Project::look(file("p")).error().message, Project::open(file("p")).error().message})
            EXPECT_THAT(
                why, AllOf(HasSubstr("journal-1: damaged at byte 0"),
                           HasSubstr("with 3 steps that could be read"), HasSubstr("--discard")));
        EXPECT_EQ(bytes_of("p/journal-1"), damaged);
        EXPECT_EQ(
            all_of(Project::look(file("p"), {.unsaved = false, .stop = {}})->contents.document),
            expected()[0]);
        const auto opened = Project::open(file("p"), {.unsaved = false, .stop = {}});
        ASSERT_TRUE(opened) << opened.error().message;
        EXPECT_EQ(all_of(opened->setup.document), expected()[0]);
        EXPECT_EQ(bytes_of("p/journal-1.set-aside"), damaged);
    }
}

// A map of u8 in which a label above 255 is drawn is u16 from then on, saved or not; undone, it is
// u8 again.
TEST_F(ProjectTest, LabelsThatGrowAreKeptSavedAndTakenBack) {
    make();
    const auto draw = [](Session& session, uint16_t label) {
        const Stroke stroke = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 4})", ""),
                                           {.kind = OperationKind::draw, .label = label}, {{}});
        ASSERT_TRUE(session.use({stroke.shape, stroke.tool, stroke.operation, "organs", ""}));
        const Grid& grid = session.state().document.find("organs")->grid();
        const StrokePose at{0.0, {world_point(grid, glm::dvec3(grid.size / 2u)), {1, 0, 0, 0}}};
        ASSERT_TRUE(session.stroke(EditInput::Kind::down, at));
        ASSERT_TRUE(session.stroke(EditInput::Kind::up, at));
        session.settle();
    };
    const auto organs = [](const Document& document) { return *document.find("organs"); };
    const Volume before = organs(contents().document);
    ASSERT_EQ(before.type(), ScalarType::u8);
    for (const bool saved : {false, true}) {
        {
            Result<Project::Opened> opened = Project::open(file("p"));
            opened->setup.edit.threaded = false;
            Session session(std::move(opened->setup));
            draw(session, saved ? 65535 : 300);
            EXPECT_EQ(session.felt().labels->type(), ScalarType::u16);
            if (saved) {
                ASSERT_TRUE(opened->project.save(session));
                ASSERT_TRUE(session.undo());
                session.settle();
                EXPECT_EQ(session.state().document.find("organs")->type(), ScalarType::u16)
                    << "300 is there still";
                ASSERT_TRUE(session.redo());
                session.settle();
            }
        }
        const Result<Project::Seen> seen = Project::look(file("p"));
        ASSERT_TRUE(seen) << seen.error().message;
        const Volume grown = organs(seen->contents.document);
        EXPECT_EQ(grown.type(), ScalarType::u16);
        EXPECT_EQ(grown.range().max, saved ? 65535.0f : 300.0f);
        Result<Project::Opened> opened = Project::open(file("p"));
        EXPECT_EQ(content_hash(organs(opened->setup.document)), content_hash(grown));
        opened->setup.edit.threaded = false;
        if (saved)
            continue;
        Session session(std::move(opened->setup));
        ASSERT_TRUE(session.undo());
        session.settle();
        EXPECT_EQ(organs(session.state().document).type(), ScalarType::u8);
        EXPECT_EQ(content_hash(organs(session.state().document)), content_hash(before));
        ASSERT_TRUE(session.redo());
        session.settle();
        EXPECT_EQ(content_hash(organs(session.state().document)), content_hash(grown));
    }
}

// Undo and redo are told by the steps that are in effect; strokes that changed nothing by why.
TEST_F(ProjectTest, TellsWhichStepsAreInEffectAndWhichChangedNothing) {
    make();
    Result<Project::Opened> opened = Project::open(file("p"));
    opened->setup.edit.threaded = false;
    Session session(std::move(opened->setup));
    const auto in_effect = [&] {
        std::string text;
        const Result<Project::Seen> seen = Project::look(file("p"));
        EXPECT_TRUE(seen) << seen.error().message;
        EXPECT_EQ(all_of(seen->contents.document), all_of(session.state().document));
        EXPECT_EQ(seen->in_effect(), session.state().undo_steps);
        for (const Project::Step& step : seen->unsaved)
            text += step.in_effect ? '1' : '0';
        return text;
    };
    const auto do_all = [&](const char* acts) { // s: a stroke, u: undo, r: redo
        for (; *acts; ++acts) {
            if (*acts == 's')
                stroke(session, static_cast<int>(session.state().strokes_done));
            else
                ASSERT_TRUE(*acts == 'u' ? session.undo() : session.redo());
            session.settle();
        }
    };
    do_all("sss");
    EXPECT_EQ(in_effect(), "111");
    do_all("uu");
    EXPECT_EQ(in_effect(), "100");
    do_all("r");
    EXPECT_EQ(in_effect(), "110");
    do_all("s"); // what was undone cannot be done again
    EXPECT_EQ(in_effect(), "1101");
    do_all("uuu");
    EXPECT_EQ(in_effect(), "0000");

    const Stroke far = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 3})", ""),
                                    {.kind = OperationKind::cut, .to_value = 5}, {{}});
    ASSERT_TRUE(session.use({far.shape, far.tool, far.operation, "head", ""}));
    using Kind = EditInput::Kind;
    ASSERT_TRUE(session.stroke(Kind::down, {0.0, {{500, 0, 0}}}));
    ASSERT_TRUE(session.stroke(Kind::up, {0.0, {{500, 0, 0}}}));
    session.settle();
    const Result<Project::Seen> seen = Project::look(file("p"));
    EXPECT_THAT(seen->unsaved.back().why_idle, HasSubstr("the volume lies elsewhere"));
    EXPECT_EQ(seen->unsaved.front().why_idle, "");
}

// Those who look while another works and saves see the states there were, in their order.
TEST_F(ProjectTest, IsSeenWholeWhileAnotherSavesIt) {
    make();
    std::atomic<bool> done = false;
    std::vector<std::string> states; // the worker's until it has ended
    std::thread worker([&] {
        Result<Project::Opened> opened = Project::open(file("p"));
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        states.push_back(all_of(session.state().document));
        for (int n = 0; n < 300; ++n) {
            if (n % 15 == 0) {
                stroke(session, n / 15);
                states.push_back(all_of(session.state().document));
            }
            const Result<void> saved = opened->project.save(session);
            EXPECT_TRUE(saved) << saved.error().message;
        }
        done = true;
    });
    struct Looker {
        std::vector<std::string> seen, errors;
        std::set<uint64_t> saves;
    };
    Looker lookers[3];
    {
        std::vector<std::jthread> threads;
        for (Looker& looker : lookers)
            threads.emplace_back([&] {
                while (!done || looker.saves.empty()) {
                    const Result<Project::Seen> looked = Project::look(file("p"));
                    if (!looked) {
                        looker.errors.push_back(looked.error().message);
                        continue;
                    }
                    looker.errors.insert(looker.errors.end(), looked->notes.begin(),
                                         looked->notes.end());
                    looker.saves.insert(looked->saves);
                    looker.seen.push_back(all_of(looked->contents.document));
                }
            });
    }
    worker.join();
    for (const Looker& looker : lookers) {
        EXPECT_TRUE(looker.errors.empty())
            << looker.errors.size() << " errors: " << looker.errors.front();
        size_t at = 0;
        for (const std::string& state : looker.seen) {
            const auto found =
                std::find(states.begin() + static_cast<ptrdiff_t>(at), states.end(), state);
            ASSERT_NE(found, states.end()) << "a state that was not there, or no longer";
            at = static_cast<size_t>(found - states.begin());
        }
        std::printf("    seen %zu times, at %zu saves\n", looker.seen.size(), looker.saves.size());
    }
}

TEST_F(ProjectTest, OneProcessHasItOpen) {
    make();
    const Result<Project::Opened> opened = Project::open(file("p"));
    ASSERT_TRUE(opened);
    EXPECT_THAT(error(),
                HasSubstr("p: the project is open already, in a window or in another program"));
}

TEST_F(ProjectTest, BadOnesAreRefusedInASentence) {
    make();
    const std::string good = bytes_of("p/project.json");
    const auto with = [&](const std::string& what, const std::string& other) {
        std::string text = good;
        const size_t at = text.find(what);
        EXPECT_NE(at, text.npos) << what;
        write("p/project.json", text.replace(at, what.size(), other));
        return error();
    };
    EXPECT_THAT(
        with("\"project\": 1", "\"project\": 2"),
        AllOf(HasSubstr("project.json:"), HasSubstr("expected version 1"), HasSubstr("found 2")));
    EXPECT_THAT(with("\"project\"", "\"picture\""), HasSubstr("expected a project"));
    EXPECT_THAT(with("\"file\": \"head-1.pbv\"", "\"file\": \"../head-1.pbv\""),
                HasSubstr("expected the name of a file in the project's folder"));
    EXPECT_THAT(with("\"file\": \"head-1.pbv\"", "\"file\": \"nose-1.pbv\""),
                HasSubstr("nose-1.pbv"));
    EXPECT_THAT(with("\"kind\": \"grey\"", "\"kind\": \"gray\""), HasSubstr("labels"));
    EXPECT_THAT(with("\"name\": \"organs\"", "\"name\": \"head\""), HasSubstr("names that differ"));
    EXPECT_THAT(with("\"grey\": \"head\"", "\"grey\": \"nose\""), HasSubstr("one of the volumes"));
    EXPECT_THAT(with("\"stiffness_n_per_m\": 321", "\"stiffness_n_per_m\": -1"),
                HasSubstr("touch.stiffness_n_per_m: expected"));
    EXPECT_THAT(with("\"mode\": \"iso\"", "\"mode\": \"isa\""), HasSubstr("project.json: scene"));
    EXPECT_THAT(with("\"save\": 1", "\"save\": 4"), HasSubstr("journal-4"));
    for (size_t size = 0; size < good.size(); size += 97) {
        write("p/project.json", good.substr(0, size));
        EXPECT_THAT(error(), HasSubstr("project.json"));
    }
    write("p/project.json", good);
    write("p/head-1.pbv", "no volume");
    EXPECT_THAT(error(), HasSubstr("head-1.pbv"));
    fs::remove_all(file("p"));
    EXPECT_THAT(error(), HasSubstr("project.json"));
}

} // namespace
} // namespace palpate
