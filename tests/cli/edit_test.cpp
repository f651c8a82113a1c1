#include <algorithm>

#include <gmock/gmock.h>
#include <unistd.h>

#include <glm/gtc/matrix_transform.hpp>

#include <nlohmann/json.hpp>

#include "engine/edit/journal.h"
#include "engine/edit/stroke_run.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "engine/volume/synthetic.h"
#include "engine/volume/synthetic_name.h"
#include "tests/support/kill.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

const glm::dquat kUnturned(1, 0, 0, 0);

using testing::HasSubstr;

// EditCommand takes over 5 s of a processor: the program is started for each option and each
// damage.
class EditCommand : public ProgramTest {
 protected:
    static Volume phantom() {
        return synthetic::sample_ct_phantom(
            make_grid({100, 90, 40}, {2, 2, 5}, glm::dvec3(-100, -90, -100)));
    }

    // A hole drilled from the left, a groove milled over the top, and a bite.
    static std::vector<Stroke> grey_strokes(int count = 3) {
        std::vector<Stroke> strokes;
        for (int i = 0; i < count; ++i) {
            Operation op;
            op.kind = i % 3 == 2 ? OperationKind::cut : OperationKind::mill;
            op.to_value = -1000;
            op.falloff_mm = 2;
            op.rates = {{0, 60000}, {1000, 20000}};
            std::vector<StrokePose> poses;
            for (int k = 0; k < 40; ++k)
                poses.push_back(
                    {0.01 * k, {glm::dvec3(-80 + 2 * k, 10 * (i % 7), 5 * (i % 5)), kUnturned}});
            strokes.push_back(*make_stroke(
                *parse_json(R"({"kind": "burr", "radius_mm": 9, "flutes": 4})", ""), op, poses));
        }
        return strokes;
    }
    static std::string text_of(const std::vector<Stroke>& strokes) {
        std::string text;
        for (const Stroke& stroke : strokes)
            text += stroke_text(stroke);
        return text;
    }
    static Volume after(Volume volume, const std::vector<Stroke>& strokes, size_t count) {
        for (size_t i = 0; i < count; ++i)
            volume = *apply_stroke(volume, strokes[i].tool, strokes[i].operation, strokes[i].poses);
        return volume;
    }
    uint64_t hash_of(const std::string& name) const {
        const Result<LoadedVolume> loaded = load_volume(file(name));
        EXPECT_TRUE(loaded) << loaded.error().message;
        return loaded ? content_hash(loaded->volume) : 0;
    }
    ProgramRun edit(std::vector<std::string> more) const {
        more.insert(more.begin(), {"edit", file("in.nrrd").string()});
        more.insert(more.end(), {"-o", file("out.nrrd").string()});
        return run(more);
    }
    // As a program that was killed would, or, as long as it lives, one that is running.
    Journal leave_journal(const std::vector<Stroke>& strokes, size_t count) const {
        std::filesystem::remove(file("out.nrrd.journal"));
        const Result<LoadedVolume> in = load_volume(file("in.nrrd"));
        Result<Journal> journal =
            Journal::create(file("out.nrrd.journal"), Journal::base_of(in->volume));
        EXPECT_TRUE(journal);
        for (size_t i = 0; i < count; ++i)
            EXPECT_TRUE(journal->append({JournalEntry::Kind::stroke, strokes[i]}));
        return std::move(*journal);
    }
    void save_input() const { ASSERT_TRUE(save_volume(file("in.nrrd"), phantom())); }
    std::string strokes_path() const { return file("strokes.jsonl").string(); }
};

TEST_F(EditCommand, DoesStrokesAndTakesThemBack) {
    save_input();
    const std::vector<Stroke> strokes = grey_strokes();
    write("strokes.jsonl", text_of(strokes));
    for (const size_t undo : {0u, 1u, 3u}) {
        const ProgramRun done = edit({strokes_path(), "--undo", std::to_string(undo), "--report",
                                      file("report.json").string()});
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        EXPECT_EQ(done.output, "");
        const Volume expected = after(phantom(), strokes, 3 - undo);
        EXPECT_EQ(hash_of("out.nrrd"), content_hash(expected));
        EXPECT_FALSE(std::filesystem::exists(file("out.nrrd.journal")));
        const auto report = nlohmann::json::parse(bytes_of("report.json"));
        EXPECT_EQ(report["steps"].size(), 3 + undo);
        EXPECT_EQ(report["steps"][0]["operation"], "mill");
        EXPECT_EQ(report["steps"][0]["poses"], 40);
        EXPECT_GT(report["steps"][0]["changed_bricks"], 0);
        EXPECT_EQ(report["history"]["undo_steps"], 3 - undo);
        EXPECT_EQ(report["history"]["redo_steps"], undo);
        EXPECT_EQ(report["content_hash"], fmt::format("{:016x}", content_hash(expected)));
    }
    const ProgramRun done = edit({strokes_path(), "--undo", "4"});
    EXPECT_EQ(done.exit_code, 1); // before the work: there is no journal to recover
    EXPECT_THAT(done.messages,
                HasSubstr("--undo: expected at most 3 strokes to take back, found 4"));
    EXPECT_FALSE(std::filesystem::exists(file("out.nrrd.journal")));
}

