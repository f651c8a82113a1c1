// A person is asked before edits are lost: after saves that fail, and of a mesh that was
// pulled.

#include <sys/resource.h>

#include <csignal>
#include <thread>

#include "apps/view/document/work.h"
#include "engine/base/timer.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

// With threads, as in a window: such a document can be saved.
class Leaving : public TemporaryFolder {
 protected:
    Work work_{Source{open_synthetic("synthetic:ball?size=24")}, {800, 600}, 1.0, true};
    ViewState state_ = work_.subject().home;

    void measure() {
        Measure ruler;
        ruler.kind = MeasureKind::ruler;
        ruler.points_mm = {glm::dvec3(0.0), glm::dvec3(1.0 + double(state_.notes.measures.size()))};
        state_.notes.measures.push_back(ruler);
        work_.follow_notes(state_, false);
        work_.session().settle();
    }
    // Of the project, as one reads them who does not open it.
    static size_t measures_in(const std::filesystem::path& folder) {
        const Result<Project::Seen> seen = Project::look(folder);
        EXPECT_TRUE(seen) << seen.error().message;
        return notes_of(seen->contents.document.notes)->measures.size();
    }
    // The message to the person.
    std::string save(const std::filesystem::path& folder) {
        const bool lost = work_.leaving_loses_edits();
        work_.saving().save(state_, folder.string());
        EXPECT_EQ(work_.leaving_loses_edits(), lost); // until it has ended
        while (work_.saving().is_saving()) {
            work_.poll();
            std::this_thread::yield();
        }
        return work_.take_message().shown(false);
    }
};

// A window without its screen, with threads.
class SaveAndOpen : public TemporaryFolder {
 protected:
    static ViewerOptions options() {
        ViewerOptions options{.threaded = true};
        options.open = [](const std::string& path, const std::string&, const std::stop_token&,
                          const std::function<void(double)>&) -> Result<Source> {
            return Source{open_synthetic(path)};
        };
        return options;
    }
    void frame(std::vector<Event> events) {
        viewer_.frame(std::move(events), time_s_);
        time_s_ += 1e-4; // of a clock of its own: messages go after seconds
    }
    template <class Done>
    void frames_until(const Done& done) {
        for (const Timer timer; !done(); frame({})) {
            ASSERT_LT(timer.ms(), 60e3);
            std::this_thread::yield();
        }
    }

    double time_s_ = 1.0;
    GpuDevice device_{headless_device("", true)};
    Viewer viewer_{device_,
                   device_,
                   VK_FORMAT_R8G8B8A8_UNORM,
                   Source{open_synthetic("synthetic:ball?size=24")},
                   {640, 480},
                   1.0,
                   options()};
};

TEST_F(Leaving, MeasuresOfANewProjectThatCannotBeWrittenAreAskedFor) {
    EXPECT_FALSE(work_.leaving_loses_edits());
    measure();
    EXPECT_TRUE(work_.leaving_loses_edits());
    write("file", "no folder");
    EXPECT_NE(save(file("file") / "work.palpate"), "");
    EXPECT_FALSE(work_.saving().has_project());
    EXPECT_TRUE(work_.leaving_loses_edits());
    EXPECT_NE(save(file("work.palpate")).find("saved to"), std::string::npos);
    EXPECT_TRUE(work_.saving().has_project());
    EXPECT_FALSE(work_.leaving_loses_edits());
}

// The limit on the size of files stands for a disk that is full. A measure is a step, and on disk
// before any save.
TEST_F(Leaving, MeasuresOfALaterSaveThatFailsAreKept) {
    measure();
    save(file("work.palpate"));
    ASSERT_FALSE(work_.leaving_loses_edits());
    measure();
    EXPECT_FALSE(work_.leaving_loses_edits());
    ::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    rlimit little = old;
    little.rlim_cur = 600; // a journal begins, project.json is larger
    ::setrlimit(RLIMIT_FSIZE, &little);
    const std::string told = save({});
    ::setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_EQ(told.find("saved to"), std::string::npos) << told;
    EXPECT_NE(told, "");
    EXPECT_EQ(measures_in(file("work.palpate")), 2u);
    EXPECT_NE(save({}).find("saved to"), std::string::npos);
    EXPECT_EQ(measures_in(file("work.palpate")), 2u);
}

