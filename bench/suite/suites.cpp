#include "bench/suite/suites.h"

#include <array>
#include <cstdlib>
#include <ctime>

#include "bench/suite/page.h"
#include "engine/base/assert.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/timer.h"

namespace palpate::bench {

namespace {

constexpr std::array kSuites{
    Suite{"quality", "error against time: integrators, steps, VTK, convergence, factors",
          run_quality},
    Suite{"render", "modes, integrators and sizes: time beside error, and the aims beside VTK",
          run_render},
    Suite{"upload", "bytes to the device: a whole volume, 1 to 256 bricks, share of memcpy",
          run_upload},
    Suite{"touch", "touch: scenes, trajectories and algorithms; time of a tick; Z-width",
          run_touch},
    Suite{"edit", "a dab from the hand to snapshot, device, surface and pixels, beside VTK",
          run_edit},
    Suite{"frame", "processor time of the recording thread a frame, 128^3 to 1024^3, with dabs",
          run_frame},
    Suite{"stability", "the hard cases of ray casting, each with its figure and bound",
          run_stability},
    Suite{"segment", "filters and methods of segmentation: time beside error, ITK's in turn",
          run_segment},
    Suite{"surface", "meshes: time beside error, VTK's in turn; dabs (table 1 of paper 1); windows",
          run_surface},
};

std::string now_utc() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    ::gmtime_r(&now, &parts);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts);
    return text;
}

} // namespace

std::span<const Suite> suites() {
    return kSuites;
}

Result<void> run_suite(const std::string& name, const Options& options) {
    const auto suite = std::find_if(kSuites.begin(), kSuites.end(),
                                    [&](const Suite& s) { return name == s.name; });
    PALPATE_ASSERT(suite != kSuites.end());
    std::error_code error;
    fs::create_directories(options.out, error);
    if (error)
        return fail("{}: cannot be made: {}", options.out.string(), error.message());
    if (!options.tiny) { // first frames compile, as on a new machine
        ::setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
        ::setenv("__GL_SHADER_DISK_CACHE", "0", 1); // NVIDIA's
    }
    const std::string started = now_utc();
    const Timer timer;
    const Neighbours neighbours;
    GpuDevice device({.select = options.device});
    Bench bench(device, options);
    PALPATE_TRY(const Report report, suite->run(bench));
    Json json{{"suite", suite->name},
              {"form", options.tiny   ? "tiny"
                       : options.full ? "full"
                                      : "short"},
              {"started_utc", started},
              {"duration_s", timer.ms() / 1000.0},
              {"environment", environment(device.info())},
              {"busy_neighbours", neighbours.cores()},
              {"pass", report.failures.empty()},
              {"failures", report.failures}};
    json.update(report.json);
    const fs::path path = options.out / fmt::format("{}.json", suite->name);
    const std::string text = json_text(json);
    PALPATE_TRY(save_bytes(path, std::as_bytes(std::span(text))));
    PALPATE_TRY(write_page(options.out));
    log::info("{} and {} after {:.0f} s", path.string(), (options.out / "index.html").string(),
              timer.ms() / 1000.0);
    if (!report.failures.empty())
        return fail("{}{}", report.failures[0],
                    report.failures.size() == 1
                        ? ""
                        : fmt::format(" (and {} more)", report.failures.size() - 1));
    return {};
}

} // namespace palpate::bench
