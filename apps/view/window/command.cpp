#include <filesystem>

#include "apps/palpate/command.h"
#include "apps/view/document/label_import.h"
#include "apps/view/panels/file_browser.h"
#include "apps/view/window/layers.h"
#include "apps/view/window/loop.h"
#include "apps/view/window/panel.h"
#include "apps/view/window/small_pictures.h"
#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/image/png.h"
#include "engine/program/device_options.h"
#include "engine/program/open_scene.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "haptics/device/registry.h"
#include "haptics/proxy/algorithms.h"

namespace palpate {

namespace {

struct ViewOptions {
    SceneOptions scene;
    std::vector<std::string> layers; // files over the volume of the scene
    ReadFlags read;
    DeviceMemoryOptions memory;
    std::string device, display, latency, record, replay, shot, state;
    std::optional<uint32_t> monitor;
    std::string hand, hand_path, algorithm = "swept-tool";
    double frame_ms = 60.0, text_scale = 0.0, speed = 1.0;
    bool headless = false, validate = false, hints = false;
};

std::vector<std::string> algorithm_names() {
    std::vector<std::string> names;
    for (const haptics::AlgorithmEntry& entry : haptics::algorithms())
        if (view::follows_edits(entry))
            names.emplace_back(entry.name);
    return names;
}

std::vector<NamedFile> files_of(const ViewOptions& o) {
    std::vector<NamedFile> files{
        {"--tf", o.scene.transfer}, {"--display", o.display}, {"--replay", o.replay}};
    append_volume(files, "SCENE", o.scene.input);
    for (const std::string& layer : o.layers)
        append_volume(files, "LAYER", layer);
    append_volume(files, "--labels", o.scene.labels);
    append_volume(files, "--fused", o.scene.fused);
    append_volume(files, "--overlay", o.scene.overlay);
    if (const Result<SceneFile> scene = base_scene(o.scene)) // else it is told later
        append_files(*scene, files);
    files.push_back({"--hand-path", o.hand_path});
    if (const Result<haptics::DeviceEntry> hand = haptics::find_device(o.hand))
        files.push_back({"--hand", hand->argument});
    files.insert(files.end(), {{"--record", o.record, FileUse::write},
                               {"--shot", o.shot, FileUse::write},
                               {"--latency", o.latency, FileUse::write_text},
                               {"--state", o.state, FileUse::write_text}});
    return files;
}

Result<void> check_together(const ViewOptions& o) {
    if (o.scene.input.empty() && (o.headless || !o.latency.empty()))
        return fail("SCENE is required with --headless and --latency");
    if (o.headless && o.replay.empty() && o.shot.empty() && o.state.empty() && o.latency.empty())
        return fail(
            "--headless: expected --replay, --shot, --state or --latency, found none of them");
    if (!o.latency.empty() &&
        !(o.replay.empty() && o.shot.empty() && o.state.empty() && o.record.empty()))
        return fail("--latency: expected none of --record, --replay, --shot and --state");
    if (o.headless && !o.record.empty() && o.replay.empty())
        return fail("--record: with --headless, needs --replay");
    if (o.headless && o.monitor)
        return fail("--full-screen: opens a window; leave out --headless");
    if (!o.shot.empty() && !o.headless)
        return fail("--shot: needs --headless");
    if (!o.replay.empty() && !o.latency.empty() && !o.headless)
        return fail("--replay: expected without --latency");
    if (!o.shot.empty() && !o.shot.ends_with(".png"))
        return fail("--shot: expected a name ending in .png, found '{}'", o.shot);
    if (!o.hand_path.empty() && (o.hand.empty() || o.hand == view::kMouse))
        return fail("--hand-path: needs a device that --hand names, and not {}", view::kMouse);
    const std::vector<uint32_t>& size = o.scene.size_px;
    if (size.size() == 2 &&
        (size[0] < view::kSmallestWindow_px.x || size[1] < view::kSmallestWindow_px.y))
        return fail("--size: expected at least {},{} for a window, found {},{}",
                    view::kSmallestWindow_px.x, view::kSmallestWindow_px.y, size[0], size[1]);
    return {};
}

// Options of a scene that the window does not heed: the one list of them.
void warn_of_idle_options(const CLI::App& app, const ViewOptions& o) {
    const IdleOptions idle[] = {
        {o.scene.slice_settings.empty(), {"--slice"}, "the window has slices of its own"},
        {o.scene.slices.empty(), {"--slab", "--slab-mode"}, "without --slice"},
        {true, {"--interpolation"}, "slices of the window are linear"},
        {true, {"--values"}, "of render"},
        {o.scene.transparent(), {"--background"}, "transparent is of render"},
        {o.replay.empty() || o.headless, {"--speed"}, "of --replay in a window"},
        {o.headless, {"--frame-ms"}, "--headless draws at full quality"}};
    warn_of_idle(app, idle);
}

// `keeps`: a project is opened so that it keeps what is done from now on; else it is only read.
// steps_folder: of what is no project; empty: its steps are not kept.
Result<view::Source> open_source(const SceneOptions& options, const ReadFlags& read, bool keeps,
                                 const std::filesystem::path& steps_folder,
                                 const std::stop_token& stop) {
    PALPATE_TRY(OpenedScene scene, open_scene(options, read, stop));
    if (std::optional<Volume>& labels = scene.loaded.data.labels) { // in another order of samples
        const Grid& grid = scene.loaded.data.volume.grid();
        if (view::have_same_samples(labels->grid(), grid)) {
            PALPATE_TRY(LoadedVolume put,
                        view::on_grid({std::move(*labels), {}, {}, {}, {}, {}}, grid, stop));
            labels = std::move(put.volume);
        }
    }
    view::Source source{std::move(scene)};
    if (keeps && Project::is_one(options.input)) {
        PALPATE_TRY(Project::Opened project, Project::open(options.input));
        PALPATE_TRY(view::add_maps(project));
        source.project.emplace(std::move(project));
    } else if (!steps_folder.empty() && !is_synthetic(options.input)) {
        source.steps.emplace(
            view::keep_steps(view::fresh_document(source.scene.loaded.data), steps_folder, stop));
    }
    return source;
}

Result<void> run_view(const ViewOptions& options, const CLI::App& app) {
    return_freed_memory();
    const Interrupt interrupt;
    warn_of_idle_options(app, options);
    view::Script script;
    if (!options.replay.empty()) {
        PALPATE_TRY(script, view::load_script(options.replay));
    }
    if (options.scene.size_px.size() == 2)
        script.size_px = {options.scene.size_px[0], options.scene.size_px[1]};
    if (options.text_scale > 0.0)
        script.text_scale = options.text_scale;

    view::LoopOptions loop{.device = options.device,
                           .validate = options.validate,
                           .size_px = script.size_px,
                           .text_scale = options.text_scale,
                           .record = options.record,
                           .monitor = options.monitor};
    if (!options.display.empty()) {
        Result<DisplayProfile> display = load_display_profile(options.display);
        if (!display)
            return pass_on(display);
        loop.viewer.display = std::move(*display);
    }
    if (!options.replay.empty() && !options.headless) {
        loop.replay = script;
        loop.replay_speed = options.speed;
    }
    loop.viewer.volume_alone = options.monitor.has_value();
    loop.viewer.frame_ms = options.frame_ms;
    loop.viewer.hand = {options.hand, {}, options.algorithm};
    if (!options.hand_path.empty()) {
        PALPATE_TRY(loop.viewer.hand.path, haptics::load_hand_path(options.hand_path));
    }
    loop.viewer.threaded = !options.headless;
    // A recording begins with what is in the files, and is one of the steps.
    const std::filesystem::path steps_folder =
        options.headless || !options.record.empty() || !options.latency.empty()
            ? std::filesystem::path()
            : view::state_file("steps");
    loop.viewer.open = [&](const std::string& path, const std::string& series,
                           const std::stop_token& stop,
                           const std::function<void(double)>& progress) {
        SceneOptions dropped;
        dropped.input = path;
        dropped.size_px = options.scene.size_px;
        ReadFlags read = options.read;
        read.series = series;
        read.progress = progress;
        return open_source(dropped, read, !options.headless, steps_folder, stop);
    };
    loop.viewer.open_beside = [&](const std::string& path, bool labels, const std::stop_token& stop,
                                  const std::function<void(double)>& progress) {
        ReadFlags read = options.read;
        read.frame = -1; // it is the volume's, and so is the series
        read.series.clear();
        read.resample_slices = false;
        read.progress = progress;
        const ReadOptions how = read_options(read, stop);
        return labels ? load_labels(path, how) : load_volume(path, how);
    };
    loop.viewer.preview = [&](const std::string& path, uint32_t series,
                              const std::stop_token& stop) {
        ReadOptions read = read_options(options.read, stop);
        read.series = std::to_string(series);
        read.middle_image = true;
        return load_volume(path, read);
    };
    if (!options.headless) { // a script is a function of its input
        const std::filesystem::path file = view::state_file("view.json");
        const view::Settings settings = view::load_settings(file);
        loop.viewer.settings = settings;
        if (options.text_scale == 0.0)
            loop.text_scale = settings.text_scale;
        loop.viewer.keep_settings = [file](const view::Settings& changed) {
            if (const Result<void> saved = view::save_settings(file, changed); !saved)
                log::info("{}", saved.error().message);
        };
        loop.viewer.recent = [](const std::string& path) {
            if (!path.empty() && !is_synthetic(path)) {
                std::error_code ignored;
                const auto whole = std::filesystem::absolute(path, ignored);
                if (const auto kept = view::add_recent(view::recent_file(), whole.string()); !kept)
                    log::info("{}", kept.error().message);
            }
            return view::load_recent(view::recent_file());
        };
        loop.viewer.keep_small_picture = [](const std::string& path,
                                            const std::vector<std::byte>& rgba) {
            if (is_synthetic(path))
                return;
            std::error_code ignored;
            const std::string whole = std::filesystem::absolute(path, ignored).string();
            const std::filesystem::path folder = view::state_file("pictures");
            if (const auto kept = view::keep_small_picture(folder, whole, rgba); !kept)
                log::info("{}", kept.error().message);
            std::vector<std::string> listed = view::load_recent(view::recent_file());
            listed.push_back(whole);
            view::forget_small_pictures(folder, listed);
        };
    }
    loop.viewer.small_picture = [](const std::string& path) -> Result<std::vector<std::byte>> {
        if (!is_synthetic(path))
            return view::load_small_picture(view::state_file("pictures"), path);
        SceneFile file; // coarse: its picture is small
        file.volume = path.substr(0, path.find('?')) + "?size=48";
        PALPATE_TRY(LoadedScene loaded, load_scene_data(file));
        return view::preview_of({std::move(loaded.data.volume), {}, {}, "", {}, {}},
                                view::SeriesPreviews::kSide_px);
    };
    loop.viewer.hints = options.hints || (!options.headless && options.replay.empty() &&
                                          options.record.empty() && options.latency.empty());
    loop.stop = interrupt.token();
    loop.set_renderer = [&](const GpuDevice& device, RendererOptions& renderer) {
        apply(options.memory, device, true, renderer);
    };
    // A camera that fits the volume fits it into its view.
    SceneOptions scene = options.scene;
    PALPATE_TRY(
        view::take_layers(options.layers, read_options(options.read, interrupt.token()), scene));
    if (scene.input.empty()) {
        scene.input = "synthetic:phantom?size=96";
        loop.viewer.asks_for_file = true;
    }
    view::ViewState first;
    first.size_px = script.size_px;
    const glm::uvec2 room = view::volume_size_px(first);
    scene.size_px = {room.x, room.y};
    PALPATE_TRY(view::Source opened, open_source(scene, options.read, !options.headless,
                                                 steps_folder, interrupt.token()));
    if (!options.latency.empty()) {
        loop.viewer.threaded = true;
        PALPATE_TRY(const Json found,
                    view::run_latency(std::move(opened), std::move(loop), options.headless));
        return write_text(options.latency, report_text(found));
    }
    if (loop.viewer.recent)
        loop.viewer.recent(scene.input);
    view::HeadlessResult result;
    if (options.headless) {
        PALPATE_TRY(result, view::run_headless(std::move(opened), script, std::move(loop),
                                               !options.shot.empty()));
    } else {
        PALPATE_TRY(result.state, view::run_window(std::move(opened), std::move(loop)));
    }
    if (result.shot)
        PALPATE_TRY(save_png(options.shot, *result.shot));
    return options.state.empty() ? Result<void>()
                                 : write_text(options.state, report_text(result.state));
}

} // namespace

Command add_view(CLI::App& app) {
    auto o = std::make_shared<ViewOptions>();
    add_scene_options(app, o->scene);
    CLI::Option* scene = app.get_option("SCENE")->required(false);
    scene->description(scene->get_description() + " (default: a phantom, and files to open)");
    app.add_option("LAYER", o->layers,
                   "Files over the volume, each by what it holds: labels, or another volume half "
                   "transparent over the slices (default: none)")
        ->type_name("FILE");
    app.get_option("--size")->description(
        "Width and height of the window in pixels (default: 1280,800)");
    add_read_limits(app, o->read);
    app.add_option(
           "--frame-ms", o->frame_ms,
           "Time of a picture of the volume in ms while something moves; then it is refined")
        ->capture_default_str()
        ->check(positive());
    app.add_option("--display", o->display,
                   "Profile of a stereo display, JSON: eyes, screen, mirror, calibration (default: "
                   "none)")
        ->type_name("FILE");
    app.add_option("--full-screen", o->monitor,
                   "Fill a monitor with the 3D view, 0 the first (default: a window)")
        ->type_name("MONITOR");
    app.add_option("--text-scale", o->text_scale,
                   "Size of letters and widgets, 0.5 .. 4 (default: as the display asks, or 1)")
        ->check(within(0.5, 4.0));
    app.add_option(
           "--hand", o->hand,
           "Haptic device that runs from the start, without force until it is armed: mouse, "
           "or one of `palpate devices` (default: none)")
        ->check(CLI::Validator(
            [](std::string& text) {
                return text == view::kMouse ? std::string() : device_name()(text);
            },
            ""));
    app.add_option("--hand-path", o->hand_path,
                   "Where the hand on a simulated --hand means to be, .csv as of palpate touch "
                   "(default: where the mouse is)")
        ->type_name("FILE");
    app.add_option("--algorithm", o->algorithm, "Haptic algorithm, as of palpate touch")
        ->check(one_of(algorithm_names()))
        ->capture_default_str();
    app.add_option("--record", o->record,
                   "Write every input to a script, JSON lines; with --headless that of --replay "
                   "(default: none)")
        ->type_name("FILE");
    app.add_option("--replay", o->replay,
                   "Do the input of a script; in a window a press or a key ends it (default: none)")
        ->type_name("FILE");
    app.add_option("--speed", o->speed,
                   "Play --replay in a window so many times as fast as it was recorded")
        ->capture_default_str()
        ->check(within(0.1, 1000.0));
    app.add_flag("--hints", o->hints,
                 "Show the hints of a first start (default: once, in a window that plays and "
                 "records no script)");
    app.add_flag("--headless", o->headless, "Open no window, and end when the script is done");
    app.add_option("--shot", o->shot,
                   "With --headless: picture of the window at the end, .png (default: none)")
        ->type_name("FILE");
    app.add_option("--state", o->state,
                   "At the end: views, tool and document as JSON, or - (default: none)")
        ->type_name("FILE");
    app.add_option("--latency", o->latency,
                   "Measure how fast the window answers, about a minute, as JSON, or - (default: "
                   "none)")
        ->type_name("FILE");
    app.add_option("--device", o->device,
                   "Vulkan device: part of its name, or its number in palpate doctor (default: the "
                   "first discrete, integrated, then CPU device)");
    add_device_memory_options(app, o->memory);
    app.add_flag("--validate", o->validate,
                 "Run under Vulkan validation; a validation message is a failure");
    refuse_where_wrong(app, [o] { return check_together(*o); });
    return {[o, &app] { return run_view(*o, app); }, [o] { return files_of(*o); },
            /*files_together=*/false};
}

} // namespace palpate
