#pragma once

#include <gtest/gtest.h>
#include <volk.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "engine/gpu/command_slot.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/error.h"
#include "tests/support/kept_device.h"

namespace palpate {

// With this variable the device comes through the system's loader, with validation and
// synchronisation validation above it; else the program calls the driver itself.
inline bool through_loader() {
    return std::getenv("PALPATE_THROUGH_LOADER") != nullptr;
}

// One private device for all tests of a program; a message of validation fails the test.
class NativeTest : public testing::Test {
 protected:
    static GpuDevice& device() {
        static KeptForTests<GpuDevice>& kept =
            keep_device({.select = "palpate native", .validation = through_loader()});
        return kept.get();
    }
    void SetUp() override { messages_before_ = device().validation_messages().size(); }
    void TearDown() override {
        const auto messages = device().validation_messages();
        for (size_t i = messages_before_; i < messages.size(); ++i)
            ADD_FAILURE() << messages[i];
    }

 private:
    size_t messages_before_ = 0;
};

// Records Vulkan's own calls into a buffer of commands and waits for their end.
class RawCommands {
 public:
    explicit RawCommands(GpuDevice& device) : device_(&device), slot_(device.take_slot()) {}
    ~RawCommands() {
        if (slot_)
            device_->give_slot(std::move(slot_), 0);
    }
    RawCommands(const RawCommands&) = delete;
    RawCommands& operator=(const RawCommands&) = delete;

    VkCommandBuffer handle() const { return slot_->commands(); }
    VkQueryPool queries() const { return slot_->queries(); }
    // Everything recorded before is done and seen before what follows.
    void barrier() const {
        const VkMemoryBarrier2 all{
            .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
            .srcStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
            .srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT,
            .dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
            .dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT};
        const VkDependencyInfo info{.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO,
                                    .memoryBarrierCount = 1,
                                    .pMemoryBarriers = &all};
        vkCmdPipelineBarrier2(handle(), &info);
    }
    // The slot stays this object's, so that its queries can be read after the commands are done.
    void run(std::span<const SemaphoreUse> waits = {}) {
        barrier();
        check(vkEndCommandBuffer(handle()), "ending commands");
        value_ = device_->submit(*slot_, waits);
    }
    void wait() const { device_->wait(value_); }

 private:
    GpuDevice* device_;
    std::unique_ptr<CommandSlot> slot_;
    uint64_t value_ = 0;
};

inline std::vector<std::byte> random_bytes(size_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<std::byte> bytes(count);
    for (std::byte& byte : bytes)
        byte = static_cast<std::byte>(random());
    return bytes;
}

inline std::vector<std::byte> copied(std::span<const std::byte> bytes) {
    return {bytes.begin(), bytes.end()};
}

} // namespace palpate
