#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>

#include "apps/palpate/command.h"
#include "apps/palpate/surface_device.h"
#include "apps/palpate/surface_print.h"
#include "engine/base/file.h"
#include "engine/base/json.h"
#include "engine/base/log.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/io/label_names.h"
#include "engine/io/mesh_io.h"
#include "engine/mesh/decimate.h"
#include "engine/mesh/open_edges.h"
#include "engine/mesh/smooth.h"
#include "engine/mesh/topology.h"
#include "engine/program/interrupt.h"
#include "engine/program/mesh_export.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"
#include "engine/program/read_options.h"
#include "engine/program/surface_labels.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"
#include "engine/surface/tracker.h"

namespace palpate {

namespace {

enum class LabelWalls { shared, separate };
enum class Smoothing { none, bounded, mean, taubin, sinc };

struct SurfaceCommand {
    ReadFlags read;
    std::string out, report;
    std::optional<double> iso;
    std::string label_names; // a table of labels
    std::string label_text;  // of --labels: "true", or labels apart by commas; empty: not given
    std::vector<std::string> only_labels; // of it, by number or name; empty: all
    bool labels = false, closed = false, ascii = false;
    SurfaceTopology topology = SurfaceTopology::classic;
    SurfaceNormals normals = SurfaceNormals::gradient;
    LabelWalls walls = LabelWalls::shared;
    Smoothing smoothing = Smoothing::none;
    uint32_t passes = 10;
    double decimate_mm = 0.0;
    std::string decimate_to;
    bool is_decimated() const { return decimate_mm > 0.0 || !decimate_to.empty(); }
    PrintFlags print;
    ExtractOn on = ExtractOn::automatic;
    std::string device;
};

const std::map<std::string, SurfaceTopology> kTopologies{{"classic", SurfaceTopology::classic},
                                                         {"correct", SurfaceTopology::correct}};
const std::map<std::string, SurfaceNormals> kNormals{{"none", SurfaceNormals::none},
                                                     {"gradient", SurfaceNormals::gradient},
                                                     {"triangles", SurfaceNormals::triangles}};
const std::map<std::string, LabelWalls> kWalls{{"shared", LabelWalls::shared},
                                               {"separate", LabelWalls::separate}};
const std::map<std::string, Smoothing> kSmoothings{{"none", Smoothing::none},
                                                   {"bounded", Smoothing::bounded},
                                                   {"mean", Smoothing::mean},
                                                   {"taubin", Smoothing::taubin},
                                                   {"sinc", Smoothing::sinc}};

const std::map<std::string, ExtractOn> kExtractOn{
    {"auto", ExtractOn::automatic}, {"cpu", ExtractOn::cpu}, {"gpu", ExtractOn::gpu}};

// Runs stages one after another: each is timed, shown on a terminal, and not begun once somebody
// has asked to stop.
class Stages {
 public:
    explicit Stages(const Interrupt& interrupt) : interrupt_(interrupt), progress_("surface") {}

    template <class Work>
    Result<void> run(const char* name, double share_before, const Work& work) {
        if (interrupt_.token().stop_requested())
            return fail("interrupted before {}", name);
        progress_.show(share_before);
        const profile::Scope scope(name);
        const Timer timer;
        Result<void> done = work();
        ms_[name] = timer.ms();
        if (done && interrupt_.token().stop_requested())
            return fail("interrupted during {}", name);
        return done;
    }
    void show(double share) { progress_.show(share); }
    Json ms() const {
        Json json = ms_;
        json["total"] = total_.ms();
        return json;
    }

