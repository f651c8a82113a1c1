#pragma once

#include <vulkan/vulkan_core.h>

#include <array>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"

struct ImDrawData;

namespace palpate::view {

// Draws the lists of Dear ImGui, whose textures are pictures kept here under small numbers. Number
// 0 is that of letters. The device draws without render passes (DeviceOptions::can_present).
class UiDrawing {
 public:
    // For targets of this format. Makes the texture of ImGui's fonts.
    UiDrawing(GpuDevice& device, VkFormat format);
    ~UiDrawing();
    UiDrawing(const UiDrawing&) = delete;
    UiDrawing& operator=(const UiDrawing&) = delete;

    // Keeps a picture for draws recorded from here on: size.x * size.y texels of 4 bytes (R, G, B,
    // A), row 0 at the top.
    void set_picture(Commands& commands, uint32_t number, glm::uvec2 size_px,
                     std::span<const std::byte> rgba);
    // The same of an image that is on the device: rgba8. Held for as long as it may be read.
    void set_picture(uint32_t number, std::shared_ptr<GpuImage> image);
    // Lets all pictures but the letters go, now.
    void drop_pictures();
    bool has_picture(uint32_t number) const { return pictures_.count(number) > 0; }

    // Clears the target to black and draws on it. Submits `commands` so far, and then the
    // triangles; what is recorded later comes after them.
    void record(Commands& commands, GpuImage& target, const ImDrawData& data);

 private:
    struct Picture {
        std::shared_ptr<GpuImage> image;
        VkDescriptorSet set;
    };
    struct Slot { // what a frame's triangles are recorded into
        VkCommandBuffer commands = VK_NULL_HANDLE;
        VkFence done = VK_NULL_HANDLE;
    };
    void drop(uint32_t number);
    Slot& next_slot();

    GpuDevice* device_;
    Sampler linear_, nearest_; // for letters and lines; for pictures, pixel by pixel
    VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
    VkCommandPool slots_pool_ = VK_NULL_HANDLE;
    std::array<Slot, 3> slots_;
    size_t slot_ = 0;
    std::map<uint32_t, Picture> pictures_;
};

// All that record() reads of the lists: equal bytes draw the same, from the same pictures.
std::vector<std::byte> drawing_of(const ImDrawData& data);

} // namespace palpate::view