TEST_F(EditCommand, AStrokeThatMissesIsAStrokeToTakeBack) {
    save_input();
    std::vector<Stroke> strokes = grey_strokes(2);
    for (StrokePose& pose : strokes[1].poses)
        pose.tool.position_mm.x += 5000;
    write("strokes.jsonl", text_of(strokes));
    for (const size_t undo : {0u, 1u, 2u}) {
        const ProgramRun done = edit({strokes_path(), "--undo", std::to_string(undo)});
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        EXPECT_EQ(hash_of("out.nrrd"), content_hash(after(phantom(), strokes, 2 - undo)));
    }
    write("strokes.jsonl", text_of({strokes[1]})); // and where there is no other
    const ProgramRun done = edit({strokes_path(), "--undo", "1"});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("out.nrrd"), content_hash(phantom()));
}

TEST_F(EditCommand, PaintsWithinAMask) {
    const Grid grid = phantom().grid();
    const auto had = [](glm::uvec3 i) { return i.x < 30 ? 1.0 : i.x < 60 ? 2.0 : 0.0; };
    ASSERT_TRUE(save_volume(file("labels.nii"), make_volume(grid, ScalarType::u8, had)));
    Operation op;
    op.label = 5;
    write("strokes.jsonl",
          stroke_text(
              *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 300})", ""), op, {{}})));
    const auto painted = [&](std::vector<std::string> options, const auto& becomes) {
        std::vector<std::string> words{"edit", file("labels.nii").string(), strokes_path(), "-o",
                                       file("out.nii").string()};
        words.insert(words.end(), options.begin(), options.end());
        const ProgramRun done = run(words);
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        const Volume out = load_labels(file("out.nii"))->volume;
        for (const uint32_t x : {0u, 29u, 30u, 59u, 60u, 99u})
            EXPECT_EQ(out.value({x, 40, 20}), becomes(had({x, 40, 20}))) << options[0] << " " << x;
    };
    painted({"--inside", "1"}, [](double v) { return v == 1 ? 5 : v; });
    painted({"--inside", "any"}, [](double v) { return v != 0 ? 5 : v; });
    painted({"--outside", "2"}, [](double v) { return v != 2 ? 5 : v; });
    painted({"--outside", "any", "--over", "0,2"}, [](double v) { return v == 0 ? 5 : v; });
    painted({"--over", "2,0"}, [](double v) { return v != 1 ? 5 : v; });
    const auto why = [&](std::vector<std::string> options) {
        std::vector<std::string> words{"edit", file("labels.nii").string(), strokes_path(), "-o",
                                       file("out.nii").string()};
        words.insert(words.end(), options.begin(), options.end());
        return run(words).messages;
    };
    EXPECT_THAT(why({"--inside", "0"}),
                HasSubstr("--inside: expected labels from 1 to 65535 between commas, found '0'"));
    EXPECT_THAT(why({"--only-values", "9", "3"}),
                HasSubstr("--only-values: expected LOW <= HIGH, found 9 3"));
    EXPECT_THAT(why({"--only-values", "3", "9"}), HasSubstr("only_values needs a guide"));
}

