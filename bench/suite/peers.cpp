#include "bench/suite/peers.h"

#include <array>
#include <fstream>

#include "bench/suite/spawn.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/profile.h"
#include "engine/volume/extent.h"

namespace palpate::bench {

int run_program(std::vector<std::string> command, const fs::path& output) {
    const Result<int> child =
        spawn(std::move(command), std::array{Redirection{.descriptor = 1, .file = output},
                                             Redirection{.descriptor = 2, .from = 1}});
    return child ? wait_for(*child) : 127;
}

std::string last_line(const fs::path& file) {
    std::ifstream in(file);
    std::string last;
    for (std::string line; std::getline(in, line);)
        if (!line.empty())
            last = line;
    return last;
}

Result<Json> save_raw(const Sample& sample, const fs::path& path) {
    const Volume& volume = sample.volume;
    const bool floats = volume.type() == ScalarType::f32;
    PALPATE_TRY(floats ? save_samples<float>(volume, path) : save_samples<int16_t>(volume, path));
    const glm::uvec3 size = volume.size();
    return Json{{"file", fs::absolute(path).string()},
                {"dtype", floats ? "<f4" : "<i2"},
                {"dims", {size.x, size.y, size.z}},
                {"spacing", spacing_mm(volume.grid())}};
}

namespace {

// Why VTK cannot be asked on this machine; empty where it can.
std::string missing(const fs::path& out) {
    const fs::path script = fs::path(PALPATE_BENCH_SCRIPTS) / "peers_points.py";
    if (!fs::exists(script))
        return fmt::format("VTK was not asked: its script {} is not there", script.string());
    const fs::path said = out / "probe.txt";
    if (run_program({"xvfb-run", "--help"}, said) != 0)
        return "VTK was not asked: xvfb-run is not installed (scripts/bootstrap --peers)";
    if (run_program({kPython, "-c", "import vtk, numpy"}, said) != 0)
        return "VTK was not asked: python3-vtk9 is not installed (scripts/bootstrap --peers)";
    return {};
}

bool scored(const Subject& subject) {
    return !subject.layer.shading.has_value();
}

Json case_json(const Subject& subject, const std::vector<double>& steps) {
    const RayCastLayer& layer = subject.layer;
    Json v{{"name", subject.name},
           {"volume", subject.sample->name},
           {"mode", subject.peers},
           {"eye", subject.camera.eye_mm},
           {"target", subject.camera.target_mm},
           {"up", subject.camera.up},
           {"view_angle_deg", subject.camera.view_angle_deg},
           {"scored", scored(subject)},
           {"opacity_unit_mm", layer.transfer.opacity_unit_mm}};
    const ValueRange range = subject.sample->volume.range();
    v["range"] = {range.min, range.max};
    v["opacity"] = Json::array();
    v["color"] = Json::array();
    for (const auto& point : layer.transfer.opacities)
        v["opacity"].push_back({point.value, point.opacity});
    for (const auto& point : layer.transfer.colors)
        v["color"].push_back({point.value, point.color.x, point.color.y, point.color.z});
    if (!layer.isos.empty())
        v["iso"] = layer.isos[0].value;
    v["steps_mm"] = Json::array();
    for (const double step : steps)
        v["steps_mm"].push_back(step * smallest_spacing_mm(subject.sample->volume.grid()));
    return v;
}

Result<Image> read_picture(const fs::path& path, const Subject& subject, const std::string& mapper,
                           Sampling sampling) {
    std::vector<std::string> channels{"value"};
    if (subject.metric == Metric::color)
        channels = {"R", "G", "B"};
    if (subject.metric == Metric::surface)
        channels = {mapper == "gpu" ? "depth" : "hit"};
    Image image = make_image(glm::uvec2(sampling.size_px), channels);
    std::ifstream in(path, std::ios::binary);
    const auto bytes = static_cast<std::streamsize>(image.samples.size() * sizeof(float));
    in.read(reinterpret_cast<char*>(image.samples.data()), bytes);
    if (!in || in.gcount() != bytes || in.peek() != EOF)
        return fail("{}: expected {} bytes", path.string(), bytes);
    return sampling.of(image);
}

} // namespace

std::string run_vtk_script(Bench& bench, const std::string& script,
                           std::vector<std::string> arguments) {
    const fs::path out = bench.options().out / "peers";
    if (std::string problem = missing(out); !problem.empty())
        return problem;
    std::vector<std::string> command{"xvfb-run", "-a",
                                     "-s",       "-screen 0 1280x1280x24 -noreset",
                                     kPython,    std::string(PALPATE_BENCH_SCRIPTS) + "/" + script};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const fs::path said = out / (script + ".txt");
    const int code = run_program(std::move(command), said);
    return code == 0 ? "" : fmt::format("VTK failed with code {}: {}", code, last_line(said));
}

std::string PeerPoint::name() const {
    return fmt::format("VTK {} mapper, step {:g}", mapper == "gpu" ? "GPU" : "fixed-point",
                       step_samples);
}

Result<Peers> Peers::start(Bench& bench, const std::vector<Subject>& subjects,
                           const std::vector<double>& steps, Sampling sampling) {
    const profile::Scope scope("peers");
    Peers peers(bench, steps, sampling);
    const fs::path out = bench.options().out / "peers";
    std::error_code ignored;
    fs::create_directories(out, ignored);
    if (!bench.options().peers) {
        peers.absent_because_ = "VTK was not asked (--no-peers)";
        return peers;
    }
    if (peers.absent_because_ = missing(out); !peers.absent_because_.empty())
        return peers;
    Json job{{"size_px", sampling.size_px}, {"out", fs::absolute(out).string()}};
    job["volumes"] = Json::object();
    job["cases"] = Json::array();
    for (const Subject& subject : subjects) {
        if (subject.peers.empty())
            continue;
        Json& volume = job["volumes"][subject.sample->name];
        if (volume.is_null()) {
            PALPATE_TRY(volume, save_raw(*subject.sample, out / (subject.sample->name + ".raw")));
        }
        job["cases"].push_back(case_json(subject, steps));
        peers.names_.push_back(subject.name);
    }
    ::setenv("MESA_SHADER_CACHE_DISABLE", "true", 1); // first frames compile
    for (const std::string mapper : {"gpu", "fixed"}) {
        job["mapper"] = mapper;
        const fs::path work = out / ("job_" + mapper + ".json");
        const std::string text = json_text(job);
        PALPATE_TRY(save_bytes(work, std::as_bytes(std::span(text))));
        PALPATE_TRY(Conversation vtk,
                    Conversation::start(
                        {"xvfb-run", "-a", "-s", "-screen 0 1280x1280x24 -noreset", kPython,
                         std::string(PALPATE_BENCH_SCRIPTS) + "/peers_points.py", work.string()},
                        out / ("said_" + mapper + ".txt")));
        peers.mappers_.push_back({mapper, std::move(vtk)});
    }
    return peers;
}

void Peers::give_up(const Mapper& mapper, const Error& error) {
    absent_because_ = fmt::format("VTK's {} mapper failed: {}",
                                  mapper.name == "gpu" ? "GPU" : "fixed-point", error.message);
    std::erase_if(points_, [](const PeerPoint& point) { return point.wall_ms.empty(); });
    mappers_.clear();
    open_ = false;
}

Result<void> Peers::score(PeerPoint& point, const std::string& file, const Subject& subject) {
    PALPATE_TRY(Image picture, read_picture(file, subject, point.mapper, sampling_));
    PALPATE_TRY(const Image truth, bench_->truth(subject, sampling_));
    point.errors = errors_of(picture, truth, subject.metric,
                             smallest_spacing_mm(subject.sample->volume.grid()));
    point.picture = std::move(picture);
    return {};
}

Result<void> Peers::open(const Subject& subject) {
    const profile::Scope scope("peers");
    const auto asked = std::find(names_.begin(), names_.end(), subject.name);
    open_ = asked != names_.end() && !mappers_.empty();
    if (!open_)
        return {};
    for (Mapper& mapper : mappers_) {
        const Result<Json> answer = mapper.vtk.ask({{"open", asked - names_.begin()}});
        if (!answer) {
            give_up(mapper, answer.error());
            return {};
        }
        version_ = (*answer)["vtk"].string;
        mapper.first_point = points_.size();
        for (size_t step = 0; step < steps_.size(); ++step) {
            PeerPoint& point = points_.emplace_back(
                PeerPoint{.subject = subject.name,
                          .mapper = mapper.name,
                          .step_samples = steps_[step],
                          .first_frame_ms = (*answer)["first_frame_ms"].number});
            const std::vector<Json>& pictures = (*answer)["pictures"].items;
            if (pictures.empty())
                continue;
            PALPATE_TRY(score(point, pictures.at(step).string, subject));
        }
    }
    return {};
}

void Peers::time_frames(int frames, double budget_s) {
    const profile::Scope scope("peers");
    if (!open_)
        return;
    for (Mapper& mapper : mappers_) {
        const Result<Json> answer = mapper.vtk.ask({{"frames", frames}, {"budget_s", budget_s}});
        if (!answer)
            return give_up(mapper, answer.error());
        for (size_t step = 0; step < steps_.size(); ++step) {
            PeerPoint& point = points_[mapper.first_point + step];
            const Json& took = answer->items.at(step);
            for (const double ms : took["wall_ms"].numbers())
                point.wall_ms.push_back(ms);
            for (const double ms : took["cpu_ms"].numbers())
                point.cpu_ms.push_back(ms);
        }
    }
}

} // namespace palpate::bench
