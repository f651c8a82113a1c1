// Projects are opened again to the byte, and lose no step that had ended, whenever the process that
// works on them is killed. PALPATE_KILLS is how often: few in `quick`.

#include "engine/session/project.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <map>
#include <set>
#include <thread>

#include "engine/base/profile.h"
#include "tests/support/kill.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/session/session_work.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kActs = 12; // of the process that is killed
// After these it saves. No undo leads beyond: who opens a project has the steps since its save.
bool saves_after(int n) {
    return n == 4 || n == 6 || n == 11;
}

ProjectContents contents() {
    ProjectContents all{head_and_organs(), "head", "organs", {}, {}};
    all.scene.volume = "head.nrrd";
    all.scene.scene.ray_cast.emplace();
    all.scene.scene.ray_cast->mode = RayMode::iso;
    all.scene.scene.ray_cast->isos = {{300.0}};
    all.scene.scene.labels.emplace();
    all.touch.iso = 0.1;
    all.touch.stiffness_n_per_m = 321.0;
    all.touch.source = haptics::TouchSource::labels;
    all.touch.transfer[1] = {.strength_n = 0.3, .point_count = 2, .values = {1, 2}};
    all.touch.label_count = 1;
    all.touch.labels[0] = {.label = 3, .stiffness_n_per_m = 99.0, .friction_static = 0.25};
    return all;
}

// Opens it and does acts `from` to `to`, saving after some; tells `told` how many had ended, after
// each.
Result<void> work(const fs::path& folder, int from, int to, const std::function<void(int)>& told) {
    PALPATE_TRY(Project::Opened opened, Project::open(folder));
    opened.setup.edit.threaded = false;
    Session session(std::move(opened.setup));
    told(from);
    for (int n = from; n < to; ++n) {
        act(session, n);
        told(n + 1);
        if (saves_after(n))
            PALPATE_TRY(opened.project.save(session));
    }
    return {};
}

// The document after 0, 1, .. acts, without any project.
const std::vector<std::string>& expected() {
    static const std::vector<std::string> all = [] {
        Session session({.document = head_and_organs(),
                         .grey = "head",
                         .labels = "organs",
                         .scene = {},
                         .touch = {},
                         .parameters = {},
                         .mesh_iso = {},
                         .edit = {.threaded = false}});
        std::vector<std::string> states{all_of(session.state().document)};
        for (int n = 0; n < kActs; ++n) {
            act(session, n);
            states.push_back(all_of(session.state().document));
        }
        return states;
    }();
    return all;
}

class ProjectTest : public TemporaryFolder {
 protected:
    void make() const {
        fs::remove_all(file("p"));
        const Result<void> made = Project::create(file("p"), contents());
        ASSERT_TRUE(made) << made.error().message;
    }
    // At once, for one who may be killed meanwhile.
    void take_away() const {
        fs::remove_all(file("old"));
        if (fs::exists(file("p")))
            fs::rename(file("p"), file("old"));
    }
    std::string what_is_there() const {
        const Result<Project::Opened> opened = Project::open(file("p"));
        return opened ? all_of(opened->setup.document) : opened.error().message;
    }
    std::string error() const {
        const Result<Project::Opened> opened = Project::open(file("p"));
        return opened ? "" : opened.error().message;
    }
    std::set<std::string> files() const {
        std::set<std::string> names;
        for (const auto& entry : fs::directory_iterator(file("p")))
            names.insert(entry.path().filename().string());
        return names;
    }
};

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

TEST_F(ProjectTest, GoesOnFromWhereItWasLeftWithOrWithoutASave) {
    for (int step = 1; step < kActs; ++step) {
        make();
        for (int from = 0; from < kActs; from += step) {
            const int to = std::min(from + step, kActs);
            const Result<void> done = work(file("p"), from, to, [](int) {});
            ASSERT_TRUE(done) << done.error().message;
            ASSERT_EQ(what_is_there(), expected()[size_t(to)]) << from << " to " << to;
        }
        // Of four saves, only what the last one needs is there.
        EXPECT_TRUE(files().contains("journal-4"));
        for (const std::string& name : files())
            EXPECT_TRUE(name == "journal-4" || !name.starts_with("journal")) << name;
    }
}