TEST_F(EditCommand, PaintsLabelsWhereAGuideLiesInARange) {
    save_input();
    ASSERT_TRUE(save_volume(file("labels.nii"), make_volume(phantom().grid(), ScalarType::u8,
                                                            [](glm::uvec3) { return 0.0; })));
    Operation op;
    op.label = 5;
    op.only_values = {700, 3000};
    write("strokes.jsonl",
          stroke_text(
              *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 300})", ""), op, {{}})));
    const ProgramRun done = run({"edit", file("labels.nii").string(), strokes_path(), "--guide",
                                 file("in.nrrd").string(), "-o", file("out.nii").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const Volume guide = phantom(), out = load_labels(file("out.nii"))->volume;
    size_t painted = 0;
    for (uint32_t z = 0; z < 40; ++z)
        for (uint32_t y = 0; y < 90; ++y)
            for (uint32_t x = 0; x < 100; ++x) {
                const bool bone = guide.value({x, y, z}) >= 700;
                ASSERT_EQ(out.value({x, y, z}), bone ? 5.0f : 0.0f);
                painted += bone;
            }
    EXPECT_GT(painted, 1000u);
}

TEST_F(EditCommand, GoesOnFromItsJournal) {
    save_input();
    const std::vector<Stroke> strokes = grey_strokes(5);
    write("strokes.jsonl", text_of(strokes));
    leave_journal(strokes, 2);
    ProgramRun done = edit({strokes_path()});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("--recover applies them, --discard drops them"));
    EXPECT_FALSE(std::filesystem::exists(file("out.nrrd")));

    done = edit({"--recover"}); // what is there and no more
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_THAT(done.messages, HasSubstr("2 steps recovered"));
    EXPECT_EQ(hash_of("out.nrrd"), content_hash(after(phantom(), strokes, 2)));

    leave_journal(strokes, 2);
    done = edit({strokes_path(), "--recover"});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("out.nrrd"), content_hash(after(phantom(), strokes, 5)));

    leave_journal(strokes, 4);
    write("strokes.jsonl", text_of({strokes[0], strokes[2]}));
    done = edit({strokes_path(), "--recover"});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("found another step 2"));
    EXPECT_TRUE(std::filesystem::exists(file("out.nrrd.journal")));
    done = edit({strokes_path(), "--discard"});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("out.nrrd"), content_hash(after(phantom(), {strokes[0], strokes[2]}, 2)));
}

TEST_F(EditCommand, LeavesTheJournalOfARunningEditAlone) {
    save_input();
    const std::vector<Stroke> strokes = grey_strokes(2);
    write("strokes.jsonl", text_of(strokes));
    const Journal running = leave_journal(strokes, 1);
    const std::string before = bytes_of("out.nrrd.journal");
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--recover"},
                                                      {strokes_path(), "--recover"},
                                                      {strokes_path(), "--discard"},
                                                      {strokes_path()}}) {
        const ProgramRun done = edit(arguments);
        EXPECT_EQ(done.exit_code, 1);
        EXPECT_THAT(done.messages, HasSubstr("found one that is running"));
        EXPECT_EQ(std::count(done.messages.begin(), done.messages.end(), '\n'), 1);
        EXPECT_EQ(bytes_of("out.nrrd.journal"), before);
        EXPECT_FALSE(std::filesystem::exists(file("out.nrrd")));
    }
}

TEST_F(EditCommand, NamesDamageAndKeepsAllOfIt) {
    save_input();
    const std::vector<Stroke> strokes = grey_strokes(4);
    write("strokes.jsonl", text_of(strokes));
    const auto damage = [&](size_t stroke) { // a byte in the middle of it
        leave_journal(strokes, 4);
        std::string bytes = bytes_of("out.nrrd.journal");
        const size_t text = bytes.find(stroke_text(strokes[stroke]));
        const size_t at = bytes.rfind("{\"on\"", text); // the line before it
        bytes[text + 100] ^= 1;
        write("out.nrrd.journal", bytes);
        return std::pair(bytes, at - 8);
    };
    const auto [bytes, at] = damage(2);
    // Two strokes can be done again, so three cannot be taken back.
    ProgramRun done = edit({"--recover", "--undo", "3"});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("expected at most 2 strokes to take back, found 3"));
    EXPECT_EQ(bytes_of("out.nrrd.journal"), bytes);

    done = edit({"--recover"});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_THAT(done.messages, HasSubstr("2 steps recovered\n"));
    EXPECT_THAT(done.messages,
                HasSubstr(fmt::format("damaged at byte {}: expected checksum ", at)));
    EXPECT_THAT(done.messages, HasSubstr("1 later step could be read and is left out"));
    EXPECT_EQ(hash_of("out.nrrd"), content_hash(after(phantom(), strokes, 2)));
    EXPECT_FALSE(std::filesystem::exists(file("out.nrrd.journal")));
    EXPECT_EQ(bytes_of("out.nrrd.journal.damaged"), bytes);

    std::filesystem::remove(file("out.nrrd"));
    damage(2);
    done = edit({strokes_path(), "--recover"}); // which has the others
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("out.nrrd"), content_hash(after(phantom(), strokes, 4)));

    std::filesystem::remove(file("out.nrrd"));
    const std::string first = damage(0).first;
    done = edit({"--recover"});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("before its first step has ended"));
    EXPECT_EQ(bytes_of("out.nrrd.journal"), first);
    EXPECT_FALSE(std::filesystem::exists(file("out.nrrd")));
}

