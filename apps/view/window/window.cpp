#include "apps/view/window/window.h"

#include <volk.h>

// GLFW after the types of Vulkan.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>

namespace palpate::view {

namespace {

std::string g_error; // GLFW's last

// Whether a key that stays down acts again and again: what steps does, what switches does not.
bool repeats(const Event& event) {
    if (event.modifiers.ctrl)
        return true;
    if (event.key.size() == 1)
        return std::isalnum(static_cast<unsigned char>(event.key[0])) == 0;
    return event.key != "space" && event.key != "enter" && event.key != "escape";
}

std::string name_of_key(int key) {
    static const std::map<int, std::string> names{{GLFW_KEY_ESCAPE, "escape"},
                                                  {GLFW_KEY_ENTER, "enter"},
                                                  {GLFW_KEY_KP_ENTER, "enter"},
                                                  {GLFW_KEY_TAB, "tab"},
                                                  {GLFW_KEY_BACKSPACE, "backspace"},
                                                  {GLFW_KEY_INSERT, "insert"},
                                                  {GLFW_KEY_DELETE, "delete"},
                                                  {GLFW_KEY_RIGHT, "right"},
                                                  {GLFW_KEY_LEFT, "left"},
                                                  {GLFW_KEY_DOWN, "down"},
                                                  {GLFW_KEY_UP, "up"},
                                                  {GLFW_KEY_PAGE_UP, "page_up"},
                                                  {GLFW_KEY_PAGE_DOWN, "page_down"},
                                                  {GLFW_KEY_HOME, "home"},
                                                  {GLFW_KEY_END, "end"},
                                                  {GLFW_KEY_SPACE, "space"},
                                                  {GLFW_KEY_KP_ADD, "+"},
                                                  {GLFW_KEY_KP_SUBTRACT, "-"},
                                                  {GLFW_KEY_LEFT_SHIFT, "shift"},
                                                  {GLFW_KEY_RIGHT_SHIFT, "shift"},
                                                  {GLFW_KEY_LEFT_CONTROL, "ctrl"},
                                                  {GLFW_KEY_RIGHT_CONTROL, "ctrl"},
                                                  {GLFW_KEY_LEFT_ALT, "alt"},
                                                  {GLFW_KEY_RIGHT_ALT, "alt"}};
    if (const auto found = names.find(key); found != names.end())
        return found->second;
    if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9)
        return std::string(1, static_cast<char>('0' + (key - GLFW_KEY_KP_0)));
    if (key <= GLFW_KEY_SPACE || key > GLFW_KEY_GRAVE_ACCENT)
        return "";
    const std::string name(1, static_cast<char>(key >= 'A' && key <= 'Z' ? key - 'A' + 'a' : key));
    const auto& known = key_names();
    return std::find(known.begin(), known.end(), name) == known.end() ? "" : name;
}

// The key that writes a letter: shortcuts are by what is printed on a keyboard.
std::string name_of_key(int key, int scancode) {
    const char* printed = glfwGetKeyName(key, scancode);
    if (printed && printed[0] != '\0' && printed[1] == '\0' &&
        (key < GLFW_KEY_KP_0 || key > GLFW_KEY_KP_EQUAL)) {
        const auto& known = key_names();
        const std::string name(1, printed[0]);
        if (std::find(known.begin(), known.end(), name) != known.end())
            return name;
    }
    return name_of_key(key);
}

std::string utf8(unsigned int code) {
    std::string text;
    if (code < 0x80) {
        text += static_cast<char>(code);
    } else if (code < 0x800) {
        text += static_cast<char>(0xc0 | code >> 6);
        text += static_cast<char>(0x80 | (code & 0x3f));
    } else if (code < 0x10000) {
        text += static_cast<char>(0xe0 | code >> 12);
        text += static_cast<char>(0x80 | (code >> 6 & 0x3f));
        text += static_cast<char>(0x80 | (code & 0x3f));
    } else {
        text += static_cast<char>(0xf0 | code >> 18);
        text += static_cast<char>(0x80 | (code >> 12 & 0x3f));
        text += static_cast<char>(0x80 | (code >> 6 & 0x3f));
        text += static_cast<char>(0x80 | (code & 0x3f));
    }
    return text;
}

Window& of(GLFWwindow* window) {
    return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

} // namespace

Result<std::unique_ptr<Window>> Window::create(glm::uvec2 size_px, const std::string& title,
                                               std::optional<uint32_t> number) {
    glfwSetErrorCallback([](int, const char* text) { g_error = text; });
    const auto refuse = [&] {
        return fail(
            "palpate view: expected a display (DISPLAY or WAYLAND_DISPLAY), found none that opens "
            "a "
            "window ({}); --headless --shot F.png draws without one",
            g_error);
    };
    // GLFW 3.4 would try both all the same, and libwayland then writes to standard error.
    const auto is_set = [](const char* name) {
        const char* value = std::getenv(name);
        return value && *value;
    };
    if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY")) {
        g_error = "neither is set";
        return refuse();
    }
    if (!glfwInit())
        return refuse();
    std::unique_ptr<Window> window(new Window());
    if (!glfwVulkanSupported())
        return fail("palpate view: expected a Vulkan driver that opens windows, found none ({})",
                    g_error);
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    GLFWmonitor* monitor = nullptr;
    if (number) {
        int count = 0;
        GLFWmonitor** const monitors = glfwGetMonitors(&count);
        if (*number >= static_cast<uint32_t>(count))
            return fail("--full-screen: expected a monitor 0 .. {}, found {}", count - 1, *number);
        monitor = monitors[*number];
        const GLFWvidmode* const mode = glfwGetVideoMode(monitor);
        size_px = glm::uvec2(mode->width, mode->height);
        glfwWindowHint(GLFW_REFRESH_RATE, mode->refreshRate);
    }
    window->window_ = glfwCreateWindow(static_cast<int>(size_px.x), static_cast<int>(size_px.y),
                                       title.c_str(), monitor, nullptr);
    if (!window->window_)
        return refuse();
    if (!monitor)
        glfwSetWindowSizeLimits(window->window_, static_cast<int>(kSmallestWindow_px.x),
                                static_cast<int>(kSmallestWindow_px.y), GLFW_DONT_CARE,
                                GLFW_DONT_CARE);
    window->listen();
    return window;
}

