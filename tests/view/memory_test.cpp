// All recorded sessions once more, in which memory runs out: no failure ends the window or is left
// half done, and no step that was accepted is lost. PALPATE_FAILURES fail in each session that has
// large calls of operator new; below 1, one does in such a share of the sessions.

#include <unistd.h>

#include <filesystem>
#include <random>

#include "apps/view/document/kept_steps.h"
#include "engine/edit/replay.h"
#include "engine/volume/changes.h"
#include "tests/support/given.h"
#include "tests/view/failing_memory.h"
#include "tests/view/recorded_session.h"

namespace palpate::view {
namespace {

void expect_same_samples(const Document& found, const Document& expected, const char* what) {
    ASSERT_EQ(found.volumes.size(), expected.volumes.size()) << what;
    for (size_t i = 0; i < found.volumes.size(); ++i) {
        const NamedVolume &a = found.volumes[i], &b = expected.volumes[i];
        ASSERT_EQ(a.name, b.name) << what;
        ASSERT_EQ(a.volume.grid(), b.volume.grid()) << what;
        EXPECT_TRUE(changed_bricks(b.volume, a.volume).empty()) << what << ": " << a.name;
    }
}

// Says at the end how many failures there were: sessions without large calls have none.
class FailureCount final : public ::testing::Environment {
 public:
    void add(uint64_t failures) {
        failures_ += failures;
        ++sessions_;
    }
    void TearDown() override {
        fmt::print("{} failures of memory in {} sessions\n", failures_, sessions_);
    }

 private:
    uint64_t failures_ = 0, sessions_ = 0;
};
auto* const failure_count =
    static_cast<FailureCount*>(::testing::AddGlobalTestEnvironment(new FailureCount));

} // namespace

class MemorySession {
 public:
    static void run(RecordedSession& session) {
        const double asked = given("PALPATE_FAILURES", 0.25);
        std::mt19937_64 random(std::hash<std::string>{}(session.GetParam().name));
        if (std::uniform_real_distribution(0.0, 1.0)(random) >= asked)
            return;
        const auto wanted = uint64_t(std::max(asked, 1.0));
        MemorySession test(session);
        const uint64_t calls = test.play(0).calls;
        // Threads make calls that another run may not make, and a run is played again then.
        constexpr uint64_t kRunsForOne = 4;
        uint64_t failed = 0;
        for (uint64_t run = 0; calls > 0 && failed < wanted; ++run) {
            ASSERT_LT(run, wanted * kRunsForOne) << "calls are not made again";
            const uint64_t number = std::uniform_int_distribution<uint64_t>(1, calls)(random);
            SCOPED_TRACE(fmt::format("of {} calls number {} fails", calls, number));
            failed += test.play(number).failed ? 1 : 0;
            if (::testing::Test::HasFatalFailure())
                return;
        }
        if (failed > 0)
            failure_count->add(failed);
    }

 private:
    struct After { // a frame
        uint64_t undo_steps = 0;
        Document document;
    };

    explicit MemorySession(RecordedSession& session)
        : session_(session),
          folder_(std::filesystem::temp_directory_path() /
                  fmt::format("palpate.memory.{}", ::getpid())) {}
    ~MemorySession() { std::filesystem::remove_all(folder_); }

    failing_memory::Counted play(uint64_t fails_at) {
        std::filesystem::remove_all(folder_);
        Source source{open_synthetic("synthetic:phantom?size=24")};
        source.steps.emplace(keep_steps(fresh_document(source.scene.loaded.data), folder_));
        const std::filesystem::path journal = source.steps->path;
        session_.open_scene(std::move(source), {800, 600});
        const std::string title = session_.viewer().title();
        const Document first = session_.viewer().work().edited().document;
        is_reference_ = fails_at == 0;
        if (is_reference_)
            frames_.clear();
        frame_ = 0;
        told_ = lost_ = false;
        before_ = {0, first};
        failing_memory::begin(fails_at);
        session_.at_frame_ = [this](bool begins) { at_frame(begins); };
        try {
            std::istringstream steps(session_.GetParam().steps);
            for (std::string text; std::getline(steps, text, ';');)
                if (has_widget_of(text))
                    session_.step(text);
        } catch (const std::exception& error) {
            failing_memory::end();
            session_.at_frame_ = {};
            ADD_FAILURE() << "the window has ended: " << error.what();
            return {0, true};
        }
        const failing_memory::Counted counted = failing_memory::end();
        session_.at_frame_ = {};
        session_.frame({});
        EXPECT_TRUE(!lost_ || told_) << "a step was given up, and nobody was told of memory";
        if (session_.viewer().title() == title) // else another file was opened
            expect_whole(session_.viewer().work(), first, journal);
        return counted;
    }

