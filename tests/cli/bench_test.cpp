// palpate bench and scripts/bench-compare, as a person runs them.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// BenchCommand takes over 5 s of a processor: every suite of bench runs, as small as it can be, and
// half of the time is the grid of touch, each cell of which is a haptic loop.
class BenchCommand : public ProgramTest {
 protected:
    ProgramRun bench(const std::string& suite) const {
        return run({"bench", suite, "--tiny", "--no-peers", "--out", file("out").string()});
    }
    json result(const std::string& suite) const {
        return json::parse(bytes_of("out/" + suite + ".json"));
    }
    ProgramRun compare(const std::string& a, const std::string& b) const {
        const std::string command = std::string(kSourceDir) + "/scripts/bench-compare " +
                                    file(a).string() + " " + file(b).string() + " --all >" +
                                    file("stdout").string() + " 2>" + file("stderr").string();
        const int status = std::system(command.c_str());
        return {WEXITSTATUS(status), bytes_of("stdout"), bytes_of("stderr")};
    }
};

void expect_environment(const json& v) {
    for (const char* key : {"commit", "compiler", "build_type", "device", "driver", "cpu", "cores"})
        EXPECT_TRUE(v["environment"].contains(key)) << key;
    EXPECT_FALSE(v["environment"]["commit"].get<std::string>().empty());
}

void expect_panels(const json& v) {
    ASSERT_FALSE(v["panels"].empty());
    for (const json& panel : v["panels"]) {
        int defaults = 0, on_front = 0;
        for (const json& point : panel["points"]) {
            defaults += point["default"].get<bool>();
            on_front += point["on_front"].get<bool>();
            const json& wall = point["time"]["wall_ms"];
            EXPECT_GT(wall["median"], 0.0);
            EXPECT_LE(wall["low"], wall["median"]);
            EXPECT_GE(wall["high"], wall["median"]);
            EXPECT_LE(wall["median"], wall["p95"]);
            EXPECT_GT(point["time"]["gpu_ms"]["median"], 0.0);
            for (const char* key : {"rmse", "max", "p999", "count", "unit"})
                EXPECT_TRUE(point["error"].contains(key)) << key;
            EXPECT_LE(point["error"]["rmse"], point["error"]["max"]);
            EXPECT_GE(point["error"]["flip_mean"].get<double>(), 0.0);
        }
        EXPECT_EQ(defaults, 1) << panel["subject"];
        EXPECT_GE(on_front, 1) << panel["subject"];
        EXPECT_TRUE(panel["default_on_front"].is_boolean());
    }
}

TEST_F(BenchCommand, IsAProgramOfItsOwnAndTheProgramSaysWhereItIsMissing) {
    namespace fs = std::filesystem;
    const fs::path alone = file("alone/palpate");
    fs::create_directories(alone.parent_path());
    fs::copy_file(kProgram, alone);
    const std::string command =
        "PATH=/usr/bin " + alone.string() + " bench upload --tiny 2> " + file("stderr").string();
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1);
    EXPECT_EQ(bytes_of("stderr"),
              "palpate: error: expected the program palpate-bench beside palpate or on PATH, found "
              "none: it is a package of its own (from a checkout: cmake --build build/dev --target "
              "palpate-bench)\n");
    // From PATH, with this command's own options before and behind the word.
    const std::string found = "PATH=" + fs::path(kProgram).parent_path().string() + " " +
                              alone.string() + " --quiet bench --help > " + file("stdout").string();
    EXPECT_EQ(WEXITSTATUS(std::system(found.c_str())), 0);
    EXPECT_THAT(bytes_of("stdout"), HasSubstr("--no-peers"));
}

