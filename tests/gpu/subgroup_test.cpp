// Which devices are refused.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "engine/gpu/instance.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

TEST(Devices, WithoutAnOperationOfSubgroupsAreRefusedByItsName) {
    constexpr VkShaderStageFlags compute = VK_SHADER_STAGE_COMPUTE_BIT;
    EXPECT_EQ(subgroup_refusal(VK_SHADER_STAGE_ALL, ~0u), "");
    EXPECT_EQ(subgroup_refusal(compute, kSubgroupOperations), "");
    EXPECT_THAT(subgroup_refusal(VK_SHADER_STAGE_FRAGMENT_BIT, ~0u), HasSubstr("compute shaders"));
    for (uint32_t bit = 1; bit <= kSubgroupOperations; bit <<= 1)
        EXPECT_EQ(subgroup_refusal(compute, kSubgroupOperations & ~bit).empty(),
                  !(kSubgroupOperations & bit));
    EXPECT_EQ(subgroup_refusal(compute, kSubgroupOperations & ~VK_SUBGROUP_FEATURE_VOTE_BIT),
              "votes of subgroups are missing");
}

// The capabilities GroupNonUniform, 61, to GroupNonUniformQuad, 68, of SPIR-V are, in this order,
// the bits of VkSubgroupFeatureFlagBits.
TEST(Devices, ShadersUseTheOperationsOfSubgroupsThatAreAskedForAndNoOther) {
    VkSubgroupFeatureFlags used = 0;
    size_t shaders = 0;
    for (const char* folder : {PALPATE_RENDER_SPIRV, PALPATE_EXTRACT_SPIRV})
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
            if (entry.path().extension() != ".spv")
                continue;
            ++shaders;
            std::ifstream in(entry.path(), std::ios::binary);
            std::vector<uint32_t> words(entry.file_size() / sizeof(uint32_t));
            in.read(reinterpret_cast<char*>(words.data()),
                    static_cast<std::streamsize>(words.size() * sizeof(uint32_t)));
            constexpr uint32_t capability = 17; // OpCapability; these come first, behind the header
            for (size_t at = 5; at + 1 < words.size() && (words[at] & 0xffff) == capability;
                 at += 2)
                if (words[at + 1] >= 61 && words[at + 1] <= 68)
                    used |= 1u << (words[at + 1] - 61);
        }
    EXPECT_GT(shaders, 0u);
    EXPECT_EQ(used, kSubgroupOperations);
}

} // namespace
} // namespace palpate
