// Filters and methods of engine/segment beside ITK's, in turn with them: time, and error against an
// exact reference in double at samples spread over the volume.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bench/segment/cases.h"
#include "bench/segment/live_cases.h"
#include "bench/study/guidance.h"
#include "bench/study/liver_phantom.h"
#include "bench/study/liver_study.h"
#include "bench/study/samples.h"
#include "bench/study/seeds_study.h"
#include "bench/suite/peers.h"
#include "bench/suite/suites.h"
#include "engine/base/log.h"
#include "engine/io/volume_io.h"
#include "engine/segment/seeds.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {

namespace {

// 8 x 8 x 8 samples, spread over the volume.
std::vector<glm::ivec3> probes(glm::uvec3 size) {
    std::vector<glm::ivec3> all;
    for (uint32_t z = 0; z < 8; ++z)
        for (uint32_t y = 0; y < 8; ++y)
            for (uint32_t x = 0; x < 8; ++x)
                all.emplace_back(glm::uvec3(2 * x + 1, 2 * y + 1, 2 * z + 1) * size / 16u);
    return all;
}

// The temple of the CT phantom, 24 x 24 x 20 samples.
Result<Sample> small_sample() {
    return Sample{
        "phantom", "a part of the CT phantom",
        synthetic::sample_ct_phantom(make_grid({24, 24, 20}, {1, 1, 1.5}, {-80, -12, -15}))};
}

template <class Found>
Json error_json(const std::vector<double>& exact, const Found& found) {
    double largest = 0, squares = 0;
    size_t count = 0;
    for (size_t i = 0; i < exact.size(); ++i) {
        if (std::isnan(exact[i]))
            continue;
        ++count;
        const double off = std::abs(double{found(i)} - exact[i]);
        largest = std::max(largest, off);
        squares += off * off;
    }
    return {{"rms", std::sqrt(squares / double(std::max<size_t>(count, 1)))}, {"max", largest}};
}

Json times_json(const std::vector<double>& times) {
    const Spread ms = spread(times);
    return {{"median", ms.median}, {"low", ms.low}, {"high", ms.high}, {"count", ms.count}};
}

} // namespace

namespace {

constexpr const char* kStudy = "study"; // the part's name

// Labels of TotalSegmentator (version 2) on which parameters were looked at: spleen, kidneys,
// liver, stomach.
constexpr uint16_t kLookedAt[] = {1, 2, 3, 5, 6};
constexpr double kLeast_ml = 20.0, kMost_ml = 3000.0; // of an organ that is scored

Result<std::vector<StudyOrgan>> organs_of(const Options& options) {
    std::vector<StudyOrgan> organs;
    if (options.tiny || !options.scores_organs)
        return organs;
    PALPATE_TRY(const LoadedVolume ct, load_volume(options.head_ct));
    PALPATE_TRY(const LoadedVolume labels, load_labels(options.labels));
    const Grid& grid = ct.volume.grid();
    if (labels.volume.grid() != grid)
        return fail("{}: expected labels on the grid of {}, found another grid",
                    options.labels.string(), options.head_ct.string());
    const double sample_ml = std::abs(glm::determinant(glm::dmat3(grid.world_from_index))) / 1000.0;
    for (const LabelCount& one : label_counts(labels.volume)) {
        const double ml = double(one.count) * sample_ml;
        if (ml < kLeast_ml || ml > kMost_ml)
            continue;
        std::string name = fmt::format("label {}", one.label);
        for (const LabelName& named : labels.labels)
            if (named.label == one.label)
                name = named.name;
        organs.push_back(
            {name, ct.volume,
             make_volume(grid, ScalarType::u8,
                         [&](glm::uvec3 i) { return labels.volume.value(i) == float(one.label); }),
             std::ranges::find(kLookedAt, one.label) == std::end(kLookedAt)});
    }
    return organs;
}

Result<void> add_study(const Options& options, Json& json) {
    StudyOptions study;
    if (options.full)
        study = {.curves = 12, .clicks = 12};
    if (options.tiny)
        study = {.phantoms = 1, .outlined = 1, .users = 2, .curves = 1, .clicks = 2};
    PALPATE_TRY(study.organs, organs_of(options));
    int shown = 0;
    const Task task{options.stop, [&](double share) {
                        if (int(10.0 * share) > shown) {
                            shown = int(10.0 * share);
                            log::info("liver study: {} %", 10 * shown);
                        }
                    }};
    PALPATE_TRY(json["study"], liver_study(study, task));
    return {};
}

} // namespace

