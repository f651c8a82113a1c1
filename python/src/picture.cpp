// Scenes, renderers and pictures: `palpate render` with volumes in memory.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <mutex>
#include <optional>

#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "engine/image/display_byte.h"
#include "engine/image/png.h"
#include "engine/program/option_checks.h"
#include "engine/program/picture_options.h"
#include "engine/program/render_warnings.h"
#include "engine/render/interactive.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_check.h"
#include "python/src/bind.h"
#include "python/src/keywords.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

constexpr double kLargePicture_px = 1 << 20; // smaller ones are drawn at once
constexpr double kStep_ms = 200.0;           // of larger ones

void add_time(std::vector<PassTime>& all, const PassTime& pass) {
    const auto same = std::find_if(all.begin(), all.end(),
                                   [&](const PassTime& p) { return p.name == pass.name; });
    if (same == all.end())
        all.push_back(pass);
    else
        same->gpu_ms += pass.gpu_ms;
}

// The options of `palpate render`, from keywords. A scene has the name `scene`; none is needed for
// a device alone.
struct AskedPicture {
    CLI::App app;
    PictureOptions options;

    AskedPicture(const py::dict& keywords, const std::optional<std::string>& scene) {
        add_picture_options(app, options);
        if (scene)
            app.get_option("SCENE")->add_result(*scene);
        else
            app.get_option("SCENE")->required(false);
        refuse_not_finite(app);
        app.set_help_flag();
        take_keywords(app, keywords);
    }
};

struct DrawnScene {
    PictureOptions options;
    OpenedScene opened;
    bool meets_error = false; // --error has chosen integrator and step
};
using ScenePtr = std::shared_ptr<DrawnScene>;

using Volumes = std::map<std::string, std::shared_ptr<LoadedVolume>>;
using Meshes = std::map<std::string, std::shared_ptr<Mesh>>;

ScenePtr open_keywords(const py::dict& keywords, const std::string& name, const Volumes& volumes,
                       const Meshes& meshes, const py::object& progress) {
    const AskedPicture asked(keywords, name);
    InMemory memory;
    for (const auto& [role, volume] : volumes)
        memory.volumes.emplace(role, *volume);
    for (const auto& [path, mesh] : meshes)
        memory.meshes.emplace(path, mesh);
    return run<ScenePtr>(progress, [&](const Report& report) -> Result<ScenePtr> {
        const PictureOptions& o = asked.options;
        PALPATE_TRY(OpenedScene opened, open_scene(o.scene, o.read, report.stop, memory));
        make_room_for_legend(o.figure, o.scene, opened);
        PALPATE_TRY(check_budget(o, opened.scene));
        const SceneToDraw to_draw{o.scene, opened.file, opened.scene, opened.loaded};
        warn_of_idle_options(asked.app, to_draw, "picture.exr", 1);
        for (const std::string& sentence : empty_parts(to_draw))
            log::warning("{}", sentence);
        return std::make_shared<DrawnScene>(DrawnScene{o, std::move(opened)});
    });
}

// A picture and what files of it need.
struct Picture {
    std::vector<Image> eyes;
    Scene scene;
    PictureLook look;
    ImageMetadata metadata;
    FrameStats stats;
    double error_estimate = 0; // of a frame with fewer rays
    double ms = 0;             // until the pixels were on the processor
};

py::array_t<float> floats_of(const Image& image, size_t first, size_t count) {
    py::array_t<float> out({size_t{image.size_px.y}, size_t{image.size_px.x}, count});
    float* to = out.mutable_data();
    const size_t channels = image.channels.size();
    for (size_t i = 0; i < image.samples.size(); i += channels)
        to = std::copy_n(image.samples.data() + i + first, count, to);
    return out;
}

py::array_t<float> channel_of(const Picture& picture, const std::string& name, size_t eye) {
    if (eye >= picture.eyes.size())
        throw Failure(
            fmt::format("expected one of {} eyes, found number {}", picture.eyes.size(), eye));
    const Image& image = picture.eyes[eye];
    const std::optional<size_t> index = channel_index(image, name);
    if (!index)
        throw Failure(fmt::format("the picture has no {}: draw it with values=True", name));
    py::array_t<float> all = floats_of(image, *index, 1);
    return all.reshape({image.size_px.y, image.size_px.x});
}

py::array_t<uint8_t> bytes_of(const Picture& picture) {
    const Image image = shown_picture(picture.look, picture.scene, picture.eyes, true);
    py::array_t<uint8_t> out(
        {size_t{image.size_px.y}, size_t{image.size_px.x}, image.channels.size()});
    std::transform(image.samples.begin(), image.samples.end(), out.mutable_data(), display_byte);
    return out;
}