// A measure that is made while a save is under way is a step after it.
TEST_F(Leaving, MeasuresMadeDuringASaveAreKept) {
    measure();
    work_.saving().save(state_, file("work.palpate").string());
    measure();
    while (work_.saving().is_saving()) {
        work_.poll();
        std::this_thread::yield();
    }
    EXPECT_FALSE(work_.leaving_loses_edits());
    EXPECT_EQ(measures_in(file("work.palpate")), 2u);
}

// Planes that cut the view, and colours, are undone, and no reason to ask.
TEST_F(Leaving, LooksAloneAreNotAskedFor) {
    state_.notes.clip_planes = {{glm::dvec3(0.0), {1.0, 0.0, 0.0}}};
    state_.notes.label_styles[3] = {{1.0, 0.0, 0.0}, false};
    work_.follow_notes(state_, false);
    work_.session().settle();
    EXPECT_EQ(work_.edited().undo_steps, 1u);
    EXPECT_FALSE(work_.leaving_loses_edits());
    state_.notes.locked_labels = {3};
    work_.follow_notes(state_, false);
    work_.session().settle();
    EXPECT_TRUE(work_.leaving_loses_edits());
}

// The name that is offered first is taken already; a person takes it even so, then another.
TEST_F(SaveAndOpen, AFolderThatIsThereIsAskedForAgain) {
    std::filesystem::create_directory(file("taken.palpate"));
    Work& work = viewer_.work();
    const auto type = [&](const std::filesystem::path& folder) {
        const Modifiers ctrl{.ctrl = true};
        for (const bool down : {true, false})
            frame({{.kind = Event::Kind::key, .modifiers = ctrl, .down = down, .key = "a"}});
        frame({{.kind = Event::Kind::text, .text = folder.string()}});
        for (const bool down : {true, false})
            frame({{.kind = Event::Kind::key, .down = down, .key = "enter"}});
    };
    const auto press_control_s = [&] {
        const Modifiers ctrl{.ctrl = true};
        for (const bool down : {true, false})
            frame({{.kind = Event::Kind::key, .modifiers = ctrl, .down = down, .key = "s"}});
        frame({});
        frame({});
    };
    press_control_s();
    ASSERT_TRUE(viewer_.interface().takes({.kind = Event::Kind::key}));
    type(file("taken.palpate"));
    frame({});
    EXPECT_TRUE(viewer_.state().saving_open);
    EXPECT_EQ(viewer_.state().saving_failed.shown(false),
              file("taken.palpate").string() + " is there already: choose another name");
    EXPECT_TRUE(viewer_.interface().widgets().count("save/failed"));
    EXPECT_FALSE(work.saving().is_saving());
    // A folder that cannot be made is found out later.
    press_control_s();
    type(file("none/deep.palpate"));
    frames_until([&] {
        return viewer_.state().saving_failed.shown(false).find("deep") != std::string::npos;
    });
    EXPECT_TRUE(viewer_.state().saving_open);
    EXPECT_FALSE(work.saving().has_project());
    press_control_s();
    type(file("free.palpate"));
    frames_until([&] { return work.saving().has_project(); });
    frame({});
    EXPECT_FALSE(viewer_.state().saving_open);
    EXPECT_TRUE(viewer_.state().saving_failed.empty());
}

TEST_F(SaveAndOpen, ControlSGivesTheFieldTheKeysAgain) {
    const auto press = [&](const char* key, Modifiers held) {
        for (const bool down : {true, false})
            frame({{.kind = Event::Kind::key, .modifiers = held, .down = down, .key = key}});
        frame({});
        frame({});
    };
    press("s", {.ctrl = true});
    ASSERT_TRUE(viewer_.interface().takes({.kind = Event::Kind::key}));
    const Box tools = places_of(viewer_.state()).tools;
    frame({{.kind = Event::Kind::move, .at_px = glm::dvec2(tools.low_px) + 20.0}});
    for (const bool down : {true, false})
        frame({{.kind = Event::Kind::button, .button = Button::left, .down = down}});
    frame({});
    ASSERT_FALSE(viewer_.interface().takes({.kind = Event::Kind::key}));
    press("s", {.ctrl = true});
    EXPECT_TRUE(viewer_.interface().takes({.kind = Event::Kind::key}));
    EXPECT_TRUE(viewer_.state().saving_open);
}

