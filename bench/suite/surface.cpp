// Surfaces: what extraction takes, beside how far the mesh is from the surface, and beside VTK and
// scikit-image on the same samples, in turn with them; dabs; and windows for the hand.

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "bench/suite/suites.h"
#include "bench/suite/surface_cases.h"
#include "bench/suite/surface_edits.h"
#include "bench/suite/surface_live.h"
#include "bench/suite/surface_peers.h"
#include "engine/base/log.h"
#include "engine/base/percentile.h"
#include "engine/mesh/distance.h"
#include "engine/mesh/topology.h"
#include "engine/surface/local_surface.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"
#include "engine/surface/tracker.h"
#include "engine/surface_gpu/gpu_surface.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

constexpr uint32_t kErrorSamples = 20'000;

Json time_json(const std::vector<double>& ms) {
    const Spread s = spread(ms);
    return {
        {"median", s.median}, {"p95", s.p95}, {"low", s.low}, {"high", s.high}, {"count", s.count}};
}

// One contender's figures on one case. Order of members as the page shows them.
Json row_json(const SurfaceCase& of, const std::string& who, const std::vector<double>& ms,
              uint64_t triangles, const Mesh& mesh) {
    Json row{{"case", of.sample.name}, {"who", who}, {"ms", time_json(ms)}};
    row["triangles"] = triangles;
    row["mtri_per_s"] = static_cast<double>(triangles) / row["ms"]["median"].number * 1e-3;
    if (of.labels || of.for_time)
        return row;
    const MeshTopology found = topology(mesh);
    row["non_manifold_edges"] = found.non_manifold_edges;
    row["misoriented_edges"] = found.misoriented_edges;
    row["euler_number"] = found.euler_number;
    row["area_mm2"] = found.area_mm2;
    row["volume_mm3"] = found.volume_mm3;
    if (!of.field)
        return row;
    const FieldDistance distance =
        distance_to_field(mesh, *of.field, of.iso, {.samples = kErrorSamples});
    row["vertex_largest_mm"] = distance.vertex_largest_mm;
    row["rms_mm"] = distance.surface.rms_mm;
    row["largest_mm"] = distance.surface.largest_mm;
    row["normal_rms_deg"] = distance.surface.normal_rms_deg;
    if (!mesh.normals.empty())
        row["vertex_normal_max_deg"] = distance.vertex_normal_max_deg;
    row["lost"] = distance.lost;
    return row;
}

// Who extracts. run() gives ms, or nothing where a peer fell silent; triangles() and mesh() tell of
// what the last run made, outside the time, and mesh() takes it away. more() is added to the row.
struct Contender {
    std::string who;
    std::function<std::optional<double>()> run;
    std::function<uint64_t()> triangles;
    std::function<Mesh()> mesh;
    std::function<Json()> more = [] { return Json::object(); };
};

Contender on_cpu(std::string who, std::function<Mesh()> extract) {
    auto mesh = std::make_shared<Mesh>();
    return {std::move(who),
            [=]() -> std::optional<double> {
                *mesh = {}; // freed outside the time, as it is for who keeps it
                const Timer timer;
                *mesh = extract();
                return timer.ms();
            },
            [=] { return mesh->triangles.size(); }, [=] { return std::exchange(*mesh, {}); }};
}

std::vector<Contender> ours(const SurfaceCase& of) {
    const Volume& volume = of.sample.volume;
    if (of.labels)
        return {
            on_cpu("surface_nets", [&] { return surface_nets(volume); }),
            on_cpu("surface_nets_smoothed", [&] { return surface_nets(volume, {.passes = 10}); })};
    const auto iso = static_cast<float>(of.iso);
    const auto cubes = [&](const char* who, SurfaceTopology topology, SurfaceNormals normals) {
        return on_cpu(who, [&volume, iso, topology, normals] {
            return marching_cubes(volume, iso, {.topology = topology, .normals = normals});
        });
    };
    return {cubes("classic", SurfaceTopology::classic, SurfaceNormals::gradient),
            cubes("classic_plain", SurfaceTopology::classic, SurfaceNormals::none),
            cubes("correct", SurfaceTopology::correct, SurfaceNormals::gradient)};
}

// On the graphics device, from samples that lie there. `more` is what else that takes: the first
// surface with the upload, each pass, and reading it back as one mesh.
Contender on_gpu(const SurfaceCase& of, ExtractPipelines& pipelines) {
    const auto iso = static_cast<float>(of.iso);
    struct State {
        std::optional<GpuSurface> surface;
        double first_ms = 0.0, read_back_ms = 0.0;
        std::map<std::string, std::vector<double>> pass_ms;
    };
    auto state = std::make_shared<State>();
    const Timer timer;
    state->surface.emplace(pipelines, of.sample.volume, iso);
    state->first_ms = timer.ms();
    return {"classic_gpu",
            [=]() -> std::optional<double> {
                const Timer one;
                state->surface->set_iso(iso);
                const double ms = one.ms();
                for (const PassTime& pass : state->surface->pass_times())
                    state->pass_ms[pass.name].push_back(pass.gpu_ms);
                return ms;
            },
            [=] { return state->surface->triangles(); },
            [=] {
                const Timer reading;
                Mesh mesh = state->surface->mesh();
                state->read_back_ms = reading.ms();
                return mesh;
            },
            [=] {
                Json passes = Json::object();
                for (const auto& [name, ms] : state->pass_ms)
                    passes[name] = spread(ms).median;
                Json more{{"first_with_upload_ms", state->first_ms}, {"passes_ms", passes}};
                if (state->read_back_ms > 0.0)
                    more["read_back_ms"] = state->read_back_ms;
                return more;
            }};
}