void save_picture(const Picture& picture, const std::string& path) {
    run<void>(py::none(), [&](const Report&) -> Result<void> {
        if (!path.ends_with(".png") && !path.ends_with(".exr"))
            return fail("{}: expected a name ending in .png or .exr", path);
        return save_frame(path, picture.look, picture.scene, picture.eyes, picture.metadata);
    });
}

// A device with one view. Python may call it from any thread; one draws at a time.
class FrameRenderer {
 public:
    explicit FrameRenderer(const py::dict& keywords)
        : options_(AskedPicture(keywords, {}).options) {
        run<void>(py::none(), [&](const Report&) -> Result<void> {
            device_.emplace(options_.device_options());
            RendererOptions options = renderer_options(options_, *device_, false);
            options.progress = [this](double share) {
                now_->progress(share);
                return !now_->stop.stop_requested();
            };
            renderer_.emplace(*device_, options);
            return {};
        });
    }
    ~FrameRenderer() {
        const py::gil_scoped_release others_run; // the destructor waits for the device
        close();
    }

    void close() {
        const std::lock_guard lock(mutex_);
        interactive_.reset();
        renderer_.reset();
        device_.reset();
    }

    std::shared_ptr<Picture> render(const ScenePtr& scene, const py::object& progress) {
        using Made = std::shared_ptr<Picture>;
        return run<Made>(progress, [&](const Report& report) -> Result<Made> {
            const std::lock_guard lock(mutex_);
            if (!renderer_)
                return fail("the renderer was closed");
            now_ = &report;
            Result<Made> made = draw(*scene);
            now_ = nullptr;
            return made;
        });
    }

    std::string device_text() {
        const std::lock_guard lock(mutex_);
        return device_ ? device_->info().name : "";
    }

 private:
    Result<std::shared_ptr<Picture>> draw(DrawnScene& drawn) {
        const PictureOptions& o = drawn.options;
        Scene& scene = drawn.opened.scene;
        const SceneData& data = drawn.opened.loaded.data;
        if (!drawn.meets_error) {
            RendererOptions options = renderer_options(options_, *device_, false);
            PALPATE_TRY(meet_error(o, *device_, options, data, scene));
            drawn.meets_error = true;
        }
        auto picture = std::make_shared<Picture>();
        const Timer timer;
        if (o.frames.frame_ms > 0) {
            PALPATE_TRY(draw_in_time(o.frames, scene, data, *picture));
        } else if (scene.ray_cast && !scene.value_and_depth &&
                   double(scene.size_px.x) * scene.size_px.y > kLargePicture_px) {
            PALPATE_TRY(picture->stats, draw_in_steps(scene, data));
        } else {
            PALPATE_TRY(picture->stats, renderer_->draw(scene, data));
        }
        picture->eyes = renderer_->read_back();
        picture->ms = timer.ms();
        picture->scene = scene;
        picture->look = look_of(o, drawn.opened);
        picture->metadata = metadata_of(*device_, drawn_file(drawn.opened.file, scene));
        if (const auto messages = device_->validation_messages(); !messages.empty())
            return fail("Vulkan validation had {} complaints, the first: {}", messages.size(),
                        messages.front());
        return picture;
    }

    // The picture of draw(), row by row, so that it can be stopped: a coarse one, and rays over it.
    Result<FrameStats> draw_in_steps(const Scene& scene, const SceneData& data) {
        Result<FrameStats> begun = renderer_->draw(scene, data, CoarseSettings{.px_per_ray = 16});
        if (!begun) // as where the volume does not lie on the device at once
            return renderer_->draw(scene, data);
        FrameStats all = std::move(*begun);
        const uint32_t rows = Renderer::tile_rows(scene);
        double row_ms = kStep_ms;
        for (uint32_t next = 0; next < rows;) {
            if (now_->stop.stop_requested())
                return fail("interrupted after {} of {} rows of tiles", next, rows);
            const double room = std::clamp(kStep_ms / row_ms, 1.0, double(rows - next));
            const auto count = static_cast<uint32_t>(room);
            PALPATE_TRY(const FrameStats step, renderer_->draw(scene, data, TileRows{next, count}));
            row_ms = step.wall_ms / count;
            next += count;
            for (const PassTime& pass : step.passes)
                add_time(all.passes, pass);
        }
        return all;
    }

