#pragma once

#include <volk.h>

#include <optional>
#include <vector>

#include "tests/gpu/gpu_fixture.h"

namespace palpate {

// A picture that is recorded, copied to the CPU by the same commands.
struct Recording {
    explicit Recording(Commands& into) : commands(&into) {}
    void take(const Result<RecordedFrame>& recorded) {
        ASSERT_TRUE(recorded) << recorded.error().message;
        const ImageShape& shape = recorded->picture->shape();
        const Commands::Region all{
            .buffer_offset = 0, .image_offset = {}, .size = shape.size, .layers = shape.layers};
        eyes = shape.layers;
        out = commands->read_back(*recorded->picture, {&all, 1},
                                  sizeof(glm::vec4) * shape.size.x * shape.size.y * eyes);
        ticket = recorded->ticket;
    }
    // R, G, B, A of an eye, as Renderer::read_back() gives them, once the commands are done and
    // while they live.
    std::vector<float> eye(uint32_t number) const {
        const auto* floats = reinterpret_cast<const float*>(out->mapped().data());
        const size_t count = out->bytes / sizeof(float) / eyes;
        return {floats + number * count, floats + (number + 1) * count};
    }
    Commands* commands;
    uint32_t eyes = 0;
    std::optional<BufferSlice> out;
    std::optional<FrameTicket> ticket;
};

// Keeps the device from beginning commands for as long as a test wants.
class HeldBack {
 public:
    // `commands` have nothing recorded yet.
    HeldBack(GpuDevice& device, Commands& commands)
        : device_(&device), before_(device.last_submitted()) {
        const VkSemaphoreTypeCreateInfo type{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
                                             .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE};
        const VkSemaphoreCreateInfo create{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                           .pNext = &type};
        EXPECT_EQ(vkCreateSemaphore(device.handle(), &create, nullptr, &go_), VK_SUCCESS);
        commands.wait_for({go_, 1});
    }
    ~HeldBack() {
        let_go();
        device_->wait(device_->last_submitted());
        vkDestroySemaphore(device_->handle(), go_, nullptr);
    }
    HeldBack(const HeldBack&) = delete;
    HeldBack& operator=(const HeldBack&) = delete;

    // Whether the device has done nothing since.
    bool is_held() const { return device_->passed() <= before_; }
    void let_go() {
        if (std::exchange(gone_, true))
            return;
        const VkSemaphoreSignalInfo signal{
            .sType = VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO, .semaphore = go_, .value = 1};
        vkSignalSemaphore(device_->handle(), &signal);
    }

 private:
    GpuDevice* device_;
    uint64_t before_; // the last submission before
    VkSemaphore go_ = VK_NULL_HANDLE;
    bool gone_ = false;
};

} // namespace palpate
