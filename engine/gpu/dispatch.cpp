#include "engine/gpu/dispatch.h"

#include <volk.h>

#include <algorithm>
#include <mutex>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/native/driver/driver.h"
#include "engine/native/driver/functions.h"
#include "engine/native/kernel.h"

namespace palpate {

namespace {

PFN_vkGetInstanceProcAddr loader = nullptr; // null where the system has none

// A function of Vulkan, of whichever driver its first argument belongs to. `place` tells functions
// of one type apart.
template <int place, class Function>
struct Either;
template <int place, class Returned, class Handle, class... Arguments>
struct Either<place, Returned(VKAPI_PTR*)(Handle, Arguments...)> {
    using Function = Returned(VKAPI_PTR*)(Handle, Arguments...);
    static inline Function systems = nullptr, ours = nullptr;
    static VKAPI_ATTR Returned VKAPI_CALL call(Handle handle, Arguments... arguments) {
        return (native::is_native(handle) ? ours : systems)(handle, arguments...);
    }
};

// Loads both pointers of an Either; what the system lacks stays.
template <class One>
void load(VkInstance instance, const char* name) {
    using Function = typename One::Function;
    One::ours = reinterpret_cast<Function>(native::get_instance_proc_addr(nullptr, name));
    if (!loader || !instance)
        return;
    const auto found = reinterpret_cast<Function>(loader(instance, name));
    if (found && found != One::systems) // other threads may be calling it
        One::systems = found;
}

template <class Function>
Function loaders(const char* name) {
    return loader ? reinterpret_cast<Function>(loader(nullptr, name)) : nullptr;
}
template <class Function>
Function drivers(const char* name) {
    return reinterpret_cast<Function>(native::get_instance_proc_addr(nullptr, name));
}

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info,
                                               const VkAllocationCallbacks* callbacks,
                                               VkInstance* out) {
    const auto systems = loaders<PFN_vkCreateInstance>("vkCreateInstance");
    const VkResult made = systems ? systems(info, callbacks, out) : VK_ERROR_INCOMPATIBLE_DRIVER;
    // Ours has no layers and presents nothing: who asks for these lacks a driver of the system.
    const auto ours = drivers<PFN_vkCreateInstance>("vkCreateInstance");
    return made == VK_ERROR_INCOMPATIBLE_DRIVER && ours(info, callbacks, out) == VK_SUCCESS
               ? VK_SUCCESS
               : made;
}

VKAPI_ATTR VkResult VKAPI_CALL enumerate_extensions(const char* layer, uint32_t* count,
                                                    VkExtensionProperties* out) {
    constexpr const char* name = "vkEnumerateInstanceExtensionProperties";
    const auto systems = loaders<PFN_vkEnumerateInstanceExtensionProperties>(name);
    return (systems ? systems : drivers<PFN_vkEnumerateInstanceExtensionProperties>(name))(
        layer, count, out);
}

VKAPI_ATTR VkResult VKAPI_CALL enumerate_layers(uint32_t* count, VkLayerProperties* out) {
    constexpr const char* name = "vkEnumerateInstanceLayerProperties";
    const auto systems = loaders<PFN_vkEnumerateInstanceLayerProperties>(name);
    return (systems ? systems : drivers<PFN_vkEnumerateInstanceLayerProperties>(name))(count, out);
}

// The system's devices, and ours behind them: not in a program that holds no native code.
template <int place>
struct EitherDevices : Either<place, PFN_vkEnumeratePhysicalDevices> {
    using Base = Either<place, PFN_vkEnumeratePhysicalDevices>;
    static VKAPI_ATTR VkResult VKAPI_CALL call(VkInstance instance, uint32_t* count,
                                               VkPhysicalDevice* out) {
        if (native::is_native(instance))
            return Base::ours(instance, count, out);
        uint32_t found = 0;
        if (const VkResult result = Base::systems(instance, &found, nullptr); result != VK_SUCCESS)
            return result;
        std::vector<VkPhysicalDevice> all(found);
        if (const VkResult result = Base::systems(instance, &found, all.data());
            result != VK_SUCCESS)
            return result;
        if (!native::kernels().empty())
            all.push_back(native::physical_device());
        const auto size = static_cast<uint32_t>(all.size());
        if (!out) {
            *count = size;
            return VK_SUCCESS;
        }
        *count = std::min(*count, size);
        std::copy_n(all.begin(), *count, out);
        return *count < size ? VK_INCOMPLETE : VK_SUCCESS;
    }
};

struct Known {
    std::string_view name;
    void (*load)(VkInstance, const char*);
    PFN_vkVoidFunction function;
};

template <class One>
Known known(const char* name) {
    return {name, load<One>, reinterpret_cast<PFN_vkVoidFunction>(One::call)};
}

const std::vector<Known>& functions() {
    static const std::vector<Known> all = {
        known<EitherDevices<__COUNTER__>>("vkEnumeratePhysicalDevices"), // before its namesake
#define PALPATE_KNOWN(name) known<Either<__COUNTER__, PFN_##name>>(#name),
        PALPATE_VULKAN_FUNCTIONS(PALPATE_KNOWN)
#undef PALPATE_KNOWN
    };
    return all;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL function_of(VkInstance, const char* name) {
    const std::string_view wanted = name;
    if (wanted == "vkCreateInstance")
        return reinterpret_cast<PFN_vkVoidFunction>(create_instance);
    if (wanted == "vkEnumerateInstanceExtensionProperties")
        return reinterpret_cast<PFN_vkVoidFunction>(enumerate_extensions);
    if (wanted == "vkEnumerateInstanceLayerProperties")
        return reinterpret_cast<PFN_vkVoidFunction>(enumerate_layers);
    const auto found = std::find_if(functions().begin(), functions().end(),
                                    [&](const Known& one) { return one.name == wanted; });
    return found == functions().end() ? nullptr : found->function;
}

// volk asks for all of its names when it loads an instance; the pointers it gets are the same for
// every instance.
VkInstance any_instance() {
    return reinterpret_cast<VkInstance>(uintptr_t{1});
}

} // namespace

void load_vulkan() {
    static std::once_flag once;
    std::call_once(once, [] {
        if (volkInitialize() == VK_SUCCESS)
            loader = vkGetInstanceProcAddr;
        volkInitializeCustom(function_of);
        for (const Known& one : functions())
            one.load(nullptr, one.name.data());
        volkLoadInstance(any_instance());
    });
}

void load_vulkan(VkInstance instance) {
    if (native::is_native(instance))
        return;
    for (const Known& one : functions())
        one.load(instance, one.name.data());
}

} // namespace palpate
