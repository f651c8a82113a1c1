#include "apps/view/window/loop.h"

#include <sys/resource.h>
#include <volk.h>

#include <exception>
#include <thread>

#include "apps/view/window/latency.h"
#include "apps/view/window/pacing.h"
#include "apps/view/window/replay.h"
#include "apps/view/window/script_desk.h"
#include "apps/view/window/window.h"
#include "engine/base/json.h"
#include "engine/gpu/error.h"

namespace palpate::view {

namespace {

constexpr int kNicePictures = 5; // of a CPU driver's threads, beside 0 of the interface's

// A loop's result is an error if a message of validation is left.
Result<void> expect_valid(const GpuDevice& device) {
    const std::vector<std::string> messages = device.validation_messages();
    if (!messages.empty())
        return fail("Vulkan validation had {} complaints, the first: {}", messages.size(),
                    messages.front());
    return {};
}

// The interface's: one that presents. Where the one that was asked for does not, another does.
std::unique_ptr<GpuDevice> presenting_device(const LoopOptions& options) {
    DeviceOptions wanted{.select = options.device,
                         .validation = options.validate,
                         .instance_extensions = Window::instance_extensions(),
                         .device_extensions = {VK_KHR_SWAPCHAIN_EXTENSION_NAME},
                         .can_present = Window::can_present()};
    try {
        return std::make_unique<GpuDevice>(wanted);
    } catch (const GpuError&) {
        if (wanted.select.empty())
            throw;
    }
    wanted.select.clear();
    return std::make_unique<GpuDevice>(wanted);
}

// A graphics card draws both, and pictures stay there. A CPU driver works off one device in turns,
// so that the interface would wait for the rays of the pictures: these have a device of their own,
// as where the one that was asked for cannot present.
std::unique_ptr<GpuDevice> device_of_pictures(const LoopOptions& options, GpuDevice& interface) {
    // One table of functions serves all instances: each is made with what the window needs.
    const DeviceOptions wanted{.select = options.device,
                               .validation = options.validate,
                               .instance_extensions = Window::instance_extensions()};
    if (interface.info().type != VK_PHYSICAL_DEVICE_TYPE_CPU && options.device.empty())
        return std::make_unique<GpuDevice>(interface);
    std::unique_ptr<GpuDevice> own;
    std::exception_ptr error;
    std::thread([&] {
        // Threads of a CPU driver are as urgent as the one that makes the device: rays give way to
        // the interface. Elsewhere it is all one.
        setpriority(PRIO_PROCESS, 0, kNicePictures);
        try {
            own = std::make_unique<GpuDevice>(wanted);
        } catch (...) {
            error = std::current_exception();
        }
    }).join();
    if (error)
        std::rethrow_exception(error);
    if (own->info().type == VK_PHYSICAL_DEVICE_TYPE_CPU ||
        own->info().index != interface.info().index)
        return own;
    return std::make_unique<GpuDevice>(interface);
}

} // namespace

DeviceOptions headless_device(const std::string& select, bool validate) {
    return {.select = select,
            .validation = validate,
            .can_present = [](VkInstance, VkPhysicalDevice device, uint32_t family) {
                uint32_t count = 0;
                vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
                std::vector<VkQueueFamilyProperties> families(count);
                vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
                return family < count && (families[family].queueFlags & VK_QUEUE_GRAPHICS_BIT) != 0;
            }};
}

Result<Json> run_latency(Source source, LoopOptions options, bool headless) {
    std::unique_ptr<Window> window;
    if (!headless) {
        PALPATE_TRY(window, Window::create(options.size_px, "palpate", options.monitor));
    }
    const std::unique_ptr<GpuDevice> interface =
        headless ? std::make_unique<GpuDevice>(headless_device(options.device, options.validate))
                 : presenting_device(options);
    const std::unique_ptr<GpuDevice> pictures = device_of_pictures(options, *interface);
    options.set_renderer(*pictures, options.viewer.renderer);
    std::optional<Screen> screen;
    if (window)
        screen.emplace(*interface, *window);
    const glm::uvec2 size =
        window ? glm::max(window->size_px(), kSmallestWindow_px) : options.size_px;
    const VkFormat format = screen ? screen->format() : VK_FORMAT_R8G8B8A8_UNORM;
    Viewer viewer(*pictures, *interface, format, std::move(source), size,
                  std::max(1.0, options.text_scale), std::move(options.viewer));
    const auto record = [&](Commands& commands, UiTarget& target) {
        viewer.record(commands, target);
    };
    std::vector<UiTarget> targets; // as a window has several
    if (!window)
        for (size_t i = 0; i < FramesUnderWay::kMost; ++i)
            targets.push_back(
                {GpuImage(*interface, "frame",
                          {.format = format, .size = glm::uvec3(size, 1), .attachment = true})});
    size_t turn = 0;
    Result<Json> found = measure_latency(viewer, [&]() -> std::optional<Ticket> {
        if (screen) {
            window->wait(0.0);
            window->events().take_frame(); // the hand is not the person's
            return screen->show(window->size_px(), record);
        }
        UiTarget& target = targets[turn++ % targets.size()];
        Commands commands(*interface);
        record(commands, target);
        commands.submit();
        return commands.ticket();
    });
    for (const GpuDevice* device : {pictures.get(), interface.get()})
        PALPATE_TRY(expect_valid(*device));
    if (found) {
        (*found)["device"] = pictures->info().name;
        (*found)["one_device"] = pictures->handle() == interface->handle();
        (*found)["window"] = window != nullptr;
        (*found)["size"] = {size.x, size.y};
    }
    return found;
}

// Until there is input, or the window is to be drawn. What wakes it else, as a picture, is shown
// then, and at once where nothing is going on.
static void wait_for_turn(Window& window, const Pacing& pacing, bool busy) {
    constexpr double kIdle_s = 0.25; // edits and messages show within
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::max(0.0, pacing.turn_s() - window.time_s())));
    window.wait(0.0);
    if (!busy && window.events().empty())
        window.wait(kIdle_s);
    while (window.events().empty()) {
        const double wait_s = pacing.draw_s() - window.time_s();
        if (wait_s <= 0.0)
            break;
        window.wait(wait_s);
    }
}

