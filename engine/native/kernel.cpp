#include "engine/native/kernel.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "engine/native/level.h"

namespace palpate::native {

namespace {

constexpr std::array<std::string_view, 3> kLevelNames = {"sse2", "avx2", "avx512"};

// A place in kLevelNames, or their count.
size_t wished_level() {
    const char* wish = std::getenv("PALPATE_NATIVE_LEVEL");
    if (!wish)
        return static_cast<size_t>(Level::kAvx512);
    const auto found = std::find(kLevelNames.begin(), kLevelNames.end(), wish);
    return static_cast<size_t>(found - kLevelNames.begin());
}

Level best_level() {
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
        return Level::kAvx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return Level::kAvx2;
#endif
    return Level::kSse2;
}

// Empty for levels that the build lacks.
struct Registry {
    std::array<std::vector<const Kernel*>, 3> of_level;

    // The widest that this processor runs and this program holds.
    size_t level() const {
        size_t best = std::min(static_cast<size_t>(best_level()), wished_level());
        while (best > 0 && of_level[best].empty())
            --best;
        return best;
    }
};

Registry& registry() {
    static Registry all;
    return all;
}

const std::vector<const Kernel*>& usable() {
    static const std::vector<const Kernel*> sorted = [] {
        std::vector<const Kernel*> all = registry().of_level[registry().level()];
        std::sort(all.begin(), all.end(),
                  [](const Kernel* a, const Kernel* b) { return a->hash < b->hash; });
        return all;
    }();
    return sorted;
}

} // namespace

std::string level_refusal() {
    if (wished_level() < kLevelNames.size())
        return "";
    return "PALPATE_NATIVE_LEVEL: expected sse2, avx2 or avx512, found " +
           std::string(std::getenv("PALPATE_NATIVE_LEVEL"));
}

uint32_t texel_bytes(VkFormat format) {
    switch (format) {
        case VK_FORMAT_R8_UNORM:
        case VK_FORMAT_R8_UINT:
            return 1;
        case VK_FORMAT_R8G8_UNORM:
        case VK_FORMAT_R16_UNORM:
        case VK_FORMAT_R16_SNORM:
        case VK_FORMAT_R16_UINT:
        case VK_FORMAT_R16_SFLOAT:
            return 2;
        case VK_FORMAT_R8G8B8A8_UNORM:
        case VK_FORMAT_B8G8R8A8_UNORM:
        case VK_FORMAT_R16G16_UNORM:
        case VK_FORMAT_R16G16_SFLOAT:
        case VK_FORMAT_R32_SFLOAT:
        case VK_FORMAT_R32_UINT:
            return 4;
        case VK_FORMAT_R16G16B16A16_SFLOAT:
        case VK_FORMAT_R32G32_SFLOAT:
        case VK_FORMAT_R32G32_UINT:
            return 8;
        case VK_FORMAT_R32G32B32A32_SFLOAT:
        case VK_FORMAT_R32G32B32A32_UINT:
            return 16;
        default:
            return 0;
    }
}

uint32_t width() {
    return Level{registry().level()} == Level::kAvx512 ? 16 : 8;
}

const char* instructions() {
    switch (Level{registry().level()}) {
        case Level::kAvx512:
            return "AVX-512";
        case Level::kAvx2:
            return "AVX2";
        default:
            return "SSE2";
    }
}

std::span<const Kernel* const> kernels() {
    return usable();
}

const Kernel* find_kernel(uint64_t hash) {
    const auto found = std::lower_bound(usable().begin(), usable().end(), hash,
                                        [](const Kernel* a, uint64_t b) { return a->hash < b; });
    return found != usable().end() && (*found)->hash == hash ? *found : nullptr;
}

Registered::Registered(Level level, std::initializer_list<const Kernel*> kernels) {
    std::vector<const Kernel*>& all = registry().of_level[static_cast<size_t>(level)];
    all.insert(all.end(), kernels.begin(), kernels.end());
}

} // namespace palpate::native