// A stroke after the project is opened again draws what it would have drawn before.
TEST_F(Leaving, AProjectKeepsTheRadiusAndTheLabelOfTheTool) {
    {
        Work work(Source{open_synthetic("synthetic:ball?size=24")}, {800, 600}, 1.0, true);
        state_.radius_mm = 7.5;
        state_.label = 4;
        work.saving().save(state_, file("work.palpate").string());
        while (work.saving().is_saving()) {
            work.poll();
            std::this_thread::yield();
        }
        work.watch(state_); // keeps what the save has put down
        EXPECT_EQ(work.session().kept().tool_label, 4);
    }
    Result<Project::Opened> opened = Project::open(file("work.palpate"));
    ASSERT_TRUE(opened) << opened.error().message;
    const Work again(Source{open_synthetic("synthetic:ball?size=24"), std::move(*opened)},
                     {800, 600}, 1.0, true);
    EXPECT_EQ(again.subject().home.radius_mm, 7.5);
    EXPECT_EQ(again.subject().home.label, 4);
}

TEST_F(Leaving, AFolderThatIsThereIsNotOffered) {
    const std::filesystem::path offered = work_.saving().new_folder(false);
    EXPECT_FALSE(std::filesystem::exists(offered));
    std::filesystem::create_directory(offered);
    const std::filesystem::path next = work_.saving().new_folder(false);
    std::filesystem::remove(offered);
    EXPECT_NE(next, offered);
    EXPECT_EQ(next.extension(), ".palpate");
    EXPECT_EQ(next.parent_path(), offered.parent_path());
}

// A person who saved on the way to another file reads where, once that is shown.
TEST_F(SaveAndOpen, SavedOnTheWayToAnotherFileIsSaid) {
    Session& session = viewer_.work().session();
    const NotePages before = session.state().document.notes;
    Notes notes = notes_of(before).value();
    name_label(notes, 1, "liver");
    session.note(changes_between(before, pages_of(notes)), "label names");
    session.settle();
    frame({});
    frame({{.kind = Event::Kind::drop, .paths = {"synthetic:phantom?size=24"}}});
    frame({});
    const auto press = [&](const char* id) {
        ASSERT_TRUE(viewer_.interface().widgets().count(id)) << id;
        const Box box = viewer_.interface().widgets().at(id);
        frame({{.kind = Event::Kind::move,
                .at_px = glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px)}});
        for (const bool down : {true, false})
            frame({{.kind = Event::Kind::button, .button = Button::left, .down = down}});
        frame({});
    };
    press("leave/save");
    ASSERT_TRUE(viewer_.state().saving_open);
    frame({});
    EXPECT_TRUE(viewer_.interface().widgets().count("save/folder/choose"));
    for (const bool down : {true, false})
        frame({{.kind = Event::Kind::key, .modifiers = {.ctrl = true}, .down = down, .key = "a"}});
    frame({{.kind = Event::Kind::text, .text = file("way.palpate").string()}});
    press("save/save");
    frames_until([&] { return viewer_.title() == "synthetic:phantom?size=24"; });
    frame({});
    EXPECT_NE(viewer_.interface().message().find("saved to " + file("way.palpate").string()),
              std::string::npos)
        << viewer_.interface().message();
}

// A document's messages are gone with it: a person does not take them to be about the next one.
TEST_F(SaveAndOpen, NothingNamesTheOldProjectOnceTheNextFileIsShown) {
    viewer_.work().saving().save(viewer_.state(), file("first.palpate").string());
    frames_until([&] { return !viewer_.interface().message().empty(); });
    EXPECT_NE(viewer_.interface().message().find("first.palpate"), std::string::npos);
    EXPECT_EQ(viewer_.title(), "first.palpate");
    frame({{.kind = Event::Kind::drop, .paths = {"synthetic:phantom?size=24"}}});
    frames_until([&] { return viewer_.title() != "first.palpate"; });
    EXPECT_LT(time_s_, 6.0) << "as long as a message is shown";
    EXPECT_EQ(viewer_.interface().message(), "");
    frame({});
    EXPECT_EQ(viewer_.interface().message(), "");
}

} // namespace
} // namespace palpate::view
