// Devices that somebody else made, and submissions that wait for semaphores and signal them.

#include "engine/gpu/device.h"

#include <volk.h>

#include "engine/gpu/commands.h"
#include "engine/gpu/error.h"
#include "engine/volume/builder.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

class DeviceTest : public GpuTest {
 protected:
    static Frame picture(GpuDevice& on) {
        const Volume volume =
            make_volume(make_grid({40, 40, 40}, glm::dvec3(1)), ScalarType::i16, [](glm::uvec3 i) {
                return 1000.0 - 60.0 * glm::length(glm::dvec3(i) - glm::dvec3(20));
            });
        Scene scene;
        scene.size_px = {48, 40};
        scene.camera = frame_volume(volume.grid(), {0.3, -1.0, 0.4}, {0, 0, 1});
        scene.ray_cast = RayCastLayer{};
        scene.ray_cast->transfer = window_function(0.0, 1000.0, 0.1);
        Renderer renderer(on);
        return renderer.render(scene, {volume, std::nullopt}).value();
    }
    static std::string why_refused(const AdoptedDevice& adopted) {
        try {
            const GpuDevice device(adopted);
        } catch (const GpuError& error) {
            return error.what();
        }
        return "";
    }
    static std::string why_refused(const DeviceOptions& options) {
        try {
            const GpuDevice device(options);
        } catch (const GpuError& error) {
            return error.what();
        }
        return "";
    }
};

// Instance and device as a program makes them that draws with Vulkan itself: on the physical device
// that the tests run on.
class HandMade {
 public:
    explicit HandMade(const DeviceInfo& like) {
        const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                            .apiVersion = VK_API_VERSION_1_3};
        const VkInstanceCreateInfo instance{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                            .pApplicationInfo = &application};
        check(vkCreateInstance(&instance, nullptr, &instance_), "an instance");
        uint32_t count = 0;
        vkEnumeratePhysicalDevices(instance_, &count, nullptr);
        std::vector<VkPhysicalDevice> devices(count);
        vkEnumeratePhysicalDevices(instance_, &count, devices.data());
        const VkPhysicalDevice physical = devices.at(like.index);
        const float priority = 1.0f;
        const VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                            .queueFamilyIndex = 0,
                                            .queueCount = 1,
                                            .pQueuePriorities = &priority};
        v13_.synchronization2 = v13_.maintenance4 = VK_TRUE;
        v12_.scalarBlockLayout = v12_.timelineSemaphore = VK_TRUE;
        v12_.pNext = &v13_;
        features_.pNext = &v12_;
        const VkDeviceCreateInfo create{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                        .pNext = &features_,
                                        .queueCreateInfoCount = 1,
                                        .pQueueCreateInfos = &queue};
        VkDevice device = VK_NULL_HANDLE;
        check(vkCreateDevice(physical, &create, nullptr, &device), "a device");
        made_ = {instance_, physical, device, VK_NULL_HANDLE, 0, &features_};
        vkGetDeviceQueue(device, 0, 0, &made_.queue);
    }
    ~HandMade() {
        vkDestroyDevice(made_.device, nullptr);
        vkDestroyInstance(instance_, nullptr);
    }
    HandMade(const HandMade&) = delete;
    HandMade& operator=(const HandMade&) = delete;
    const AdoptedDevice& handles() const { return made_; }

 private:
    VkInstance instance_ = VK_NULL_HANDLE;
    VkPhysicalDeviceVulkan13Features v13_{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceVulkan12Features v12_{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    VkPhysicalDeviceFeatures2 features_{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
    AdoptedDevice made_{};
};

TEST_F(DeviceTest, AnAdoptedOneDrawsTheSameBits) {
    const Frame expected = picture(device());
    const HandMade made(device().info());
    {
        GpuDevice adopted(made.handles());
        EXPECT_EQ(adopted.info().name, device().info().name);
        EXPECT_EQ(picture(adopted).eyes[0].samples, expected.eyes[0].samples);
    }
    GpuDevice again(made.handles()); // the handles still serve
    EXPECT_EQ(picture(again).eyes[0].samples, expected.eyes[0].samples);
    EXPECT_EQ(picture(device()).eyes[0].samples, expected.eyes[0].samples);
}

TEST_F(DeviceTest, AnAdoptedOneThatLacksAFeatureIsRefusedByItsName) {
    const HandMade made(device().info());
    VkPhysicalDeviceVulkan13Features v13{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
        .synchronization2 = VK_TRUE};
    VkPhysicalDeviceVulkan12Features v12{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
        .pNext = &v13,
        .scalarBlockLayout = VK_TRUE,
        .timelineSemaphore = VK_TRUE};
    const VkPhysicalDeviceFeatures2 features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2,
                                             .pNext = &v12};
    AdoptedDevice adopted = made.handles();
    adopted.features = &features;
    EXPECT_NE(why_refused(adopted).find("maintenance4"), std::string::npos);
    adopted = made.handles();
    adopted.queue_family = 1000;
    EXPECT_NE(why_refused(adopted).find("family 1000"), std::string::npos);
}

TEST_F(DeviceTest, QueuesAreThoseThatCanPresent) {
    const std::string select = device().info().name;
    int asked = 0;
    DeviceOptions options{.select = select};
    options.can_present = [&](VkInstance instance, VkPhysicalDevice physical, uint32_t family) {
        ++asked;
        return instance != VK_NULL_HANDLE && physical != VK_NULL_HANDLE && family == 0;
    };
    GpuDevice presenting(options);
    EXPECT_GT(asked, 0);
    EXPECT_EQ(presenting.queue_family(), 0u);
    EXPECT_NE(presenting.queue(), VK_NULL_HANDLE);
    options.can_present = [](VkInstance, VkPhysicalDevice, uint32_t) { return false; };
    EXPECT_NE(why_refused(options).find("presents"), std::string::npos);
    EXPECT_NE(why_refused({.select = select, .device_extensions = {"VK_EXT_no_such"}})
                  .find("VK_EXT_no_such"),
              std::string::npos);
    EXPECT_NE(why_refused({.select = select, .instance_extensions = {"VK_EXT_no_such"}})
                  .find("VK_EXT_no_such"),
              std::string::npos);
}

class SemaphoreTest : public GpuTest {
 protected:
    static VkSemaphore semaphore(VkSemaphoreType kind) {
        const VkSemaphoreTypeCreateInfo type{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
                                             .semaphoreType = kind};
        const VkSemaphoreCreateInfo create{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                           .pNext = &type};
        VkSemaphore made = VK_NULL_HANDLE;
        check(vkCreateSemaphore(device().handle(), &create, nullptr, &made), "a semaphore");
        return made;
    }
    static void signal(VkSemaphore semaphore, uint64_t value) {
        const VkSemaphoreSignalInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO,
                                         .semaphore = semaphore,
                                         .value = value};
        check(vkSignalSemaphore(device().handle(), &info), "signalling");
    }
};

