#include "bench/suite/surface_live.h"

#include <algorithm>
#include <random>
#include <span>

#include "engine/base/log.h"
#include "engine/base/percentile.h"
#include "engine/base/timer.h"
#include "engine/surface/block_surface.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/edit.h"

namespace palpate::bench {

namespace {

constexpr float kIso = 300.0f;
constexpr double kRadius_mm = 5.0, kAir = -1000.0;

// A ball taken out.
Volume dabbed(const Volume& volume, glm::dvec3 centre_mm) {
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const glm::dvec3 last(volume.size() - 1u);
    const glm::uvec3 low(glm::max(glm::ceil((centre_mm - kRadius_mm) / spacing), glm::dvec3(0.0)));
    const glm::uvec3 high(glm::min(glm::floor((centre_mm + kRadius_mm) / spacing), last));
    VolumeEdit edit(volume);
    for (uint32_t z = low.z; z <= high.z; ++z)
        for (uint32_t y = low.y; y <= high.y; ++y)
            for (uint32_t x = low.x; x <= high.x; ++x)
                if (glm::distance(glm::dvec3(x, y, z) * spacing, centre_mm) <= kRadius_mm)
                    edit.set({x, y, z}, kAir);
    return edit.commit();
}

std::shared_ptr<const Mesh> mesh_of(const Volume& volume) {
    return std::make_shared<const Mesh>(marching_cubes(volume, kIso, {.closed_at_border = true}));
}

struct LiveKeeper {
    const char* who;
    std::optional<BlockMaker> maker; // none: a mesh
};
constexpr LiveKeeper kLiveKeepers[] = {
    {"device", BlockMaker::device}, {"cpu", BlockMaker::cpu}, {"mesh", std::nullopt}};

Scene scene_of(const Volume& volume, const LiveKeeper& keeper, uint32_t size_px) {
    Scene scene;
    scene.size_px = glm::uvec2(size_px);
    scene.camera = peer_camera(volume);
    scene.surfaces.resize(1);
    if (keeper.maker)
        scene.surfaces[0].live_iso = kIso;
    return scene;
}

// A frame, recorded and waited for.
struct Drawn {
    double record_ms = 0.0, frame_ms = 0.0;
    uint64_t bytes = 0;
    size_t blocks = 0;
};
Result<Drawn> draw(GpuDevice& device, Renderer& renderer, const Scene& scene,
                   const SceneData& data) {
    Drawn drawn;
    const uint64_t before = device.traffic().uploaded_bytes;
    Commands commands(device);
    const Timer timer;
    Result<RecordedFrame> frame = renderer.record(commands, scene, data);
    drawn.record_ms = timer.ms();
    commands.submit();
    commands.finish();
    drawn.frame_ms = timer.ms();
    if (!frame)
        return pass_on(frame);
    drawn.bytes = device.traffic().uploaded_bytes - before;
    drawn.blocks = frame->ticket.stats().made_blocks;
    return drawn;
}

bool same_bits(const std::vector<Image>& a, const std::vector<Image>& b) {
    return a.size() == b.size() && std::ranges::equal(std::as_bytes(std::span(a[0].samples)),
                                                      std::as_bytes(std::span(b[0].samples)));
}

Json spread_json(const std::vector<double>& values) {
    return {{"median", percentile(values, 0.5)}, {"largest", percentile(values, 1.0)}};
}

} // namespace

Result<Json> measure_live(Bench& bench, std::vector<std::string>& failures) {
    const Options& options = bench.options();
    Sample sample = phantom(64);
    if (!options.tiny) {
        PALPATE_TRY(const Sample ct, head_ct(options.head_ct));
        sample = resampled(ct, {512, 512, 174}, "head_ct_174");
    }
    const uint32_t size_px = options.tiny ? 96 : 1024;
    const Volume& whole = sample.volume;
    const std::shared_ptr<const Mesh> first_mesh = mesh_of(whole);
    std::mt19937 random(1);
    std::vector<Volume> after{whole};
    for (int i = 0; i < (options.tiny ? 2 : 9); ++i)
        after.push_back(
            dabbed(after.back(),
                   glm::dvec3(first_mesh->positions[random() % first_mesh->positions.size()])));

    Renderer afresh(bench.device());
    const Scene of_mesh = scene_of(whole, kLiveKeepers[2], size_px);
    PALPATE_TRY(const Frame truth,
                afresh.render(of_mesh, {after.back(), {}, {mesh_of(after.back())}}));

    Json rows = Json::array();
    for (const LiveKeeper& keeper : kLiveKeepers) {
        const Scene scene = scene_of(whole, keeper, size_px);
        Renderer renderer(bench.device(), {.block_maker = keeper.maker});
        std::optional<BlockSurface> blocks;
        if (!keeper.maker)
            blocks.emplace(whole, kIso, SurfaceOptions{.closed_at_border = true});
        std::vector<double> bytes, made, record_ms, frame_ms;
        Drawn first;
        for (size_t i = 0; i < after.size(); ++i) {
            if (options.stop.stop_requested())
                return fail("interrupted");
            SceneData data{after[i], {}, {nullptr}};
            const Timer timer;
            size_t remade = 0;
            if (blocks && i > 0)
                remade = blocks->update(after[i]).blocks.size();
            if (blocks)
                data.meshes = {std::make_shared<const Mesh>(blocks->mesh())};
            const double meshing_ms = timer.ms();
            Result<Drawn> drawn = draw(bench.device(), renderer, scene, data);
            if (!drawn)
                return fail("{}: {}", keeper.who, drawn.error().message);
            drawn->record_ms += meshing_ms;
            drawn->frame_ms += meshing_ms;
            drawn->blocks += remade;
            if (i == 0) {
                first = *drawn;
                continue;
            }
            bytes.push_back(static_cast<double>(drawn->bytes));
            made.push_back(static_cast<double>(drawn->blocks));
            record_ms.push_back(drawn->record_ms);
            frame_ms.push_back(drawn->frame_ms);
        }
        const bool same = same_bits(renderer.read_back(), truth.eyes);
        if (!same)
            failures.push_back(fmt::format(
                "live, {}: the picture after {} dabs is not that of the mesh from scratch",
                keeper.who, bytes.size()));
        rows.push_back({{"who", keeper.who},
                        {"volume", sample.title},
                        {"triangles", first_mesh->triangles.size()},
                        {"dabs", bytes.size()},
                        {"first_blocks", first.blocks},
                        {"first_bytes", first.bytes},
                        {"blocks", spread_json(made)},
                        {"bytes", spread_json(bytes)},
                        {"record_ms", spread_json(record_ms)},
                        {"frame_ms", spread_json(frame_ms)},
                        {"same_picture", same}});
        log::info(
            "live, {}: {} of {} blocks, {} of {} bytes, {:.2f} ms to record, {:.0f} ms a frame",
            keeper.who, percentile(made, 0.5), first.blocks, percentile(bytes, 0.5), first.bytes,
            percentile(record_ms, 0.5), percentile(frame_ms, 0.5));
    }
    return rows;
}

} // namespace palpate::bench
