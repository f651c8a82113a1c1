// Whenever an edit is killed, every stroke that was done is in its journal, no file is partial, and
// the edit can be gone on with. PALPATE_KILLS is how often: few in `quick`.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <stdlib.h>
#include <sys/inotify.h>
#include <unistd.h>

#include "engine/edit/journal.h"
#include "engine/edit/stroke_run.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "engine/volume/synthetic.h"
#include "tests/support/given.h"
#include "tests/support/kill.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

const glm::dquat kUpright(1, 0, 0, 0);

// A terminal: a program tells how far it is to a terminal alone.
class Terminal {
 public:
    Terminal() : here_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
        EXPECT_EQ(::grantpt(here_), 0);
        EXPECT_EQ(::unlockpt(here_), 0);
        there_ = ::open(::ptsname(here_), O_RDWR | O_NOCTTY);
        EXPECT_GE(there_, 0);
    }
    ~Terminal() {
        ::close(there_);
        ::close(here_);
    }
    Terminal(const Terminal&) = delete;
    Terminal& operator=(const Terminal&) = delete;

    int there() const { return there_; } // where the program writes
    std::string read() const {           // since the last call
        std::string all;
        char some[4096];
        for (ssize_t n; (n = ::read(here_, some, sizeof some)) > 0;)
            all.append(some, static_cast<size_t>(n));
        return all;
    }

 private:
    int here_, there_ = -1;
};

const int kKills = int(given("PALPATE_KILLS", 6));

class KilledEdit : public ProgramTest {
 protected:
    KilledEdit() {
        for (int i = 0; i < 12; ++i) {
            Operation op;
            op.kind = i % 2 ? OperationKind::mill : OperationKind::cut;
            op.to_value = i % 3 ? -1000 : 1500;
            op.rates = {{0, 30000}};
            std::vector<StrokePose> poses;
            for (int k = 0; k < 20; ++k)
                poses.push_back({0.01 * k, {glm::dvec3(-60 + 5 * k, 8 * i - 50, 3 * i), kUpright}});
            strokes_.push_back(*make_stroke(
                *parse_json(R"({"kind": "capsule", "radius_mm": 8, "length_mm": 20})", ""), op,
                poses));
            text_ += stroke_text(strokes_.back());
        }
        const Volume in = synthetic::sample_ct_phantom(
            make_grid({90, 80, 70}, glm::dvec3(2), glm::dvec3(-90, -80, -70)));
        EXPECT_TRUE(save_volume(file("in.nrrd"), in));
        write("strokes.jsonl", text_);
        hashes_.push_back(content_hash(in));
        Volume now = in;
        for (const Stroke& stroke : strokes_) {
            now = *apply_stroke(now, stroke.tool, stroke.operation, stroke.poses);
            hashes_.push_back(content_hash(now));
        }
    }

    std::vector<std::string> arguments(bool recover) const {
        std::vector<std::string> all{"edit", file("in.nrrd").string(),
                                     file("strokes.jsonl").string(), "-o",
                                     file("out.nrrd").string()};
        if (recover)
            all.push_back("--recover");
        return all;
    }
    uint64_t hash_of(const std::string& name) const {
        const Result<LoadedVolume> loaded = load_volume(file(name));
        EXPECT_TRUE(loaded) << loaded.error().message;
        return loaded ? content_hash(loaded->volume) : 0;
    }

    // How many strokes the messages say were done: each is shown after it, as whole percents.
    size_t done_of(const std::string& messages) const {
        const std::string_view before = "editing: ";
        const size_t at = messages.rfind(before);
        if (at == std::string::npos)
            return 0;
        const auto percent = std::strtoul(messages.c_str() + at + before.size(), nullptr, 10);
        return (percent * strokes_.size() + 99) / 100;
    }

    std::vector<Stroke> strokes_;
    std::string text_;
    std::vector<uint64_t> hashes_; // after 0, 1, .. strokes
};

