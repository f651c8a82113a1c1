// The cost of a frame to the thread that records it, and whether that grows with the volume.

#include <tbb/global_control.h>

#include <cmath>
#include <ctime>
#include <deque>

#include "bench/suite/suites.h"
#include "engine/base/log.h"
#include "engine/base/percentile.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate::bench {

namespace {

constexpr double kSurface = 500.0, kInside = 1000.0;
constexpr double kEdge = 10.0; // samples over which values rise
constexpr double kDab_mm = 5.0;
constexpr double kAskedRatio = 1.3, kMovingTarget_ms = 0.3, kDabTarget_ms = 1.0;

struct FramePlan {
    std::vector<uint32_t> sides;
    uint64_t limit_bytes; // of the device's memory: the largest volume does not fit it whole
    int frames;
};

Result<FramePlan> frame_plan_of(const Options& options) {
    FramePlan plan{{128, 512, 1024}, uint64_t{1} << 30, options.full ? 400 : 100};
    if (options.tiny)
        plan = {{64, 256}, uint64_t{30} << 20, 3};
    if (options.only.empty())
        return plan;
    std::vector<uint32_t> asked;
    for (const uint32_t side : plan.sides)
        if (std::ranges::count(options.only, fmt::to_string(side)) > 0)
            asked.push_back(side);
    if (asked.size() != options.only.size())
        return fail("--only: expected sides of the volumes of frame ({}), found '{}'",
                    fmt::join(plan.sides, ", "), fmt::join(options.only, ","));
    plan.sides = asked;
    return plan;
}

double radius_of(uint32_t side) {
    return 0.3 * side;
}

// A ball with an edge, samples 1 mm apart. Bricks off the edge hold one value and next to no bytes,
// so that the bricks that matter grow with the square of the side.
Sample ball_of(uint32_t side) {
    const Grid grid = make_grid(glm::uvec3(side), glm::dvec3(1.0));
    const glm::dvec3 middle = 0.5 * (glm::dvec3(side) - 1.0);
    const auto value = [&](glm::dvec3 at) {
        const double depth = radius_of(side) - glm::length(at - middle);
        return std::clamp(kSurface + depth / kEdge * kInside, 0.0, kInside);
    };
    VolumeBuilder builder(grid, ScalarType::u16);
    const glm::uvec3 count = builder.brick_count();
    for (uint32_t z = 0; z < count.z; ++z)
        for (uint32_t y = 0; y < count.y; ++y)
            for (uint32_t x = 0; x < count.x; ++x) {
                const glm::uvec3 brick(x, y, z);
                const glm::dvec3 centre = glm::dvec3(brick * kBrickSide) + 0.5 * (kBrickSide - 1.0);
                const double depth = radius_of(side) - glm::length(centre - middle);
                const auto one = static_cast<uint16_t>(depth > 0 ? kInside : 0.0);
                const bool constant =
                    std::abs(depth) > 0.5 * kEdge + 0.5 * std::sqrt(3.0) * kBrickSide;
                builder.set_brick(
                    brick, constant
                               ? Brick::make(std::span(&one, 1))
                               : make_brick(
                                     grid, ScalarType::u16,
                                     [&](glm::uvec3 i) { return value(glm::dvec3(i)); }, brick));
            }
    return {fmt::format("ball_{}", side), fmt::format("{}^3", side), builder.finish()};
}

struct Look {
    const char* name;
    RayMode mode;
    bool slices; // three views of one each, and two eyes
};
constexpr Look kLooks[] = {{"one 3D view, alpha", RayMode::alpha, false},
                           {"one 3D view, iso", RayMode::iso, false},
                           {"one 3D view, MIP", RayMode::mip, false},
                           {"three slices, two eyes", RayMode::alpha, true}};

// The scene of each view. Rays are opaque about the ball's surface alone.
std::vector<Scene> scenes_of_look(const Look& look, const Sample& sample, double turned_deg) {
    Scene plain;
    plain.size_px = glm::uvec2(64);
    plain.camera = orbit(peer_camera(sample.volume), turned_deg);
    Scene rays = plain;
    RayCastLayer layer;
    layer.mode = look.mode;
    layer.transfer = peak(kSurface, 600.0, 1.0, 1.0);
    layer.isos = {{kSurface}};
    if (look.mode == RayMode::mip)
        layer.transfer = window_function(0.0, kInside, 1.0);
    rays.ray_cast = layer;
    if (!look.slices)
        return {rays};
    rays.stereo = StereoSettings{};
    std::vector<Scene> scenes{rays};
    const glm::dvec3 middle = 0.5 * (glm::dvec3(sample.volume.size()) - 1.0);
    for (int axis = 0; axis < 3; ++axis) {
        SliceLayer slice;
        slice.point_mm = middle;
        slice.normal = glm::dvec3(axis == 0, axis == 1, axis == 2);
        Scene scene = plain;
        scene.slices = {slice};
        scene.slice_transfer = window_function(0.0, kInside, 1.0);
        scenes.push_back(scene);
    }
    return scenes;
}

// The volume with a ball cut out of the surface, or put on it, at the i-th place of a way round it.
Volume dabbed(const Volume& volume, int i) {
    const double angle = i * 3.0 / radius_of(volume.size().x); // 3 mm from place to place
    const glm::dvec3 out(std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle));
    const glm::dvec3 centre =
        0.5 * (glm::dvec3(volume.size()) - 1.0) + radius_of(volume.size().x) * out;
    VolumeEdit edit(volume);
    const glm::uvec3 low(glm::floor(centre - kDab_mm)), high(glm::ceil(centre + kDab_mm));
    for (uint32_t z = low.z; z <= high.z; ++z)
        for (uint32_t y = low.y; y <= high.y; ++y)
            for (uint32_t x = low.x; x <= high.x; ++x)
                if (glm::length(glm::dvec3(x, y, z) - centre) <= kDab_mm)
                    edit.set({x, y, z}, i / 8 % 2 ? kInside : 0.0);
    return edit.commit();
}