namespace {

constexpr const char* kGuidance = "guidance"; // the parts' names
constexpr const char* kSeeds = "seeds";

// Phantoms, and the ten largest organs of a real volume.
Result<void> add_seeds(const Options& options, Json& json) {
    SeedsOptions seeds;
    for (uint64_t n = 0; n < (options.tiny ? 1 : options.full ? 24 : 4); ++n) {
        LiverPhantom phantom = liver_phantom(n);
        seeds.cases.push_back({fmt::format("phantom {}", n),
                               std::move(phantom.volume),
                               std::move(phantom.truth),
                               {1}});
    }
    if (options.tiny)
        seeds.users = 1, seeds.methods = {"grow-from-seeds"};
    else
        seeds.first_user = 100;
    if (options.scores_organs && !options.tiny) {
        PALPATE_TRY(const LoadedVolume grey, load_volume(options.head_ct));
        PALPATE_TRY(const LoadedVolume labels, load_labels(options.labels));
        std::vector<LabelCount> counts = label_counts(labels.volume);
        std::ranges::sort(counts, std::greater(), &LabelCount::count);
        SeedsCase one{"ten organs", grey.volume, labels.volume, {}};
        for (size_t n = 0; n < std::min<size_t>(10, counts.size()); ++n)
            one.labels.push_back(counts[n].label);
        seeds.cases.push_back(std::move(one));
    }
    const Task task{options.stop, {}};
    if (options.peers && !options.tiny) {
        seeds.keep = options.out / "seeds";
        std::error_code error;
        fs::create_directories(seeds.keep, error); // what fails is told by the first file
    }
    PALPATE_TRY(json["seeds"], seeds_study(seeds, task));
    if (!seeds.keep.empty()) {
        const fs::path found = seeds.keep / "skimage.json", said = seeds.keep / "skimage.txt";
        const int code = run_program(
            {kPython, PALPATE_BENCH_SCRIPTS "/peers_seeds.py", seeds.keep.string(), found.string()},
            said);
        if (code == 0) {
            PALPATE_TRY(const std::string text, load_text(found));
            PALPATE_TRY(json["seeds"]["skimage"], parse_json(text, found.string()));
        } else {
            json["seeds"]["skimage_absent"] = last_line(said);
        }
    }
    if (!options.tiny) {
        PALPATE_TRY(json["seeds"]["times"], seeds_times(options.full, task));
    }
    return {};
}

Result<void> add_guidance(const Options& options, Json& json) {
    GuidanceOptions guidance;
    if (options.tiny)
        guidance = {.phantoms = 1, .seeds = 2, .repeats = 2};
    PALPATE_TRY(json["guidance"], guidance_study(guidance, {options.stop, {}}));
    return {};
}

// Adds the answers that a person waits for to the same table.
Result<void> add_live_case(const LiveCase& one, const Options& options, Json& json) {
    PALPATE_TRY(const LiveTimes found, one.run(options.tiny, {options.stop, {}}));
    const Spread ms = spread(found.ms);
    const std::vector<double> none(found.errors.size(), 0.0);
    Json row{{"name", one.name}, {"setting", one.setting}, {"ours_ms", times_json(found.ms)}};
    row["ours_ms"]["p95"] = ms.p95;
    row["ours_ms"]["worst"] = *std::max_element(found.ms.begin(), found.ms.end());
    row["ours_error"] = error_json(none, [&](size_t i) { return found.errors[i]; });
    if (!options.tiny)
        add_aim(json["aims"], fmt::format("{}, {}", one.name, one.setting),
                fmt::format("95 % of the answers within {:g} ms", one.wanted_ms), ms.p95,
                ms.p95 <= one.wanted_ms);
    log::info("{}: {:.2f} ms, 95 % within {:.2f} ms", one.name, ms.median, ms.p95);
    json["filters"].push_back(std::move(row));
    return {};
}

// Refuses parts that the suite does not have.
Result<void> check_parts(const Options& options) {
    std::vector<std::string> known{kStudy, kGuidance, kSeeds};
    const auto add = [&](const std::string& name) {
        if (std::ranges::find(known, name) == known.end()) // some have a row for each setting
            known.push_back(name);
    };
    for (const LiveCase& one : live_cases())
        add(one.name);
    for (const SegmentCase& one : segment_cases())
        add(one.name);
    for (const std::string& part : options.only)
        if (std::ranges::find(known, part) == known.end())
            return fail("--only: expected parts of segment ({}), found '{}'",
                        fmt::join(known, ", "), part);
    return {};
}

} // namespace

