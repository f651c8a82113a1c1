// Surfaces: what extraction takes, beside how far the mesh is from the surface, and beside VTK and
// scikit-image on the same samples in the same run.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <thread>

#include "bench/suite/peers.h"
#include "bench/suite/suites.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/io/volume_io.h"
#include "engine/mesh/distance.h"
#include "engine/mesh/topology.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"
#include "engine/surface/tracker.h"
#include "engine/surface_gpu/gpu_surface.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {

namespace {

constexpr const char* kAtlas = "/usr/share/mricron/templates/aal.nii.gz"; // 116 regions
constexpr uint32_t kErrorSamples = 20'000;

// A volume and the surface to take from it: of a value, or of all its labels.
struct SurfaceCase {
    Sample sample;
    double iso = 0.0;
    bool labels = false;
    std::optional<synthetic::Field> field; // the truth, where it is known
};

// `side` samples an axis over 100 mm.
Sample sampled(const synthetic::Field& field, uint32_t side, const std::string& name) {
    const Grid grid = make_grid(glm::uvec3(side), glm::dvec3(100.0 / (side - 1.0)));
    return {fmt::format("{}_{}", name, side), fmt::format("{}, {}^3", name, side),
            synthetic::sample(field, grid, ScalarType::f32)};
}

Result<std::vector<SurfaceCase>> make_cases(const Options& options, Value& notes) {
    std::vector<SurfaceCase> cases;
    const synthetic::Field sphere = synthetic::sphere_distance(glm::dvec3(50.0), 35.0);
    const synthetic::Field gyroid = synthetic::gyroid(25.0);
    std::vector<uint32_t> sides{32, 64, 128};
    if (options.tiny)
        sides = {16, 32};
    if (options.full)
        sides.push_back(256);
    for (const uint32_t side : sides) {
        cases.push_back({sampled(sphere, side, "sphere"), 0.0, false, sphere});
        cases.push_back({sampled(gyroid, side, "gyroid"), 0.0, false, gyroid});
    }
    if (options.full)
        cases.push_back({sampled(gyroid, 512, "gyroid"), 0.0, false, gyroid});
    if (options.tiny)
        return cases;
    Result<Sample> ct = head_ct(options.head_ct);
    if (!ct)
        notes.push_back(fmt::format("without the head CT: {}", ct.error().message));
    else {
        cases.push_back({resampled(*ct, {512, 512, 174}, "head_ct_174"), 300.0, false, {}});
        cases.push_back({std::move(*ct), 300.0, false, {}});
    }
    Result<LoadedVolume> atlas = load_labels(kAtlas);
    if (!atlas) {
        notes.push_back(fmt::format("without the atlas: {}", atlas.error().message));
    } else {
        const Volume& volume = atlas->volume;
        cases.push_back({{"atlas", "AAL atlas, 116 regions",
                          with_grid(volume, make_grid(volume.size(), spacing_mm(volume.grid())))},
                         0.0,
                         true,
                         {}});
    }
    return cases;
}

Value time_json(const std::vector<double>& ms) {
    const Spread s = spread(ms);
    return {
        {"median", s.median}, {"p95", s.p95}, {"low", s.low}, {"high", s.high}, {"count", s.count}};
}

// One contender's figures on one case. Order of members as the page shows them.
Value row_json(const SurfaceCase& of, const std::string& who, const std::vector<double>& ms,
               const Mesh& mesh) {
    Value row{{"case", of.sample.name}, {"who", who}, {"ms", time_json(ms)}};
    const auto triangles = static_cast<double>(mesh.triangles.size());
    row["triangles"] = mesh.triangles.size();
    row["mtri_per_s"] = triangles / row["ms"]["median"].get<double>() * 1e-3;
    if (of.labels)
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

struct Contender {
    std::string who;
    std::function<Mesh()> extract;
    std::function<Mesh()> mesh = {}; // fetches, outside the time, what extract() leaves elsewhere
};

std::vector<Contender> ours(const SurfaceCase& of) {
    const Volume& volume = of.sample.volume;
    if (of.labels)
        return {{"surface_nets", [&] { return surface_nets(volume); }},
                {"surface_nets_smoothed", [&] { return surface_nets(volume, {.passes = 10}); }}};
    const auto iso = static_cast<float>(of.iso);
    const auto cubes = [&volume, iso](SurfaceTopology topology, SurfaceNormals normals) {
        return [&volume, iso, topology, normals] {
            return marching_cubes(volume, iso, {.topology = topology, .normals = normals});
        };
    };
    return {{"classic", cubes(SurfaceTopology::classic, SurfaceNormals::gradient)},
            {"classic_plain", cubes(SurfaceTopology::classic, SurfaceNormals::none)},
            {"correct", cubes(SurfaceTopology::correct, SurfaceNormals::gradient)}};
}

// On the graphics device, from samples that lie there.
Contender on_gpu(const SurfaceCase& of, ExtractPipelines& pipelines) {
    const auto iso = static_cast<float>(of.iso);
    auto surface = std::make_shared<GpuSurface>(pipelines, of.sample.volume, iso);
    return {"classic_gpu",
            [=] {
                surface->set_iso(iso);
                return Mesh();
            },
            [=] { return surface->mesh(); }};
}

// The paper's extractor on the segmented volume: detection and triangles.
Contender tracker(const Volume& mask) {
    return {"tracker", [&mask] {
                SurfaceTracker made(mask, 1);
                made.find_all();
                return made.triangulate();
            }};
}

// Rounds go through all contenders in turn, so that a machine that grows slower does so for all.
Result<void> measure(const SurfaceCase& of, const std::vector<Contender>& contenders, int rounds,
                     const Options& options, Value& rows) {
    std::vector<std::vector<double>> ms(contenders.size());
    std::vector<Mesh> meshes(contenders.size());
    for (int round = 0; round <= rounds; ++round)
        for (size_t i = 0; i < contenders.size(); ++i) {
            if (options.stop.stop_requested())
                return fail("interrupted");
            meshes[i] = {}; // freed outside the time, as it is for who keeps it
            const Timer timer;
            meshes[i] = contenders[i].extract();
            if (round > 0)
                ms[i].push_back(timer.ms());
            if (round == rounds && contenders[i].mesh)
                meshes[i] = contenders[i].mesh();
        }
    for (size_t i = 0; i < contenders.size(); ++i)
        rows.push_back(row_json(of, contenders[i].who, ms[i], meshes[i]));
    return {};
}

std::vector<double> labels_in(const Volume& volume) {
    std::set<float> found;
    std::vector<float> row(volume.size().x);
    for (uint32_t z = 0; z < volume.size().z; ++z)
        for (uint32_t y = 0; y < volume.size().y; ++y) {
            read_row(volume, {0, y, z}, volume.size().x, row.data());
            found.insert(row.begin(), row.end());
        }
    found.erase(0.0f);
    return {found.begin(), found.end()};
}

template <class T>
std::vector<T> read_array(const fs::path& path) {
    std::ifstream in(path, std::ios::binary | std::ios::ate);
    std::vector<T> values(static_cast<size_t>(std::max<std::streamoff>(0, in.tellg())) / sizeof(T));
    in.seekg(0);
    in.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(T)));
    return in ? values : std::vector<T>{};
}