TEST_F(BenchCommand, SegmentGivesTimesAndErrorsBesideItk) {
    ProgramRun ran = run(
        {"bench", "segment", "--tiny", "--only", "gaussian,median", "--out", file("out").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json v = result("segment");
    ASSERT_EQ(v["filters"].size(), 2u);
    for (const json& row : v["filters"]) {
        EXPECT_GT(row["ours_ms"]["median"], 0.0);
        EXPECT_LE(row["ours_error"]["rms"], row["ours_error"]["max"]);
        EXPECT_LT(row["ours_error"]["rms"], 0.5); // of HU -1000 .. 1100
        if (row.contains("itk")) {
            EXPECT_GT(row["itk_ms"]["median"], 0.0);
            EXPECT_LT(row["itk_error"]["rms"], 20.0);
        }
    }
    ran = run({"bench", "segment", "--only", "gaussian,gauss", "--out", file("out").string()});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("found 'gauss'"));
}

TEST_F(BenchCommand, QualityGivesFrontsOrdersMapsAndFactors) {
    const ProgramRun ran = bench("quality"); // so short a run judges no default by its times
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json v = result("quality");
    EXPECT_EQ(v["pass"], true);
    EXPECT_EQ(v["failures"], json::array());
    expect_environment(v);
    expect_panels(v);
    EXPECT_EQ(v["peers"]["absent_because"], "VTK was not asked (--no-peers)");
    EXPECT_EQ(v["maps"].size(), v["panels"].size());
    EXPECT_GE(v["convergence"].size(), 4u);
    EXPECT_FALSE(v["factors"]["one_at_a_time"].empty());
    EXPECT_FALSE(v["factors"]["main_effects"].empty());
    // Errors fall with the step: the coarsest is no better than the finest.
    for (const json& curve : v["convergence"])
        EXPECT_GE(curve["rmse"].front().get<double>(), curve["rmse"].back().get<double>()) << curve;
    const std::string html = bytes_of("out/index.html");
    EXPECT_THAT(html, HasSubstr("data:image/png;base64,"));
    EXPECT_EQ(html.find("http"), std::string::npos);
    // Truth is kept, and read the second time.
    EXPECT_FALSE(std::filesystem::is_empty(file("out/truth")));
}

TEST_F(BenchCommand, FrameTellsWhatTheRecordingThreadTakes) {
    const ProgramRun ran = bench("frame");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json frame = result("frame");
    ASSERT_EQ(frame["frames"].size(), 24u); // two volumes, four views, three kinds of frames
    for (const json& row : frame["frames"]) {
        EXPECT_GT(row["cpu_ms"]["median"], 0.0);
        EXPECT_EQ(row["residency"], row["volume"] == "256^3" ? "atlas" : "dense");
        if (row["frames"] == "a dab a frame") {
            EXPECT_GT(row["uploaded_bytes_median"], 0.0) << row["view"];
        }
    }
    EXPECT_EQ(frame["aims"].size(), 24u);
    ProgramRun named =
        run({"bench", "frame", "--tiny", "--only", "64", "--out", file("out").string()});
    ASSERT_EQ(named.exit_code, 0) << named.messages;
    EXPECT_EQ(result("frame")["frames"].size(), 12u); // of one volume
    EXPECT_EQ(result("frame")["aims"].size(), 12u);   // milliseconds, and no ratio
    named = run({"bench", "frame", "--tiny", "--only", "64,65", "--out", file("out").string()});
    EXPECT_EQ(named.exit_code, 1);
    EXPECT_THAT(named.messages, HasSubstr("(64, 256), found '64,65'"));
}

TEST_F(BenchCommand, RenderAndUploadShareAPageAndCompareWithThemselves) {
    ProgramRun ran = bench("render");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json render = result("render");
    EXPECT_EQ(render["pass"], true);
    expect_panels(render);
    ASSERT_EQ(render["relative"].size(), 4u);
    EXPECT_EQ(render["relative"][0]["interactive"].size(), 1u);
    ran = bench("upload");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json upload = result("upload");
    ASSERT_GE(upload["rows"].size(), 2u);
    for (const json& row : upload["rows"]) {
        EXPECT_GT(row["bytes"], 0.0) << row;
        EXPECT_GT(row["share_of_memcpy"], 0.0) << row;
    }
    // Whatever is derived from it, a volume of 64^3 is no fewer bytes than its samples.
    EXPECT_GE(upload["rows"][0]["bytes"], 64 * 64 * 64 * 2);
    const std::string html = bytes_of("out/index.html");
    EXPECT_THAT(html, HasSubstr("\"suite\": \"render\""));
    EXPECT_THAT(html, HasSubstr("\"suite\": \"upload\""));

    ran = compare("out/render.json", "out/render.json");
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.output, HasSubstr("0 faster, 0 slower"));
    EXPECT_THAT(ran.output, HasSubstr("time x1.000 (noise"));
    // The same with one point three times slower and less exact.
    json worse = render;
    json& point = worse["panels"][0]["points"][0];
    point["time"]["wall_ms"]["median"] = 3 * point["time"]["wall_ms"]["median"].get<double>();
    point["time"]["noise"] = 0.01;
    point["error"]["rmse"] = 2 * point["error"]["rmse"].get<double>();
    worse["panels"][0]["points"][1]["name"] = "another";
    write("worse.json", worse.dump());
    json quiet = render;
    quiet["panels"][0]["points"][0]["time"]["noise"] = 0.01;
    write("quiet.json", quiet.dump());
    ran = compare("quiet.json", "worse.json");
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.output, HasSubstr("time x3.000 , error x2.000"));
    EXPECT_THAT(ran.output, HasSubstr("slower and less exact"));
    EXPECT_THAT(ran.output, HasSubstr("gone:"));
    EXPECT_THAT(ran.output, HasSubstr("new:"));
    // Refused with one sentence.
    EXPECT_EQ(compare("out/render.json", "out/upload.json").exit_code, 2);
    EXPECT_THAT(bytes_of("stderr"), HasSubstr("expected results of one suite"));
    EXPECT_EQ(compare("out/render.json", "none.json").exit_code, 1);
    EXPECT_THAT(bytes_of("stderr"), HasSubstr("none.json: No such file"));
}