 private:
    const Interrupt& interrupt_;
    Progress progress_;
    Timer total_;
    Json ms_ = Json::object();
};

// Several meshes in one, in their order.
Mesh joined(const std::vector<Mesh>& meshes, const Grid& grid) {
    Mesh all{.world_from_mesh = world_from_mesh(grid)};
    for (const Mesh& mesh : meshes) {
        const auto offset = static_cast<uint32_t>(all.positions.size());
        all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
        all.normals.insert(all.normals.end(), mesh.normals.begin(), mesh.normals.end());
        all.labels.insert(all.labels.end(), mesh.labels.begin(), mesh.labels.end());
        for (const glm::uvec3 t : mesh.triangles)
            all.triangles.push_back(t + offset);
    }
    return all;
}

Result<Mesh> extract_iso(const SurfaceCommand& options, const Volume& volume,
                         const Interrupt& interrupt, Json& told) {
    const SurfaceOptions wanted{.topology = options.topology,
                                .normals = options.normals,
                                .closed_at_border = options.closed,
                                .stop = interrupt.token()};
    PALPATE_TRY(Extractor by, choose_extractor(options.on, options.device, volume, wanted));
    ExtractPasses passes;
    PALPATE_TRY(Mesh mesh,
                extract_on(by, volume, static_cast<float>(*options.iso), wanted, passes));
    told["on"] = by.device ? "gpu" : "cpu";
    told["why"] = by.why;
    if (by.device) {
        told["device"] = by.device->info().name;
        told["driver"] = by.device->info().driver;
        for (const auto& [name, ms] : passes)
            told["ms"][name] = ms;
    }
    return mesh;
}

Result<Mesh> extract(const SurfaceCommand& options, const Volume& volume,
                     const Interrupt& interrupt, Json& told) {
    told = {{"on", "cpu"}, {"why", "labels are, unless asked for otherwise"}};
    const glm::uvec3 size = volume.size();
    if (options.labels && std::max({size.x, size.y, size.z}) >= 65535)
        return fail("{}: expected fewer than 65535 samples along each axis, found {} x {} x {}",
                    options.read.path, size.x, size.y, size.z);
    if (options.labels && options.walls == LabelWalls::shared) {
        const bool is_bounded = options.smoothing == Smoothing::bounded;
        const SurfaceNetsOptions nets{.passes = is_bounded ? options.passes : 0,
                                      .stop = interrupt.token()};
        if (options.on != ExtractOn::gpu)
            return surface_nets(volume, nets);
        told = {{"on", "gpu"}, {"why", "asked for"}};
        return nets_on_device(options.device, volume, nets);
    }
    if (options.labels)
        return joined(track_labels(volume, {.closed = true, .stop = interrupt.token()}),
                      volume.grid());
    const ValueRange range = volume.range();
    if (range.empty())
        return fail("{}: expected data, found none", options.read.path);
    const auto iso = static_cast<float>(*options.iso); // as it is extracted
    if (!(iso >= range.min && iso <= range.max))
        return fail("{}: expected an iso-value within {:g} .. {:g}, found {:g}", options.read.path,
                    range.min, range.max, *options.iso);
    return extract_iso(options, volume, interrupt, told);
}

Json smoothed(const SurfaceCommand& options, Mesh& mesh) {
    SmoothReport report;
    if (options.smoothing == Smoothing::mean)
        report = mean_filter(mesh, options.passes);
    else if (options.smoothing == Smoothing::taubin)
        report = taubin_filter(mesh, options.passes);
    else
        report = windowed_sinc_filter(mesh, options.passes);
    return {{"passes", options.passes},
            {"volume_before_mm3", report.volume_before_mm3},
            {"volume_after_mm3", report.volume_after_mm3},
            {"area_before_mm2", report.area_before_mm2},
            {"area_after_mm2", report.area_after_mm2},
            {"largest_shift_mm", report.largest_shift_mm}};
}

// "50%" of some triangles, or a number of them; absent where it is neither.
std::optional<uint64_t> triangle_count(const std::string& text, uint64_t of) {
    double number = 0.0;
    const bool is_share = text.ends_with('%');
    const char* end = text.data() + text.size() - (is_share ? 1 : 0);
    const auto [stop, error] = std::from_chars(text.data(), end, number);
    if (error != std::errc() || stop != end || !(number > 0.0) || (is_share && number > 100.0) ||
        (!is_share && (number != std::floor(number) || number > 1e15)))
        return {};
    return static_cast<uint64_t>(is_share ? std::ceil(number / 100.0 * double(of)) : number);
}

// Warns of what held the triangles if more are left than asked for or, unasked, than nine tenths.
void warn_of_little_gain(const SurfaceCommand& options, uint64_t wanted, size_t before,
                         const Decimated& decimated) {
    const size_t after = decimated.mesh.triangles.size();
    if (wanted > 0 ? after <= wanted : double(after) <= 0.9 * double(before))
        return;
    std::string asked;
    if (options.decimate_mm > 0.0)
        asked = fmt::format("--decimate {:g}", options.decimate_mm);
    if (wanted > 0)
        asked += fmt::format("{}--decimate-to {}", asked.empty() ? "" : " ", options.decimate_to);
    const KeptEdges& kept = decimated.kept;
    const uint64_t edges = kept.by_distance + kept.by_topology + kept.by_shape;
    const auto percent = [&](uint64_t count) {
        return edges == 0 ? 0.0 : 100.0 * double(count) / double(edges);
    };
    log::warning(
        "{}: {} of {} triangles are left; of the edges that stay, {:.0f} % would move the "
        "surface too far, {:.0f} % would change its topology, and {:.0f} % would turn "
        "triangles over or make slivers",
        asked, after, before, percent(kept.by_distance), percent(kept.by_topology),
        percent(kept.by_shape));
}

Result<Json> decimated(const SurfaceCommand& options, Mesh& mesh, const std::stop_token& stop,
                       const std::function<void(double)>& progress) {
    const size_t before = mesh.triangles.size();
    DecimateOptions wanted{.stop = stop, .progress = progress};
    if (options.decimate_mm > 0.0)
        wanted.error_mm = options.decimate_mm;
    if (!options.decimate_to.empty())
        wanted.least_triangles = triangle_count(options.decimate_to, before).value();
    if (before > 100'000)
        log::info("making {} triangles fewer: one to three minutes a million", before);
    PALPATE_TRY(Decimated found, decimate(mesh, wanted));
    warn_of_little_gain(options, wanted.least_triangles, before, found);
    mesh = std::move(found.mesh);
    Json json{{"hausdorff_mm", found.hausdorff_mm}, {"triangles_before", before}};
    if (options.decimate_mm > 0.0)
        json["error_mm"] = options.decimate_mm;
    return json;
}

void warn_of_idle_options(const SurfaceCommand& o, const CLI::App& app) {
    const std::string extension = std::filesystem::path(o.out).extension().string();
    const IdleOptions idle[] = {
        {o.labels, {"--topology", "--normals", "--closed"}, "with --labels"},
        {o.labels && o.on != ExtractOn::gpu, {"--device"}, "with --labels, unless --on gpu"},
        {!o.labels, {"--walls"}, "with --iso"},
        {o.only_labels.empty(), {"--label-names"}, "without --labels=NAME"},
        {!o.labels && o.on == ExtractOn::cpu, {"--device"}, "with --on cpu"},
        {o.smoothing == Smoothing::none, {"--passes"}, "without --smooth"},
        {extension != ".ply" && extension != ".stl", {"--ascii"}, "of .ply and .stl alone"}};
    warn_of_idle(app, idle);
}

// Reads the value of --labels; returns what is wrong with it.
std::string read_labels(const std::string& text, SurfaceCommand& options) {
    options.labels = true;
    options.only_labels.clear();
    if (text == "true")
        return {};
    for (size_t at = 0; at <= text.size();) {
        const size_t end = std::min(text.find(',', at), text.size());
        const std::string label = text.substr(at, end - at);
        const bool is_number = label.find_first_not_of("0123456789.+-") == std::string::npos;
        uint16_t number = 0;
        const auto [rest, error] =
            std::from_chars(label.data(), label.data() + label.size(), number);
        if (is_number &&
            (error != std::errc() || rest != label.data() + label.size() || number == 0))
            return fmt::format(
                "expected labels from 1 to 65535, or names of them, apart by commas, found '{}'",
                text);
        options.only_labels.push_back(label);
        at = end + 1;
    }
    return {};
}

// A note where the surface ends in open edges.
void tell_open_edges(const SurfaceCommand& options, const Mesh& mesh) {
    if (options.labels)
        return;
    const uint64_t open = count_open_edges(mesh);
    if (open == 0)
        return;
    if (options.closed)
        log::info("{}: {} open edges are left where data is missing", options.out, open);
    else
        log::info(
            "{}: {} open edges are left, where the surface meets the volume's border or missing "
            "data, so that it encloses no volume; --closed closes it at the border",
            options.out, open);
}

// Checks the options whatever the volume.
Result<void> check_together(const SurfaceCommand& o) {
    if (o.smoothing == Smoothing::bounded && !(o.labels && o.walls == LabelWalls::shared))
        return fail("--smooth bounded: expected --labels with shared walls, found {}",
                    o.labels ? "--walls separate" : "--iso");
    if (o.labels && o.on == ExtractOn::gpu && o.walls != LabelWalls::shared)
        return fail("--on gpu: expected shared walls, found --walls separate");
    return {};
}

Result<void> run_surface(const SurfaceCommand& options, const CLI::App& app) {
    if (!has_mesh_extension(options.out))
        return fail("{}: expected an extension .ply, .stl, .obj or .vtp, found \"{}\"", options.out,
                    std::filesystem::path(options.out).extension().string());
    warn_of_idle_options(options, app);
    const Interrupt interrupt;
    Stages stages(interrupt);
    std::optional<LoadedVolume> loaded;
    Mesh mesh;
    Json report = Json::object(), extra = Json::object();
    Result<void> done = stages.run("read", 0.0, [&]() -> Result<void> {
        PALPATE_TRY(LoadedVolume read, load(options.read, options.labels, interrupt));
        loaded.emplace(std::move(read));
        if (options.only_labels.empty())
            return {};
        if (!options.label_names.empty()) {
            PALPATE_TRY(loaded->labels, load_label_table(options.label_names));
        }
        Result<std::vector<uint16_t>> labels = labels_named(options.only_labels, loaded->labels);
        if (!labels)
            return fail("--labels: {}", labels.error().message);
        Result<Volume> kept = with_labels(loaded->volume, *labels);
        if (!kept)
            return fail("{}: {}", options.read.path, kept.error().message);
        loaded->volume = std::move(*kept);
        return {};
    });
    if (done && !options.print.clips.empty())
        done = stages.run("cut", 0.1, [&]() -> Result<void> {
            loaded->volume = cut_for_print(options.print, loaded->volume, options.iso);
            return {};
        });
    if (done)
        done = stages.run("extract", 0.2, [&]() -> Result<void> {
            PALPATE_TRY(mesh, extract(options, loaded->volume, interrupt, extra["extraction"]));
            if (mesh.triangles.empty() && !interrupt.token().stop_requested())
                return options.labels
                           ? fail("{}: expected labels other than 0, found none", options.read.path)
                           : fail("{}: expected values on both sides of {:g}, found none",
                                  options.read.path, *options.iso);
            return {};
        });
    if (done && options.smoothing != Smoothing::none && options.smoothing != Smoothing::bounded)
        done = stages.run("smooth", 0.4, [&]() -> Result<void> {
            extra["smoothing"] = smoothed(options, mesh);
            return {};
        });
    if (done && options.print.chooses_pieces())
        done = stages.run("pieces", 0.48, [&]() -> Result<void> {
            PALPATE_TRY(extra["pieces"], choose_pieces(options.print, mesh));
            return {};
        });
    if (done && options.is_decimated())
        done = stages.run("decimate", 0.5, [&]() -> Result<void> {
            PALPATE_TRY(extra["decimation"],
                        decimated(options, mesh, interrupt.token(),
                                  [&](double share) { stages.show(0.5 + 0.2 * share); }));
            return {};
        });
    if (done && options.print.shapes())
        done = stages.run("shape", 0.7, [&]() -> Result<void> {
            PALPATE_TRY(extra["print"],
                        shape_for_print(options.print, mesh, interrupt.token(),
                                        [&](double share) { stages.show(0.7 + 0.1 * share); }));
            return {};
        });
    if (done && !options.report.empty())
        done = stages.run("check", 0.8, [&]() -> Result<void> {
            report = json_of(topology(mesh));
            if (options.labels) {
                const bool bounded = options.smoothing == Smoothing::bounded;
                const bool exact = options.walls == LabelWalls::shared && !options.is_decimated() &&
                                   (bounded || options.smoothing == Smoothing::none);
                extra["labels"] = label_entries(
                    mesh, loaded->volume,
                    exact ? std::optional(bounded ? options.passes : 0u) : std::nullopt);
                count_faults_by_label(report, extra["labels"]);
            }
            return {};
        });
    if (!done)
        return done;
    done = stages.run("write", 0.9, [&]() -> Result<void> {
        return save_mesh(options.out, mesh, {.ascii = options.ascii, .stop = interrupt.token()});
    });
    report["ms"] = stages.ms();
    report.update(extra);
    if (done)
        done = write_text(options.report, report_text(report));
    if (done) {
        tell_made(options.out, fmt::format("{} triangles, {} vertices", mesh.triangles.size(),
                                           mesh.positions.size()));
        tell_open_edges(options, mesh);
        if (options.print.chooses_pieces() || options.print.shapes())
            log::info("{}: {}", options.out, watertight_text(topology(mesh)));
    }
    return done;
}

} // namespace

Command add_surface(CLI::App& app) {
    auto o = std::make_shared<SurfaceCommand>();
    add_read_flags(app, o->read);
    app.add_option("-o,--output", o->out,
                   "Mesh to write, in world mm (LPS): .ply, .stl, .obj or .vtp")
        ->required();
    CLI::Option_group* what = app.add_option_group("what", "One of these");
    what->add_option("--iso", o->iso,
                     "Iso-value of the surface, in the volume's units, HU for CT (default: none)");
    what->add_flag("--labels", o->label_text,
                   "Surfaces of all labels of a label map (0 is background), or of some, by number "
                   "or name: --labels=5,Liver treats all others as background (default: no)")
        ->check([o](const std::string& text) { return read_labels(text, *o); }, "");
    what->require_option(1);
    app.add_option("--label-names", o->label_names,
                   "With --labels=NAME: a table of labels and their names, of ITK-SNAP, 3D Slicer "
                   "or FreeSurfer (default: the names in the label map's file)")
        ->type_name("FILE");
    app.add_option("--topology", o->topology,
                   "With --iso, topology of ambiguous cells: classic, or correct (that of the "
                   "trilinear interpolant) (default: classic)")
        ->transform(one_of(kTopologies));
    app.add_option("--normals", o->normals,
                   "With --iso: none, gradient (of the values) or triangles (default: gradient)")
        ->transform(one_of(kNormals));
    app.add_flag("--closed", o->closed,
                 "With --iso: close the surface at the volume's border (default: it ends there)");
    app.add_option("--walls", o->walls,
                   "With --labels: shared (one wall between two labels) or separate (each label by "
                   "itself, by surface tracking) (default: shared)")
        ->transform(one_of(kWalls));
    app.add_option("--smooth", o->smoothing,
                   "Smoothing filter: none, mean, taubin, sinc (windowed), or, with shared walls, "
                   "bounded (at most 0.375 samples an axis) (default: none)")
        ->transform(one_of(kSmoothings));
    app.add_option("--passes", o->passes, "Passes of --smooth; the number of terms for sinc")
        ->check(CLI::Range(1u, 10000u))
        ->capture_default_str();
    app.add_option("--decimate", o->decimate_mm,
                   "Fewer triangles, with no point of either surface farther from the other than "
                   "this, in mm (default: all triangles)")
        ->check(positive())
        ->type_name("MM");
    app.add_option("--decimate-to", o->decimate_to,
                   "Fewer triangles: a share such as 50%, or a number, at the smallest distance; "
                   "with --decimate a lower limit (default: all triangles)")
        ->type_name("SHARE%|COUNT")
        ->check([](const std::string& text) {
            return triangle_count(text, 100)
                       ? std::string()
                       : fmt::format(
                             "expected a share such as 50% or a whole number of triangles, "
                             "above 0, found '{}'",
                             text);
        });
    add_print_flags(app, o->print);
    app.add_option(
           "--on", o->on,
           "Where to extract: cpu, gpu, or auto (with --iso the graphics device unless it is "
           "a software driver; with --labels the processor) (default: auto)")
        ->transform(one_of(kExtractOn));
    app.add_option("--device", o->device,
                   "Vulkan device: part of its name, or its number in palpate doctor (default: the "
                   "first discrete, integrated, then CPU device)");
    app.add_flag("--ascii", o->ascii, "PLY and STL as text (default: binary)");
    app.add_option("--report", o->report,
                   "JSON with counts, Euler number, faults, area, volume, and ms by stage; - is "
                   "standard output (default: none)")
        ->type_name("FILE");
    refuse_where_wrong(app, [o] { return check_together(*o); });
    return {[o, &app] { return run_surface(*o, app); },
            [o] {
                std::vector<NamedFile> files;
                append_volume(files, "V", o->read.path);
                files.push_back({"--label-names", o->label_names});
                files.push_back({"-o", o->out, FileUse::write});
                files.push_back({"--report", o->report, FileUse::write_text});
                return files;
            }};
}

} // namespace palpate
