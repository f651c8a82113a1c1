#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bench/touch/open_loop.h"
#include "bench/touch/special_cases.h"
#include "haptics/proxy/algorithms.h"
#include "tests/unit/haptics_falcon/held_falcon.h"

// The closed loop of `palpate bench touch` through the Falcon's driver and the bytes of its model,
// beside the same loop on a simulated Falcon without them.
namespace palpate::haptics::falcon {
namespace {

using touch::LoopResult;

struct Sums {
    uint64_t cells = 0, pop_throughs = 0, not_finite = 0, restless = 0;
    double penetration_voxels = 0.0, force_n = 0.0, limit_cycle_mm = 0.0, made_steps = 0.0;

    void add(const LoopResult& r, bool is_held, bool is_edited, double step_m) {
        ++cells;
        pop_throughs += r.figures.pop_throughs;
        not_finite += r.figures.not_finite;
        penetration_voxels = std::max(penetration_voxels, r.figures.penetration_voxels);
        force_n = std::max(force_n, r.figures.largest_force_n);
        if (is_held)
            limit_cycle_mm = std::max(limit_cycle_mm, r.limit_cycle_mm);
        // As the suite judges energy: in steps of the encoder under the largest force sent.
        if (const double step_mj = 1e3 * r.largest_sent_n * step_m; step_mj > 0.0 && !is_edited)
            made_steps = std::max(made_steps, (r.work_mj + r.held_mj) / step_mj);
    }
    std::string text() const {
        return fmt::format(
            "{} cells: {} passed through, {} not finite, proxy at most {:.4f} voxels deep, force "
            "at "
            "most {:.2f} N, limit cycle at most {:.1f} um, energy made {:.2f} encoder steps",
            cells, pop_throughs, not_finite, penetration_voxels, force_n, 1e3 * limit_cycle_mm,
            made_steps);
    }
};

TEST(FalconGrid, TheDriverKeepsTheBoundsOfTheLoopWithoutIt) {
    const DevicePreset& preset = *find_device_preset("falcon");
    DevicePreset late = preset; // forces that act a tick later, as the cable makes them
    late.plant.delay_ticks = 1;
    late.capabilities.delay_s = touch::kTick_s;
    for (const char* name : {"swept-point", "swept-tool", "swept-local"}) {
        Sums plain, delayed, driver;
        const AlgorithmEntry* entry = find_algorithm(name);
        ASSERT_TRUE(entry) << name;
        const touch::Storage storage;
        std::vector<touch::TouchCase> cases = touch::touch_cases(storage, false);
        for (touch::TouchCase& body : touch::special_cases(storage))
            if (body.why_not.empty() && body.felt_by.empty())
                cases.push_back(std::move(body));
        for (const touch::TouchCase& body : cases) {
            const touch::Scene scene = touch::make_scene(body, storage);
            TouchParameters parameters = touch::scene_parameters(scene);
            parameters.stiffness_n_per_m = 500.0; // what every device holds still
            if (entry->name == std::string_view("swept-tool")) {
                parameters.tool_radius_mm = 1.5 * touch::voxel_mm(storage);
                parameters.tool_samples = 340;
            }
            std::string last;
            for (touch::Trajectory& path : touch::trajectories(body, 1500, 1, false)) {
                if (path.id == last || path.id.size() != 2 || path.id > "T6")
                    continue;
                last = path.id;
                const bool is_held = path.id == "T1";
                if (is_held)
                    path.path = touch::press(body, 40.0, 0.75 * body.deepest_mm, 0.8);
                for (glm::dvec3& x : path.path)
                    x += parameters.tool_radius_mm * body.normal;
                const auto algorithm = entry->make();
                touch::Loop loop{.device = &preset, .hand = {}, .is_controlled = true};
                const auto run = [&] {
                    return touch::closed_loop(*algorithm, scene, path.path, parameters, loop);
                };
                const double step_m = preset.capabilities.resolution_m;
                const bool is_edited = !body.edits.empty();
                plain.add(run(), is_held, is_edited, step_m);
                loop.device = &late;
                delayed.add(run(), is_held, is_edited, step_m);
                loop.make_held = [](const HandPath& hand_path, const HandModel& hand) {
                    return std::make_unique<HeldFalcon>(hand_path, hand);
                };
                driver.add(run(), is_held, is_edited, step_m);
            }
        }
        fmt::print("{0}, without: {1}\n{0}, a tick later: {2}\n{0}, through the driver: {3}\n",
                   name, plain.text(), delayed.text(), driver.text());
        EXPECT_GT(driver.cells, 100u);
        EXPECT_EQ(driver.pop_throughs, plain.pop_throughs);
        EXPECT_EQ(driver.not_finite, 0u);
        // The proxy knows no device: as deep wherever the hand goes.
        EXPECT_LE(driver.penetration_voxels, plain.penetration_voxels + 0.01);
        // The hand gets farther by one tick more of delay and two steps of the encoders.
        const double step_n = 500.0 * 2.0 * preset.capabilities.resolution_m;
        EXPECT_LE(driver.force_n, 1.1 * plain.force_n + step_n);
        // Energy: as the suite judges it without a cable, two steps of the encoder.
        EXPECT_LE(plain.made_steps, 2.0);
        EXPECT_LE(driver.made_steps, 2.0);
        EXPECT_LE(driver.limit_cycle_mm,
                  std::max(0.05, plain.limit_cycle_mm + 2e3 * preset.capabilities.resolution_m));
    }
}

} // namespace
} // namespace palpate::haptics::falcon