TEST_F(EditCommand, AGuideLiesWhereTheLabelsDo) {
    save_input();
    Operation op;
    op.only_values = {700, 3000};
    write("strokes.jsonl",
          stroke_text(*make_stroke(*parse_json(R"({"kind": "point"})", ""), op, {{}})));
    Grid moved = phantom().grid();
    moved.world_from_index[3].x += 2;
    const auto labels_on = [&](const Grid& grid) {
        EXPECT_TRUE(save_volume(file("labels.nii"),
                                make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; })));
        return run({"edit", file("labels.nii").string(), strokes_path(), "--guide",
                    file("in.nrrd").string(), "-o", file("out.nii").string()});
    };
    const ProgramRun done = labels_on(moved);
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("in.nrrd: expected a guide whose samples lie where"));
    EXPECT_FALSE(std::filesystem::exists(file("out.nii")));
    // The same number of samples, along other axes.
    const ProgramRun across = labels_on(make_grid({90, 100, 40}, glm::dvec3(2)));
    EXPECT_EQ(across.exit_code, 1);
    EXPECT_THAT(across.messages,
                HasSubstr("a guide of 90 x 100 x 40 samples, found 100 x 90 x 40"));
}

TEST_F(EditCommand, SaysWhatIsWrong) {
    save_input();
    const auto expect = [&](std::vector<std::string> arguments, int code, const char* part) {
        const ProgramRun done = edit(std::move(arguments));
        EXPECT_EQ(done.exit_code, code);
        EXPECT_THAT(done.messages, HasSubstr(part));
        EXPECT_FALSE(std::filesystem::exists(file("out.nrrd")));
        EXPECT_FALSE(std::filesystem::exists(file("out.nrrd.journal")));
    };
    expect({}, 2, "expected STROKES, or --recover");
    expect({"--recover"}, 1, "nothing to recover");
    expect({file("none").string()}, 1, "no such file");
    write("strokes.jsonl", "{\"stroke\": 1}\n");
    expect({strokes_path()}, 1, "strokes.jsonl:1: ");
    Operation draw;
    const Stroke drawn = *make_stroke(*parse_json(R"({"kind": "point"})", ""), draw, {{}});
    write("strokes.jsonl", stroke_text(drawn) + text_of(grey_strokes(1)));
    expect({strokes_path()}, 1, "found both");
    write("strokes.jsonl", stroke_text(drawn)); // HU are no labels
    expect({strokes_path()}, 1, "in.nrrd: ");
    expect({strokes_path(), "--history-memory", "-1"}, 2, "--history-memory");
    expect({strokes_path(), "--recover", "--discard"}, 2, "excludes");
}

TEST_F(EditCommand, RefusesBeforeTheWorkWhatItCouldNotWrite) {
    Grid oblique = phantom().grid();
    oblique.world_from_index = glm::rotate(oblique.world_from_index, 0.3, glm::dvec3(0, 0, 1));
    ASSERT_TRUE(save_volume(file("in.nrrd"), with_grid(phantom(), oblique)));
    write("strokes.jsonl", text_of(grey_strokes(1)));
    const auto refused = [&](const char* out) {
        const ProgramRun done =
            run({"edit", file("in.nrrd").string(), strokes_path(), "-o", file(out).string()});
        EXPECT_EQ(done.exit_code, 1);
        EXPECT_FALSE(std::filesystem::exists(file(out)));
        EXPECT_FALSE(std::filesystem::exists(file(std::string(out) + ".journal")));
        return done.messages;
    };
    EXPECT_THAT(refused("o.vtk"), HasSubstr("o.vtk: legacy VTK holds only axes towards left"));
    EXPECT_THAT(refused("o.txt"), HasSubstr("o.txt: expected an extension .nii"));
    // A value that no sample of this type can hold.
    ASSERT_TRUE(save_volume(file("in.nrrd"), make_volume(phantom().grid(), ScalarType::u8,
                                                         [](glm::uvec3 i) { return i.x; })));
    EXPECT_THAT(refused("o.nrrd"),
                HasSubstr("mill: expected a to_value within 0 .. 255, which the volume's type u8 "
                          "holds, found -1000"));
}