// The paper's extractor on the segmented volume: detection and triangles.
Contender tracker(const Volume& mask) {
    return on_cpu("tracker", [&mask] {
        SurfaceTracker made(mask, 1);
        made.find_all();
        return made.triangulate();
    });
}

std::vector<Contender> those_of(SurfacePeers& peers, const SurfaceCase& of) {
    std::vector<Contender> found;
    const std::vector<double> labels =
        of.labels ? labels_in(of.sample.volume) : std::vector<double>();
    for (const std::string& who : peers.open(of.sample, of.iso, labels, of.for_time)) {
        found.push_back({who, [&peers, who] { return peers.run(who); },
                         [&peers, who] {
                             const auto made = peers.made(who, false);
                             return made ? made->triangles : 0;
                         },
                         [&peers, who] {
                             auto made = peers.made(who, true);
                             return made ? std::move(made->mesh) : Mesh();
                         },
                         [] {
                             return Json{{"peer", true}};
                         }});
    }
    return found;
}

// Rounds go through all contenders in turn, so that a machine that grows slower does so for all.
// Who has taken `budget_s` seconds is left out after two runs; a first one is not counted.
Result<void> measure(const SurfaceCase& of, const std::vector<Contender>& contenders, int rounds,
                     double budget_s, const Options& options, Json& rows) {
    std::vector<std::vector<double>> ms(contenders.size());
    std::vector<double> spent_s(contenders.size(), 0.0);
    for (int round = 0; round <= rounds; ++round)
        for (size_t i = 0; i < contenders.size(); ++i) {
            if (options.stop.stop_requested())
                return fail("interrupted");
            if (spent_s[i] > budget_s && ms[i].size() >= 2)
                continue;
            const std::optional<double> took = contenders[i].run();
            spent_s[i] += took.value_or(0.0) / 1e3;
            if (took && round > 0)
                ms[i].push_back(*took);
        }
    for (size_t i = 0; i < contenders.size(); ++i) {
        if (ms[i].empty())
            continue;
        const uint64_t triangles = contenders[i].triangles();
        const Mesh mesh = of.labels || of.for_time ? Mesh() : contenders[i].mesh();
        Json row = row_json(of, contenders[i].who, ms[i], triangles, mesh);
        row.update(contenders[i].more());
        rows.push_back(std::move(row));
    }
    return {};
}

const Json* row_of(const Json& rows, const std::string& name, const std::string& who) {
    for (const Json& row : rows)
        if (row["case"] == name && row["who"] == who)
            return &row;
    return nullptr;
}

// How errors on the sphere fall from one size to the next finer: 2 is what linear interpolation
// has.
Json orders_of(const Json& rows) {
    Json orders = Json::array();
    std::set<std::string> who;
    for (const Json& row : rows)
        who.insert(row["who"].string);
    constexpr double kRadius = 35.0, kPi = 3.14159265358979323846;
    for (const std::string& one : who) {
        std::vector<double> step, rms, area, volume;
        for (const Json& row : rows)
            if (row["who"] == one && row["case"].string.starts_with("sphere_")) {
                step.push_back(100.0 / (std::stod(row["case"].string.substr(7)) - 1));
                rms.push_back(row["rms_mm"].number);
                area.push_back(
                    std::abs(row["area_mm2"].number / (4 * kPi * kRadius * kRadius) - 1));
                // Peers may turn their triangles the other way.
                volume.push_back(std::abs(std::abs(row["volume_mm3"].number) /
                                              (4 * kPi / 3 * kRadius * kRadius * kRadius) -
                                          1));
            }
        const auto is_positive = [](const std::vector<double>& v) {
            return v.size() >= 2 && *std::min_element(v.begin(), v.end()) > 0.0;
        };
        if (is_positive(rms) && is_positive(area) && is_positive(volume))
            orders.push_back({{"who", one},
                              {"rms", fit_power(step, rms).order},
                              {"area", fit_power(step, area).order},
                              {"volume", fit_power(step, volume).order}});
    }
    return orders;
}

