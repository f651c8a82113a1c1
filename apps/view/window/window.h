#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/view/drawing/ui_drawing.h"
#include "apps/view/script/script.h"
#include "apps/view/window/panel.h"
#include "engine/gpu/commands.h"

struct GLFWwindow;

namespace palpate::view {

// A window of the system, by GLFW. For the main thread, wake() apart. One at a time.
class Window {
 public:
    // An error where there is no display, with what to do.
    // monitor: the number of the one whose whole screen it fills; none: a window of this size.
    static Result<std::unique_ptr<Window>> create(glm::uvec2 size_px, const std::string& title,
                                                  std::optional<uint32_t> monitor = {});
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    // The extensions for devices that can present to it, made with can_present() of the window.
    static std::vector<std::string> instance_extensions();
    static std::function<bool(VkInstance, VkPhysicalDevice, uint32_t family)> can_present();

    // Waits for input or wake(), at most so long.
    void wait(double most_s);
    static void wake(); // any thread
    EventQueue& events() { return events_; }
    // Whether the system has lost what was shown, since this was last asked.
    bool take_damage() { return std::exchange(damaged_, false); }
    glm::uvec2 size_px() const;  // in pixels; 0 while it is an icon
    glm::ivec2 place_px() const; // of its first pixel on the screen; 0 where that is unknown
    void hide_pointer(bool hidden);
    double text_scale() const; // that the system asks for
    double time_s() const;     // since it opened
    void set_title(const std::string& title);
    GLFWwindow* handle() { return window_; }

 private:
    Window() = default;
    void listen();
    Event event(Event::Kind kind) const;

    GLFWwindow* window_ = nullptr;
    bool pointer_hidden_ = false, damaged_ = false;
    EventQueue events_;
};

// The picture that a window shows, on a device that presents.
class Screen {
 public:
    Screen(GpuDevice& device, Window& window); // throws GpuError
    ~Screen();
    Screen(const Screen&) = delete;
    Screen& operator=(const Screen&) = delete;

    VkFormat format() const { return format_; }
    // Has the next image drawn by `record` and shows it; nothing where there is none. Made anew
    // where the window has another size.
    std::optional<Ticket> show(glm::uvec2 size_px,
                               const std::function<void(Commands&, UiTarget&)>& record);

 private:
    void make(glm::uvec2 size_px);
    void drop();

    GpuDevice* device_;
    VkSurfaceKHR surface_ = VK_NULL_HANDLE;
    VkSwapchainKHR chain_ = VK_NULL_HANDLE;
    VkFormat format_ = VK_FORMAT_UNDEFINED;
    glm::uvec2 size_px_{0};
    std::vector<UiTarget> images_;
    // Signalled when an image may be drawn on, by turns; and when it is drawn, one an image.
    std::vector<VkSemaphore> free_, drawn_;
    std::vector<uint64_t> values_; // of the timeline: the last use of each of free_
    size_t turn_ = 0;
};

} // namespace palpate::view
