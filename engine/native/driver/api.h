#pragma once

#include <vulkan/vulkan_core.h>

#include <type_traits>

#include "engine/native/driver/functions.h"

// The driver's functions under Vulkan's names.
namespace palpate::native::driver::api {

#define PALPATE_DECLARE(name) std::remove_pointer_t<PFN_##name> name;
PALPATE_DRIVER_FUNCTIONS(PALPATE_DECLARE)
#undef PALPATE_DECLARE

} // namespace palpate::native::driver::api
