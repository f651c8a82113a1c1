// Functions by name.

#include <cstring>
#include <mutex>
#include <string_view>

#include "engine/base/log.h"
#include "engine/native/driver/api.h"
#include "engine/native/driver/driver.h"
#include "engine/native/driver/objects.h"

namespace palpate::native {

namespace driver {

namespace {

const char kOurWord = 0;                       // whose address begins the handles
constexpr uintptr_t kLoadersWord = 0x01CDC0DE; // as <vulkan/vk_icd.h> asks
const void* first = &kOurWord;                 // word of handles that are made

struct Name {
    std::string_view text;
    PFN_vkVoidFunction function;
};

// Stands for a function that the driver lacks.
template <int place, class Function>
struct Refused;
template <int place, class Returned, class Handle, class... Arguments>
struct Refused<place, Returned(VKAPI_PTR*)(Handle, Arguments...)> {
    static inline const char* name = nullptr;
    static VKAPI_ATTR Returned VKAPI_CALL call(Handle handle, Arguments...) {
        complain(fmt::format("{} is not there", name));
        if constexpr (std::is_same_v<Handle, VkCommandBuffer>)
            of<CommandBuffer>(handle)->failure = name;
        if constexpr (!std::is_void_v<Returned>)
            return VK_ERROR_FEATURE_NOT_PRESENT;
    }
};

template <int place, class Function>
PFN_vkVoidFunction refused(const char* name) {
    Refused<place, Function>::name = name;
    return reinterpret_cast<PFN_vkVoidFunction>(Refused<place, Function>::call);
}

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info,
                                               const VkAllocationCallbacks*, VkInstance* out) {
    if (info->enabledLayerCount > 0)
        return VK_ERROR_LAYER_NOT_PRESENT;
    for (uint32_t i = 0; i < info->enabledExtensionCount; ++i)
        if (std::strcmp(info->ppEnabledExtensionNames[i], VK_EXT_DEBUG_UTILS_EXTENSION_NAME) != 0)
            return VK_ERROR_EXTENSION_NOT_PRESENT;
    return create(out, [] { return std::make_unique<Instance>(); });
}

VKAPI_ATTR VkResult VKAPI_CALL enumerate_extensions(const char* layer, uint32_t* count,
                                                    VkExtensionProperties* out) {
    if (layer)
        return VK_ERROR_LAYER_NOT_PRESENT;
    if (out && *count > 0)
        out[0] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_DEBUG_UTILS_SPEC_VERSION};
    const bool is_short = out && *count == 0;
    *count = is_short ? 0 : 1;
    return is_short ? VK_INCOMPLETE : VK_SUCCESS;
}

VKAPI_ATTR VkResult VKAPI_CALL enumerate_layers(uint32_t* count, VkLayerProperties*) {
    *count = 0;
    return VK_SUCCESS;
}

VKAPI_ATTR VkResult VKAPI_CALL enumerate_version(uint32_t* out) {
    *out = VK_API_VERSION_1_3;
    return VK_SUCCESS;
}

const std::vector<Name>& names() {
    static const std::vector<Name> all = {
        {"vkCreateInstance", reinterpret_cast<PFN_vkVoidFunction>(create_instance)},
        {"vkEnumerateInstanceExtensionProperties",
         reinterpret_cast<PFN_vkVoidFunction>(enumerate_extensions)},
        {"vkEnumerateInstanceLayerProperties",
         reinterpret_cast<PFN_vkVoidFunction>(enumerate_layers)},
        {"vkEnumerateInstanceVersion", reinterpret_cast<PFN_vkVoidFunction>(enumerate_version)},
        {"vkGetInstanceProcAddr", reinterpret_cast<PFN_vkVoidFunction>(get_instance_proc_addr)},
#define PALPATE_NAME(name) {#name, reinterpret_cast<PFN_vkVoidFunction>(api::name)},
        PALPATE_DRIVER_FUNCTIONS(PALPATE_NAME)
#undef PALPATE_NAME
#define PALPATE_NAME(name) {#name, refused<__COUNTER__, PFN_##name>(#name)},
            PALPATE_REFUSED_FUNCTIONS(PALPATE_NAME)
#undef PALPATE_NAME
    };
    return all;
}

} // namespace

const void* Dispatchable::first_word() {
    return first;
}

void complain(const std::string& sentence) {
    log::error("palpate native: {}", sentence);
}

namespace api {

void vkDestroyInstance(VkInstance instance, const VkAllocationCallbacks*) {
    delete of<Instance>(instance);
}

VkResult vkCreateDebugUtilsMessengerEXT(VkInstance, const VkDebugUtilsMessengerCreateInfoEXT*,
                                        const VkAllocationCallbacks*,
                                        VkDebugUtilsMessengerEXT* out) {
    return create(out, [] { return std::make_unique<Messenger>(); });
}

void vkDestroyDebugUtilsMessengerEXT(VkInstance, VkDebugUtilsMessengerEXT messenger,
                                     const VkAllocationCallbacks*) {
    delete of<Messenger>(messenger);
}

PFN_vkVoidFunction vkGetDeviceProcAddr(VkDevice, const char* name) {
    return get_instance_proc_addr(nullptr, name);
}

} // namespace api
} // namespace driver

PFN_vkVoidFunction VKAPI_CALL get_instance_proc_addr(VkInstance, const char* name) {
    for (const driver::Name& known : driver::names())
        if (known.text == name)
            return known.function;
    return nullptr;
}

bool is_native(const void* dispatchable) {
    return dispatchable && *static_cast<const void* const*>(dispatchable) == &driver::kOurWord;
}

void serve_the_loader() {
    driver::first = reinterpret_cast<const void*>(driver::kLoadersWord);
}

} // namespace palpate::native