Mesh peer_mesh(const std::string& stem) {
    const std::vector<float> points = read_array<float>(stem + ".points");
    const std::vector<int32_t> corners = read_array<int32_t>(stem + ".triangles");
    Mesh mesh;
    for (size_t i = 0; i + 2 < points.size(); i += 3)
        mesh.positions.emplace_back(points[i], points[i + 1], points[i + 2]);
    for (size_t i = 0; i + 2 < corners.size(); i += 3)
        mesh.triangles.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
    return mesh;
}

// Adds rows; empty where peers answered, else why they did not.
Result<std::string> measure_peer_surfaces(const std::vector<SurfaceCase>& cases, int rounds,
                                          const Options& options, Value& rows, Value& versions) {
    if (!options.peers)
        return std::string("VTK was not asked (--no-peers)");
    const fs::path out = options.out / "peers";
    std::error_code ignored;
    fs::create_directories(out, ignored);
    const fs::path script = fs::path(PALPATE_BENCH_SCRIPTS) / "peers_surface.py";
    const fs::path said = out / "said_surface.txt";
    if (!fs::exists(script))
        return fmt::format("VTK was not asked: its script {} is not there", script.string());
    if (run_program({kPython, "-c", "import vtk, numpy"}, said) != 0)
        return std::string(
            "VTK was not asked: python3-vtk9 is not installed (scripts/bootstrap --peers)");
    Value job{{"out", fs::absolute(out).string()},
              {"threads", std::thread::hardware_concurrency()},
              {"rounds", rounds},
              {"budget_s", options.full ? 120 : 15}};
    job["cases"] = Value::array();
    for (const SurfaceCase& one : cases) {
        Result<Value> saved = save_raw(one.sample, out / (one.sample.name + ".raw"));
        if (!saved)
            return pass_on(saved);
        Value entry = *saved;
        entry["name"] = one.sample.name;
        if (one.labels)
            entry["labels"] = labels_in(one.sample.volume);
        else
            entry["iso"] = one.iso;
        entry["keep"] = !one.labels;
        job["cases"].push_back(std::move(entry));
    }
    const std::string text = job.dump(1) + "\n";
    const fs::path work = out / "job_surface.json";
    if (Result<void> saved = save_bytes(work, std::as_bytes(std::span(text))); !saved)
        return pass_on(saved);
    log::info("VTK and scikit-image");
    const int code = run_program({kPython, script.string(), work.string()}, said);
    if (code != 0)
        return fmt::format("VTK failed with code {}: {}", code, last_line(said));
    std::ifstream file(out / "results_surface.json");
    const Value results = Value::parse(file);
    versions = {{"vtk", results["vtk"]}, {"skimage", results["skimage"]}};
    for (const Value& row : results["rows"]) {
        const auto of = std::find_if(cases.begin(), cases.end(), [&](const SurfaceCase& c) {
            return c.sample.name == row["case"];
        });
        if (of == cases.end())
            continue;
        Mesh mesh;
        if (row.contains("mesh"))
            mesh = peer_mesh(row["mesh"]);
        Value made = row_json(*of, row["who"], row["wall_ms"].get<std::vector<double>>(), mesh);
        made["triangles"] = row["triangles"];
        made["mtri_per_s"] =
            row["triangles"].get<double>() / made["ms"]["median"].get<double>() * 1e-3;
        rows.push_back(std::move(made));
    }
    return std::string();
}

