#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "apps/palpate/command.h"
#include "engine/annotate/strokes.h"
#include "engine/base/file.h"
#include "engine/base/json.h"
#include "engine/base/log.h"
#include "engine/image/compare.h"
#include "engine/image/display_byte.h"
#include "engine/image/exr.h"
#include "engine/image/png.h"
#include "engine/io/mesh_io.h"
#include "engine/mesh/distance.h"
#include "engine/program/compare_json.h"
#include "engine/program/compare_labels.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/read_options.h"
#include "engine/volume/compare.h"

namespace palpate {

namespace {

// A limit that a person may set on one measure.
struct Tolerance {
    const char* flag;
    const char* measure; // its name in a sentence
    bool at_least;       // the limit is the least that passes, not the most
    const char* help;
    std::optional<double> limit = {};
};

struct CompareOptions {
    std::string first, second;
    bool labels = false;
    double bound = 0.0;
    double pixels_per_degree = kFlipPixelsPerDegree;
    double max_memory_mib = 0.0; // 0: the default of reading
    std::string difference;      // a picture to write
    double gain = 1.0;           // of it
    std::vector<Tolerance> tolerances{
        {"--max", "the largest difference", false, "Largest difference of a sample, in its units"},
        {"--share", "the share beyond the bound", false,
         "Largest share of pixels or voxels that differ by more than the bound, 0 .. 1"},
        {"--rmse", "the root mean square", false,
         "Largest root mean square of the differences, in the samples' units"},
        {"--mean", "the mean difference", false,
         "Largest mean of B - A in either direction, in the samples' units"},
        {"--flip", "FLIP", false, "Pictures: largest mean FLIP difference, 0 .. 1"},
        {"--neighborhood", "the share that matches nearby", true,
         "Pictures: smallest share of pixels that match one of the 3x3 pixels around within the "
         "bound, 0 .. 1"},
        {"--hausdorff", "the upper bound of the Hausdorff distance", false,
         "Meshes, labels: largest Hausdorff distance, in mm"},
        {"--rms-distance", "the RMS distance", false,
         "Meshes: largest root mean square of the distances of all points, in mm"},
        {"--normal-angle", "the RMS angle between normals", false,
         "Meshes: largest root mean square of the angle between normals, in degrees"},
        {"--dice", "the least Dice coefficient", true,
         "Labels: smallest Dice coefficient of a label, 0 .. 1"},
        {"--surface-dice", "the least surface Dice coefficient", true,
         "Labels: smallest share of a label's surface within --tolerance-mm, 0 .. 1"},
    };
    double geometry_mm = 0.001;
    LabelScoresOptions scores;
    std::vector<std::string> runs;
};

// Holds what was measured against the tolerances, and collects what is beyond.
class Verdict {
 public:
    explicit Verdict(const CompareOptions& options) : unused_(options.tolerances) {
        std::erase_if(unused_, [](const Tolerance& t) { return !t.limit; });
        none_given_ = unused_.empty();
    }

    void judge(std::string_view flag, double found) {
        const auto at = std::find_if(unused_.begin(), unused_.end(),
                                     [&](const Tolerance& t) { return t.flag == flag; });
        if (at == unused_.end())
            return;
        if (at->at_least ? found < *at->limit : found > *at->limit)
            failed_.push_back(fmt::format("{} is {:.6g}, {} than {:g}", at->measure, found,
                                          at->at_least ? "less" : "more", *at->limit));
        unused_.erase(at);
    }
    // Holds a measure to a limit that is required whatever was given.
    void require_at_most(const char* measure, double found, double limit) {
        if (found > limit)
            failed_.push_back(fmt::format("{} is {:.6g}, more than {:g}", measure, found, limit));
    }
    // The measures that every kind with numbers has. Where no tolerance was given, nothing may
    // differ by more than the bound; else what cannot be measured may only hide in the share.
    void judge_samples(const SampleDifference& difference) {
        if (none_given_)
            require_at_most("the share beyond the bound", difference.share_beyond, 0.0);
        const size_t before = unused_.size();
        judge("--max", difference.max_abs);
        judge("--rmse", difference.rmse);
        judge("--mean", std::abs(difference.mean_signed));
        if (unused_.size() < before)
            require_at_most("the number of samples without a counterpart (NaN, infinity)",
                            static_cast<double>(difference.nan_mismatch), 0.0);
        judge("--share", difference.share_beyond);
    }

    bool none_given() const { return none_given_; }
    // The limit that is given for a measure that has not been judged yet.
    std::optional<double> limit_of(std::string_view flag) const {
        for (const Tolerance& tolerance : unused_)
            if (tolerance.flag == flag)
                return tolerance.limit;
        return {};
    }
    const std::vector<Tolerance>& unused() const { return unused_; }
    const std::vector<std::string>& failed() const { return failed_; }