TEST_F(EditCommand, WithoutAValueToolsLeaveTheLowestOfTheVolume) {
    for (const ScalarType type : {ScalarType::u8, ScalarType::u16, ScalarType::i16}) {
        const double lowest = type == ScalarType::i16 ? -120 : 3;
        const double step = type == ScalarType::u8 ? 1 : 10; // so that no smaller type holds all
        const Volume before = make_volume(phantom().grid(), type, [&](glm::uvec3 i) {
            return lowest + step * ((i.x + i.y) % 100);
        });
        ASSERT_TRUE(save_volume(file("in.nrrd"), before));
        std::vector<Stroke> strokes = grey_strokes(), unsaid;
        for (Stroke& stroke : strokes) {
            stroke.operation.to_value.reset();
            unsaid.push_back(stroke);
            stroke.operation.to_value = lowest;
        }
        write("strokes.jsonl", text_of(unsaid));
        ASSERT_EQ(bytes_of("strokes.jsonl").find("to_value"), std::string::npos);
        const uint64_t expected = content_hash(after(before, strokes, 3));
        ProgramRun done = edit({strokes_path()});
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        EXPECT_EQ(hash_of("out.nrrd"), expected);
        // A journal says the value, and belongs to the strokes that do not.
        leave_journal(strokes, 2);
        done = edit({strokes_path(), "--recover"});
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        EXPECT_EQ(hash_of("out.nrrd"), expected);
    }
}

TEST_F(EditCommand, SaysThatLabelsAreNeeded) {
    save_input();
    Operation op;
    op.kind = OperationKind::erase;
    write("strokes.jsonl",
          stroke_text(*make_stroke(*parse_json(R"({"kind": "point"})", ""), op, {{}})));
    const ProgramRun done = edit({strokes_path()});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("'erase' of the strokes works on labels: expected a label "
                                         "map as V"));
    write("strokes.jsonl", R"({"stroke": 2, "units": "mm"})");
    EXPECT_THAT(edit({strokes_path()}).messages,
                HasSubstr("expected \"stroke\": 1, the version of the format"));
}

TEST_F(EditCommand, TellsInWordsWhatAJournalDoesNotBelongTo) {
    save_input();
    const std::vector<Stroke> strokes = grey_strokes(1);
    leave_journal(strokes, 1);
    Grid moved = phantom().grid();
    moved.world_from_index[3].z += 1;
    ASSERT_TRUE(save_volume(file("in.nrrd"), with_grid(phantom(), moved)));
    const ProgramRun done = edit({"--recover"});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("belongs to another edit: 'volume' lies elsewhere (1 of "
                                         "the 12 numbers"));
    EXPECT_THAT(done.messages, testing::Not(HasSubstr("samples differ")));
}

TEST_F(EditCommand, AFolderThatTakesNothingIsASentenceAndLosesNothing) {
    save_input();
    write("strokes.jsonl", text_of(grey_strokes(1)));
    const ProgramRun done = run({"edit", file("in.nrrd").string(), strokes_path(), "-o",
                                 "/proc/no/out.nrrd"}); // the test may be root: no chmod would do
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("/proc/no/out.nrrd: cannot be written"));
    // A disk with room for the journal and no more: files are limited to 60 blocks of 512 bytes.
    const std::string volume = "synthetic:phantom?size=48";
    const std::string out = file("out.nrrd").string();
    const std::string command = "trap '' XFSZ; ulimit -f 60; '" + std::string(kProgram) +
                                "' edit '" + volume + "' '" + strokes_path() + "' -o '" + out +
                                "' 2> '" + file("messages").string() + "'";
    EXPECT_NE(std::system(command.c_str()), 0);
    EXPECT_THAT(bytes_of("messages"), HasSubstr("cannot be written"));
    EXPECT_THAT(bytes_of("messages"), HasSubstr("--recover applies them"));
    EXPECT_FALSE(std::filesystem::exists(file("out.nrrd")));
    const ProgramRun again = run({"edit", volume, "--recover", "-o", out});
    ASSERT_EQ(again.exit_code, 0) << again.messages;
    const Volume expected = after(*make_synthetic(volume, 1 << 30), grey_strokes(1), 1);
    EXPECT_EQ(hash_of("out.nrrd"), content_hash(expected));
}

} // namespace
} // namespace palpate
