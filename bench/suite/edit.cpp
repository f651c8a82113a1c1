// One dab of a tool, from the hand to the pixels: snapshot published, bricks uploaded, surface made
// again, picture drawn; beside what a whole surface and a whole texture cost in VTK.

#include <cstring>

#include "bench/suite/edit_live.h"
#include "bench/suite/peers.h"
#include "bench/suite/suites.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/mailbox.h"
#include "engine/base/percentile.h"
#include "engine/edit/history.h"
#include "engine/edit/stroke_run.h"
#include "engine/render/cell_map.h"
#include "engine/render/gpu_volume.h"
#include "engine/render/texel_storage.h"
#include "engine/surface/block_surface.h"
#include "engine/volume/builder.h"
#include "engine/volume/changes.h"
#include "engine/volume/extent.h"
#include "engine/volume/synthetic_name.h"

namespace palpate::bench {

namespace {

constexpr double kBone = 300.0 + 1024.0; // of the phantom as u16
constexpr double kAir = -1000.0 + 1024.0;

struct Times {
    std::vector<double> publish, changes, stage, copy, cells, mesh, ready, frame, pixels, history;
    std::vector<double> coarse_pixels, coarse_error;
    std::vector<double> bricks, blocks;
};

Json row_of(const std::string& what, const std::vector<double>& ms, double target = 0.0) {
    const Spread s = spread(ms);
    Json row{{"what", what},
             {"ms",
              {{"median", s.median},
               {"p99", percentile(ms, 0.99)},
               {"low", s.low},
               {"high", s.high},
               {"count", s.count}}}};
    if (target > 0.0) {
        row["target_ms"] = target;
        row["met"] = s.median <= target;
    }
    return row;
}

// The first place of bone on a ray from outside to the middle; the middle where it meets none.
glm::dvec3 place_on_bone(const Volume& volume, glm::dvec3 direction) {
    const glm::dvec3 middle = 0.5 * (glm::dvec3(volume.size()) - 1.0);
    double t = 1.0;
    while (t > 0.0 &&
           !(volume.value(glm::uvec3(glm::round(middle + t * middle * direction))) > kBone))
        t -= 0.5 / middle.x;
    return world_point(volume.grid(), middle + std::max(t, 0.0) * middle * direction);
}

// Spread evenly over the head (a spiral of golden angles).
std::vector<glm::dvec3> places_on_bone(const Volume& volume, int count) {
    std::vector<glm::dvec3> places;
    for (int i = 0; i < count; ++i) {
        const double z = 1.0 - 2.0 * ((i * 0.618034) - std::floor(i * 0.618034));
        const double r = std::sqrt(1.0 - z * z), a = 2.399963 * i;
        places.push_back(place_on_bone(volume, {r * std::cos(a), r * std::sin(a), 0.8 * z}));
    }
    return places;
}

// Half way round the head.
std::vector<glm::dvec3> way_over_bone(const Volume& volume) {
    std::vector<glm::dvec3> way;
    for (int degree = 0; degree <= 180; degree += 2)
        way.push_back(place_on_bone(volume, {std::cos(glm::radians(double(degree))),
                                             std::sin(glm::radians(double(degree))), 0.2}));
    return way;
}

Scene iso_scene(const Sample& sample, uint32_t size_px) {
    const Subject subject = iso_subject(sample, kBone);
    return scene_of(subject, size_px);
}

// One dab of radius 10 samples: what paper 1 calls an editing operation, as a cut into bone.
Result<Times> dabs(Bench& bench, const Sample& sample, Volume& now, int count) {
    Times times;
    GpuDevice& device = bench.device();
    Commands making(device);
    Result<GpuVolume> image = GpuVolume::make(
        device, "edited", now,
        {.residency = Residency::dense, .limit_bytes = device.info().memory_bytes}, making);
    making.submit();
    if (!image)
        return fail("{}", image.error().message);
    const auto voxels = std::make_shared<VolumeCells>(now);
    CellMap cells(device, voxels);
    BlockSurface surface(now, static_cast<float>(kBone));
    Renderer renderer(device);
    const Scene scene = iso_scene(sample, bench.options().tiny ? 32 : 512);
    PALPATE_TRY(renderer.draw(scene, {now, std::nullopt}));
    PALPATE_TRY(renderer.draw(scene, {now, std::nullopt}, CoarseSettings{}));
    {
        Commands commands(device);
        cells.show(*scene.ray_cast, 1.0f, 0.0f, {}, commands);
        commands.submit();
        commands.finish();
    }
    Mailbox<Volume> mailbox(std::make_unique<Volume>(now));
    History history;
    const Tool ball{make_ball(10.0 * smallest_spacing_mm(now.grid()))};
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.to_value = kAir;
    const auto places = places_on_bone(now, count);
    for (size_t i = 0; i < places.size(); ++i) {
        if (bench.options().stop.stop_requested())
            return fail("interrupted");
        const StrokePose pose{0.0, {places[i], {1, 0, 0, 0}}};
        const Timer since_hand;
        auto run = StrokeRun::start(now, ball, cut);
        (*run)->add({&pose, 1});
        (*run)->lift();
        (*run)->work();
        const Volume next = (*run)->publish();
        mailbox.publish(std::make_unique<Volume>(next));
        times.publish.push_back(since_hand.ms());

        const Timer changing;
        const std::vector<ChangedBrick> changed = changed_bricks(now, next);
        times.changes.push_back(changing.ms());
        times.bricks.push_back(static_cast<double>(changed.size()));
        const Timer staging;
        Commands commands(device);
        image->update(next, changed, commands);
        times.stage.push_back(staging.ms());
        const Timer patching;
        voxels->update(next, changed);
        cells.show(*scene.ray_cast, 1.0f, 0.0f, changed, commands);
        times.cells.push_back(patching.ms());
        commands.submit(); // the device copies while the surface is made
        const Timer meshing;
        times.blocks.push_back(static_cast<double>(surface.update(next, changed).blocks.size()));
        times.mesh.push_back(meshing.ms());
        double copy = 0.0;
        for (const PassTime& pass : commands.finish())
            copy += pass.name == "upload" ? pass.gpu_ms : 0.0;
        times.copy.push_back(copy);
        times.ready.push_back(since_hand.ms() - times.publish.back());

        // The same dab once more, to pixels: the renderer's own upload and patch are in it.
        const Timer drawing;
        PALPATE_TRY(renderer.draw(scene, {next, std::nullopt}));
        times.frame.push_back(drawing.ms());
        times.pixels.push_back(times.publish.back() + times.frame.back());
        const Timer recording;
        history.record(now, next);
        times.history.push_back(recording.ms());
        now = next;
    }
    // And to pixels of the interactive mode, in places further on.
    for (const glm::dvec3 place : places) {
        const StrokePose pose{
            0.0, {place + glm::dvec3(3.0 * smallest_spacing_mm(now.grid())), {1, 0, 0, 0}}};
        const Timer since_hand;
        now = *apply_stroke(now, ball, cut, {&pose, 1});
        PALPATE_TRY(const FrameStats frame,
                    renderer.draw(scene, {now, std::nullopt}, CoarseSettings{}));
        times.coarse_pixels.push_back(since_hand.ms());
        times.coarse_error.push_back(frame.coarse->error_estimate);
    }
    return times;
}

// Bricks to the device in batches: converting them to staging memory, the copy command, and a plain
// copy of the same rows of texels into a flat array of the volume's size by one thread.
Json batches(Bench& bench, const Volume& volume, int repeats) {
    GpuDevice& device = bench.device();
    Commands making(device);
    Result<GpuVolume> image = GpuVolume::make(
        device, "batches", volume,
        {.residency = Residency::dense, .limit_bytes = device.info().memory_bytes}, making);
    making.submit();
    PALPATE_ASSERT(image);
    const glm::uvec3 size = volume.size(), count = volume.brick_count();
    const VkFormat format = image->image().shape().format;
    const size_t texel = texel_bytes(format), brick_bytes = kBrickSamples * texel;
    std::vector<std::byte> flat(sample_count(volume.grid()) * texel);
    const size_t all = size_t{count.x} * count.y * count.z;
    Json rows = Json::array();
    uint64_t turn = 0;
    for (const size_t n : {size_t{1}, size_t{8}, size_t{32}, size_t{64}}) {
        if (n > all)
            continue;
        std::vector<double> stage, copy, plain;
        for (int i = 0; i < repeats; ++i) {
            std::vector<ChangedBrick> some; // bricks that are no constants, other ones each time
            for (; some.size() < n; ++turn) {
                const uint64_t b = turn * 7919 % all;
                const glm::uvec3 at(b % count.x, b / count.x % count.y,
                                    b / (size_t{count.x} * count.y));
                if (!volume.brick(at).is_constant() || all < 100)
                    some.push_back({at, ~uint64_t{0}});
            }
            Commands commands(device);
            const Timer staging;
            image->update(volume, some, commands);
            stage.push_back(staging.ms());
            commands.submit();
            for (const PassTime& pass : commands.finish())
                if (pass.name == "upload")
                    copy.push_back(pass.gpu_ms);
            std::vector<std::byte> bricks(n * brick_bytes);
            for (size_t b = 0; b < n; ++b)
                store_texels(volume.brick(some[b].position), format, glm::uvec3(0),
                             glm::uvec3(kBrickSide), kBrickSide, kBrickSide,
                             &bricks[b * brick_bytes]);
            const Timer copying;
            for (size_t b = 0; b < n; ++b) {
                const glm::uvec3 first = some[b].position * kBrickSide;
                const glm::uvec3 valid = volume.valid_in_brick(some[b].position);
                for (uint32_t z = 0; z < valid.z; ++z)
                    for (uint32_t y = 0; y < valid.y; ++y)
                        std::memcpy(
                            &flat[texel * (first.x + size.x * (first.y + y +
                                                               size_t{size.y} * (first.z + z)))],
                            &bricks[b * brick_bytes + texel * offset_in_brick({0, y, z})],
                            valid.x * texel);
            }
            plain.push_back(copying.ms());
        }
        Json row{{"bricks", n},
                 {"bytes", n * brick_bytes},
                 {"staging_ms", spread(stage).median},
                 {"memcpy_of_rows_ms", spread(plain).median}};
        if (!copy.empty()) {
            row["copy_command_ms"] = spread(copy).median;
            row["copy_share_of_memcpy"] = spread(plain).median / spread(copy).median;
        }
        rows.push_back(row);
    }
    return rows;
}

Result<Json> ask_vtk(Bench& bench, const Volume& volume, int repeats) {
    const fs::path out = bench.options().out / "peers";
    std::error_code ignored;
    fs::create_directories(out, ignored);
    const fs::path raw = out / "edited.raw", result = out / "edit.json";
    PALPATE_TRY(save_samples<uint16_t>(volume, raw));
    const std::string problem =
        run_vtk_script(bench, "peers_edit.py",
                       {raw.string(), std::to_string(volume.size().x), fmt::format("{}", kBone),
                        std::to_string(repeats), result.string()});
    fs::remove(raw, ignored);
    if (!problem.empty())
        return Json{{"absent_because", problem}};
    PALPATE_TRY(const std::string text, load_text(result));
    PALPATE_TRY(const Json found, parse_json(text, result.string()));
    const double frame = spread(found["frame_ms"].numbers()).median;
    const double edges = spread(found["flying_edges_ms"].numbers()).median;
    const double upload = spread(found["frame_after_edit_ms"].numbers()).median - frame;
    return Json{{"vtk", found["vtk"]},       {"triangles", found["triangles"]},
                {"whole_surface_ms", edges}, {"whole_texture_ms", upload},
                {"frame_64_px_ms", frame},   {"sum_ms", edges + upload}};
}

} // namespace

Result<Report> run_edit(Bench& bench) {
    const Options& options = bench.options();
    const uint32_t side = options.tiny ? 96 : 512;
    const int count = options.tiny ? 3 : options.full ? 401 : 101;
    PALPATE_TRY(
        const Volume made,
        make_synthetic(fmt::format("synthetic:phantom?size={}&type=u16", side), uint64_t{8} << 30));
    // At the origin, as the cameras of subjects expect.
    const Grid grid = make_grid(made.size(), spacing_mm(made.grid()));
    Sample sample{"phantom", fmt::format("CT phantom {}^3, u16", side), with_grid(made, grid)};
    Volume now = sample.volume;
    PALPATE_TRY(const Times times, dabs(bench, sample, now, count));
    Report report;
    Json& json = report.json;
    json["title"] =
        fmt::format("a dab of radius 10 samples, cut into the bone of a {}", sample.title);
    json["bricks_changed_median"] = percentile(times.bricks, 0.5);
    json["blocks_meshed_median"] = percentile(times.blocks, 0.5);
    json["rows"] = Json::array();
    const auto add = [&](const std::string& what, const std::vector<double>& ms, double target) {
        json["rows"].push_back(row_of(what, ms, options.tiny ? 0.0 : target));
    };
    add("hand to snapshot (published)", times.publish, 1.0);
    add("list of changed bricks", times.changes, 0);
    add("staging of the bricks", times.stage, 0);
    add("copy command on the device", times.copy, 0);
    add("macro-cells: ranges, occupancy, distances", times.cells, 0);
    add("surface of changed blocks (paper 3: 0.4 ms local update)", times.mesh, 0);
    add("snapshot to uploaded and re-meshed", times.ready, 8.0);
    add("frame of 512 x 512, iso, after the dab", times.frame, 0);
    add("hand to new pixels, iso 512 x 512 (paper 5: 300 ms)", times.pixels, 60.0);
    add("hand to new pixels, interactive mode 512 x 512", times.coarse_pixels, 60.0);
    add("step recorded for undo", times.history, 0);
    json["interactive_error_median"] = percentile(times.coarse_error, 0.5);
    PALPATE_TRY(json["live"],
                edit_live(bench, sample.volume, iso_scene(sample, options.tiny ? 32 : 512),
                          way_over_bone(sample.volume), options.tiny ? 0.3 : 6.0));
    json["batches"] = batches(bench, sample.volume, options.tiny ? 2 : 21);
    if (options.peers && !options.tiny) {
        log::info("VTK: the whole surface and the whole texture");
        PALPATE_TRY(json["vtk"], ask_vtk(bench, sample.volume, options.full ? 21 : 5));
    }
    return report;
}

} // namespace palpate::bench
