// Dispatches of the private driver, by kernels that are written by hand.

#include <array>
#include <numeric>

#include "engine/gpu/pipeline.h"
#include "probe_words.h"
#include "seen_words.h"
#include "tests/native/native_fixture.h"
#include "tests/native/probe_kernel.h"

namespace palpate {
namespace {

constexpr BindingSlot kProbeSlots[] = {{0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 0, "counts"},
                                       {1, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 4, "added"}};
constexpr ShaderConstant kProbeConstants[] = {{7, "step", 1}};
constexpr ShaderCode kProbe{"probe", kProbeWords, kProbeSlots, kProbeConstants};
constexpr BindingSlot kSeenSlots[] = {{0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 0, "told"},
                                      {2, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 0, "volume"},
                                      {3, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 0, "picture"}};
constexpr ShaderCode kSeen{"seen", kSeenWords, kSeenSlots, {}};

class NativeLaunch : public NativeTest {
 protected:
    using Counts = std::array<uint32_t, 512>; // of groups, 8 a side

    // Counts of the kernel in the groups of one dispatch, each as often as it ran times `step`
    // times `added`. With `indirect`, the numbers of groups come from a buffer.
    static Counts count(glm::uvec3 groups, glm::uvec3 first, bool indirect, uint32_t step = 1,
                        uint32_t added = 1) {
        ComputePipeline pipeline(device(), Shader{&kProbe, {step}});
        Buffer counts(device(), "counts", sizeof(Counts), Memory::device);
        Buffer numbers(device(), "groups", 32, Memory::device);
        const uint32_t words[] = {9, groups.x, groups.y, groups.z};
        Commands commands(device());
        const Bound bound[] = {bind_storage(0, counts, Use::storage_write),
                               bind_uniform(1, commands.upload(bytes_of(added)))};
        commands.zero(counts);
        if (indirect) {
            commands.fill(numbers, words); // by the commands themselves, just before
            commands.dispatch_indirect(pipeline, bound, numbers, 1);
        } else {
            commands.dispatch(pipeline, bound, groups, first);
        }
        const BufferSlice back = commands.read_back(counts);
        commands.submit();
        commands.ticket().wait();
        Counts found;
        std::memcpy(found.data(), back.mapped().data(), sizeof found);
        return found;
    }

    static Counts expected(glm::uvec3 groups, glm::uvec3 first, uint32_t each = 1) {
        Counts counts{};
        for (uint32_t z = first.z; z < first.z + groups.z; ++z)
            for (uint32_t y = first.y; y < first.y + groups.y; ++y)
                for (uint32_t x = first.x; x < first.x + groups.x; ++x)
                    counts[x + 8 * (y + 8 * z)] = each;
        return counts;
    }
};

TEST_F(NativeLaunch, EveryGroupRunsOnce) {
    for (const glm::uvec3 groups : {glm::uvec3(1), glm::uvec3(8, 1, 1), glm::uvec3(3, 5, 7),
                                    glm::uvec3(8), glm::uvec3(0, 3, 3)}) {
        SCOPED_TRACE(groups.x);
        EXPECT_EQ(count(groups, {}, false), expected(groups, {}));
        EXPECT_EQ(count(groups, {}, true), expected(groups, {}));
    }
}

TEST_F(NativeLaunch, GroupsAreNumberedFromTheFirst) {
    EXPECT_EQ(count({2, 3, 4}, {5, 4, 1}, false), expected({2, 3, 4}, {5, 4, 1}));
}

TEST_F(NativeLaunch, ConstantsAndUniformBuffersReachTheKernel) {
    EXPECT_EQ(count({2, 2, 2}, {}, false, 3, 5), expected({2, 2, 2}, {}, 15));
    EXPECT_EQ(count({2, 2, 2}, {}, true, 4, 7), expected({2, 2, 2}, {}, 28));
}

TEST_F(NativeLaunch, KernelsAreGivenImagesAsTheirViewsShowThem) {
    using namespace native_probe;
    const ImageShape solid{
        .type = VK_IMAGE_TYPE_3D, .format = VK_FORMAT_R32_SFLOAT, .size = {5, 3, 4}};
    const ImageShape layered{
        .format = VK_FORMAT_R32G32B32A32_SFLOAT, .size = {6, 2, 1}, .layers = 3, .storage = true};
    std::vector<uint32_t> voxels(60), pixels(144);
    std::iota(voxels.begin(), voxels.end(), 1000u);
    std::iota(pixels.begin(), pixels.end(), 2000u);
    for (const SampleFilter filter : {SampleFilter::nearest, SampleFilter::linear}) {
        const bool is_linear = filter == SampleFilter::linear;
        const Sampler sampler(device(), filter, is_linear ? Edge::clamp : Edge::border_zero);
        GpuImage volume(device(), "volume", solid), picture(device(), "picture", layered);
        Buffer told(device(), "told", kTold * 4, Memory::device);
        ComputePipeline pipeline(device(), Shader{&kSeen});
        const Commands::Region all{.buffer_offset = 0, .image_offset = {}, .size = solid.size};
        const Commands::Region layers{
            .buffer_offset = 0, .image_offset = {}, .size = layered.size, .layers = 3};
        Commands commands(device());
        commands.copy(commands.upload(std::as_bytes(std::span(voxels))), volume, {&all, 1});
        commands.copy(commands.upload(std::as_bytes(std::span(pixels))), picture, {&layers, 1});
        const Bound bound[] = {bind_storage(0, told, Use::storage_write),
                               bind_sampled(2, volume, sampler), bind_storage_image(3, picture)};
        commands.dispatch(pipeline, bound, {1, 1, 1});
        const BufferSlice back = commands.read_back(told);
        commands.submit();
        commands.ticket().wait();
        std::array<uint32_t, kTold> found;
        std::memcpy(found.data(), back.mapped().data(), sizeof found);
        EXPECT_EQ(found[kVolumeWidth], 5u);
        EXPECT_EQ(found[kVolumeHeight], 3u);
        EXPECT_EQ(found[kVolumeDepth], 4u);
        EXPECT_EQ(found[kVolumeIsLinear], is_linear ? 1u : 0u);
        EXPECT_EQ(found[kVolumeIsClampedToBorder], is_linear ? 0u : 1u);
        EXPECT_EQ(found[kVolumeLast], 1059u);
        EXPECT_EQ(found[kPictureWidth], 6u);
        EXPECT_EQ(found[kPictureHeight], 2u);
        EXPECT_EQ(found[kPictureLayers], 3u);
        EXPECT_EQ(found[kPictureIsArray], 1u);
        EXPECT_EQ(found[kPictureLast], 2143u);
    }
}

} // namespace
} // namespace palpate
