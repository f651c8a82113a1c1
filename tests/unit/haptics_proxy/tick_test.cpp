// Every algorithm owes this to the servo thread; and the loop through a simulated device.

#include <atomic>
#include <cstdlib>
#include <new>

#include "bench/touch/closed_loop.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "haptics/field/field.h"
#include "haptics/proxy/swept_mesh.h"
#include "tests/unit/haptics_proxy/run.h"

namespace {
thread_local bool is_counting = false;
thread_local size_t allocations = 0;
} // namespace

// Counts what a tick allocates. (malloc by C code is not seen; the proxies call none.)
void* operator new(size_t size) {
    allocations += is_counting;
    if (void* p = std::malloc(size ? size : 1))
        return p;
    throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
    std::free(p);
}
void operator delete(void* p, size_t) noexcept {
    std::free(p);
}

namespace palpate::touch {
namespace {

using glm::dvec3;

TEST(Tick, AllocatesNothing) {
    const TouchCase body = flat_plane();
    for (const Form form : {Form::grey_i16, Form::labels}) {
        Scene scene = make_scene(body, {.form = form});
        if (scene.touch.grey)
            scene.touch.touch_mesh = haptics::make_touch_mesh(
                std::make_shared<Mesh>(marching_cubes(*scene.touch.grey, 500.0f)), 1.0);
        haptics::TouchParameters parameters = scene_parameters(scene);
        parameters.source =
            form == Form::labels ? haptics::TouchSource::labels : haptics::TouchSource::grey;
        parameters.tool_radius_mm = 1.5;
        parameters.friction_static = parameters.friction_dynamic = 0.2;
        parameters.yield_n = 2.0;
        parameters.vibration_n = 0.1;
        const Path path = hand(body, 3.0, 0.4, 1);
        for (const haptics::AlgorithmEntry& entry : haptics::algorithms()) {
            const auto algorithm = entry.make();
            haptics::TickInput input{
                .removal = 1.0, .scene = &scene.touch, .parameters = &parameters};
            allocations = 0;
            is_counting = true;
            input.tool.position_mm = path.front();
            algorithm->reset(input);
            for (const dvec3 x : path) {
                input.tool.position_mm = x;
                algorithm->tick(input);
            }
            is_counting = false;
            EXPECT_EQ(allocations, 0u) << entry.name;
        }
    }
}

// Turning scene and hand together turns the forces: nothing knows the world's axes. Lattices stay
// those of the volume, so a rigid motion of its grid changes no sample; what is left is the
// rounding of other products.
TEST(Tick, ForcesTurnWithTheWorld) {
    const TouchCase body = touch_cases({}, false)[3]; // a ball
    const Scene scene = make_scene(body, {});
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.tool_radius_mm = 0.0;
    parameters.normal_blur_samples = 0.6;
    const glm::dmat3 turn = glm::mat3_cast(glm::normalize(glm::dquat(0.8, 0.3, -0.4, 0.2)));
    const dvec3 offset(1000.0, -350.0, 77.0);
    Scene turned = scene;
    Grid grid = scene.touch.grey->grid();
    glm::dmat4 motion(turn);
    motion[3] = glm::dvec4(offset, 1.0);
    grid.world_from_index = motion * grid.world_from_index;
    turned.touch.grey = with_grid(*scene.touch.grey, grid);
    const Path path = hand(body, 1.0, 0.6, 4);
    for (const char* name : {"swept-point", "eriksson-2006", "swept-local"}) {
        const auto a = haptics::find_algorithm(name)->make();
        const auto b = haptics::find_algorithm(name)->make();
        haptics::TickInput here{.scene = &scene.touch, .parameters = &parameters};
        haptics::TickInput there{.scene = &turned.touch, .parameters = &parameters};
        double worst = 0.0;
        for (const dvec3 x : path) {
            here.tool.position_mm = x;
            there.tool.position_mm = turn * x + offset;
            const dvec3 f = a->tick(here).force_n, g = b->tick(there).force_n;
            worst = std::max(worst, glm::distance(turn * f, g));
        }
        EXPECT_LE(worst, 2e-3) << name; // proxies converge to 1e-4 mm; k is 1 N/mm
    }
}

// A bad algorithm would ring: a hand holds a wall through each device at a stiffness it can show.
TEST(ClosedLoop, HoldsStillAndStaysOut) {
    const Scene scene = make_scene(flat_wall(2.0), {});
    for (const haptics::DevicePreset& device : haptics::device_presets()) {
        haptics::TouchParameters parameters = scene_parameters(scene);
        parameters.stiffness_n_per_m = 400.0;
        parameters.damping_n_s_per_m = 0.5;
        parameters.normal_blur_samples = 0.0;
        Path path = press(scene.body, 40.0, 4.0, 1.2);
        path.resize(path.size() - 160);
        const auto algorithm = haptics::find_algorithm("swept-point")->make();
        const LoopResult found =
            closed_loop(*algorithm, scene, path, parameters, {.device = &device, .hand = {}});
        EXPECT_EQ(found.figures.pop_throughs, 0u) << device.name;
        EXPECT_LE(found.limit_cycle_mm, std::max(0.05, 2e3 * device.plant.encoder_step_m))
            << device.name;
        EXPECT_GT(found.settled_force_n, 0.3) << device.name;
        EXPECT_LE(found.work_mj, 0.02) << device.name; // pressed in and held: it took energy
    }
}

// Stiffer is harder to hold: what shakes at one stiffness does not become still at eight times it.
TEST(ClosedLoop, ZWidthEndsSomewhere) {
    const haptics::DevicePreset* device = haptics::find_device_preset("omega");
    ASSERT_NE(device, nullptr);
    const auto cells = z_width("swept-point", *device, 2, 1);
    ASSERT_EQ(cells.size(), 2u);
    EXPECT_TRUE(cells[0].stable) << cells[0].limit_cycle_mm;
}

} // namespace
} // namespace palpate::touch