double thread_ms() {
    std::timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// More than a processor's caches hold.
constexpr size_t kCacheBytes = size_t{64} << 20;

// If the processor stands for the device, what is left in its caches depends on how long the
// picture before took. A thread that comes back to draw after other work finds them cold.
void empty_caches() {
    static std::vector<uint8_t> bytes(kCacheBytes);
    for (size_t i = 0; i < bytes.size(); i += 64)
        ++bytes[i];
}

struct Costs {
    std::vector<double> cpu_ms, uploaded_bytes;
};

// Frames of a look while the camera turns; with dabs, each frame takes a snapshot made before its
// time begins.
class Series {
 public:
    Series(Bench& bench, const Sample& sample, const Look& look, uint64_t limit_bytes)
        : bench_(bench), sample_(sample), look_(look), now_(sample.volume) {
        views_.emplace_back(bench.device(), RendererOptions{.memory_limit_bytes = limit_bytes});
        while (views_.size() < scenes_of_look(look, sample, 0.0).size())
            views_.emplace_back(views_.front().store());
    }

    Result<void> draw(bool dab, Costs& measured) {
        if (bench_.options().stop.stop_requested())
            return fail("interrupted");
        if (dab)
            now_ = dabbed(now_, dabs_++);
        const std::vector<Scene> scenes = scenes_of_look(look_, sample_, turned_++);
        const uint64_t bytes = bench_.device().traffic().uploaded_bytes;
        empty_caches();
        const double since = thread_ms();
        PALPATE_TRY(const FrameStats stats, draw_views(scenes, {now_, std::nullopt}));
        measured.cpu_ms.push_back(thread_ms() - since);
        atlas_ = stats.atlas;
        measured.uploaded_bytes.push_back(
            static_cast<double>(bench_.device().traffic().uploaded_bytes - bytes));
        return {};
    }
    bool atlas() const { return atlas_; }

 private:
    // The measured work, as a function of its own: callgrind counts its instructions by name
    // (docs/reference/bench.md).
    [[gnu::noinline]] Result<FrameStats> draw_views(const std::vector<Scene>& scenes,
                                                    const SceneData& data) {
        Commands commands(bench_.device());
        std::optional<FrameTicket> ticket;
        for (size_t view = 0; view < scenes.size(); ++view) {
            PALPATE_TRY(const RecordedFrame recorded,
                        views_[view].record(commands, scenes[view], data));
            ticket = recorded.ticket;
        }
        commands.submit();
        return ticket->stats(); // waits
    }

    Bench& bench_;
    const Sample& sample_;
    Look look_;
    Volume now_;
    std::deque<Renderer> views_; // of one store
    int dabs_ = 0, turned_ = 0;
    bool atlas_ = false;
};

Json row_of(const Look& look, const Sample& sample, bool atlas, const char* frames,
            const Costs& measured) {
    const Spread cpu = spread(measured.cpu_ms);
    const double worst = percentile(measured.cpu_ms, 1.0);
    const double bytes = percentile(measured.uploaded_bytes, 0.5);
    log::info("{}, {} ({}), {}: median {:.3f} ms, p95 {:.3f}, worst {:.3f}; {:.0f} bytes uploaded",
              look.name, sample.title, atlas ? "atlas" : "dense", frames, cpu.median, cpu.p95,
              worst, bytes);
    return {{"view", look.name},
            {"volume", sample.title},
            {"residency", atlas ? "atlas" : "dense"},
            {"frames", frames},
            {"cpu_ms",
             {{"median", cpu.median},
              {"p95", cpu.p95},
              {"worst", worst},
              {"low", cpu.low},
              {"high", cpu.high},
              {"count", cpu.count}}},
            {"uploaded_bytes_median", bytes}};
}

} // namespace

