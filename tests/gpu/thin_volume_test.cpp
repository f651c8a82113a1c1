// Volumes one sample thick.

#include <fmt/format.h>

#include <cmath>

#include "engine/reference/twin.h"
#include "engine/volume/builder.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

class ThinVolume : public GpuTest {
 protected:
    Image drawn(const Scene& scene, const Volume& volume) {
        return renderer.render(scene, {volume, std::nullopt, {}}).value().eyes.front();
    }
    Renderer renderer{device()};
    // Bright in the first half of its longest axis.
    static double value(glm::uvec3 at, glm::uvec3 size) {
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        return 2 * at[axis] < size[axis] ? 1000.0 : 200.0;
    }
};

// The same samples in two layers half a spacing to either side, which need no thickness.
TEST_F(ThinVolume, IsDrawnAsThickAsItsSamplesAreWide) {
    const glm::dvec3 spacing(2.0, 1.0, 3.0);
    for (const glm::uvec3 size : {glm::uvec3(1, 1, 20), {20, 1, 1}, {1, 12, 9}}) {
        Grid grid = make_grid(size, spacing);
        const Volume thin =
            make_volume(grid, ScalarType::i16, [=](glm::uvec3 at) { return value(at, size); });
        for (int axis = 0; axis < 3; ++axis)
            if (size[axis] == 1) {
                grid.size[axis] = 2;
                grid.world_from_index[3][axis] -= 0.5 * spacing[axis];
            }
        const Volume layers = make_volume(grid, ScalarType::i16, [=](glm::uvec3 at) {
            return value(glm::min(at, size - 1u), size);
        });
        Scene scene;
        scene.size_px = {48, 48};
        scene.camera = frame_volume(grid, {-0.45, -1.0, 0.4}, {0, 0, 1}, 0.7);
        scene.slice_transfer = window_function(0.0, 1000.0, 1.0);
        std::vector<Scene> scenes;
        for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
            scenes.push_back(scene);
            scenes.back().ray_cast = RayCastLayer{};
            scenes.back().ray_cast->mode = mode;
            scenes.back().ray_cast->transfer = window_function(0.0, 1000.0, 1.0);
            scenes.back().ray_cast->isos = {IsoSurface{600.0}};
            if (mode == RayMode::iso) // of a line of samples it is no larger than one
                scenes.back().camera = frame_volume(grid, {-0.45, -1.0, 0.4}, {0, 0, 1}, 0.2);
        }
        for (const glm::dvec3 normal : {glm::dvec3(1, 0, 0), {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}) {
            scenes.push_back(scene);
            scenes.back().camera = frame_volume(grid, normal, {0.1, 0.2, 0.3}, 0.7);
            scenes.back().slices = {SliceLayer{center_mm(grid), normal}};
        }
        for (const Scene& one : scenes) {
            const Image found = drawn(one, thin);
            EXPECT_EQ(found.samples, drawn(one, layers).samples);
            const Image twin = render_twin(one, {thin, std::nullopt, {}});
            double brightest = 0.0;
            size_t beyond = 0;
            for (uint32_t y = 0; y < 48; ++y)
                for (uint32_t x = 0; x < 48; ++x) {
                    brightest = std::max(brightest, double{found.at(x, y, 0)});
                    beyond += std::abs(double{found.at(x, y, 0)} - double{twin.at(x, y, 0)}) > 0.02;
                }
            const std::string what =
                fmt::format("{} x {} x {}, scene {}", size.x, size.y, size.z, &one - scenes.data());
            EXPECT_GT(brightest, 0.1) << what;
            EXPECT_LE(beyond, size_t{48 * 48 / 20}) << what; // at rims
        }
    }
}

} // namespace
} // namespace palpate
