#include "bench/suite/surface_peers.h"

#include <algorithm>
#include <fstream>
#include <thread>

#include "bench/suite/peers.h"

namespace palpate::bench {

namespace {

template <class T>
std::vector<T> read_array(const fs::path& path) {
    std::ifstream in(path, std::ios::binary | std::ios::ate);
    std::vector<T> values(static_cast<size_t>(std::max<std::streamoff>(0, in.tellg())) / sizeof(T));
    in.seekg(0);
    in.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(T)));
    return in ? values : std::vector<T>{};
}

Mesh read_mesh(const std::string& stem) {
    const std::vector<float> points = read_array<float>(stem + ".points");
    const std::vector<int32_t> corners = read_array<int32_t>(stem + ".triangles");
    Mesh mesh;
    for (size_t i = 0; i + 2 < points.size(); i += 3)
        mesh.positions.emplace_back(points[i], points[i + 1], points[i + 2]);
    for (size_t i = 0; i + 2 < corners.size(); i += 3)
        mesh.triangles.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
    return mesh;
}

} // namespace

SurfacePeers::SurfacePeers(const Options& options) : out_(options.out / "peers") {
    const fs::path script = fs::path(PALPATE_BENCH_SCRIPTS) / "peers_surface.py";
    std::error_code ignored;
    fs::create_directories(out_, ignored);
    if (!options.peers)
        absent_because_ = "VTK was not asked (--no-peers)";
    else if (!fs::exists(script))
        absent_because_ =
            fmt::format("VTK was not asked: its script {} is not there", script.string());
    else if (run_program({kPython, "-c", "import vtk, numpy"}, out_ / "probe.txt") != 0)
        absent_because_ =
            "VTK was not asked: python3-vtk9 is not installed (scripts/bootstrap --peers)";
    if (!absent_because_.empty())
        return;
    Result<Conversation> vtk = Conversation::start(
        {kPython, script.string(), std::to_string(std::thread::hardware_concurrency())},
        out_ / "said_surface.txt");
    if (vtk)
        vtk_.emplace(std::move(*vtk));
    else
        absent_because_ = fmt::format("VTK was not asked: {}", vtk.error().message);
}

std::optional<Json> SurfacePeers::ask(const Json& question) {
    if (!vtk_)
        return std::nullopt;
    Result<Json> answer = vtk_->ask(question);
    if (answer)
        return std::move(*answer);
    absent_because_ = fmt::format("VTK failed: {}", answer.error().message);
    vtk_.reset();
    return std::nullopt;
}

std::vector<std::string> SurfacePeers::open(const Sample& sample, double iso,
                                            const std::vector<double>& labels, bool few) {
    if (!vtk_)
        return {};
    const fs::path raw = out_ / (sample.name + ".raw");
    const Result<Json> saved = save_raw(sample, raw);
    if (!saved) {
        absent_because_ = fmt::format("VTK was not asked: {}", saved.error().message);
        vtk_.reset();
        return {};
    }
    Json told = *saved;
    told["few"] = few;
    if (labels.empty())
        told["iso"] = iso;
    else
        told["labels"] = labels;
    const std::optional<Json> answer = ask({{"open", told}});
    std::error_code ignored;
    fs::remove(raw, ignored); // it was read
    if (!answer)
        return {};
    versions_ = {{"vtk", (*answer)["vtk"]}, {"skimage", (*answer)["skimage"]}};
    std::vector<std::string> who;
    for (const Json& one : (*answer)["who"])
        who.push_back(one.string);
    return who;
}

std::optional<double> SurfacePeers::run(const std::string& who) {
    const std::optional<Json> answer = ask({{"run", who}});
    return answer ? std::optional<double>((*answer)["ms"].number) : std::nullopt;
}

std::optional<SurfacePeers::Made> SurfacePeers::made(const std::string& who, bool with_mesh) {
    const std::string stem = with_mesh ? fs::absolute(out_ / who).string() : std::string();
    const std::optional<Json> answer = ask({{"keep", who}, {"stem", stem}});
    if (!answer)
        return std::nullopt;
    Made made{static_cast<size_t>((*answer)["triangles"].number), {}};
    if (with_mesh) {
        made.mesh = read_mesh(stem);
        std::error_code ignored;
        fs::remove(stem + ".points", ignored);
        fs::remove(stem + ".triangles", ignored);
    }
    return made;
}

std::optional<SurfacePeers::Dab> SurfacePeers::dab(glm::dvec3 centre, double radius, double slope) {
    const std::optional<Json> answer =
        ask({{"dab", {{"centre", centre}, {"radius", radius}, {"slope", slope}}}});
    if (!answer)
        return std::nullopt;
    return Dab{(*answer)["ms"].number, static_cast<size_t>((*answer)["triangles"].number)};
}

} // namespace palpate::bench