const Value* row_of(const Value& rows, const std::string& name, const std::string& who) {
    for (const Value& row : rows)
        if (row["case"] == name && row["who"] == who)
            return &row;
    return nullptr;
}

// How errors on the sphere fall from one size to the next finer: 2 is what linear interpolation
// has.
Value orders_of(const Value& rows) {
    Value orders = Value::array();
    std::set<std::string> who;
    for (const Value& row : rows)
        who.insert(row["who"]);
    constexpr double kRadius = 35.0, kPi = 3.14159265358979323846;
    for (const std::string& one : who) {
        std::vector<double> step, rms, area, volume;
        for (const Value& row : rows)
            if (row["who"] == one && row["case"].get<std::string>().starts_with("sphere_")) {
                step.push_back(100.0 / (std::stod(row["case"].get<std::string>().substr(7)) - 1));
                rms.push_back(row["rms_mm"]);
                area.push_back(
                    std::abs(row["area_mm2"].get<double>() / (4 * kPi * kRadius * kRadius) - 1));
                // Peers may turn their triangles the other way.
                volume.push_back(std::abs(std::abs(row["volume_mm3"].get<double>()) /
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

void add_aims(const Value& rows, Report& report) {
    report.json["aims"] = Value::array();
    const auto add = [&](const std::string& name, const char* mine, const char* theirs,
                         double least, const char* aim) {
        const Value *a = row_of(rows, name, mine), *b = row_of(rows, name, theirs);
        if (!a || !b)
            return;
        const double ratio =
            (*b)["ms"]["median"].get<double>() / (*a)["ms"]["median"].get<double>();
        report.json["aims"].push_back(
            {{"what", fmt::format("{}: {} beside {}", name, mine, theirs)},
             {"aim", aim},
             {"figure", ratio},
             {"reached", ratio >= least}});
    };
    for (const char* name : {"head_ct", "head_ct_174", "gyroid_512"})
        add(name, "classic", "vtkFlyingEdges3D", 1.0, "as fast, normals included");
    add("atlas", "surface_nets", "vtkDiscreteFlyingEdges3D", 5.0, "5 times as fast");
}

} // namespace

Result<Report> run_surface(Bench& bench) {
    const Options& options = bench.options();
    const int rounds = options.tiny ? 2 : options.full ? 15 : 7;
    Report report;
    report.json["notes"] = Value::array();
    Result<std::vector<SurfaceCase>> cases = make_cases(options, report.json["notes"]);
    if (!cases)
        return pass_on(cases);
    Value rows = Value::array();
    ExtractPipelines pipelines(bench.device());
    for (const SurfaceCase& one : *cases) {
        log::info("{}", one.sample.title);
        std::vector<Contender> contenders = ours(one);
        if (!one.labels && GpuSurface::supports(bench.device(), one.sample.volume, {}))
            contenders.push_back(on_gpu(one, pipelines));
        std::optional<Volume> mask;
        if (!one.labels && one.sample.name != "gyroid_512") {
            const Volume& volume = one.sample.volume;
            mask = make_volume(volume.grid(), ScalarType::u8, [&](glm::uvec3 i) {
                return double(volume.value(i)) >= one.iso ? 1.0 : 0.0;
            });
            contenders.push_back(tracker(*mask));
        }
        if (Result<void> measured = measure(one, contenders, rounds, options, rows); !measured)
            return pass_on(measured);
    }
    for (const Value& row : rows)
        if (!row.contains("euler_number"))
            continue;
        else if (row["non_manifold_edges"] != 0 || row["misoriented_edges"] != 0)
            report.failures.push_back(fmt::format("{}: {} has non-manifold or misoriented edges",
                                                  row["case"].get<std::string>(),
                                                  row["who"].get<std::string>()));
    Value versions;
    Result<std::string> absent = measure_peer_surfaces(*cases, rounds, options, rows, versions);
    if (!absent)
        return pass_on(absent);
    report.json["peers"] = versions.is_null() ? Value::object() : versions;
    if (!absent->empty())
        report.json["peers"]["absent_because"] = *absent;
    std::stable_sort(rows.begin(), rows.end(),
                     [](const Value& a, const Value& b) { return a["case"] < b["case"]; });
    add_aims(rows, report);
    report.json["orders"] = orders_of(rows);
    report.json["surfaces"] = std::move(rows);
    return report;
}

} // namespace palpate::bench
