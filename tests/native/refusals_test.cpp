// Things that the private driver does not have, and how it stands beside the system's drivers.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>

#include "engine/native/driver/driver.h"
#include "engine/native/driver/functions.h"
#include "engine/native/level.h"
#include "tests/native/native_fixture.h"
#include "tests/support/paths.h"

namespace palpate {
namespace {

using testing::HasSubstr;

class NativeRefusals : public NativeTest {};

// Text that a call wrote to standard error.
template <class Call>
std::string said(const Call& call) {
    testing::internal::CaptureStderr();
    call();
    return testing::internal::GetCapturedStderr();
}

TEST_F(NativeRefusals, AFunctionThatIsNotThereSaysItsName) {
    VkPipelineCache cache = VK_NULL_HANDLE;
    EXPECT_THAT(said([&] {
                    EXPECT_EQ(vkCreatePipelineCache(device().handle(), nullptr, nullptr, &cache),
                              VK_ERROR_FEATURE_NOT_PRESENT);
                }),
                HasSubstr("vkCreatePipelineCache is not there"));
}

TEST_F(NativeRefusals, ACommandThatCannotBeRecordedFailsItsCommandBuffer) {
    RawCommands commands(device());
    EXPECT_THAT(said([&] { vkCmdDrawIndexed(commands.handle(), 3, 1, 0, 0, 0); }),
                HasSubstr("vkCmdDrawIndexed: expected a target"));
    EXPECT_EQ(vkEndCommandBuffer(commands.handle()), VK_ERROR_FEATURE_NOT_PRESENT);
}

TEST_F(NativeRefusals, AShaderWithoutNativeCodeIsNamedByItsHash) {
    constexpr uint32_t kWords[] = {0x07230203, 1, 2, 3, 4};
    const VkShaderModuleCreateInfo create{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                          .codeSize = sizeof kWords,
                                          .pCode = kWords};
    VkShaderModule module = VK_NULL_HANDLE;
    ASSERT_EQ(vkCreateShaderModule(device().handle(), &create, nullptr, &module), VK_SUCCESS);
    const VkComputePipelineCreateInfo info{
        .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                  .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                  .module = module,
                  .pName = "main"}};
    VkPipeline pipeline = VK_NULL_HANDLE;
    EXPECT_THAT(said([&] {
                    EXPECT_EQ(vkCreateComputePipelines(device().handle(), VK_NULL_HANDLE, 1, &info,
                                                       nullptr, &pipeline),
                              VK_ERROR_FEATURE_NOT_PRESENT);
                }),
                HasSubstr("no native code for the shader"));
    EXPECT_EQ(pipeline, VkPipeline{VK_NULL_HANDLE});
    vkDestroyShaderModule(device().handle(), module, nullptr);
}

TEST_F(NativeRefusals, ImagesOfOtherKindsAreRefusedInASentence) {
    VkImageCreateInfo info{.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                           .imageType = VK_IMAGE_TYPE_2D,
                           .format = VK_FORMAT_R8_UNORM,
                           .extent = {4, 4, 1},
                           .mipLevels = 2,
                           .arrayLayers = 1,
                           .samples = VK_SAMPLE_COUNT_1_BIT,
                           .usage = VK_IMAGE_USAGE_SAMPLED_BIT};
    const auto why = [&] {
        return said([&] {
            VkImage image = VK_NULL_HANDLE;
            EXPECT_EQ(vkCreateImage(device().handle(), &info, nullptr, &image),
                      VK_ERROR_FEATURE_NOT_PRESENT);
        });
    };
    EXPECT_THAT(why(), HasSubstr("expected one mip level and one sample a texel, found 2 and 1"));
    info.mipLevels = 1;
    info.format = VK_FORMAT_D32_SFLOAT;
    EXPECT_THAT(why(), HasSubstr("the format 126 is not there"));
    info.format = VK_FORMAT_R8_UNORM;
    info.extent = {4, 20000, 1};
    EXPECT_THAT(why(), HasSubstr("4 x 20000 x 1 texels in 1 layers are more than"));
}

TEST_F(NativeRefusals, FeaturesThatAreNotThereFailTheDevice) {
    const VkPhysicalDeviceFeatures wanted{.geometryShader = VK_TRUE};
    const VkDeviceCreateInfo create{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                    .pEnabledFeatures = &wanted};
    VkDevice made = VK_NULL_HANDLE;
    EXPECT_THAT(said([&] {
                    EXPECT_EQ(vkCreateDevice(device().physical(), &create, nullptr, &made),
                              VK_ERROR_FEATURE_NOT_PRESENT);
                }),
                HasSubstr("vkCreateDevice: the feature at 4"));
}

// A pool says when it is full, and takes what is given back: the engine adds pools by that.
TEST_F(NativeRefusals, AFullDescriptorPoolSaysSo) {
    const VkDescriptorSetLayoutBinding binding{
        .binding = 3, .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, .descriptorCount = 1};
    const VkDescriptorSetLayoutCreateInfo layout_info{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
        .bindingCount = 1,
        .pBindings = &binding};
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2};
    const VkDescriptorPoolCreateInfo pool_info{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
        .maxSets = 5,
        .poolSizeCount = 1,
        .pPoolSizes = &size};
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    ASSERT_EQ(vkCreateDescriptorSetLayout(device().handle(), &layout_info, nullptr, &layout),
              VK_SUCCESS);
    ASSERT_EQ(vkCreateDescriptorPool(device().handle(), &pool_info, nullptr, &pool), VK_SUCCESS);
    const auto take = [&] {
        const VkDescriptorSetAllocateInfo allocate{
            .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
            .descriptorPool = pool,
            .descriptorSetCount = 1,
            .pSetLayouts = &layout};
        VkDescriptorSet set = VK_NULL_HANDLE;
        return vkAllocateDescriptorSets(device().handle(), &allocate, &set);
    };
    for (int turn = 0; turn < 2; ++turn) {
        EXPECT_EQ(take(), VK_SUCCESS);
        EXPECT_EQ(take(), VK_SUCCESS);
        EXPECT_EQ(take(), VK_ERROR_OUT_OF_POOL_MEMORY);
        EXPECT_EQ(vkResetDescriptorPool(device().handle(), pool, 0), VK_SUCCESS);
    }
    vkDestroyDescriptorPool(device().handle(), pool, nullptr);
    vkDestroyDescriptorSetLayout(device().handle(), layout, nullptr);
}