Result<Report> run_frame(Bench& bench) {
    PALPATE_TRY(const FramePlan plan, frame_plan_of(bench.options()));
    // This thread does what frames hand to other threads, so that its time holds all of it.
    const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
    Report report;
    Json rows = Json::array(), aims = Json::array();
    std::map<std::string, std::vector<double>> medians; // by view and kind of frames, by side
    std::vector<Sample> samples;
    for (const uint32_t side : plan.sides)
        samples.push_back(ball_of(side));
    for (const Look& look : kLooks) {
        std::deque<Series> all; // of each side
        const auto draw = [&](int frames, bool dabs) -> Result<std::vector<Costs>> {
            std::vector<Costs> measured(all.size());
            for (int i = 0; i < frames; ++i) // in turn: what else runs affects all sides alike
                for (size_t side = 0; side < all.size(); ++side)
                    PALPATE_TRY(all[side].draw(dabs, measured[side]));
            return measured;
        };
        for (const Sample& sample : samples) {
            const uint64_t others = bench.device().resource_bytes();
            all.emplace_back(bench, sample, look, plan.limit_bytes + others);
            Costs uncounted;
            for (int i = 0; i < 3; ++i)
                PALPATE_TRY(all.back().draw(false, uncounted));
        }
        // Behind the dabs, what they left to be done comes in quiet frames.
        for (const auto& [frames, dabs] :
             {std::pair("camera moving", false), std::pair("a dab a frame", true),
              std::pair("moving after dabs", false)}) {
            PALPATE_TRY(draw(dabs ? 2 : 0, dabs));
            PALPATE_TRY(const std::vector<Costs> measured, draw(plan.frames, dabs));
            for (size_t side = 0; side < all.size(); ++side) {
                rows.push_back(
                    row_of(look, samples[side], all[side].atlas(), frames, measured[side]));
                medians[fmt::format("{}, {}", look.name, frames)].push_back(
                    rows.items.back()["cpu_ms"]["median"].number);
            }
        }
    }
    for (const auto& [what, by_side] : medians) {
        const double ratio = by_side.back() / by_side.front();
        if (by_side.size() > 1)
            add_aim(
                aims,
                fmt::format("{}: {}^3 beside {}^3", what, plan.sides.back(), plan.sides.front()),
                fmt::format("at most {:g} times", kAskedRatio), ratio, ratio <= kAskedRatio);
        const bool dab = what.ends_with("a dab a frame");
        const double target = dab ? kDabTarget_ms : kMovingTarget_ms;
        add_aim(aims, fmt::format("{}, {}^3: ms", what, plan.sides.back()),
                fmt::format("at most {:g}", target), by_side.back(), by_side.back() <= target);
    }
    report.json["frame_title"] =
        "Processor time of the thread that draws: preparing, recording and submitting a frame of "
        "64 x "
        "64 pixels a view and eye. Sleeping until the picture is there costs none; the driver's "
        "own "
        "threads are not in it. Each frame begins with cold caches. Dabs of radius 5 mm are made "
        "before the time begins.";
    report.json["frames"] = rows;
    report.json["aims"] = aims;
    return report;
}

} // namespace palpate::bench