TEST_F(KilledEdit, LosesNoStrokeThatWasDone) {
    std::vector<size_t> kept(strokes_.size() + 1); // how often a journal held so many
    size_t whole = 0, none = 0;
    const Terminal terminal;
    bool listen = false; // not to the run that nobody disturbs, whose messages no check takes
    kill_at_many_moments(
        kKills, [&] { return become_program(arguments(false), listen ? terminal.there() : -1); },
        [&] {
            listen = true;
            const size_t told = done_of(terminal.read());
            const bool journal = std::filesystem::exists(file("out.nrrd.journal"));
            if (std::filesystem::exists(file("out.nrrd"))) {
                ASSERT_EQ(hash_of("out.nrrd"), hashes_.back());
                ++whole;
            } else if (!journal) {
                ASSERT_EQ(told, 0u);
                ++none; // killed before it began
            } else {
                const auto journalled = Journal::peek(file("out.nrrd.journal"));
                ASSERT_TRUE(journalled) << journalled.error().message;
                ASSERT_FALSE(journalled->damage);
                const auto* entries = &journalled->entries;
                ASSERT_GE(entries->size(), told);
                ASSERT_LE(entries->size(), strokes_.size());
                for (size_t i = 0; i < entries->size(); ++i)
                    ASSERT_EQ(stroke_text((*entries)[i].stroke), stroke_text(strokes_[i]));
                ++kept[entries->size()];
                // Its strokes alone, and then, from a copy, all of them.
                std::filesystem::copy_file(file("out.nrrd.journal"), file("copy.nrrd.journal"));
                if (!entries->empty()) {
                    const ProgramRun some = run({"edit", file("in.nrrd").string(), "--recover",
                                                 "-o", file("copy.nrrd").string()});
                    ASSERT_EQ(some.exit_code, 0) << some.messages;
                    ASSERT_EQ(hash_of("copy.nrrd"), hashes_[entries->size()]);
                }
                const ProgramRun rest = run(arguments(true));
                ASSERT_EQ(rest.exit_code, 0) << rest.messages;
                ASSERT_EQ(hash_of("out.nrrd"), hashes_.back());
            }
            for (const char* name :
                 {"out.nrrd", "out.nrrd.journal", "copy.nrrd", "copy.nrrd.journal"})
                std::filesystem::remove(file(name));
        });
    size_t between = 0;
    for (size_t i = 0; i < strokes_.size(); ++i)
        between += kept[i];
    std::printf("    whole %zu, not begun %zu, between strokes %zu, all strokes kept %zu\n", whole,
                none, between, kept.back());
    // Checks the figures compared above: after a run to its end, the messages tell of all strokes.
    ASSERT_EQ(run_and_kill(std::chrono::hours(1),
                           [&] { return become_program(arguments(false), terminal.there()); }),
              End::finished);
    EXPECT_EQ(done_of(terminal.read()), strokes_.size());
    if (kKills >= 100) { // few moments may all miss
        EXPECT_GT(between, 0u);
    }
}

// The library's promise, stroke by stroke: when append() has returned, the stroke is there.
TEST_F(KilledEdit, AStrokeThatCountsAsDoneIsInTheJournal) {
    std::mt19937 random(3);
    const Volume base = load_volume(file("in.nrrd"))->volume;
    const Journal::Base of = Journal::base_of(base);
    for (int i = 0; i < kKills; ++i) {
        std::filesystem::remove(file("j"));
        int pipe[2];
        ASSERT_EQ(::pipe(pipe), 0);
        const auto delay = std::chrono::microseconds(random() % 20000);
        const End end = run_and_kill(delay, [&] {
            Result<Journal> journal = Journal::create(file("j"), of);
            for (uint8_t n = 1; n <= 200 && journal; ++n) {
                if (!journal->append({JournalEntry::Kind::stroke, strokes_[n % strokes_.size()]}))
                    return 1;
                if (::write(pipe[1], &n, 1) != 1)
                    return 1;
            }
            return journal ? 0 : 1;
        });
        ASSERT_NE(end, End::failed);
        ::close(pipe[1]);
        uint8_t done = 0, n = 0;
        while (::read(pipe[0], &n, 1) == 1)
            done = n;
        ::close(pipe[0]);
        if (!std::filesystem::exists(file("j"))) {
            EXPECT_EQ(done, 0);
            continue;
        }
        const auto entries = Journal::peek(file("j"));
        ASSERT_TRUE(entries) << entries.error().message;
        EXPECT_FALSE(entries->damage);
        EXPECT_GE(entries->entries.size(), done);
        EXPECT_LE(entries->entries.size(), done + 1u);
        EXPECT_TRUE(Journal::open(file("j"), of)); // a lock ends with who held it
    }
}

// One stroke that takes minutes within a single slice: a process asked to end does so within it.
TEST_F(KilledEdit, ALongSweepEndsWhenAskedTo) {
    Operation op;
    op.kind = OperationKind::mill;
    op.to_value = 0;
    op.rates = {{0, 1}};
    std::vector<StrokePose> poses;
    for (int k = 0; k < 4000; ++k) // across one brick and back, each way some sixty places
        poses.push_back({0.01 * k, {glm::dvec3(k % 2 ? 31 : 0, 15, 15), kUpright}});
    write("strokes.jsonl",
          stroke_text(*make_stroke(
              *parse_json(R"({"kind": "burr", "radius_mm": 9, "flutes": 12})", ""), op, poses)));
    ASSERT_TRUE(save_volume(file("in.nrrd"),
                            make_volume(make_grid(glm::uvec3(32), glm::dvec3(1)), ScalarType::i16,
                                        [](glm::uvec3) { return 1000.0; })));
    const int news = ::inotify_init1(IN_CLOEXEC);
    ASSERT_GE(::inotify_add_watch(news, file("").c_str(), IN_CREATE), 0);
    const int messages = ::open(file("messages").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    const pid_t child = ::fork();
    if (child == 0)
        ::_exit(become_program(arguments(false), messages));
    while (!std::filesystem::exists(file("out.nrrd.journal"))) { // the last thing before the stroke
        char some[4096];
        ASSERT_GT(::read(news, some, sizeof some), 0);
    }
    ::close(news);
    ::kill(child, SIGTERM);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ::close(messages);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 1);
    EXPECT_THAT(bytes_of("messages"), testing::HasSubstr("interrupted; the finished strokes"));
    EXPECT_EQ(Journal::peek(file("out.nrrd.journal"))->entries.size(), 0u);
    EXPECT_FALSE(std::filesystem::exists(file("out.nrrd")));
}

} // namespace
} // namespace palpate