TEST_F(SemaphoreTest, ASubmissionWaitsAndTellsWhenItIsDone) {
    const VkSemaphore go = semaphore(VK_SEMAPHORE_TYPE_TIMELINE);
    const VkSemaphore done = semaphore(VK_SEMAPHORE_TYPE_TIMELINE);
    const std::vector<std::byte> bytes(1000, std::byte(7));
    Buffer buffer(device(), "buffer", bytes.size(), Memory::device);
    Commands commands(device());
    commands.wait_for({go, 5});
    commands.signal({done, 3});
    commands.begin_pass("first");
    commands.copy(commands.upload(bytes), buffer);
    commands.end_pass();
    commands.flush(); // which waits, too, and signals nothing
    commands.begin_pass("second");
    const BufferSlice out = commands.read_back(buffer);
    commands.end_pass();
    const Ticket ticket = commands.ticket();
    EXPECT_FALSE(ticket.ready());
    EXPECT_EQ(ticket.value(), 0u);
    const uint64_t value = commands.submit();
    EXPECT_EQ(value, ticket.value());
    EXPECT_FALSE(ticket.ready());
    EXPECT_LT(device().passed(), ticket.value());
    uint64_t reached = 1;
    vkGetSemaphoreCounterValue(device().handle(), done, &reached);
    EXPECT_EQ(reached, 0u);
    signal(go, 5);
    const std::vector<PassTime> times = ticket.times();
    EXPECT_TRUE(ticket.ready());
    ASSERT_EQ(times.size(), 2u);
    EXPECT_EQ(times[0].name, "first");
    EXPECT_EQ(times[1].name, "second");
    vkGetSemaphoreCounterValue(device().handle(), done, &reached);
    EXPECT_EQ(reached, 3u);
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), out.mapped().begin()));
    vkDestroySemaphore(device().handle(), go, nullptr);
    vkDestroySemaphore(device().handle(), done, nullptr);
}

// As a window's picture comes and goes: one submission signals what the other waits for.
TEST_F(SemaphoreTest, BinaryOnesLinkTwoSubmissions) {
    const VkSemaphore acquired = semaphore(VK_SEMAPHORE_TYPE_BINARY);
    Buffer buffer(device(), "buffer", 64, Memory::device);
    const std::vector<std::byte> bytes(64, std::byte(9));
    Commands first(device());
    first.copy(first.upload(bytes), buffer);
    first.signal({acquired});
    first.submit();
    Commands second(device());
    second.wait_for({acquired, 0, VK_PIPELINE_STAGE_2_COPY_BIT});
    const BufferSlice out = second.read_back(buffer);
    second.submit();
    second.finish();
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), out.mapped().begin()));
    vkDestroySemaphore(device().handle(), acquired, nullptr);
}

} // namespace
} // namespace palpate
