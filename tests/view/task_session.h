#pragma once

#include <nlohmann/json.hpp>

#include <set>
#include <thread>

#include "apps/view/window/replay.h"
#include "engine/base/timer.h"
#include "engine/io/volume_io.h"
#include "engine/program/open_scene.h"
#include "engine/volume/builder.h"
#include "tests/support/paths.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {

// The fifty tasks of docs/benchmarks/tasks.md: each is a recorded session in tests/view/tasks, done
// by the program without its window from the state that the row has at its start. A test compares
// the end with arithmetic on what the session names, or with the volume itself.
class Task : public ViewerTest {
 protected:
    void SetUp() override {
        ViewerTest::SetUp();
        std::filesystem::create_directories(folder_);
        before_ = std::filesystem::current_path();
        std::filesystem::current_path(folder_); // the folder that the chooser shows first
    }
    void TearDown() override {
        window_.reset();
        ViewerTest::TearDown();
        std::filesystem::current_path(before_);
        std::filesystem::remove_all(folder_);
    }

    // A head CT that says it is one: skull, brain and vessels about 0 (synthetic::ct_phantom()).
    static OpenedScene head(uint32_t size = 41) {
        return as_ct(open_synthetic(fmt::format("synthetic:phantom?size={}", size)));
    }
    static OpenedScene as_ct(OpenedScene scene) {
        scene.loaded.modality = "CT";
        scene.scene.ray_cast = default_ray_cast(RayMode::alpha, scene.loaded);
        return scene;
    }
    // A scene of a volume that is made in the test, and of labels on it.
    static OpenedScene scene_of_volume(Volume volume, std::optional<Volume> labels = {}) {
        LoadedScene loaded{.data = {.volume = std::move(volume)}};
        loaded.data.labels = std::move(labels);
        loaded.modality = "CT";
        Scene scene;
        scene.size_px = {400, 300};
        scene.ray_cast = default_ray_cast(RayMode::alpha, loaded);
        if (loaded.data.labels)
            scene.labels.emplace();
        scene.camera = default_camera(scene, loaded.data);
        return {{}, std::move(loaded), std::move(scene)};
    }

    // A skull of 6 mm about a brain of 0 HU and an organ of 100 HU, a ball of 16 mm; air outside.
    // The middle lies at sample (n - 1) / 2. Values have a noise of 10 HU to each side.
    static constexpr double kOrgan_mm = 16.0, kSkull_mm = 28.0, kSkullOut_mm = 34.0;
    static Volume skull(uint32_t n, double spacing_mm) {
        const double first_mm = -0.5 * (n - 1) * spacing_mm;
        const Grid grid = make_grid(glm::uvec3(n), glm::dvec3(spacing_mm), glm::dvec3(first_mm));
        return make_volume(grid, ScalarType::i16, [grid](glm::uvec3 at) {
            const double r = glm::length(world_point(grid, glm::dvec3(at)));
            const double noise = (at.x * 7u + at.y * 13u + at.z * 29u) % 21u - 10.0;
            return noise + (r <= kOrgan_mm      ? 100.0
                            : r < kSkull_mm     ? 0.0
                            : r <= kSkullOut_mm ? 1200.0
                                                : -1000.0);
        });
    }
    template <class LabelAt>
    static Volume label_map(const Volume& volume, const LabelAt& label_at) {
        return make_volume(volume.grid(), ScalarType::u8,
                           [&](glm::uvec3 at) { return double(label_at(at)); });
    }

    // asks: nothing is open but the phantom to try, and the list of files. writes: with threads, so
    // that files are written.
    void begin(OpenedScene scene, bool asks = false, bool writes = false) {
        ViewerOptions options{.threaded = writes};
        options.asks_for_file = asks;
        options.open = [](const std::string& path, const std::string& series,
                          const std::stop_token& stop,
                          const std::function<void(double)>&) { return open(path, series, stop); };
        options.open_beside = [](const std::string& path, bool labels, const std::stop_token& stop,
                                 const std::function<void(double)>&) {
            const ReadOptions how = read_options({}, stop);
            return labels ? load_labels(path, how) : load_volume(path, how);
        };
        options.recent = [this](const std::string&) { return recent_; };
        writes_ = writes;
        window_.emplace(device(), device(), VK_FORMAT_R8G8B8A8_UNORM, Source{std::move(scene)},
                        glm::uvec2(1280, 800), 1.0, std::move(options));
        frame({});
    }