// What a person did before a save can be taken back after it, in the session and from the journal.
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
    EXPECT_EQ(files(), (std::set<std::string>{"project.json", "journal-2", "head-2.pbv",
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
            EXPECT_THAT(refused.error().message, HasSubstr("found one that is running"));
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

TEST_F(ProjectTest, OneProcessHasItOpen) {
    make();
    const Result<Project::Opened> opened = Project::open(file("p"));
    ASSERT_TRUE(opened);
    EXPECT_THAT(error(), HasSubstr("found one that is running"));
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

// A child has the threads it makes, so it is this program again.
int become_worker(const char* job, const fs::path& folder, int told) {
    ::setenv("PALPATE_JOB", job, 1);
    ::setenv("PALPATE_FOLDER", folder.c_str(), 1);
    ::setenv("PALPATE_TOLD", std::to_string(told).c_str(), 1);
    ::dup2(::open("/dev/null", O_RDWR), STDOUT_FILENO);
    return ::execl("/proc/self/exe", "test", "--gtest_also_run_disabled_tests",
                   "--gtest_filter=ProjectWorker.*", static_cast<char*>(nullptr));
}

TEST(ProjectWorker, DISABLED_Works) {
    const char *job = std::getenv("PALPATE_JOB"), *folder = std::getenv("PALPATE_FOLDER");
    ASSERT_TRUE(job && folder);
    const int told = std::atoi(std::getenv("PALPATE_TOLD"));
    if (job == std::string("create")) {
        const Result<void> made = Project::create(folder, contents());
        ASSERT_TRUE(made) << made.error().message;
        return;
    }
    const Result<void> done = work(folder, 0, kActs, [&](int n) {
        const auto byte = static_cast<uint8_t>(1 + n);
        ASSERT_EQ(::write(told, &byte, 1), 1);
    });
    ASSERT_TRUE(done) << done.error().message;
}

TEST_F(ProjectTest, LosesNoStepThatHadEndedWheneverItIsKilled) {
    make();
    fs::copy(file("p"), file("fresh"), fs::copy_options::recursive);
    (void)expected();
    int told[2];
    ASSERT_EQ(::pipe2(told, O_NONBLOCK), 0);
    std::map<uint64_t, int> saves;
    kill_at_many_moments(
        PALPATE_KILLS,
        [&] {
            if (::write(told[1], "", 1) != 1) // 0: nothing is opened yet
                return 1;
            take_away();
            fs::remove_all(file("copy"));
            fs::copy(file("fresh"), file("copy"), fs::copy_options::recursive);
            fs::rename(file("copy"), file("p"));
            return become_worker("work", file("p"), told[1]);
        },
        [&] {
            uint8_t last = 0; // 1 + how many acts had ended
            for (uint8_t n = 0; ::read(told[0], &n, 1) == 1;)
                last = n;
            if (last == 0)
                return;
            const size_t done = last - 1u;
            {
                const Result<Project::Opened> opened = Project::open(file("p"));
                ASSERT_TRUE(opened) << opened.error().message;
                const std::string there = all_of(opened->setup.document);
                ASSERT_TRUE(there == expected()[done] ||
                            (done < size_t(kActs) && there == expected()[done + 1]))
                    << done << " acts had ended";
                ++saves[opened->project.saves()];
            }
            // And it can be gone on with, through another save.
            const Result<void> on = work(file("p"), 4, 6, [](int) {});
            ASSERT_TRUE(on) << on.error().message;
        });
    for (const auto& [save, times] : saves)
        std::printf("    killed after save %d: %d times\n", int(save), times);
    ::close(told[0]);
    ::close(told[1]);
}

TEST_F(ProjectTest, IsMadeWholeOrNotAtAll) {
    int whole = 0, none = 0;
    kill_at_many_moments(
        PALPATE_KILLS,
        [&] {
            take_away();
            return become_worker("create", file("p"), 2);
        },
        [&] {
            if (fs::exists(file("p"))) {
                ASSERT_EQ(what_is_there(), all_of(head_and_organs()));
                ++whole;
            } else {
                ++none;
            }
        });
    std::printf("    whole %d, none %d\n", whole, none);
}

} // namespace
} // namespace palpate
