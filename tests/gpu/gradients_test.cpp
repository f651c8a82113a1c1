// Stored gradients: what six samples give, in one.

#include <cmath>

#include "engine/render/gradient_image.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

float float_of(uint16_t half) { // no subnormals, no infinities
    if ((half & 0x7fffu) > 0x7c00u)
        return std::nanf("");
    if ((half & 0x7c00u) == 0)
        return 0.0f;
    const float size = std::ldexp(1.0f + static_cast<float>(half & 0x3ffu) / 1024.0f,
                                  static_cast<int>(half >> 10 & 0x1fu) - 15);
    return half & 0x8000u ? -size : size;
}

// A ball of soft edge on a grid of unequal spacing, 45 x 40 x 37 samples: two bricks each way.
Volume soft_ball() {
    const Grid grid = make_grid({45, 40, 37}, {0.8, 0.9, 1.1}, {-18, -18, -20});
    return make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
        return std::round(1000.0 - 60.0 * glm::length(world_point(grid, glm::dvec3(i))));
    });
}

Scene scene_of(const Volume& volume) {
    Scene scene;
    scene.size_px = {96, 96};
    scene.camera.target_mm = center_mm(volume.grid());
    scene.camera.eye_mm = scene.camera.target_mm + glm::dvec3(70, -50, 40);
    scene.camera.view_angle_deg = 25.0;
    RayCastLayer layer;
    layer.transfer.colors = {{300, {1, 0.8, 0.6}}, {1000, glm::dvec3(1)}};
    layer.transfer.opacities = {{300, 0.0}, {400, 1.0}};
    layer.shading = Shading{};
    scene.ray_cast = layer;
    return scene;
}

bool holds_gradients(GpuDevice& device) {
    for (const ResourceInfo& resource : device.resources())
        if (resource.name == "gradients")
            return true;
    return false;
}

TEST(StoreGradients, AreCentralDifferencesToElevenBits) {
    const Grid grid = make_grid({45, 40, 3}, {1, 2, 3});
    const Volume volume = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        const uint32_t hash = (i.x * 73856093u) ^ (i.y * 19349663u) ^ (i.z * 83492791u);
        return hash % 97 == 0 ? std::nan("") : static_cast<double>(hash % 1000) * 1e-3;
    });
    const float scale = 32768.0f;
    std::vector<uint16_t> texels(4 * kBrickSamples);
    size_t gaps = 0;
    for_each_brick(volume, [&](glm::uvec3 brick) {
        store_gradients(volume, brick, scale, texels.data());
        const glm::uvec3 valid = volume.valid_in_brick(brick);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const glm::ivec3 at(brick * kBrickSide + glm::uvec3(x, y, z));
                    for (int axis = 0; axis < 3; ++axis) {
                        glm::ivec3 ahead = at, behind = at;
                        ahead[axis] = std::min(at[axis] + 1, int(volume.size()[axis]) - 1);
                        behind[axis] = std::max(at[axis] - 1, 0);
                        const float exact = scale * (volume.value(glm::uvec3(ahead)) -
                                                     volume.value(glm::uvec3(behind)));
                        const float found = float_of(texels[4 * offset_in_brick({x, y, z}) + axis]);
                        gaps += std::isnan(exact);
                        ASSERT_EQ(std::isnan(found), std::isnan(exact));
                        if (std::isnan(exact))
                            continue;
                        ASSERT_LE(std::abs(found - exact),
                                  std::max(std::abs(exact) * 0x1p-11f, 0x1p-14f));
                    }
                }
    });
    EXPECT_GT(gaps, 0u);
}

class GradientsTest : public GpuTest {};

