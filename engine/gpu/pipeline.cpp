#include "engine/gpu/pipeline.h"

#include <fmt/format.h>
#include <volk.h>

#include <vector>

#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/gpu/error.h"

namespace palpate {

namespace {

VkPipeline create(VkDevice device, const std::string& name, const Shader& shader,
                  VkPipelineLayout layout) {
    std::vector<VkSpecializationMapEntry> entries;
    for (const ShaderConstant& constant : shader.code->constants)
        entries.push_back({constant.id, static_cast<uint32_t>(entries.size() * 4), 4});
    const VkSpecializationInfo specialization{static_cast<uint32_t>(entries.size()), entries.data(),
                                              sizeof shader.constants, shader.constants.data()};
    const std::span<const uint32_t> spirv = shader.code->words;
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
        scope.tell("pipeline", name);
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult result =
        vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
    vkDestroyShaderModule(device, module, nullptr);
    check(result, "creating the pipeline " + name);
    return pipeline;
}

} // namespace

std::string Shader::name() const {
    std::string name = code->name;
    for (size_t i = 0; i < code->constants.size(); ++i)
        if (constants[i] != code->constants[i].bits)
            name += fmt::format(" {}={}", code->constants[i].name, constants[i]);
    return name;
}

ComputePipeline::ComputePipeline(GpuDevice& device, const Shader& shader)
    : device_(&device), name_(shader.name()), slots_(shader.code->slots) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (const BindingSlot& slot : slots_)
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

    creation_ = std::async(std::launch::async,
                           [device = device.handle(), name = name_, shader, layout = layout_] {
                               const Timer timer;
                               const VkPipeline pipeline = create(device, name, shader, layout);
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

ComputePipeline& PipelineCache::get(const Shader& shader) {
    return made_.try_emplace(shader, *device_, shader).first->second;
}

double PipelineCache::creation_ms() const {
    double sum = 0;
    for (const auto& [shader, pipeline] : made_)
        sum += pipeline.creation_ms();
    return sum;
}

double PipelineCache::wait_ms() const {
    double sum = 0;
    for (const auto& [shader, pipeline] : made_)
        sum += pipeline.wait_ms();
    return sum;
}

} // namespace palpate
