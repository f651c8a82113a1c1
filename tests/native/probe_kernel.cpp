// Kernels written by hand for the shaders beside this file, so that tests of the driver need no
// translator.

#include "tests/native/probe_kernel.h"

#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <span>

#include "engine/native/kernel.h"
#include "probe_words.h"
#include "seen_words.h"

namespace palpate::native {

namespace {

using namespace native_probe;

uint32_t word_at(const std::byte* from) {
    uint32_t word = 0;
    std::memcpy(&word, from, sizeof word);
    return word;
}

void run_probe(const Launch& launch, uint64_t first, uint64_t count) {
    const Buffer& counts = launch.resources[0].buffer;
    const uint32_t added = word_at(launch.resources[1].buffer.data);
    for (uint64_t group = first; group < first + count; ++group) {
        const uint64_t x = group % launch.groups[0] + launch.first_group[0];
        const uint64_t y = group / launch.groups[0] % launch.groups[1] + launch.first_group[1];
        const uint64_t z = group / launch.groups[0] / launch.groups[1] + launch.first_group[2];
        const uint64_t at = x + 8 * (y + 8 * z);
        if (4 * at + 4 <= counts.bytes)
            std::atomic_ref(reinterpret_cast<uint32_t*>(counts.data)[at]) +=
                launch.constants[0] * added;
    }
}

const std::byte* last_texel(const Image& image) {
    return image.texels + (image.width - 1) * texel_bytes(image.format) +
           (image.height - 1) * image.row_bytes + (image.depth - 1) * image.slice_bytes;
}

void run_seen(const Launch& launch, uint64_t, uint64_t) {
    const Image& volume = launch.resources[1].image;
    const Sampler& sampler = launch.resources[1].sampler;
    const Image& picture = launch.resources[2].image;
    std::array<uint32_t, kTold> told{};
    told[kVolumeWidth] = volume.width;
    told[kVolumeHeight] = volume.height;
    told[kVolumeDepth] = volume.depth;
    told[kVolumeIsLinear] = sampler.is_linear;
    told[kVolumeIsClampedToBorder] = sampler.is_clamped_to_border;
    told[kVolumeLast] = word_at(last_texel(volume));
    told[kPictureWidth] = picture.width;
    told[kPictureHeight] = picture.height;
    told[kPictureLayers] = picture.depth;
    told[kPictureIsArray] = picture.is_array;
    told[kPictureLast] = word_at(last_texel(picture) + 12);
    std::memcpy(launch.resources[0].buffer.data, told.data(), sizeof told);
}

constexpr Binding kProbeBindings[] = {{0, 0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER},
                                      {0, 1, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER}};
constexpr Constant kProbeConstants[] = {{7, 1}};
constexpr Binding kSeenBindings[] = {{0, 0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER},
                                     {0, 2, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER},
                                     {0, 3, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE}};
const Kernel kProbe{hash_of(kProbeWords), "probe",         {1, 1, 1},
                    kProbeBindings,       kProbeConstants, run_probe};
const Kernel kSeen{hash_of(kSeenWords), "seen", {1, 1, 1}, kSeenBindings, {}, run_seen};

const Registered kForSse2(Level::kSse2, {&kProbe, &kSeen});
const Registered kForAvx2(Level::kAvx2, {&kProbe, &kSeen});
const Registered kForAvx512(Level::kAvx512, {&kProbe, &kSeen});

} // namespace
} // namespace palpate::native