    Result<void> draw_in_time(const FrameOptions& frames, const Scene& scene, const SceneData& data,
                              Picture& picture) {
        if (!interactive_)
            interactive_.emplace(*renderer_, frames.frame_ms);
        interactive_->set_budget_ms(frames.frame_ms);
        for (;;) {
            PALPATE_TRY(InteractiveFrame drawn, interactive_->draw(scene, data));
            picture.stats = std::move(drawn.frame);
            picture.error_estimate = drawn.error_estimate;
            if (!frames.settle || drawn.complete)
                return {};
            if (now_->stop.stop_requested())
                return fail("interrupted before the picture was of full quality");
        }
    }

    PictureOptions options_;
    std::mutex mutex_;
    std::optional<GpuDevice> device_;
    std::optional<Renderer> renderer_;
    std::optional<Interactive> interactive_;
    const Report* now_ = nullptr;
};

using Vector = std::array<double, 3>;
Vector numbers_of(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

py::dict camera_of(const DrawnScene& drawn) {
    const Camera& c = drawn.opened.scene.camera;
    py::dict out;
    out["eye"] = numbers_of(c.eye_mm);
    out["target"] = numbers_of(c.target_mm);
    out["up"] = numbers_of(c.up);
    out["view_angle"] = c.view_angle_deg;
    out["view_height"] = c.view_height_mm;
    out["orthographic"] = c.projection == Projection::orthographic;
    return out;
}

void set_camera(DrawnScene& drawn, const Vector& eye, const Vector& target, const Vector& up,
                double view_angle, double view_height, bool orthographic) {
    Camera c = drawn.opened.scene.camera;
    c.eye_mm = {eye[0], eye[1], eye[2]};
    c.target_mm = {target[0], target[1], target[2]};
    c.up = {up[0], up[1], up[2]};
    c.view_angle_deg = view_angle;
    c.view_height_mm = view_height;
    c.projection = orthographic ? Projection::orthographic : Projection::perspective;
    Scene changed = drawn.opened.scene;
    changed.camera = c;
    value_of(check_drawable(changed, drawn.opened.loaded.data));
    drawn.opened.scene = std::move(changed);
}

} // namespace

void bind_picture(py::module_& module) {
    py::class_<DrawnScene, ScenePtr>(module, "Scene")
        .def("json",
             [](const DrawnScene& d) {
                 return write_scene(drawn_file(d.opened.file, d.opened.scene));
             })
        .def("camera", camera_of)
        .def("set_camera", set_camera)
        .def("orbit",
             [](DrawnScene& d, double degrees) {
                 d.opened.scene.camera = orbit(d.opened.scene.camera, degrees);
             })
        .def("set_volume", [](DrawnScene& d, const LoadedVolume& volume) {
            Scene& scene = d.opened.scene;
            SceneData data = d.opened.loaded.data;
            data.volume = volume.volume;
            value_of(check_drawable(scene, data));
            d.opened.loaded.data = std::move(data);
        });
    py::class_<Picture, std::shared_ptr<Picture>>(module, "Picture")
        .def_property_readonly("eye_count", [](const Picture& p) { return p.eyes.size(); })
        .def("eye",
             [](const Picture& p, size_t eye) {
                 if (eye >= p.eyes.size())
                     throw Failure(fmt::format("expected one of {} eyes, found number {}",
                                               p.eyes.size(), eye));
                 return floats_of(p.eyes[eye], 0, 4);
             })
        .def("channel", channel_of)
        .def("floats",
             [](const Picture& p) {
                 const Image image = shown_picture(p.look, p.scene, p.eyes, true);
                 return floats_of(image, 0, image.channels.size());
             })
        .def("bytes", bytes_of)
        .def("png",
             [](const Picture& p) {
                 const auto bytes = value_of(
                     encode_png("the picture", shown_picture(p.look, p.scene, p.eyes, true),
                                p.look.dots_per_inch));
                 return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
             })
        .def("save", save_picture)
        .def_readonly("error_estimate", &Picture::error_estimate)
        .def_readonly("ms", &Picture::ms)
        .def_property_readonly("metadata", [](const Picture& p) { return p.metadata; })
        .def_property_readonly("passes", [](const Picture& p) {
            std::vector<std::pair<std::string, double>> passes;
            for (const PassTime& pass : p.stats.passes)
                passes.emplace_back(pass.name, pass.gpu_ms);
            return passes;
        });
    py::class_<FrameRenderer, std::shared_ptr<FrameRenderer>>(module, "Renderer")
        .def(py::init<const py::dict&>())
        .def("render", &FrameRenderer::render)
        .def("close", &FrameRenderer::close, py::call_guard<py::gil_scoped_release>())
        .def_property_readonly("device", &FrameRenderer::device_text);
    module.def("open_scene", open_keywords);
    module.def("preset_names", preset_names);
}

} // namespace palpate::python