// If gradients of neighbours point nearly one way, rounding turns a gradient by at most 2^-11,
// and light changes by at most diffuse + specular * shininess, below 2.8, times the cosine's
// change.
TEST_F(GradientsTest, GiveThePictureThatSixSamplesGive) {
    const Volume volume = soft_ball();
    for (const Integrator integrator :
         {Integrator::fast, Integrator::preintegrated, Integrator::exact}) {
        Scene scene = scene_of(volume);
        scene.ray_cast->integrator = integrator;
        Renderer taps(device()), stored(device(), {.stored_gradients = true});
        const Result<Frame> a = taps.render(scene, {volume, std::nullopt});
        EXPECT_FALSE(holds_gradients(device()));
        const Result<Frame> b = stored.render(scene, {volume, std::nullopt});
        EXPECT_TRUE(holds_gradients(device()));
        ASSERT_TRUE(a && b);
        double largest = 0.0;
        size_t lit = 0;
        for (size_t i = 0; i < a->eyes[0].samples.size(); ++i) {
            largest =
                std::max<double>(largest, std::abs(a->eyes[0].samples[i] - b->eyes[0].samples[i]));
            lit += a->eyes[0].samples[i] > 0.3f;
        }
        EXPECT_LE(largest, 2.8 * 0x1p-11);
        EXPECT_GT(lit, 1000u);
    }
}

TEST_F(GradientsTest, FollowAnEditAcrossBricksToTheBit) {
    const Volume volume = soft_ball();
    const Scene scene = scene_of(volume);
    VolumeEdit edit(volume);
    for (uint32_t y = 12; y < 20; ++y)
        for (uint32_t z = 14; z < 20; ++z)
            edit.set({32, y, z}, 900.0); // the first samples of the second brick
    const Volume after = edit.commit();
    Renderer followed(device(), {.stored_gradients = true});
    Renderer anew(device(), {.stored_gradients = true});
    const Result<Frame> before = followed.render(scene, {volume, std::nullopt});
    const Result<Frame> a = followed.render(scene, {after, std::nullopt});
    const Result<Frame> b = anew.render(scene, {after, std::nullopt});
    ASSERT_TRUE(before && a && b);
    EXPECT_NE(before->eyes[0].samples, a->eyes[0].samples);
    EXPECT_EQ(a->eyes[0].samples, b->eyes[0].samples);
}

// A volume of another type, too: nothing of the first may shade it.
TEST_F(GradientsTest, AreTakenAnewForAnotherVolume) {
    const Volume first = soft_ball();
    const Volume second = make_volume(first.grid(), ScalarType::f32, [&](glm::uvec3 i) {
        return 1000.0 - 30.0 * world_point(first.grid(), glm::dvec3(i)).x;
    });
    Renderer followed(device(), {.stored_gradients = true});
    Renderer anew(device(), {.stored_gradients = true});
    ASSERT_TRUE(followed.render(scene_of(first), {first, std::nullopt}));
    const Result<Frame> a = followed.render(scene_of(first), {second, std::nullopt});
    const Result<Frame> b = anew.render(scene_of(first), {second, std::nullopt});
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->eyes[0].samples, b->eyes[0].samples);
}

// Another transfer function shows other bricks.
TEST_F(GradientsTest, AreFilledWhereSomethingBecomesVisible) {
    const Volume volume = soft_ball();
    Scene hidden = scene_of(volume);
    hidden.ray_cast->transfer.opacities = {{950, 0.0}, {990, 1.0}};
    Renderer followed(device(), {.stored_gradients = true});
    Renderer anew(device(), {.stored_gradients = true});
    ASSERT_TRUE(followed.render(hidden, {volume, std::nullopt}));
    const Result<Frame> a = followed.render(scene_of(volume), {volume, std::nullopt});
    const Result<Frame> b = anew.render(scene_of(volume), {volume, std::nullopt});
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->eyes[0].samples, b->eyes[0].samples);
}

TEST_F(GradientsTest, AreLeftOutWhereTheyDoNotFit) {
    const Volume volume = soft_ball();
    const uint64_t used = device().resource_bytes();
    Renderer small(device(),
                   {.memory_limit_bytes = used + (uint64_t{4} << 20), .stored_gradients = true});
    ASSERT_TRUE(small.render(scene_of(volume), {volume, std::nullopt}));
    EXPECT_FALSE(holds_gradients(device()));
}

} // namespace
} // namespace palpate