TEST_F(BenchCommand, SurfaceGivesTimeBesideErrorAndTheOrder) {
    const ProgramRun ran = bench("surface");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json v = result("surface");
    expect_environment(v);
    EXPECT_EQ(v["peers"]["absent_because"], "VTK was not asked (--no-peers)");
    // Two solids of two sizes; three forms on the processor, one on the device, and the tracker.
    ASSERT_EQ(v["surfaces"].size(), 4u * 5u);
    for (const json& row : v["surfaces"]) {
        EXPECT_GT(row["ms"]["median"], 0.0) << row;
        EXPECT_GT(row["triangles"], 100) << row;
        EXPECT_EQ(row["lost"], 0) << row;
        EXPECT_EQ(row["non_manifold_edges"], 0) << row;
        EXPECT_LE(row["rms_mm"], row["largest_mm"]) << row;
        // A sphere; the gyroid is open at the border.
        if (row["case"].get<std::string>().starts_with("sphere")) {
            EXPECT_EQ(row["euler_number"], 2) << row;
        }
    }
    ASSERT_EQ(v["orders"].size(), 5u);
    for (const json& order : v["orders"])
        if (order["who"] != "tracker") { // whose vertices are midway: order 1, with noise
            for (const char* what : {"rms", "area", "volume"})
                EXPECT_NEAR(order[what], 2.0, 0.4) << order; // two coarse sizes
        }
    // A dab by each of ours, after which their surfaces have as many triangles.
    ASSERT_EQ(v["edits"].size(), 2u * 3u);
    for (size_t i = 0; i < 6; ++i) {
        const json& row = v["edits"][i];
        EXPECT_EQ(row["who"], (std::array{"tracker", "blocks", "blocks_gpu"})[i % 3]);
        EXPECT_EQ(row["radius_samples"], i < 3 ? 5 : 10);
        EXPECT_GT(row["ms"]["median"], 0.0) << row;
        EXPECT_DOUBLE_EQ(row["edits_per_s"], 1e3 / row["ms"]["median"].get<double>()) << row;
        EXPECT_EQ(row["triangles_after_mean"], v["edits"][i / 3 * 3]["triangles_after_mean"]);
        // Some 12 pi r^2 of a whole sphere; what a dab takes out has a surface, too.
        EXPECT_NEAR(row["triangles_after_mean"], 20'000, 2000) << row;
        EXPECT_EQ(row.contains("blocks_median"), i % 3 != 0) << row;
    }
    EXPECT_EQ(v["edits"][0]["printed_edits_per_s"], 52); // table 1 of Vidholm & Agmund
    EXPECT_EQ(v["edits"][3]["printed_edits_per_s"], 40);
    EXPECT_LE(v["window"]["p50_us"], v["window"]["p99_us"]);
    EXPECT_LE(v["window"]["p99_us"], v["window"]["worst_us"]);
    EXPECT_GT(v["window"]["triangles_mean"], 10.0);
    EXPECT_THAT(bytes_of("out/index.html"), HasSubstr("\"suite\": \"surface\""));
}

TEST_F(BenchCommand, RenderDoesWhatIsNamed) {
    ProgramRun ran = run({"bench", "render", "--tiny", "--no-peers", "--only", "relative", "--out",
                          file("out").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json v = result("render");
    EXPECT_TRUE(v["panels"].empty());
    EXPECT_TRUE(v["first_frames"].empty());
    ASSERT_EQ(v["relative"].size(), 4u); // modes
    for (const json& row : v["relative"]) {
        EXPECT_GT(row["stereo_by_mono"]["median"], 0.0) << row;
        ASSERT_EQ(row["interactive"].size(), 4u) << row; // sides
        for (size_t side = 0; side < 4; ++side) {
            const json& view = row["interactive"][side];
            EXPECT_EQ(view["turned_degrees"], 90.0 * double(side));
            EXPECT_GT(view["full_by_interactive"]["median"], 0.0) << row;
            EXPECT_NEAR(view["db"], -20.0 * std::log10(view["rmse"].get<double>()), 1e-9) << row;
            EXPECT_GT(view["traced_share"], 0.0) << row;
        }
    }
    ran = run({"bench", "render", "--only", "moving", "--out", file("out").string()});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("(frames, relative), found 'moving'"));
}

TEST_F(BenchCommand, SurfaceDoesWhatIsNamed) {
    ProgramRun ran = run({"bench", "surface", "--tiny", "--no-peers", "--only", "sphere_16,window",
                          "--out", file("out").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json v = result("surface");
    for (const json& row : v["surfaces"])
        EXPECT_EQ(row["case"], "sphere_16");
    EXPECT_EQ(v["surfaces"].size(), 5u);
    EXPECT_TRUE(v.contains("window"));
    EXPECT_FALSE(v.contains("edits"));
    ran = run({"bench", "surface", "--only", "sphere", "--out", file("out").string()});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("edits, window or live, found 'sphere'"));
    ran = run({"bench", "upload", "--only", "sphere_16", "--out", file("out").string()});
    EXPECT_EQ(ran.exit_code, 2);
    EXPECT_THAT(ran.messages,
                HasSubstr("expected the suite frame, render, segment, surface or touch"));
}

// Every scene with every trajectory and every algorithm: a cell has its figures or says why not.
void expect_whole_grid(const json& rows, size_t algorithms, const char* a_figure) {
    for (const json& row : rows) {
        ASSERT_EQ(row["cells"].size(), algorithms) << row;
        for (const json& cell : row["cells"]) {
            if (cell.contains("why"))
                EXPECT_FALSE(cell["why"].get<std::string>().empty()) << row;
            else
                EXPECT_TRUE(cell.contains(a_figure)) << row;
        }
    }
}

TEST_F(BenchCommand, TouchGivesTheWholeGridAndTheMetricsOfThePlan) {
    const ProgramRun ran = bench("touch");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json touch = result("touch")["touch"];
    std::map<std::string, std::set<std::string>> trajectories; // by "id scene"
    for (const json& row : touch["grid"])
        trajectories[row["id"].get<std::string>() + " " + row["scene"].get<std::string>()].insert(
            row["trajectory"].get<std::string>().substr(0, 3));
    std::set<std::string> ids;
    for (const auto& [scene, ran_with] : trajectories) {
        ids.insert(scene.substr(0, scene.find(' ')));
        EXPECT_EQ(ran_with.size(), 10u) << scene; // T1 .. T10
    }
    // Patients take seconds to read: the short form has them.
    EXPECT_THAT(ids, testing::UnorderedElementsAre("A1", "A2", "A3", "A4", "A5", "A6", "A7", "A8",
                                                   "A9", "A10", "A12", "A13", "A14"));
    expect_whole_grid(touch["grid"], 14, "excess_jump_n");
    expect_whole_grid(touch["closed_loop"], 14, "motor_work_mj");
    size_t red = 0; // each says which bound it breaks
    for (const json& row : touch["grid"])
        for (const json& cell : row["cells"])
            if (cell.contains("within_bounds")) {
                EXPECT_NE(cell["within_bounds"].get<bool>(), cell.contains("beyond")) << cell;
                red += cell.contains("beyond");
            }
    EXPECT_GT(red, 0u); // printed algorithms keep the faults of their papers
    size_t with_gate = 0;
    for (const json& metric : touch["metrics"]) {
        EXPECT_TRUE(metric.contains("proved_by") || metric["figures"].size() > 0) << metric;
        with_gate += metric.contains("figures") &&
                     metric["figures"]["swept-point"].contains("within") &&
                     metric["figures"]["swept-point"]["within"].get<bool>();
    }
    EXPECT_GE(with_gate, 15u); // held by the repaired point even on 40 ticks
    EXPECT_GE(touch["beside"].size(), 9u);
    EXPECT_EQ(touch["bounds"]["form"], "tiny");
    EXPECT_EQ(touch["bounds"]["parts"].size(), 7u);
    EXPECT_EQ(touch["bounds"]["algorithms"].size(), 14u);
    ASSERT_EQ(touch["bounds"]["rows"].size(), 11u);
    for (const json& row : touch["bounds"]["rows"])
        for (const char* name : {"swept-point", "swept-tool", "swept-local", "swept-mesh"}) {
            const json& cell = row["figures"][name];
            EXPECT_EQ(cell["within"].get<bool>(), cell["figure"] <= row["gate"]) << row["asked"];
            // All ticks together are not worse than the worst cell, but for a bin of 0.05.
            if (cell.contains("worst_figure")) {
                EXPECT_LE(cell["figure"].get<double>(), cell["worst_figure"].get<double>() + 0.05);
                EXPECT_GT(cell["ticks"].get<uint64_t>(), 0u) << name;
                EXPECT_NE(cell["worst_cell"], "") << name;
            }
        }
    ASSERT_EQ(touch["z_width"].size(), 6u); // three devices, with and without a tick of delay
    for (const json& map : touch["z_width"])
        EXPECT_TRUE(std::filesystem::exists(file("out") / map["png"].get<std::string>()));
    const std::string page = bytes_of("out/index.html");
    EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
    for (const std::string& id : ids) // the page says what each kind of scene is
        EXPECT_THAT(page, testing::ContainsRegex("Scenes: .*" + id + " [a-z]")) << id;
    std::set<std::string> kinds;
    for (const json& row : touch["grid"])
        kinds.insert(row["trajectory"].get<std::string>().substr(0, 2));
    EXPECT_TRUE(kinds.contains("T3"));
    for (const std::string& kind : kinds)
        EXPECT_THAT(page, HasSubstr(kind + " "));
    EXPECT_THAT(page, HasSubstr("T3 crossing"));
    EXPECT_THAT(page, HasSubstr("Red does not hold"));
}

TEST_F(BenchCommand, TouchDoesWhatIsNamed) {
    const auto run_only = [&](const std::string& names) {
        return run({"bench", "touch", "--tiny", "--only", names, "--out", file("out").string()});
    };
    ProgramRun ran = run_only("swept-point,eriksson-2006");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    json touch = result("touch")["touch"];
    EXPECT_EQ(touch["bounds"]["parts"], json({"open_loop"}));
    EXPECT_EQ(touch["bounds"]["algorithms"], json({"eriksson-2006", "swept-point"}));
    expect_whole_grid(touch["grid"], 2, "excess_jump_n");
    uint64_t judged = 0, above = 0; // of swept-point on the clean scenes with a surface
    for (const json& row : touch["grid"])
        if (const json& cell = row["cells"]["swept-point"];
            row["id"].get<std::string>().size() == 2 && cell.contains("direction_ticks")) {
            judged += cell["direction_ticks"].get<uint64_t>();
            above += cell["direction_ticks_above_1.5"].get<uint64_t>();
        }
    const json& all = touch["bounds"]["rows"][4]["figures"]["swept-point"];
    EXPECT_EQ(all["ticks"], judged);
    EXPECT_EQ(all["figure"].get<double>() <= 1.5, above <= judged / 100);
    for (const char* part : {"closed_loop", "times", "laws", "z_width"})
        EXPECT_TRUE(touch[part].empty()) << part;

    ran = run_only("laws,swept-mesh");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    touch = result("touch")["touch"];
    EXPECT_EQ(touch["laws"].size(), 1u);
    EXPECT_EQ(touch["bounds"]["parts"], json({"laws"}));
    for (const char* part : {"closed_loop", "times", "grid", "z_width"})
        EXPECT_TRUE(touch[part].empty()) << part;

    ran = run_only("swept");
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("--only: expected parts of touch (open_loop, patients, "
                                        "closed_loop, times, laws, z_width, family, "
                                        "family_held, vidholm-2004"));
    EXPECT_THAT(ran.messages, HasSubstr("found 'swept'"));
}

TEST_F(BenchCommand, EditGivesLatenciesOnAPage) {
    const ProgramRun ran = bench("edit");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json v = result("edit");
    std::set<std::string> rows;
    for (const json& row : v["rows"]) {
        EXPECT_GT(row["ms"]["median"], 0.0) << row;
        EXPECT_LE(row["ms"]["median"], row["ms"]["p99"]) << row;
        rows.insert(row["what"].get<std::string>());
    }
    // The page's section looks for these by name.
    for (const char* start :
         {"hand to snapshot", "staging", "copy command", "surface of changed blocks",
          "snapshot to uploaded", "hand to new pixels, iso", "hand to new pixels, interactive"})
        EXPECT_TRUE(std::any_of(rows.begin(), rows.end(), [&](const std::string& what) {
            return what.starts_with(start);
        })) << start;
    EXPECT_THAT(bytes_of("out/index.html"), HasSubstr("\"suite\": \"edit\""));
}

TEST_F(BenchCommand, RefusesWithOneSentence) {
    write("file", "");
    const ProgramRun ran = run({"bench", "upload", "--tiny", "--out", file("file").string()});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("cannot be made"));
    EXPECT_EQ(run({"bench"}).exit_code, 2);
    EXPECT_EQ(run({"bench", "upload", "--tiny", "--full"}).exit_code, 2);
}

TEST_F(BenchCommand, RefusesVolumesThatAreNoFiles) {
    for (const char* option : {"--ct", "--labels"}) {
        const ProgramRun ran =
            run({"bench", "surface", "--tiny", "--no-peers", "--only", "window", option,
                 file("none.nii").string(), "--out", file("out").string()});
        EXPECT_EQ(ran.exit_code, 1);
        EXPECT_THAT(ran.messages, HasSubstr(std::string(option) + ": expected a volume, found no"));
        EXPECT_EQ(ran.output, "");
        EXPECT_FALSE(std::filesystem::exists(file("out")));
    }
}

// A sentence and no traceback, whatever the file lacks.
TEST_F(BenchCommand, CompareSaysWhatIsNoResult) {
    const char* environment = R"("suite": "touch", "environment": {})";
    write("no_rows.json", fmt::format("{{{}}}", environment));
    write("bare_row.json", fmt::format(R"({{{}, "rows": [{{"what": "a"}}]}})", environment));
    write("odd_rows.json", fmt::format(R"({{{}, "rows": [1, 2]}})", environment));
    write("alone.json", R"({"suite": "touch"})");
    write("text.json", "no JSON");
    for (const auto& [name, words] :
         {std::pair("no_rows.json", "no_rows.json: expected panels or rows with times, found none"),
          {"bare_row.json", "found one without 'ms'"},
          {"odd_rows.json", "expected panels or rows with times"},
          {"alone.json", "found no \"environment\""},
          {"text.json", "expected JSON"},
          {"none.json", "No such file"}}) {
        const ProgramRun ran = compare(name, name);
        EXPECT_EQ(ran.exit_code, 1) << name;
        EXPECT_EQ(ran.output, "");
        EXPECT_THAT(ran.messages, HasSubstr(words));
        EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
    }
}

} // namespace
} // namespace palpate
