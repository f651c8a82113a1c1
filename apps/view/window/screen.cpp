// The images of a window.

#include <volk.h>

#include <GLFW/glfw3.h>

#include <algorithm>

#include "apps/view/window/window.h"
#include "engine/gpu/error.h"

namespace palpate::view {

namespace {

constexpr size_t kFrames = 2; // that may wait for an image
constexpr VkImageUsageFlags kUsage =
    VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;

VkSemaphore make_semaphore(GpuDevice& device) {
    const VkSemaphoreCreateInfo create{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    VkSemaphore semaphore = VK_NULL_HANDLE;
    check(vkCreateSemaphore(device.handle(), &create, nullptr, &semaphore),
          "creating a semaphore of the window");
    return semaphore;
}

} // namespace

Screen::Screen(GpuDevice& device, Window& window) : device_(&device) {
    check(glfwCreateWindowSurface(device.instance(), window.handle(), nullptr, &surface_),
          "connecting the window with " + device.info().name);
    uint32_t count = 0;
    check(vkGetPhysicalDeviceSurfaceFormatsKHR(device.physical(), surface_, &count, nullptr),
          "asking for the window's formats");
    std::vector<VkSurfaceFormatKHR> formats(count);
    check(vkGetPhysicalDeviceSurfaceFormatsKHR(device.physical(), surface_, &count, formats.data()),
          "asking for the window's formats");
    for (const VkFormat wanted : {VK_FORMAT_B8G8R8A8_UNORM, VK_FORMAT_R8G8B8A8_UNORM})
        for (const VkSurfaceFormatKHR& found : formats)
            if (format_ == VK_FORMAT_UNDEFINED && found.format == wanted)
                format_ = wanted;
    if (format_ == VK_FORMAT_UNDEFINED)
        throw GpuError("expected a window with 8 bits a channel, found none of that format");
}

Screen::~Screen() {
    device_->wait_idle();
    drop();
    vkDestroySwapchainKHR(device_->handle(), chain_, nullptr);
    vkDestroySurfaceKHR(device_->instance(), surface_, nullptr);
}

void Screen::drop() {
    images_.clear();
    for (std::vector<VkSemaphore>* all : {&free_, &drawn_}) {
        for (const VkSemaphore semaphore : *all)
            vkDestroySemaphore(device_->handle(), semaphore, nullptr);
        all->clear();
    }
}

void Screen::make(glm::uvec2 size_px) {
    device_->wait_idle();
    drop();
    VkSurfaceCapabilitiesKHR can{};
    check(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_->physical(), surface_, &can),
          "asking for the window's size");
    if ((can.supportedUsageFlags & kUsage) != kUsage)
        throw GpuError("expected a window whose images can be copied to, found one without");
    glm::uvec2 size = size_px;
    if (can.currentExtent.width != UINT32_MAX) // else the chain decides
        size = {can.currentExtent.width, can.currentExtent.height};
    if (size.x == 0 || size.y == 0)
        return; // an icon
    const uint32_t most = can.maxImageCount == 0 ? UINT32_MAX : can.maxImageCount;
    const VkSwapchainCreateInfoKHR create{.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR,
                                          .surface = surface_,
                                          .minImageCount = std::min(can.minImageCount + 1, most),
                                          .imageFormat = format_,
                                          .imageColorSpace = VK_COLOR_SPACE_SRGB_NONLINEAR_KHR,
                                          .imageExtent = {size.x, size.y},
                                          .imageArrayLayers = 1,
                                          .imageUsage = kUsage,
                                          .imageSharingMode = VK_SHARING_MODE_EXCLUSIVE,
                                          .preTransform = can.currentTransform,
                                          .compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR,
                                          .presentMode = VK_PRESENT_MODE_FIFO_KHR,
                                          .clipped = VK_FALSE, // images keep all they hold
                                          .oldSwapchain = chain_};
    VkSwapchainKHR next = VK_NULL_HANDLE;
    check(vkCreateSwapchainKHR(device_->handle(), &create, nullptr, &next),
          "making the window's images");
    vkDestroySwapchainKHR(device_->handle(), chain_, nullptr);
    chain_ = next;
    uint32_t count = 0;
    check(vkGetSwapchainImagesKHR(device_->handle(), chain_, &count, nullptr),
          "asking for the window's images");
    std::vector<VkImage> images(count);
    check(vkGetSwapchainImagesKHR(device_->handle(), chain_, &count, images.data()),
          "asking for the window's images");
    const ImageShape shape{.format = format_, .size = glm::uvec3(size, 1), .attachment = true};
    for (const VkImage image : images) {
        images_.push_back({GpuImage(*device_, shape, image)});
        drawn_.push_back(make_semaphore(*device_));
    }
    for (size_t i = 0; i < kFrames; ++i)
        free_.push_back(make_semaphore(*device_));
    values_.assign(kFrames, 0);
    size_px_ = size_px;
}

std::optional<Ticket> Screen::show(glm::uvec2 size_px,
                                   const std::function<void(Commands&, UiTarget&)>& record) {
    if (images_.empty() || size_px != size_px_)
        make(size_px);
    if (images_.empty())
        return std::nullopt;
    turn_ = (turn_ + 1) % free_.size();
    device_->wait(values_[turn_]); // its last wait is over
    uint32_t index = 0;
    const VkResult got = vkAcquireNextImageKHR(device_->handle(), chain_, UINT64_MAX, free_[turn_],
                                               VK_NULL_HANDLE, &index);
    if (got == VK_ERROR_OUT_OF_DATE_KHR) {
        size_px_ = {0, 0}; // made anew with the next frame
        return std::nullopt;
    }
    if (got != VK_SUBOPTIMAL_KHR)
        check(got, "taking an image of the window");
    UiTarget& target = images_[index];
    Commands commands(*device_);
    commands.wait_for({free_[turn_], 0, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT});
    record(commands, target);
    commands.use(target.image, Use::present);
    commands.signal({drawn_[index]});
    values_[turn_] = commands.submit();
    const VkPresentInfoKHR present{.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR,
                                   .waitSemaphoreCount = 1,
                                   .pWaitSemaphores = &drawn_[index],
                                   .swapchainCount = 1,
                                   .pSwapchains = &chain_,
                                   .pImageIndices = &index};
    const VkResult shown = [&] {
        const auto turn = device_->queue_turn();
        return vkQueuePresentKHR(device_->queue(), &present);
    }();
    if (shown == VK_ERROR_OUT_OF_DATE_KHR || shown == VK_SUBOPTIMAL_KHR)
        size_px_ = {0, 0};
    else
        check(shown, "showing an image of the window");
    return commands.ticket();
}

} // namespace palpate::view
