#include "engine/gpu/pipeline.h"

#include <volk.h>

#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/gpu/error.h"

namespace palpate {

namespace {

VkPipeline create(VkDevice device, const std::string& name, std::span<const uint32_t> spirv,
                  std::span<const uint32_t> constants, VkPipelineLayout layout) {
    std::vector<VkSpecializationMapEntry> entries;
    for (uint32_t i = 0; i < constants.size(); ++i)
        entries.push_back({i, i * 4, 4});
    const VkSpecializationInfo specialization{static_cast<uint32_t>(entries.size()), entries.data(),
                                              constants.size_bytes(), constants.data()};
    const VkShaderModuleCreateInfo module_info{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                               .codeSize = spirv.size_bytes(),
                                               .pCode = spirv.data()};
    VkShaderModule module = VK_NULL_HANDLE;
    check(vkCreateShaderModule(device, &module_info, nullptr, &module),
          "reading the shader of " + name);
    const VkComputePipelineCreateInfo info{
        .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .flags = VK_PIPELINE_CREATE_DISPATCH_BASE_BIT,
        .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                  .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                  .module = module,
                  .pName = "main",
                  .pSpecializationInfo = &specialization},
        .layout = layout};
    profile::Scope scope("create a pipeline");
    if (scope.recorded())
        scope.tell("pipeline", Json::of(name));
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult result =
        vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
    vkDestroyShaderModule(device, module, nullptr);
    check(result, "creating the pipeline " + name);
    return pipeline;
}

} // namespace

ComputePipeline::ComputePipeline(GpuDevice& device, std::string name,
                                 std::span<const uint32_t> spirv,
                                 std::span<const BindingSlot> slots,
                                 std::span<const uint32_t> constants)
    : device_(&device), name_(std::move(name)), slots_(slots.begin(), slots.end()) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (const BindingSlot& slot : slots)
        bindings.push_back({.binding = slot.binding,
                            .descriptorType = slot.type,
                            .descriptorCount = 1,
                            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT});
    const VkDescriptorSetLayoutCreateInfo set{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
        .bindingCount = static_cast<uint32_t>(bindings.size()),
        .pBindings = bindings.data()};
    check(vkCreateDescriptorSetLayout(device.handle(), &set, nullptr, &set_layout_),
          "creating the bindings of " + name_);
    const VkPipelineLayoutCreateInfo layout{.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                            .setLayoutCount = 1,
                                            .pSetLayouts = &set_layout_};
    check(vkCreatePipelineLayout(device.handle(), &layout, nullptr, &layout_),
          "creating the layout of " + name_);
    device.created().objects += 4; // with its shader module and itself

    creation_ = std::async(
        std::launch::async,
        [device = device.handle(), name = name_, spirv,
         constants = std::vector<uint32_t>(constants.begin(), constants.end()), layout = layout_] {
            const Timer timer;
            const VkPipeline pipeline = create(device, name, spirv, constants, layout);
            return Created{pipeline, timer.ms()};
        });
    entry_ = device.enter({name_, "pipeline", 0});
}

VkPipeline ComputePipeline::handle() const {
    if (handle_ == VK_NULL_HANDLE) {
        const Timer timer;
        const Created created = creation_.get();
        wait_ms_ = timer.ms();
        handle_ = created.handle;
        creation_ms_ = created.ms;
        device_->name_object(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<uint64_t>(handle_), name_);
    }
    return handle_;
}

ComputePipeline::~ComputePipeline() {
    device_->leave(entry_);
    try {
        handle_ = creation_.get().handle; // nobody may have asked for it
    } catch (...) {                       // nor need know that it failed
    }
    device_->retire(
        [device = device_->handle(), pipeline = handle_, layout = layout_, set = set_layout_] {
            vkDestroyPipeline(device, pipeline, nullptr);
            vkDestroyPipelineLayout(device, layout, nullptr);
            vkDestroyDescriptorSetLayout(device, set, nullptr);
        });
}

} // namespace palpate