Window::~Window() {
    if (window_)
        glfwDestroyWindow(window_);
    glfwTerminate();
}

Event Window::event(Event::Kind kind) const {
    Event event{.kind = kind, .time_s = time_s()};
    const auto held = [&](int left, int right) {
        return glfwGetKey(window_, left) == GLFW_PRESS || glfwGetKey(window_, right) == GLFW_PRESS;
    };
    event.modifiers = {held(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT),
                       held(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL),
                       held(GLFW_KEY_LEFT_ALT, GLFW_KEY_RIGHT_ALT)};
    return event;
}

void Window::listen() {
    glfwSetWindowUserPointer(window_, this);
    glfwSetCursorPosCallback(window_, [](GLFWwindow* window, double x, double y) {
        Window& self = of(window);
        int width = 1, height = 1;
        glfwGetWindowSize(window, &width, &height);
        Event event = self.event(Event::Kind::move);
        const glm::dvec2 pixels =
            glm::dvec2(self.size_px()) / glm::dvec2(std::max(width, 1), std::max(height, 1));
        event.at_px = glm::floor(glm::dvec2(x, y) * pixels);
        self.events_.push(std::move(event));
    });
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* window, int button, int action, int) {
        if (button > GLFW_MOUSE_BUTTON_MIDDLE)
            return;
        Event event = of(window).event(Event::Kind::button);
        event.button = button == GLFW_MOUSE_BUTTON_LEFT    ? Button::left
                       : button == GLFW_MOUSE_BUTTON_RIGHT ? Button::right
                                                           : Button::middle;
        event.down = action == GLFW_PRESS;
        of(window).events_.push(std::move(event));
    });
    glfwSetScrollCallback(window_, [](GLFWwindow* window, double x, double y) {
        Event event = of(window).event(Event::Kind::wheel);
        event.wheel = {x, y};
        of(window).events_.push(std::move(event));
    });
    glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int scancode, int action, int) {
        Event event = of(window).event(Event::Kind::key);
        event.key = name_of_key(key, scancode);
        event.down = action != GLFW_RELEASE;
        if (!event.key.empty() && (action != GLFW_REPEAT || repeats(event)))
            of(window).events_.push(std::move(event));
    });
    glfwSetCharCallback(window_, [](GLFWwindow* window, unsigned int code) {
        Event event = of(window).event(Event::Kind::text);
        event.text = utf8(code);
        of(window).events_.push(std::move(event));
    });
    glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* window, int width, int height) {
        if (width <= 0 || height <= 0)
            return; // an icon
        Event event = of(window).event(Event::Kind::resize);
        event.size_px = glm::uvec2(width, height);
        of(window).events_.push(std::move(event));
    });
    glfwSetWindowRefreshCallback(window_, [](GLFWwindow* window) { of(window).damaged_ = true; });
    glfwSetWindowCloseCallback(window_, [](GLFWwindow* window) {
        glfwSetWindowShouldClose(window, GLFW_FALSE); // a person may be asked first
        of(window).events_.push(of(window).event(Event::Kind::close));
    });
    glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
        Event event = of(window).event(Event::Kind::drop);
        event.paths.assign(paths, paths + count);
        of(window).events_.push(std::move(event));
    });
}