    // Plays the session of this name from tests/view/tasks. What takes a while on threads is waited
    // for after each event, as a person does.
    void play(const std::string& name) {
        const auto path =
            std::filesystem::path(kSourceDir) / "tests/view/tasks" / (name + ".jsonl");
        const Result<Script> script = load_script(path);
        ASSERT_TRUE(script) << script.error().message;
        ASSERT_EQ(script->size_px, viewer().state().size_px);
        ScriptCursor cursor(*script);
        const double from_s = time_s_ + 1.0; // no double click with a session before
        while (!cursor.is_done()) {
            const uint64_t number = cursor.next().frame;
            Result<std::vector<Event>> events = cursor.take(number, viewer());
            ASSERT_TRUE(events) << events.error().message;
            time_s_ = from_s + events->back().time_s;
            for (Event& event : *events)
                event.time_s = time_s_;
            window_->frame(std::move(*events), time_s_);
            for (uint64_t i = 0; i < kSettling_frames; ++i)
                frame({});
            wait();
            if (window_->is_done()) // the program ended, and is started again
                begin(open_synthetic("synthetic:phantom?size=24"), /*asks=*/true, writes_);
            if (state().alone)
                were_alone_.insert(*state().alone);
        }
    }

    Viewer& viewer() { return *window_; }
    const ViewState& state() { return window_->state(); }
    const Grid& grid() { return window_->grid(); }
    const EditState& edited() { return edited_.emplace(window_->work().edited()); }
    nlohmann::json dump() { return nlohmann::json::parse(json_line(window_->dump())); }
    bool has_widget(const std::string& id) const {
        return window_->interface().widgets().contains(id);
    }
    Volume grey() { return window_->work().grey(); }
    Volume labels() { return window_->work().labels().value(); }
    double value_at(glm::uvec3 at) { return sample(grey(), at); }
    static double sample(const Volume& volume, glm::uvec3 at) { return volume.value(at); }
    // Each sample with this label.
    template <class Each>
    void for_each_labelled(uint16_t label, const Each& each) {
        const Volume map = labels();
        const glm::uvec3 size = map.size();
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    if (map.value({x, y, z}) == label)
                        each(glm::uvec3(x, y, z));
    }
    size_t count(uint16_t label) {
        size_t found = 0;
        for_each_labelled(label, [&](glm::uvec3) { ++found; });
        return found;
    }
    glm::dvec3 mm(glm::dvec3 at) { return world_point(grid(), at); }
    const std::filesystem::path& folder() const { return folder_; }
    std::string text_of(const std::filesystem::path& path) const {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }

    std::vector<std::string> recent_; // what was opened last
    std::set<Panel> were_alone_;      // views that have filled the window

 private:
    static Result<Source> open(const std::string& path, const std::string& series,
                               const std::stop_token& stop) {
        if (Project::is_one(path)) {
            SceneOptions options;
            options.input = path;
            PALPATE_TRY(OpenedScene scene, palpate::open_scene(options, {}, stop));
            PALPATE_TRY(Project::Opened project, Project::open(path));
            PALPATE_TRY(add_maps(project));
            Source source{std::move(scene)};
            source.project.emplace(std::move(project));
            return source;
        }
        SceneOptions options;
        options.input = path;
        ReadFlags read;
        read.series = series;
        PALPATE_TRY(OpenedScene scene, palpate::open_scene(options, read, stop));
        return Source{std::move(scene)};
    }
    void frame(std::vector<Event> events) { window_->frame(std::move(events), time_s_); }
    bool is_busy() {
        Work& work = window_->work();
        return !state().opening.empty() || work.saving().is_saving() ||
               work.mesh_writing().share() || work.label_export().is_writing() ||
               work.segmentation().share() || state().figure.share ||
               work.edited().commands_done < work.session().commands_given();
    }
    void wait() {
        if (!writes_)
            return;
        window_->work().session().settle();
        for (const Timer timer; is_busy(); frame({})) {
            ASSERT_LT(timer.ms(), 60e3);
            std::this_thread::yield();
        }
        frame({});
    }

    std::filesystem::path before_, folder_ = std::filesystem::temp_directory_path() /
                                             fmt::format("palpate.Task.{}", ::getpid());
    std::optional<Viewer> window_;
    std::optional<EditState> edited_;
    bool writes_ = false;
    double time_s_ = 1.0;
};

} // namespace palpate::view