// A hand's window, at points of a phantom's skull and skin, where there is most to extract.
Json measure_window(const Options& options) {
    constexpr uint32_t kWindow = 7;
    constexpr float kIso = 300.0f;
    const double side = options.tiny ? 48.0 : 192.0;
    const Volume volume = synthetic::sample_ct_phantom(
        make_grid(glm::uvec3(static_cast<uint32_t>(side)), glm::dvec3(192.0 / side),
                  glm::dvec3(-96.0 + 96.0 / side)));
    LocalSurface local(kWindow);
    const Mesh mesh = marching_cubes(volume, kIso);
    std::mt19937 random(1);
    std::vector<double> us;
    size_t triangles = 0;
    const int count = options.tiny ? 100 : 20'000;
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 at = glm::dvec3(mesh.positions[random() % mesh.positions.size()]) /
                              spacing_mm(volume.grid());
        const Timer timer;
        const LocalSurface::Patch patch = local.extract(volume, at, kIso);
        us.push_back(timer.ms() * 1e3);
        triangles += patch.triangles.size();
    }
    return {{"samples", kWindow},
            {"count", count},
            {"p50_us", percentile(us, 0.5)},
            {"p99_us", percentile(us, 0.99)},
            {"worst_us", percentile(us, 1.0)},
            {"triangles_mean", static_cast<double>(triangles) / count}};
}

void add_aims(const Json& rows, Json& aims) {
    const auto add = [&](const std::string& name, const char* mine, const char* theirs,
                         double least, const char* aim) {
        const Json *a = row_of(rows, name, mine), *b = row_of(rows, name, theirs);
        if (!a || !b)
            return;
        const double ratio = (*b)["ms"]["median"].number / (*a)["ms"]["median"].number;
        add_aim(aims, fmt::format("{}: {} beside {}", name, mine, theirs), aim, ratio,
                ratio >= least);
    };
    for (const char* name : {"head_ct", "head_ct_174", "gyroid_512"})
        add(name, "classic", "vtkFlyingEdges3D", 1.0, "as fast, normals included");
    add("labels", "surface_nets", "vtkDiscreteFlyingEdges3D", 5.0, "5 times as fast");
}

// One volume: all who extract its surface.
Result<void> measure_case(const SurfaceCase& of, ExtractPipelines& pipelines, SurfacePeers& peers,
                          const Options& options, Json& rows) {
    std::vector<Contender> contenders = ours(of);
    if (!of.labels && GpuSurface::supports(pipelines.device(), of.sample.volume, {}))
        contenders.push_back(on_gpu(of, pipelines));
    std::optional<Volume> mask;
    if (!of.labels && !of.for_time) {
        const Volume& volume = of.sample.volume;
        mask = make_volume(volume.grid(), ScalarType::u8, [&](glm::uvec3 i) {
            return double(volume.value(i)) >= of.iso ? 1.0 : 0.0;
        });
        contenders.push_back(tracker(*mask));
    }
    for (Contender& one : those_of(peers, of))
        contenders.push_back(std::move(one));
    const int rounds = options.tiny ? 2 : options.full ? 15 : 7;
    return measure(of, contenders, rounds, options.full ? 120.0 : 8.0, options, rows);
}

} // namespace

Result<Report> run_surface(Bench& bench) {
    const Options& options = bench.options();
    PALPATE_TRY(const std::vector<NamedCase> cases, surface_cases(options));
    Report report;
    report.json["notes"] = Json::array();
    report.json["aims"] = Json::array();
    Json rows = Json::array();
    ExtractPipelines pipelines(bench.device());
    SurfacePeers peers(options);
    for (const NamedCase& one : cases) {
        log::info("{}", one.name);
        const Result<SurfaceCase> made = one.make();
        if (!made) {
            report.json["notes"].push_back(
                fmt::format("without {}: {}", one.name, made.error().message));
            continue;
        }
        PALPATE_TRY(measure_case(*made, pipelines, peers, options, rows));
    }
    for (const Json& row : rows)
        if (row.contains("euler_number") && !row.contains("peer") && // whose faults are not ours
            (row["non_manifold_edges"] != 0 || row["misoriented_edges"] != 0))
            report.failures.push_back(fmt::format("{}: {} has non-manifold or misoriented edges",
                                                  row["case"].string, row["who"].string));
    add_aims(rows, report.json["aims"]);
    report.json["orders"] = orders_of(rows);
    report.json["surfaces"] = std::move(rows);
    if (is_asked(options, kEditsPart)) {
        PALPATE_TRY(Json edits, measure_edits(pipelines, peers, options, report.failures));
        add_edit_aims(edits, bench.device().info().is_cpu(), report.json["aims"]);
        report.json["edits"] = std::move(edits);
    }
    if (is_asked(options, kLivePart)) {
        PALPATE_TRY(report.json["live"], measure_live(bench, report.failures));
    }
    if (is_asked(options, kWindowPart)) {
        const Json window = measure_window(options);
        const double p99 = window["p99_us"].number;
        add_aim(report.json["aims"], "a window of 7^3 samples, 99th percentile, us", "below 20",
                p99, p99 < 20.0);
        report.json["window"] = window;
    }
    report.json["peers"] = peers.versions();
    if (!peers.absent_because().empty())
        report.json["peers"]["absent_because"] = peers.absent_because();
    return report;
}

} // namespace palpate::bench