 private:
    std::vector<Tolerance> unused_; // given, and not yet judged
    bool none_given_ = false;
    std::vector<std::string> failed_;
};

std::string extension_of(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

// The kind of things to compare, told by a name: nothing is read for it.
enum class Kind { picture, mesh, volume };

Kind kind_of(const std::string& path) {
    const std::string extension = extension_of(path);
    const bool pattern = path.find_first_of("*?%") != std::string::npos;
    if (!pattern && (extension == ".exr" || extension == ".png"))
        return Kind::picture;
    return has_mesh_extension(path) ? Kind::mesh : Kind::volume;
}

const char* name_of(Kind kind) {
    return kind == Kind::picture ? "a picture" : kind == Kind::mesh ? "a mesh" : "a volume";
}

Result<Image> load_picture(const std::string& path) {
    if (extension_of(path) == ".png")
        return load_png(path);
    PALPATE_TRY(ExrFile file, load_exr(path));
    return std::move(file.image);
}

bool is_png(const std::string& path) {
    return extension_of(path) == ".png";
}

// The channels of `png` as a PNG of the picture would hold them: 8 bits, colours straight where it
// has alpha. Channels that the PNG lacks are left out.
Result<Image> as_png(const std::string& name, const Image& picture, const Image& png) {
    const bool has_alpha = channel_index(png, "A").has_value();
    const Image from = has_alpha ? with_straight_alpha(picture) : picture;
    Image out = make_image(from.size_px, png.channels);
    for (size_t c = 0; c < png.channels.size(); ++c) {
        const std::optional<size_t> channel = channel_index(from, png.channels[c]);
        if (!channel)
            return fail("{}: expected the channel {}, as the PNG has it, found {}", name,
                        png.channels[c], fmt::join(from.channels, ","));
        for (uint32_t y = 0; y < from.size_px.y; ++y)
            for (uint32_t x = 0; x < from.size_px.x; ++x)
                out.at(x, y, c) = float(display_byte(from.at(x, y, *channel))) / 255.0f;
    }
    return out;
}

Result<Json> compare_pictures(const CompareOptions& options, Verdict& verdict) {
    PALPATE_TRY(Image first, load_picture(options.first));
    PALPATE_TRY(Image second, load_picture(options.second));
    std::string rounded; // the name of an EXR beside a PNG
    if (is_png(options.first) != is_png(options.second)) {
        const bool exr_first = is_png(options.second);
        rounded = exr_first ? options.first : options.second;
        PALPATE_TRY(Image shown,
                    as_png(rounded, exr_first ? first : second, exr_first ? second : first));
        (exr_first ? first : second) = std::move(shown);
    }
    Result<ImageDifference> difference =
        compare_images(first, second, options.bound, options.pixels_per_degree);
    if (!difference)
        return fail("{} and {}: {}", options.first, options.second, difference.error().message);
    if (!rounded.empty())
        log::info("{}: compared as a PNG of it would be, in 8 bits", rounded);
    if (!options.difference.empty()) {
        const Image picture = difference_image(first, second, static_cast<float>(options.gain));
        PALPATE_TRY(is_png(options.difference)
                        ? save_png(options.difference, picture)
                        : save_exr(options.difference, picture, ExrPrecision::full_float));
        PALPATE_TRY(FilesTogether::commit_newest()); // whatever the verdict
    }
    verdict.judge_samples(difference->all);
    verdict.judge("--neighborhood", difference->neighborhood_match_share);
    if (difference->flip_mean)
        verdict.judge("--flip", *difference->flip_mean);
    Json json{{"kind", "image"},
              {"size_px", {first.size_px.x, first.size_px.y}},
              {"bound", options.bound}};
    json.update(json_of(*difference));
    return json;
}

Result<Json> compare_voxels(const CompareOptions& options, Verdict& verdict) {
    const Interrupt interrupt;
    std::vector<std::string> paths{options.first, options.second};
    paths.insert(paths.end(), options.runs.begin(), options.runs.end());
    std::vector<Volume> volumes;
    for (const std::string& path : paths) {
        const ReadFlags flags{.path = path, .max_memory_mib = options.max_memory_mib};
        PALPATE_TRY(LoadedVolume loaded, load(flags, options.labels, interrupt));
        volumes.push_back(std::move(loaded.volume));
    }
    const double bound = options.labels ? 0.0 : options.bound;
    Result<VolumeDifference> difference = compare_volumes(volumes[0], volumes[1], bound);
    if (!difference)
        return fail("{} and {}: {}", options.first, options.second, difference.error().message);
    verdict.require_at_most("the distance in mm between like corners", difference->geometry_mm,
                            options.geometry_mm);
    const glm::uvec3 size = volumes[0].size();
    const SampleDifference samples = samples_of(*difference, sample_count(volumes[0].grid()));
    Json json{{"kind", options.labels ? "labels" : "volume"},
              {"size", {size.x, size.y, size.z}},
              {"bound", bound},
              {"geometry_mm", difference->geometry_mm},
              {"same_type", difference->same_type}};
    if (!options.labels) {
        verdict.judge_samples(samples);
        json.update(json_of(samples));
        return json;
    }
    const std::vector<Volume> runs(volumes.begin() + 2, volumes.end());
    for (const Volume& run : runs) {
        PALPATE_TRY(const VolumeDifference apart, compare_volumes(volumes[0], run, 0.0));
        verdict.require_at_most("the distance in mm between like corners of a run",
                                apart.geometry_mm, options.geometry_mm);
    }
    Result<LabelComparison> labels =
        compare_label_maps(volumes[0], volumes[1], runs, options.scores, {interrupt.token(), {}});
    if (!labels)
        return fail("{} and {}: {}", options.first, options.second, labels.error().message);
    if (verdict.none_given())
        verdict.require_at_most("the share of voxels with another label", samples.share_beyond, 0);
    verdict.judge("--share", samples.share_beyond);
    verdict.judge("--dice", labels->least_dice);
    verdict.judge("--surface-dice", labels->least_surface_dice);
    verdict.judge("--hausdorff", labels->largest_mm);
    json["share_beyond"] = samples.share_beyond;
    json["beyond"] = samples.beyond;
    json.update(labels->json);
    return json;
}

// Narrows it until a limit lies outside, or to what doubles tell apart: a limit within it can be
// neither promised nor denied.
HausdorffRange narrowed(const Mesh& first, const Mesh& second, HausdorffRange range, double limit,
                        double finest_mm) {
    while (range.least <= limit && limit < range.most && range.most - range.least > finest_mm) {
        const double tolerance = std::max(0.5 * (limit - range.least), finest_mm);
        const double least =
            compare_meshes(first, second, {.tolerance_mm = tolerance, .samples = 1}).hausdorff_mm();
        range = {std::max(range.least, least), std::min(range.most, least + tolerance)};
        if (tolerance == finest_mm)
            break;
    }
    return range;
}

Result<Json> compare_surfaces(const CompareOptions& options, Verdict& verdict) {
    std::vector<Mesh> meshes;
    for (const std::string& path : {options.first, options.second}) {
        MeshReadOptions read;
        if (options.max_memory_mib > 0)
            read.max_memory_bytes =
                ReadFlags{.max_memory_mib = options.max_memory_mib}.max_memory_bytes();
        PALPATE_TRY(LoadedMesh loaded, load_mesh(path, read));
        for (const std::string& warning : loaded.warnings)
            log::warning("{}", warning);
        meshes.push_back(std::move(loaded.mesh));
    }
    if (meshes[0].triangles.empty() != meshes[1].triangles.empty())
        return fail("{} and {}: only one of them has triangles", options.first, options.second);
    const double tolerance_mm = distance_tolerance_mm(meshes[0]);
    const MeshDistance distance =
        compare_meshes(meshes[0], meshes[1], {.tolerance_mm = tolerance_mm});
    const double normal_deg =
        std::max(distance.forward.normal_rms_deg, distance.backward.normal_rms_deg);
    // Points on the triangles of one mesh are off its own triangles by the rounding of doubles.
    const std::optional<double> limit =
        verdict.none_given() ? std::max(options.bound, 1e-6) : verdict.limit_of("--hausdorff");
    HausdorffRange hausdorff{distance.hausdorff_mm(), distance.hausdorff_mm() + tolerance_mm};
    if (limit)
        hausdorff = narrowed(meshes[0], meshes[1], hausdorff, *limit, 1e-6 * tolerance_mm);
    if (verdict.none_given())
        verdict.require_at_most("the upper bound of the Hausdorff distance in mm", hausdorff.most,
                                *limit);
    verdict.judge("--hausdorff", hausdorff.most);
    verdict.judge("--rms-distance", distance.rms_mm());
    verdict.judge("--normal-angle", normal_deg);
    Json json = mesh_json(meshes[0], meshes[1], distance, hausdorff);
    json["bound"] = options.bound;
    return json;
}

void warn_of_idle_options(const CLI::App& app, const CompareOptions& options, Kind kind) {
    const bool labels = app.count("--labels") > 0 && kind == Kind::volume;
    const IdleOptions idle[] = {
        {kind != Kind::volume, {"--labels", "--geometry"}, "of volumes"},
        {!labels, {"--tolerance-mm", "--box-margin-mm", "--runs"}, "of label maps (--labels)"},
        {kind == Kind::picture, {"--max-memory"}, "of volumes and meshes"},
        {kind != Kind::picture, {"--pixels-per-degree", "--difference"}, "of pictures"},
        {options.difference.empty(), {"--gain"}, "without --difference"}};
    warn_of_idle(app, idle);
}

Result<void> run_compare(const CompareOptions& options, const CLI::App& app) {
    const Kind kind = kind_of(options.first), other = kind_of(options.second);
    if (kind != other)
        return fail("expected A and B of one kind, found {} ({}) and {} ({})", name_of(kind),
                    options.first, name_of(other), options.second);
    if (!options.difference.empty() && kind_of(options.difference) != Kind::picture)
        return fail("--difference: expected a name ending in .png or .exr, found {}",
                    options.difference);
    warn_of_idle_options(app, options, kind);
    Verdict verdict(options);
    PALPATE_TRY(Json json, kind == Kind::picture ? compare_pictures(options, verdict)
                           : kind == Kind::mesh  ? compare_surfaces(options, verdict)
                                                 : compare_voxels(options, verdict));
    if (!verdict.unused().empty())
        return fail("{} does not apply to {} ({})", verdict.unused()[0].flag,
                    options.labels ? "a label map" : name_of(kind), options.first);
    json["failed"] = verdict.failed();
    json["pass"] = verdict.failed().empty();
    PALPATE_TRY(print_report(report_text(json)));
    if (!verdict.failed().empty())
        return fail("{} and {} differ: {}", options.first, options.second,
                    fmt::join(verdict.failed(), "; "));
    return {};
}

} // namespace

Command add_compare(CLI::App& app) {
    auto options = std::make_shared<CompareOptions>();
    app.add_option("A", options->first,
                   "A picture (.exr or .png), a mesh (.ply, .stl, .obj or .vtp) or a volume")
        ->required();
    app.add_option("B", options->second, "Another of the same kind")->required();
    app.add_flag("--labels", options->labels,
                 "Volumes: compare as label maps (default: grey values)");
    app.add_option("--tolerance-mm", options->scores.tolerance_mm,
                   "Labels: distance up to which surfaces agree, in mm, for their Dice coefficient")
        ->check(non_negative())
        ->capture_default_str();
    app.add_option("--box-margin-mm", options->scores.box_margin_mm,
                   "Labels: margin of B's box for specificity near the object, in mm")
        ->check(non_negative())
        ->capture_default_str();
    app.add_option("--runs", options->runs,
                   "Labels: more maps of the same object; prints how well all agree pairwise")
        ->type_name("FILE ...");
    app.add_option("--bound", options->bound,
                   "Differences up to this do not count in shares; in the samples' units (colours: "
                   "1 is white; meshes: mm)")
        ->check(non_negative())
        ->capture_default_str();
    app.add_option("--pixels-per-degree", options->pixels_per_degree,
                   "Pictures: pixels per degree of visual angle, for FLIP")
        ->check(positive())
        ->capture_default_str();
    app.add_option("--difference", options->difference,
                   "Pictures: write |B - A| of each channel to this .png or .exr (default: none)")
        ->type_name("FILE");
    app.add_option("--gain", options->gain, "With --difference: factor of the differences")
        ->check(positive())
        ->capture_default_str();
    app.add_option("--geometry", options->geometry_mm,
                   "Volumes: largest distance of equal corners, in mm")
        ->check(non_negative())
        ->capture_default_str();
    app.add_option(
           "--max-memory", options->max_memory_mib,
           "Volumes and meshes: most memory for reading each, in MiB (default: 75 % of this "
           "machine's)")
        ->check(positive());
    for (Tolerance& tolerance : options->tolerances)
        app.add_option(tolerance.flag, tolerance.limit,
                       fmt::format("{} (default: any)", tolerance.help))
            ->check(non_negative())
            ->group("Tolerances; with none given, nothing may differ by more than the bound");
    return {[options, &app] { return run_compare(*options, app); },
            [options] {
                std::vector<NamedFile> files;
                append_volume(files, "A", options->first);
                append_volume(files, "B", options->second);
                files.push_back({"--difference", options->difference, FileUse::write});
                for (const std::string& run : options->runs)
                    append_volume(files, "--runs", run);
                return files;
            }};
}

} // namespace palpate
