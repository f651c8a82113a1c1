// Everything that lives while a volume is carved, at once: the servo's thread feels the newest
// snapshot and pushes poses, the editor cuts, one thread meshes what changed and one draws it.
// PALPATE_SECONDS is how long the random work lasts at least; it also lasts until every thread has
// met edits, however slow the machine. Meant for the thread sanitizer.

#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "engine/base/profile.h"
#include "engine/edit/edit_lag.h"
#include "engine/edit/editor.h"
#include "engine/edit/stroke.h"
#include "engine/surface/block_surface.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/content_hash.h"
#include "haptics/servo/servo_thread.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/unit/haptics_servo/bench_loop.h"

namespace palpate {
namespace {

using Reader = EditLag::Reader;

constexpr float kIso = 250.0f;
constexpr size_t kFewestFrames = 12;   // of each kind of drawing some, by random
constexpr size_t kFewestSnapshots = 3; // seen by the picture and by the mesh
constexpr double kLongest_s = 240.0;   // of the hand's path; the test is ended soon after

class EditThreads : public GpuTest {
 protected:
    static Volume ball() { return *haptics::ball_scene(72).grey; }

    static Scene iso_scene() {
        Scene scene;
        scene.size_px = {48, 48};
        scene.camera.eye_mm = {60, 40, 30};
        scene.camera.view_angle_deg = 35.0;
        scene.ray_cast.emplace();
        scene.ray_cast->mode = RayMode::iso;
        scene.ray_cast->isos = {{kIso}};
        return scene;
    }

    // A hand that wanders in and about the ball.
    static haptics::HandPath wandering(double seconds) {
        std::mt19937 random(1);
        std::uniform_real_distribution<double> place(-13.0, 13.0);
        std::vector<haptics::HandPose> poses;
        for (double t = 0; t <= seconds; t += 0.1)
            poses.push_back(
                {.time_s = t,
                 .tool = {.position_mm = {place(random), place(random), place(random)}}});
        return haptics::HandPath(std::move(poses));
    }

    // Presses and lifts the tool at random ticks; on the servo's thread.
    class Pusher {
     public:
        explicit Pusher(Editor& editor) : editor_(editor) {}
        void operator()(const haptics::ServoTick& tick) {
            const bool edge = --left_ <= 0;
            const auto kind = !down_ ? EditInput::Kind::down
                              : edge ? EditInput::Kind::up
                                     : EditInput::Kind::move;
            if (!down_ && !edge)
                return;
            if (edge)
                left_ = 3 + static_cast<int>(random_() % 60);
            const StrokePose pose{1e-9 * static_cast<double>(tick.now_ns),
                                  {tick.tool.position_mm, tick.tool.rotation}};
            if (!editor_.push({kind, pose, number_ + 1, profile::now_ns()}))
                return; // full: tried again with the next tick's pose
            ++number_;
            if (edge)
                down_ = !down_;
        }
        bool down() const { return down_; }
        uint64_t pushed() const { return number_; }

     private:
        Editor& editor_;
        std::mt19937 random_{2};
        bool down_ = false;
        int left_ = 5;
        uint64_t number_ = 0;
    };