    // Without what failed a widget of a later step may not be there.
    bool has_widget_of(const std::string& step) {
        std::istringstream in(step);
        std::string word, id;
        in >> word >> id;
        return word != "widget" || session_.viewer().interface().widgets().count(id) > 0;
    }

    void at_frame(bool begins) {
        if (begins) {
            failed_before_ = failing_memory::so_far().failed;
            failing_memory::pause(false);
            return;
        }
        failing_memory::pause(true);
        const EditState now = session_.viewer().work().edited();
        const bool fails_here = failing_memory::so_far().failed && !failed_before_;
        const std::string message = session_.viewer().interface().message();
        told_ = told_ || message.find("memory") != message.npos;
        if (is_reference_)
            frames_.push_back({now.undo_steps, now.document});
        else if (fails_here && frame_ < frames_.size())
            expect_between(now, frames_[frame_]);
        before_ = {now.undo_steps, now.document};
        ++frame_;
    }

    // After the frame in which memory ran out there are no fewer steps than before it, or than
    // without the failure.
    void expect_between(const EditState& now, const After& otherwise) {
        EXPECT_GE(now.undo_steps, std::min(before_.undo_steps, otherwise.undo_steps));
        EXPECT_LE(now.undo_steps, std::max(before_.undo_steps, otherwise.undo_steps));
        lost_ = now.undo_steps != otherwise.undo_steps;
    }

    // The document is what the journal's entries make of the first one, and undo leads back there.
    void expect_whole(Work& work, const Document& first, const std::filesystem::path& journal) {
        for (const Button button : {Button::left, Button::right})
            session_.button(false, button);
        work.session().stop();
        work.session().settle();
        const EditState now = work.edited();
        const Result<Journal::Contents> kept = Journal::peek(journal);
        ASSERT_TRUE(kept) << kept.error().message;
        EXPECT_FALSE(kept->cut || kept->damage);
        Document replayed = first;
        History history;
        for (const JournalEntry& entry : kept->entries) {
            const Result<Replayed> done = replay(replayed, history, entry, {});
            ASSERT_TRUE(done) << done.error().message;
        }
        expect_same_samples(now.document, replayed, "by the journal");
        EXPECT_TRUE(now.document.notes == replayed.notes);
        EXPECT_EQ(now.undo_steps, history.stats().undo_steps);
        EXPECT_EQ(now.redo_steps, history.stats().redo_steps);
        for (size_t left = now.undo_steps; left > 0; --left) {
            work.session().undo();
            work.session().settle();
        }
        EXPECT_EQ(work.edited().undo_steps, 0u);
        expect_same_samples(work.edited().document, first, "all undone");
    }

    RecordedSession& session_;
    std::filesystem::path folder_;
    bool is_reference_ = false;
    std::vector<After> frames_; // without a failure
    size_t frame_ = 0;
    After before_{0, Document(empty_labels(make_grid({1, 1, 1}, glm::dvec3(1.0))))};
    bool failed_before_ = false;
    bool told_ = false, lost_ = false;
};

// Else no session would meet a failure, and all would pass.
TEST(FailingSession, LargeCallOfTheProgramFailsAndASmallOneDoesNot) {
    const auto call = [](size_t bytes) { ::operator delete(::operator new(bytes)); };
    failing_memory::begin(1);
    failing_memory::pause(false);
    EXPECT_NO_THROW(call(failing_memory::kLarge - 1));
    EXPECT_THROW(call(failing_memory::kLarge), std::bad_alloc);
    EXPECT_NO_THROW(call(failing_memory::kLarge));
    const failing_memory::Counted counted = failing_memory::end();
    EXPECT_EQ(counted.calls, 2u);
    EXPECT_TRUE(counted.failed);
}

namespace {
[[maybe_unused]] const bool kInstead = [] {
    RecordedSession::instead_of_end = MemorySession::run;
    return true;
}();
} // namespace

} // namespace palpate::view