std::vector<std::string> Window::instance_extensions() {
    uint32_t count = 0;
    const char** names = glfwGetRequiredInstanceExtensions(&count);
    return {names, names + count};
}

std::function<bool(VkInstance, VkPhysicalDevice, uint32_t)> Window::can_present() {
    return [](VkInstance instance, VkPhysicalDevice device, uint32_t family) {
        uint32_t count = 0;
        vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
        std::vector<VkQueueFamilyProperties> families(count);
        vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
        return family < count && (families[family].queueFlags & VK_QUEUE_GRAPHICS_BIT) &&
               glfwGetPhysicalDevicePresentationSupport(instance, device, family) == GLFW_TRUE;
    };
}

void Window::wait(double most_s) {
    if (most_s > 0.0)
        glfwWaitEventsTimeout(most_s);
    else
        glfwPollEvents();
}

void Window::wake() {
    glfwPostEmptyEvent();
}

glm::uvec2 Window::size_px() const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    return {static_cast<uint32_t>(std::max(width, 0)), static_cast<uint32_t>(std::max(height, 0))};
}

glm::ivec2 Window::place_px() const {
    glm::ivec2 place(0), size(1);
    glfwGetWindowPos(window_, &place.x, &place.y); // in the screen's units
    glfwGetWindowSize(window_, &size.x, &size.y);
    return place * glm::ivec2(size_px()) / glm::max(size, 1);
}

void Window::hide_pointer(bool hidden) {
    if (hidden == pointer_hidden_)
        return;
    glfwSetInputMode(window_, GLFW_CURSOR, hidden ? GLFW_CURSOR_HIDDEN : GLFW_CURSOR_NORMAL);
    pointer_hidden_ = hidden;
}

double Window::text_scale() const {
    float x = 1.0f, y = 1.0f;
    glfwGetWindowContentScale(window_, &x, &y);
    return std::clamp(std::round(4.0 * y) / 4.0, 1.0, 4.0);
}

double Window::time_s() const {
    return glfwGetTime();
}

void Window::set_title(const std::string& title) {
    glfwSetWindowTitle(window_, title.c_str());
}

} // namespace palpate::view