    static void use_some_tool(Editor& editor, std::mt19937& random) {
        static const char* const kShapes[] = {
            R"({"kind": "ball", "radius_mm": 2})",
            R"({"kind": "burr", "radius_mm": 3, "flutes": 6})",
            R"({"kind": "capsule", "radius_mm": 1, "length_mm": 4})"};
        Json shape = *parse_json(kShapes[random() % 3], "");
        Operation operation;
        operation.kind = random() % 2 ? OperationKind::cut : OperationKind::mill;
        operation.to_value = random() % 2 ? 0.0 : 500.0; // removes, or adds
        operation.rates = {{0.0, 20000.0}};
        const Stroke stroke = make_stroke(std::move(shape), operation, {{}});
        (void)editor.use(stroke.shape, stroke.tool, stroke.operation); // full: the next one then
    }
};

TEST_F(EditThreads, HandEyeAndMeshFollowTheEditorForARandomWhile) {
    const Volume first = ball();
    const double seconds = PALPATE_SECONDS;
    haptics::Loop loop{{.grey = first, .version = 0},
                       {.iso = kIso},
                       std::make_unique<haptics::WallAlgorithm>(),
                       std::make_unique<haptics::RecordedDevice>(
                           haptics::DeviceCapabilities{.workspace_m = glm::dvec3(0.05)},
                           records_of_path(wandering(seconds + kLongest_s),
                                           haptics::Workspace({0, 0, 0}, 1), haptics::kTick_ns),
                           profile::now_ns())};
    Editor editor(first, {.slice_ms = 1.0});
    auto mesh_reader = editor.add_reader(), frame_reader = editor.add_reader();
    EditLag lag;
    std::mt19937 random(3);
    use_some_tool(editor, random);

    Pusher pusher(editor);
    std::atomic<bool> stopping = false;
    haptics::ServoThread servo(loop.servo, {.after = [&](const haptics::ServoTick& tick) {
                                   haptics::ToolStamp stamp;
                                   loop.poses.pop(stamp);
                                   lag.feels(tick.scene_version);
                                   if (!stopping || pusher.down())
                                       pusher(tick);
                                   return !stopping || pusher.down(); // never mid-stroke
                               }});
    // Hands each snapshot to the servo, and meshes what changed.
    BlockSurface surface(first, kIso);
    std::jthread mesher([&](const std::stop_token& stop) {
        for (uint64_t done = 0; !stop.stop_requested();) {
            const auto pin = mesh_reader.pin();
            if (pin->snapshot == done) {
                std::this_thread::yield();
                continue;
            }
            done = pin->snapshot;
            loop.scenes.publish(std::make_unique<const haptics::TouchScene>(
                haptics::TouchScene{.grey = pin->volume(), .version = done}));
            surface.update(pin->volume());
            lag.reached(Reader::mesh, *pin, profile::now_ns());
        }
    });

    Renderer renderer(device());
    const Scene scene = iso_scene();
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    size_t frames = 0;
    bool edited = false; // a picture has shown another volume than the first
    const auto has_met = [&](Reader reader) {
        return lag.latency_ms(reader).count >= kFewestSnapshots;
    };
    while ((std::chrono::steady_clock::now() < end || frames < kFewestFrames || !edited ||
            !has_met(Reader::picture) || !has_met(Reader::mesh)) &&
           !HasFailure()) {
        const auto pin = frame_reader.pin();
        const SceneData data{pin->volume(), std::nullopt};
        switch (random() % 4) {
            case 0: {
                const uint32_t rows = Renderer::tile_rows(scene);
                ASSERT_TRUE(
                    renderer.refine(scene, data, static_cast<uint32_t>(random() % rows), 1));
                break;
            }
            case 1:
                ASSERT_TRUE(renderer.draw_coarse(scene, data, {}));
                break;
            default:
                ASSERT_TRUE(renderer.draw(scene, data));
        }
        lag.reached(Reader::picture, *pin, profile::now_ns());
        ++frames;
        edited = edited || content_hash(pin->volume()) != content_hash(first);
        if (random() % 3 == 0)
            use_some_tool(editor, random);
        if (random() % 8 == 0)
            (void)(random() % 2 ? editor.undo() : editor.redo());
    }
    stopping = true;
    while (!servo.ended())
        std::this_thread::yield();
    servo.stop();
    while (frame_reader.pin()->inputs_done < pusher.pushed())
        std::this_thread::yield();
    mesher.request_stop();
    mesher.join();

    // What each of them holds at the end is what one who begins now would hold.
    const Volume last = frame_reader.pin()->volume();
    surface.update(last);
    const Mesh mesh = surface.mesh(), fresh_mesh = marching_cubes(last, kIso);
    EXPECT_EQ(mesh.positions, fresh_mesh.positions);
    EXPECT_EQ(mesh.triangles, fresh_mesh.triangles);
    Renderer fresh(device());
    const Result<Frame> picture = renderer.render(scene, {last, std::nullopt});
    const Result<Frame> expected = fresh.render(scene, {last, std::nullopt});
    ASSERT_TRUE(picture && expected);
    EXPECT_EQ(picture->eyes[0].samples, expected->eyes[0].samples);
    std::printf("    %zu ticks, %zu inputs, %zu frames, %zu strokes standing; %s\n",
                size_t(loop.servo.telemetry().ticks.load()), size_t(pusher.pushed()), frames,
                frame_reader.pin()->strokes_done, json_line(lag.json()).c_str());
}

} // namespace
} // namespace palpate
