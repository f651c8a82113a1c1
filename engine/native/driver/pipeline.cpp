// Shader modules are known by a hash of their words; pipelines run the kernel of that hash.

#include <algorithm>
#include <cstring>

#include "engine/native/driver/api.h"
#include "engine/native/driver/objects.h"

namespace palpate::native::driver {

namespace {

// The values of a kernel's constants: the pipeline's, else the shader's own.
std::vector<uint32_t> constants_of(const Kernel& kernel, const VkSpecializationInfo* info) {
    std::vector<uint32_t> values;
    for (const Constant& constant : kernel.constants) {
        uint32_t bits = constant.bits;
        for (uint32_t i = 0; info && i < info->mapEntryCount; ++i)
            if (info->pMapEntries[i].constantID == constant.id)
                std::memcpy(
                    &bits, static_cast<const std::byte*>(info->pData) + info->pMapEntries[i].offset,
                    std::min(sizeof bits, info->pMapEntries[i].size));
        values.push_back(bits);
    }
    return values;
}

VkResult create_one(const VkComputePipelineCreateInfo& info, VkPipeline* out) {
    const uint64_t hash = of<ShaderModule>(info.stage.module)->hash;
    const Kernel* kernel = find_kernel(hash);
    if (!kernel)
        return refuse(
            "vkCreateComputePipelines: the program holds no native code for the shader {:016x}",
            hash);
    return create(out, [&] {
        auto pipeline = std::make_unique<Pipeline>();
        pipeline->kernel = kernel;
        pipeline->constants = constants_of(*kernel, info.stage.pSpecializationInfo);
        return pipeline;
    });
}

} // namespace

namespace api {

VkResult vkCreateShaderModule(VkDevice, const VkShaderModuleCreateInfo* info,
                              const VkAllocationCallbacks*, VkShaderModule* out) {
    const uint64_t hash = hash_of({info->pCode, info->codeSize / sizeof(uint32_t)});
    return create(out, [&] { return std::make_unique<ShaderModule>(ShaderModule{hash}); });
}

void vkDestroyShaderModule(VkDevice, VkShaderModule module, const VkAllocationCallbacks*) {
    delete of<ShaderModule>(module);
}

VkResult vkCreateComputePipelines(VkDevice, VkPipelineCache, uint32_t count,
                                  const VkComputePipelineCreateInfo* infos,
                                  const VkAllocationCallbacks*, VkPipeline* out) {
    std::fill_n(out, count, VkPipeline{});
    VkResult first_failure = VK_SUCCESS;
    for (uint32_t i = 0; i < count; ++i)
        if (const VkResult result = create_one(infos[i], &out[i]);
            result != VK_SUCCESS && first_failure == VK_SUCCESS)
            first_failure = result;
    return first_failure;
}

void vkDestroyPipeline(VkDevice, VkPipeline pipeline, const VkAllocationCallbacks*) {
    delete of<Pipeline>(pipeline);
}

} // namespace api
} // namespace palpate::native::driver