TEST_F(NativeRefusals, MoreThanTheHeapIsRefusedByItsName) {
    try {
        const Buffer buffer(device(), "a great buffer", uint64_t{1} << 50, Memory::device);
        FAIL() << "expected no memory";
    } catch (const GpuError& error) {
        EXPECT_NE(std::string(error.what()).find("a great buffer"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("VK_ERROR_OUT_OF_DEVICE_MEMORY"),
                  std::string::npos);
    }
}

TEST_F(NativeRefusals, DevicesOfBothKindsServeOneProcess) {
    const std::vector<DeviceInfo> all = list_devices();
    ASSERT_GE(all.size(), 2u) << "a driver of the system, lavapipe at the least";
    EXPECT_THAT(all.back().name, HasSubstr("palpate native"));
    EXPECT_EQ(all.back().refusal, "");
    EXPECT_FALSE(native::is_native(GpuDevice({.select = "0"}).handle()));
    EXPECT_TRUE(native::is_native(device().handle()));
    GpuDevice other({.select = "0"}); // made while the private one is there
    for (GpuDevice* each : {&other, &device(), &other}) {
        Buffer buffer(*each, "buffer", 4, Memory::device);
        const uint32_t word[] = {each == &other ? 1u : 2u};
        Commands commands(*each);
        commands.fill(buffer, word);
        const BufferSlice back = commands.read_back(buffer);
        commands.submit();
        commands.ticket().wait();
        EXPECT_EQ(static_cast<uint32_t>(back.mapped()[0]), word[0]);
    }
}

TEST_F(NativeRefusals, AnUnknownLevelIsNamed) {
    ASSERT_EQ(setenv("PALPATE_NATIVE_LEVEL", "avx3", 1), 0);
    try {
        GpuDevice({.select = "palpate native"});
        ADD_FAILURE() << "expected no device";
    } catch (const GpuError& error) {
        EXPECT_STREQ(error.what(),
                     "PALPATE_NATIVE_LEVEL: expected sse2, avx2 or avx512, found avx3");
    }
    ASSERT_EQ(unsetenv("PALPATE_NATIVE_LEVEL"), 0);
    EXPECT_EQ(native::level_refusal(), "");
}

// Without a line in functions.h a function's pointer is null: the first call ends the program.
TEST_F(NativeRefusals, EveryFunctionThatTheProgramsCallIsListed) {
    std::set<std::string> listed = {"vkCreateInstance", "vkEnumerateInstanceExtensionProperties",
                                    "vkEnumerateInstanceLayerProperties"};
#define PALPATE_NAME(name) listed.insert(#name);
    PALPATE_VULKAN_FUNCTIONS(PALPATE_NAME)
#undef PALPATE_NAME
    const std::regex call(R"(\bvk[A-Z]\w+(?=\())");
    size_t calls = 0;
    for (const char* folder : {"engine/gpu", "apps"})
        for (const auto& entry : std::filesystem::recursive_directory_iterator(
                 std::filesystem::path(kSourceDir) / folder)) {
            if (entry.path().extension() != ".cpp" && entry.path().extension() != ".h")
                continue;
            std::ifstream file(entry.path());
            const std::string text{std::istreambuf_iterator<char>(file), {}};
            for (std::sregex_iterator found(text.begin(), text.end(), call), end; found != end;
                 ++found, ++calls)
                EXPECT_TRUE(listed.contains(found->str())) << entry.path() << ": " << found->str();
        }
    EXPECT_GT(calls, 100u);
}

} // namespace
} // namespace palpate