Result<Report> run_segment(Bench& bench) {
    const Options& options = bench.options();
    PALPATE_TRY(check_parts(options));
    Report report;
    report.json["filters"] = Json::array();
    report.json["aims"] = Json::array();
    const auto wants = [&](const char* part) {
        return options.only.empty() ||
               std::find(options.only.begin(), options.only.end(), part) != options.only.end();
    };
    if (wants(kStudy))
        PALPATE_TRY(add_study(options, report.json));
    if (wants(kGuidance))
        PALPATE_TRY(add_guidance(options, report.json));
    if (wants(kSeeds))
        PALPATE_TRY(add_seeds(options, report.json));
    for (const LiveCase& one : live_cases())
        if (wants(one.name))
            PALPATE_TRY(add_live_case(one, options, report.json));
    if (!options.only.empty() &&
        std::ranges::none_of(segment_cases(), [&](const auto& one) { return wants(one.name); }))
        return report;
    PALPATE_TRY(const Sample sample, options.tiny ? small_sample() : head_ct(options.head_ct));
    PALPATE_TRY(SegmentInput input, segment_input(sample.volume));
    report.json["filter_title"] = sample.title;
    const std::vector<glm::ivec3> places = probes(sample.volume.size());
    const glm::uvec3 n = sample.volume.size();
    for (const SegmentCase& one : segment_cases()) {
        if (!wants(one.name))
            continue;
        std::optional<ItkRun> itk;
        if (options.peers && one.peer[0] != '\0')
            itk = itk_filter(one.peer, input);
        const int rounds = options.tiny ? 1 : options.full ? one.rounds : (one.rounds + 2) / 3;
        std::vector<double> ours_ms, itk_ms;
        std::optional<Volume> made;
        for (int round = 0; round < rounds; ++round) {
            if (options.stop.stop_requested())
                return fail("interrupted at {}", one.name);
            if (itk) {
                const Timer theirs;
                itk->run();
                itk_ms.push_back(theirs.ms());
                if (one.residual && round == 0) // ours goes as far
                    input.flow_residual = one.residual(input, itk->result());
            }
            made.reset();
            const Timer ours;
            Result<Volume> result = one.ours(input, {options.stop, {}});
            ours_ms.push_back(ours.ms());
            if (!result)
                return fail("{}: {}", one.name, result.error().message);
            made = std::move(*result);
        }
        Json row{{"name", one.name}, {"setting", one.setting}, {"ours_ms", times_json(ours_ms)}};
        const Samples theirs = itk ? itk->result() : Samples();
        if (one.residual) {
            row["ours_error"] = Json{{"residual", one.residual(input, samples_of(*made))}};
            if (itk)
                row["itk_error"] = Json{{"residual", one.residual(input, theirs)}};
        }
        if (one.exact) {
            std::vector<double> exact;
            for (const glm::ivec3 at : places)
                exact.push_back(one.exact(input, at));
            row["ours_error"] =
                error_json(exact, [&](size_t i) { return made->value(glm::uvec3(places[i])); });
            if (itk)
                row["itk_error"] = error_json(exact, [&](size_t i) {
                    const glm::uvec3 at(places[i]);
                    return theirs[at.x + size_t{n.x} * (at.y + size_t{n.y} * at.z)];
                });
        }
        if (itk && one.apart)
            row["apart_mm"] = one.apart(input, samples_of(*made), theirs);
        if (itk) {
            const double ratio = spread(itk_ms).median / spread(ours_ms).median;
            row["itk"] = one.peer;
            row["itk_ms"] = times_json(itk_ms);
            row["ratio"] = ratio;
            if (one.wanted > 0 && !options.tiny)
                add_aim(report.json["aims"], fmt::format("{}, {}", one.name, one.setting),
                        fmt::format("{:g} times as fast as ITK", one.wanted), ratio,
                        ratio >= one.wanted);
        }
        log::info("{}, {}: {:.1f} ms{}", one.name, one.setting, spread(ours_ms).median,
                  itk ? fmt::format(", ITK {:.0f} ms", spread(itk_ms).median) : "");
        report.json["filters"].push_back(std::move(row));
    }
    return report;
}

} // namespace palpate::bench
