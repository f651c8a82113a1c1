#include <filesystem>

#include "apps/palpate/command.h"
#include "bench/suite/page.h"
#include "bench/suite/suites.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/scene/scene_file.h"

namespace palpate {

namespace {

struct BenchOptions {
    std::string suite, out = "out/bench", device, head_ct = bench::kHeadCt, labels;
    std::vector<std::string> only;
    std::vector<std::pair<const char*, std::string>> given; // of the volumes: option and name
    bool full = false, brief = false, tiny = false, no_peers = false;
};

std::string suite_list() {
    std::string text;
    for (const bench::Suite& suite : bench::suites())
        text += fmt::format("{}{} ({})", text.empty() ? "" : "; ", suite.name, suite.purpose);
    return text + "; page (write index.html anew from the results in --out)";
}

std::vector<NamedFile> files_of(const BenchOptions& options) {
    const std::filesystem::path out = options.out;
    return {
        {"--ct", options.head_ct},
        {"--labels", options.labels},
        {"the result in --out", (out / (options.suite + ".json")).string(), FileUse::write, true},
        {"the page in --out", (out / "index.html").string(), FileUse::write, true}};
}

Result<void> run_bench(const BenchOptions& options) {
    if (options.suite == "page")
        return bench::write_page(options.out);
    // A suite passes over what a machine lacks, but not over what it was given.
    for (const auto& [option, path] : options.given)
        if (std::error_code error; !is_synthetic(path) &&
                                   path.find_first_of("*?%") == std::string::npos &&
                                   !std::filesystem::exists(path, error))
            return fail("{}: expected a volume, found no file '{}'", option, path);
    const Interrupt interrupt;
    bench::Options asked{.out = options.out,
                         .full = options.full,
                         .device = options.device,
                         .head_ct = options.head_ct,
                         .peers = !options.no_peers,
                         .tiny = options.tiny,
                         .only = options.only,
                         .stop = interrupt.token()};
    if (!options.labels.empty()) {
        asked.labels = options.labels;
        asked.scores_organs = true;
    }
    return bench::run_suite(options.suite, asked);
}

} // namespace

Command add_bench_suites(CLI::App& app) {
    auto o = std::make_shared<BenchOptions>();
    std::vector<std::string> suites{"page"};
    for (const bench::Suite& suite : bench::suites())
        suites.emplace_back(suite.name);
    app.add_option("SUITE", o->suite, suite_list())->required()->check(one_of(suites));
    app.add_option("-o,--out", o->out, "Folder for results, index.html, pictures and cached truth")
        ->capture_default_str();
    auto* brief = app.add_flag("--short", o->brief, "About 10 minutes on 2 cores (default)");
    auto* full =
        app.add_flag("--full", o->full, "Hours: finer, larger, more frames")->excludes(brief);
    app.add_flag("--tiny", o->tiny,
                 "Small sizes that test only that the bench works: 1 to 10 s a suite on 2 cores, "
                 "touch and stability half a minute")
        ->excludes(brief)
        ->excludes(full);
    app.add_option("--ct", o->head_ct, "The head CT: any volume in HU")
        ->capture_default_str()
        ->each([o](const std::string& path) { o->given.emplace_back("--ct", path); });
    app.add_option("--labels", o->labels,
                   "surface: a label map instead of the AAL atlas; segment: organs of --ct that "
                   "are scored, "
                   "with the label numbers of TotalSegmentator")
        ->each([o](const std::string& path) { o->given.emplace_back("--labels", path); });
    app.add_option(
           "--only", o->only,
           "Parts of a suite, by name. frame: sides of its volumes (128, 512, 1024). "
           "render: frames, relative (both eyes beside one, and "
           "interactive beside full quality, from four sides; default: both, from one). "
           "segment: study, guidance, and names of its table (gaussian, ..). surface: sphere_SIDE, "
           "gyroid_SIDE, "
           "head_ct, "
           "head_ct_174, gyroid_512, labels, edits, live, window (default: all but gyroid_512, "
           "which is in the full form). touch: algorithms (swept-point, ...; none named: "
           "all) and open_loop, patients (the scenes A11), closed_loop, times, laws, "
           "z_width (none named, but an algorithm: open_loop; default: all)")
        ->delimiter(',');
    app.add_flag("--no-peers", o->no_peers, "Do not run VTK");
    app.add_option("--device", o->device,
                   "Vulkan device: part of its name, or its number in palpate doctor (default: the "
                   "first discrete, integrated, then CPU device)");
    refuse_where_wrong(app, [o]() -> Result<void> {
        if (!o->only.empty() && o->suite != "frame" && o->suite != "render" &&
            o->suite != "surface" && o->suite != "touch" && o->suite != "segment")
            return fail(
                "--only: expected the suite frame, render, segment, surface or touch, found '{}'",
                o->suite);
        return {};
    });
    return {[o] { return run_bench(*o); }, [o] { return files_of(*o); }, /*files_together=*/false};
}

} // namespace palpate
