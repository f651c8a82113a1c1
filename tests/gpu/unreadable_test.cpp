// Samples that cannot be read while a frame is made: the frame fails with what the source says, and
// the next one, when they can, is what it would have been.

#include <atomic>
#include <cstdlib>

#include "engine/volume/brick_source.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

// The bricks of a volume of floats; all but the first few reads of them fail while `broken`.
struct Sometimes : BrickSource {
    explicit Sometimes(const Volume& volume) {
        for_each_brick(volume, [&](glm::uvec3 p) {
            constexpr size_t bytes = kBrickSamples * sizeof(float);
            const std::shared_ptr<std::byte[]> samples(
                static_cast<std::byte*>(std::aligned_alloc(64, bytes)), std::free);
            volume.brick(p).read(
                std::span(reinterpret_cast<float*>(samples.get()), size_t{kBrickSamples}));
            bricks.push_back(samples);
        });
    }
    SamplesPtr fetch(uint64_t key) const override {
        if (broken && reads++ >= kReadsThatWork)
            throw SourceError("the disk was pulled out");
        return bricks[key];
    }
    static constexpr int kReadsThatWork = 3;
    std::vector<SamplesPtr> bricks;
    mutable std::atomic<int> reads{0};
    std::atomic<bool> broken{true};
};

// `volume` with the samples of its bricks in `source`.
Volume stored_in(const std::shared_ptr<Sometimes>& source, const Volume& volume) {
    VolumeBuilder builder(volume.grid(), ScalarType::f32);
    uint64_t key = 0;
    for_each_brick(volume, [&](glm::uvec3 p) {
        const auto ranges = std::make_shared<BlockRanges>();
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
            (*ranges)[block] = volume.brick(p).block_range(block);
        builder.set_brick(p, Brick::in_source(source, key++, {ScalarType::f32, ranges, 0}));
    });
    return builder.finish();
}

Volume waves() {
    const Grid grid = make_grid({80, 70, 60}, glm::dvec3(1.0), glm::dvec3(-40, -35, -30));
    return synthetic::sample(synthetic::marschner_lobb(40.0), grid, ScalarType::f32);
}

class UnreadableTest : public GpuTest {
 protected:
    UnreadableTest() {
        scene.size_px = {96, 64};
        scene.camera = frame_volume(data.volume.grid(), {-0.45, -1.0, 0.4}, {0, 0, 1});
        scene.ray_cast = RayCastLayer{};
        scene.ray_cast->transfer = window_function(0, 1, 0.1);
    }
    std::vector<float> undisturbed(const RendererOptions& options = {}) {
        source->broken = false;
        Renderer renderer(device(), options);
        return renderer.render(scene, data).value().eyes[0].samples;
    }
    std::shared_ptr<Sometimes> source = std::make_shared<Sometimes>(waves());
    SceneData data{stored_in(source, waves()), std::nullopt};
    Scene scene;
};

TEST_F(UnreadableTest, FramesOfEveryKindBeginAnewAfterwards) {
    for (const Residency residency : {Residency::dense, Residency::atlas}) {
        RendererOptions options;
        options.residency = residency;
        const auto fails_then_draws = [&](auto&& draw) {
            Renderer renderer(device(), options);
            source->broken = true;
            source->reads = 0;
            EXPECT_THROW(draw(renderer), SourceError);
            EXPECT_THROW(draw(renderer), SourceError); // also of what the first one left
            source->broken = false;
            EXPECT_TRUE(renderer.draw(scene, data));
            EXPECT_EQ(renderer.read_back()[0].samples, undisturbed(options));
        };
        fails_then_draws([&](Renderer& r) { (void)r.draw(scene, data); });
        fails_then_draws([&](Renderer& r) { (void)r.draw(scene, data, CoarseSettings{}); });
        fails_then_draws([&](Renderer& r) {
            (void)r.draw(scene, data, TileRows{0, Renderer::tile_rows(scene)});
        });
    }
}

// A part that one view's frame left unsure is so for all that share it.
TEST_F(UnreadableTest, TheOtherViewsBeginAnewToo) {
    source->broken = false;
    Renderer renderer(device()), other(renderer.store());
    ASSERT_TRUE(other.draw(scene, data));
    source->broken = true;
    source->reads = 0;
    const SceneData again{stored_in(source, waves()), std::nullopt};
    EXPECT_THROW((void)renderer.draw(scene, again), SourceError);
    source->broken = false;
    for (Renderer* view : {&other, &renderer}) {
        ASSERT_TRUE(view->draw(scene, again));
        EXPECT_EQ(view->read_back()[0].samples, undisturbed());
    }
}

// Upload memory that was taken and never filled must not keep the frames after from theirs.
TEST_F(UnreadableTest, AnEditThatCannotBeReadLeavesTheNextOnesRight) {
    source->broken = false;
    Renderer renderer(device());
    ASSERT_TRUE(renderer.draw(scene, data));
    const glm::uvec3 at(40, 30, 30);
    for (int round = 0; round < 3; ++round) {
        VolumeEdit edit(data.volume);
        edit.set(at, 0.1 * round);
        const Volume edited = edit.commit();
        const auto away = std::make_shared<Sometimes>(edited);
        away->reads = Sometimes::kReadsThatWork;
        VolumeBuilder builder(edited.grid(), ScalarType::f32);
        for_each_brick(edited, [&](glm::uvec3 p) {
            builder.set_brick(p, p == at / kBrickSide ? stored_in(away, edited).brick_ptr(p)
                                                      : edited.brick_ptr(p));
        });
        data.volume = builder.finish();
        EXPECT_THROW((void)renderer.draw(scene, data, CoarseSettings{}), SourceError);
        away->broken = false;
        ASSERT_TRUE(renderer.draw(scene, data));
        EXPECT_EQ(renderer.read_back()[0].samples, undisturbed());
    }
}

} // namespace
} // namespace palpate
