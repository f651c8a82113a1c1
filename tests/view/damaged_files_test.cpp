// Damaged projects and scripts, as they come from broken disks, other programs and people who write
// them by hand: `palpate view` opens them, or ends with one sentence and 1.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <random>

#include "engine/base/json.h"
#include "engine/session/project.h"
#include "engine/volume/builder.h"
#include "tests/reader_fuzz/harness.h"
#include "tests/support/given.h"
#include "tests/support/program.h"
#include "tests/unit/session/session_work.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class DamagedFiles : public ProgramTest {
 protected:
    DamagedFiles() { // a program that computes for ever is ended, by SIGXCPU
        const rlimit limit{60, 60};
        ::setrlimit(RLIMIT_CPU, &limit);
    }

    uint64_t below(uint64_t end) { return random_() % end; }

    // Replaces a value of a JSON document with one of another type or size.
    std::string another_value(const std::string& text) {
        Result<Json> json = parse_json(text, "");
        if (!json)
            return text;
        std::vector<Json*> values;
        const auto gather = [&](const auto& self, Json& value) -> void {
            values.push_back(&value);
            for (auto& [key, member] : value.members)
                self(self, member);
            for (Json& item : value.items)
                self(self, item);
        };
        gather(gather, *json);
        const char* others[] = {"null",   "true",        "-1",        "0",
                                "1e308",  "4294967296",  "0.5",       "\"\"",
                                "[]",     "{}",          "[[[]]]",    "\"../x\"",
                                "1e-320", "\"\\u0000\"", "[1, 2, 3]", "99999999999999999999"};
        if (Result<Json> other = parse_json(others[below(std::size(others))], ""))
            *values[below(values.size())] = std::move(*other);
        return json_text(*json);
    }

    // Puts another thing at a path where a file is expected.
    void put_something_else(const fs::path& path) {
        fs::remove_all(path);
        switch (below(6)) {
            case 0:
                fs::create_directory(path);
                break;
            case 1: // to itself
                fs::create_symlink(path.filename(), path);
                break;
            case 2:
                fs::create_symlink("/dev/zero", path);
                break;
            case 3:
                ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
                break;
            case 4:
                std::ofstream(path, std::ios::binary);
                break;
            default: // nothing
                break;
        }
    }

    void damage(const fs::path& path, uint64_t number) {
        const std::string bytes = read(path);
        const uint64_t kind = below(10);
        if (kind < 2)
            return put_something_else(path);
        std::string changed = kind < 7 ? fuzz::damaged(bytes, number) : another_value(bytes);
        if (kind == 9 && below(2) == 0)
            changed = bytes.substr(0, below(bytes.size())) +
                      std::string(100'000, below(2) == 0 ? '[' : '{');
        std::ofstream(path, std::ios::binary) << changed;
    }

    static std::string read(const fs::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }

    // Runs `palpate view` on it. name: of what is damaged, which a refusal names.
    void expect_opened_or_refused(const std::vector<std::string>& words, const std::string& name,
                                  uint64_t number) {
        const ProgramRun ran = run(words);
        SCOPED_TRACE(fmt::format("damage {}; messages: {}", number, ran.messages));
        ASSERT_TRUE(ran.exit_code == 0 || ran.exit_code == 1) << ran.exit_code;
        ++(ran.exit_code == 0 ? opened_ : refused_);
        if (ran.exit_code == 0)
            return;
        const std::string begin = "palpate: error: ";
        ASSERT_EQ(ran.messages.find(begin), 0u);
        const std::string sentence = ran.messages.substr(begin.size());
        EXPECT_EQ(sentence.find('\n'), sentence.size() - 1);
        EXPECT_NE(sentence.find(name), sentence.npos);
        for (const char* words_of_code : {"std::", "basic_", "bad_alloc", "exception"})
            EXPECT_EQ(sentence.find(words_of_code), sentence.npos);
    }
    void keep_what_failed(const fs::path& path, uint64_t number) {
        const fs::path kept =
            fs::temp_directory_path() / fmt::format("{}.{}", path.filename().string(), number);
        fs::copy(path, kept, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
        ADD_FAILURE() << "it is kept in " << kept;
    }

    std::mt19937_64 random_{2026};
    uint64_t opened_ = 0, refused_ = 0;
};

TEST_F(DamagedFiles, ProjectsAreOpenedOrRefusedInASentence) {
    const fs::path whole = file("whole"), project = file("project");
    {
        Document document = head_and_organs();
        Scene scene;
        scene.ray_cast.emplace();
        scene.ray_cast->mode = RayMode::iso;
        scene.ray_cast->isos = {{300.0}};
        ProjectContents contents{std::move(document), "head", "organs", {}, {}};
        contents.scene.volume = "head.nrrd";
        contents.scene.scene = scene;
        const Result<void> made = Project::create(whole, contents);
        ASSERT_TRUE(made) << made.error().message;
        Result<Project::Opened> opened = Project::open(whole);
        ASSERT_TRUE(opened) << opened.error().message;
        opened->setup.edit.threaded = false;
        Session session(std::move(opened->setup));
        for (int n = 0; n < 6; ++n)
            act(session, n);
    }
    for (uint64_t number = 0; number < uint64_t(given("PALPATE_DAMAGED", 12)) && !HasFailure();
         ++number) {
        fs::remove_all(project);
        fs::copy(whole, project, fs::copy_options::recursive);
        std::vector<fs::path> files;
        for (const auto& entry : fs::directory_iterator(project))
            files.push_back(entry.path());
        std::sort(files.begin(), files.end());
        for (uint64_t i = 0; i <= below(2); ++i) { // project.json is where most is to be broken
            const fs::path& which =
                below(2) == 0 ? project / "project.json" : files[below(files.size())];
            if (fs::is_regular_file(fs::symlink_status(which)))
                damage(which, number);
        }
        expect_opened_or_refused(
            {"--quiet", "view", project.string(), "--headless", "--state", "-"}, project.filename(),
            number);
        if (HasFailure())
            keep_what_failed(project, number);
    }
    RecordProperty("opened", static_cast<int>(opened_));
    EXPECT_GT(opened_, 0u);
    EXPECT_GT(refused_, 0u);
}

TEST_F(DamagedFiles, ScriptsAreDoneOrRefusedInASentence) {
    const fs::path script = file("script.jsonl");
    const std::string whole = R"({"palpate_view": 1, "size": [480, 320], "text_scale": 1}
{"frame": 1, "t_s": 0.05, "key": "b", "down": true}
{"frame": 2, "t_s": 0.1, "key": "b"}
{"frame": 3, "t_s": 0.15, "move": [90, 100]}
{"frame": 4, "t_s": 0.2, "button": "left", "down": true, "alt": true}
{"frame": 5, "t_s": 0.25, "move": [110, 120]}
{"frame": 6, "t_s": 0.3, "button": "left", "down": false}
{"frame": 7, "t_s": 0.35, "wheel": [0, -2], "ctrl": true}
{"frame": 8, "t_s": 0.4, "text": "7 mm"}
{"frame": 9, "t_s": 0.45, "resize": [640, 400]}
{"frame": 10, "t_s": 0.5, "key": "o", "down": true}
{"frame": 20, "t_s": 0.75, "drop": ["synthetic:ball?size=7"]}
)";
    for (uint64_t number = 0; number < uint64_t(given("PALPATE_DAMAGED", 12)) && !HasFailure();
         ++number) {
        fs::remove_all(script);
        std::ofstream(script, std::ios::binary) << whole;
        if (below(3) == 0) { // a line of it, as JSON
            std::istringstream in(whole);
            std::string text;
            const uint64_t which = below(12);
            uint64_t at = 0;
            for (std::string line; std::getline(in, line); ++at)
                text +=
                    (at == which ? json_line(parse_json(another_value(line), "").value()) : line) +
                    "\n";
            std::ofstream(script, std::ios::binary) << text;
        } else {
            damage(script, number);
        }
        expect_opened_or_refused({"--quiet", "view", "synthetic:ball?size=9", "--headless",
                                  "--state", "-", "--replay", script.string()},
                                 script.filename(), number);
        if (HasFailure())
            keep_what_failed(script, number);
    }
    EXPECT_GT(opened_, 0u);
    EXPECT_GT(refused_, 0u);
}

} // namespace
} // namespace palpate
