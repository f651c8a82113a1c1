#pragma once

#include <vulkan/vulkan_core.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "apps/view/drawing/ui_tiles.h"
#include "engine/gpu/commands.h"

struct ImDrawData;

namespace palpate::view {

// An image that frames are copied to. What it shows is not copied again: it keeps what it held.
struct UiTarget {
    GpuImage image;
    UiTiles shown{};
};

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

    // Draws the lists upon black. Of the frame before only the tiles that differ are drawn anew,
    // on an image that is kept, and those that the target lacks are copied there. Submits
    // `commands` so far, and then the triangles; what is recorded later comes after them.
    void record(Commands& commands, UiTarget& target, const ImDrawData& data);
    // The next record() draws all tiles.
    void forget() { tiles_ = {}; }

 private:
    struct Picture {
        std::shared_ptr<GpuImage> image;
        VkDescriptorSet set;
        uint64_t version; // of what it holds; unique in the process
    };
    struct Slot { // what a frame's triangles are recorded into
        VkCommandBuffer commands = VK_NULL_HANDLE;
        VkFence done = VK_NULL_HANDLE;
    };
    struct Triangles {
        BufferSlice vertices, indices;
    };
    void drop(uint32_t number);
    Slot& next_slot();
    std::vector<Box> find_changes(const ImDrawData& data, glm::uvec2 size_px);
    Triangles upload(Commands& commands, const ImDrawData& data);
    void draw_within(const Box& box, VkCommandBuffer to, const ImDrawData& data);
    void draw(const Triangles& triangles, const ImDrawData& data, std::span<const Box> boxes);

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
    VkFormat format_;
    std::optional<GpuImage> kept_; // the frame before
    UiTiles tiles_;                // of it
};

} // namespace palpate::view
