#include "haptics/proxy/algorithms.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "engine/mesh/mesh.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate::haptics {
namespace {

TEST(Algorithms, EachIsFoundByItsOwnName) {
    std::set<std::string> names;
    for (const AlgorithmEntry& entry : algorithms()) {
        EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
        EXPECT_EQ(find_algorithm(entry.name), &entry);
        EXPECT_NE(entry.make(), nullptr) << entry.name;
    }
    EXPECT_EQ(find_algorithm("no-such-algorithm"), nullptr);
}

TEST(Algorithms, EachFeelsNothingWhereThereIsNothing) {
    const TouchScene scene;
    const TouchParameters parameters;
    for (const AlgorithmEntry& entry : algorithms()) {
        const std::unique_ptr<Algorithm> algorithm = entry.make();
        TickInput input{.scene = &scene, .parameters = &parameters};
        algorithm->reset(input);
        for (int i = 0; i < 10; ++i) {
            input.tool.position_mm = glm::dvec3(i, 2, 3);
            const TickOutput out = algorithm->tick(input);
            EXPECT_NE(out.contact, Contact::touching) << entry.name;
            EXPECT_EQ(out.force_n, glm::dvec3(0)) << entry.name;
        }
    }
}

// Solid below z = 0, with a field that rises with z.
TouchScene floor_scene() {
    const Grid grid = make_grid({24, 24, 24}, glm::dvec3(1.0), glm::dvec3(-11.5));
    TouchScene scene;
    scene.grey = make_volume(grid, ScalarType::f32, [](glm::uvec3 at) {
        return glm::clamp(12.0 - static_cast<double>(at.z), 0.0, 1.0);
    });
    for (size_t axis = 0; axis < 3; ++axis)
        scene.field[axis] = make_volume(
            grid, ScalarType::f32, [](glm::uvec3 at) { return static_cast<double>(at.z) - 11.5; });
    scene.touch_mesh =
        make_touch_mesh(std::make_shared<Mesh>(marching_cubes(*scene.grey, 0.5f)), 1.0);
    return scene;
}

// All that a hand feels which presses into the floor, mills and slides on.
std::vector<double> felt(const AlgorithmEntry& entry, const TouchScene& scene,
                         const TouchParameters& parameters) {
    const std::unique_ptr<Algorithm> algorithm = entry.make();
    TickInput input{.removal = 0.5, .scene = &scene, .parameters = &parameters};
    input.tool.position_mm = {0.3, 0.2, 2.0};
    algorithm->reset(input);
    std::vector<double> all;
    for (int ms = 0; ms < 400; ++ms) {
        const glm::dvec3 step_mm = ms < 200 ? glm::dvec3(0, 0, -0.03) : glm::dvec3(0.02, 0, 0);
        input.tool.position_mm += step_mm;
        input.velocity_mm_per_s = 1e3 * step_mm;
        const TickOutput out = algorithm->tick(input);
        for (const glm::dvec3 v : {out.force_n, out.proxy.position_mm})
            all.insert(all.end(), {v.x, v.y, v.z});
        all.push_back(static_cast<double>(out.carving));
    }
    return all;
}

// A setting whose bit an entry lacks changes nothing that is felt. Where it has the bit, this one
// path need not show it: a tool that slides from its first tick on never meets static friction.
TEST(Algorithms, ReadNoSettingsButThoseThatTheirBitsName) {
    const TouchScene scene = floor_scene();
    TouchParameters usual;
    usual.tool_radius_mm = 0.6;
    usual.friction_static = 0.4;
    usual.friction_dynamic = 0.2;
    usual.yield_n = 0.8;
    usual.viscosity_n_s_per_m = usual.air_drag_n_s_per_m = 1.0;
    usual.vibration_n = 0.1;
    usual.drill_threshold_mm = 0.5;
    usual.transfer[0] = {.strength_n = 1.0, .center = 0.5, .width = 0.1};
    size_t shown = 0;
    for (const AlgorithmEntry& entry : algorithms()) {
        const std::vector<double> before = felt(entry, scene, usual);
        for (const Setting<TouchParameters>& setting : kTouchSettings) {
            if (setting.use.of == 0)
                continue;
            TouchParameters other = usual;
            set(setting, other, 1.5 * value_of(setting, usual));
            const bool differs = felt(entry, scene, other) != before;
            EXPECT_FALSE(differs && !entry.takes(setting.use.of))
                << entry.name << " " << setting.key;
            shown += differs;
        }
    }
    EXPECT_GE(shown, 20u); // the path is no empty one
}

TEST(Algorithms, AreNamedByTheBeginningThatTheyShare) {
    EXPECT_EQ(takers_text(kTakesTool), "swept-tool");
    EXPECT_EQ(takers_text(kTakesTransfer), "wish-2008-*");
    EXPECT_EQ(takers_text(kTakesAcross), "wish-2008-surface* and wish-2008-viscosity");
    EXPECT_EQ(takers_text(kTakesOpacity), "koerner-1999, swept-mesh and swept-local");
}

} // namespace
} // namespace palpate::haptics