Result<Json> run_window(Source source, LoopOptions options) {
    PALPATE_TRY(const std::unique_ptr<Window> made,
                Window::create(options.size_px, "palpate", options.monitor));
    Window& window = *made;
    const std::unique_ptr<GpuDevice> interface = presenting_device(options);
    const std::unique_ptr<GpuDevice> picture_device = device_of_pictures(options, *interface);
    GpuDevice& pictures = *picture_device;
    options.set_renderer(pictures, options.viewer.renderer);
    Screen screen(*interface, window);
    const double text_scale = options.text_scale > 0.0 ? options.text_scale : window.text_scale();
    const glm::uvec2 size = glm::max(window.size_px(), kSmallestWindow_px);
    options.viewer.on_picture = Window::wake;
    Viewer viewer(pictures, *interface, screen.format(), std::move(source), size, text_scale,
                  std::move(options.viewer));
    ScriptDesk desk(options.record, size, text_scale);
    if (options.replay)
        desk.play(*options.replay, options.replay_speed);
    std::string title;
    constexpr int kSettling = 3; // frames after which widgets have answered
    int frames_to_go = kSettling;
    Pacing pacing;
    FramesUnderWay under_way;
    uint64_t shown_looks = 0;
    glm::uvec2 shown_px(0);
    for (uint64_t frame = 0; !options.stop.stop_requested(); ++frame) {
        wait_for_turn(window, pacing, frames_to_go > 0 || desk.is_playing());
        const bool draws = pacing.begin(window.time_s(), !under_way.full());
        const std::vector<Event> events =
            desk.take(frame, window.events().take_frame(), window.time_s(), viewer);
        frames_to_go = events.empty() ? frames_to_go - 1 : kSettling;
        viewer.frame(events, desk.time_s());
        if (viewer.is_done())
            break;
        if (viewer.title() != title)
            window.set_title((title = viewer.title()) + " - palpate");
        if (const auto failure = viewer.failure())
            return fail("{}", *failure);
        viewer.set_place(window.place_px());
        window.hide_pointer(viewer.hides_pointer());
        const glm::uvec2 size_px = window.size_px();
        if (!draws) {
            frames_to_go = std::max(frames_to_go, 1);
            continue;
        }
        if (size_px.x == 0)
            continue;
        const uint64_t looks = viewer.looks();
        if (window.take_damage() || size_px != shown_px || looks != shown_looks) {
            shown_looks = looks;
            shown_px = size_px;
            const auto record = [&](Commands& commands, UiTarget& target) {
                viewer.record(commands, target);
            };
            if (const std::optional<Ticket> shown = screen.show(size_px, record))
                under_way.add(*shown);
        }
    }
    if (desk.failed())
        return fail("{}: cannot be written", options.record);
    for (const GpuDevice* device : {&pictures, interface.get()})
        PALPATE_TRY(expect_valid(*device));
    return viewer.dump();
}

Result<HeadlessResult> run_headless(Source source, const Script& script, LoopOptions options,
                                    bool with_shot) {
    GpuDevice device(headless_device(options.device, options.validate));
    options.set_renderer(device, options.viewer.renderer);
    options.viewer.threaded = false;
    Viewer viewer(device, device, VK_FORMAT_R8G8B8A8_UNORM, std::move(source), script.size_px,
                  script.text_scale, std::move(options.viewer));
    Recorder recorder(options.record, script.size_px, script.text_scale);
    PALPATE_TRY(replay(viewer, script, &recorder));
    if (recorder.failed())
        return fail("{}: cannot be written", options.record);
    HeadlessResult result{viewer.dump(), {}};
    if (with_shot) {
        PALPATE_TRY(result.shot, viewer.shot());
    }
    PALPATE_TRY(expect_valid(device));
    return result;
}

} // namespace palpate::view
