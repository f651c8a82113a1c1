// Waits of threads and queues, timestamps and memory of the private driver.

#include <atomic>
#include <thread>

#include "engine/base/profile.h"
#include "tests/native/native_fixture.h"

namespace palpate {
namespace {

class NativeOrder : public NativeTest {
 protected:
    VkSemaphore make_semaphore(VkSemaphoreType kind, uint64_t value = 0) {
        const VkSemaphoreTypeCreateInfo type{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
                                             .semaphoreType = kind,
                                             .initialValue = value};
        const VkSemaphoreCreateInfo create{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                           .pNext = &type};
        VkSemaphore made = VK_NULL_HANDLE;
        check(vkCreateSemaphore(device().handle(), &create, nullptr, &made), "a semaphore");
        made_.push_back(made);
        return made;
    }
    VkSemaphore make_timeline(uint64_t value = 0) {
        return make_semaphore(VK_SEMAPHORE_TYPE_TIMELINE, value);
    }
    uint64_t value_of(VkSemaphore semaphore) {
        uint64_t value = 0;
        check(vkGetSemaphoreCounterValue(device().handle(), semaphore, &value), "its value");
        return value;
    }
    void signal(VkSemaphore semaphore, uint64_t value) {
        const VkSemaphoreSignalInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO,
                                         .semaphore = semaphore,
                                         .value = value};
        check(vkSignalSemaphore(device().handle(), &info), "signalling");
    }
    VkResult wait(std::vector<VkSemaphore> semaphores, std::vector<uint64_t> values,
                  uint64_t timeout_ns, VkSemaphoreWaitFlags flags = 0) {
        const VkSemaphoreWaitInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO,
                                       .flags = flags,
                                       .semaphoreCount = static_cast<uint32_t>(semaphores.size()),
                                       .pSemaphores = semaphores.data(),
                                       .pValues = values.data()};
        return vkWaitSemaphores(device().handle(), &info, timeout_ns);
    }
    // Nothing to do but waiting and signalling.
    void submit(VkQueue queue, std::vector<SemaphoreUse> waits, std::vector<SemaphoreUse> signals,
                VkFence fence = VK_NULL_HANDLE) {
        const auto infos = [](const std::vector<SemaphoreUse>& uses) {
            std::vector<VkSemaphoreSubmitInfo> made;
            for (const SemaphoreUse& use : uses)
                made.push_back({.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                .semaphore = use.semaphore,
                                .value = use.value,
                                .stageMask = use.stages});
            return made;
        };
        const auto before = infos(waits), after = infos(signals);
        const VkSubmitInfo2 info{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                                 .waitSemaphoreInfoCount = static_cast<uint32_t>(before.size()),
                                 .pWaitSemaphoreInfos = before.data(),
                                 .signalSemaphoreInfoCount = static_cast<uint32_t>(after.size()),
                                 .pSignalSemaphoreInfos = after.data()};
        check(vkQueueSubmit2(queue, 1, &info, fence), "submitting");
    }
    void TearDown() override {
        device().wait_idle();
        for (const VkSemaphore semaphore : made_)
            vkDestroySemaphore(device().handle(), semaphore, nullptr);
        NativeTest::TearDown();
    }

 private:
    std::vector<VkSemaphore> made_;
};

TEST_F(NativeOrder, WorkWaitsForTheHostAndKeepsItsOrder) {
    const VkSemaphore go = make_timeline(), done = make_timeline(5);
    Buffer buffer(device(), "buffer", 4, Memory::read_back);
    std::memset(buffer.mapped().data(), 0, 4);
    RawCommands first(device()), second(device());
    vkCmdFillBuffer(first.handle(), buffer.handle(), 0, 4, 1);
    vkCmdFillBuffer(second.handle(), buffer.handle(), 0, 4, 2);
    const SemaphoreUse waits[] = {{go, 3}};
    first.run(waits);
    second.run();
    submit(device().queue(), {}, {{done, 6}});
    signal(go, 2);
    EXPECT_EQ(value_of(done), 5u); // a later value is waited for
    EXPECT_EQ(wait({done}, {6}, 0), VK_TIMEOUT);
    signal(go, 3);
    EXPECT_EQ(wait({done}, {6}, UINT64_MAX), VK_SUCCESS);
    EXPECT_EQ(buffer.mapped()[0], std::byte{2});
    second.wait();
}

TEST_F(NativeOrder, ThreadsAwakeOnceTheirValueIsThere) {
    constexpr uint64_t kThreads = 8;
    const VkSemaphore timeline = make_timeline();
    std::atomic<uint64_t> early = 0, awake = 0;
    std::vector<std::thread> threads;
    for (uint64_t i = 1; i <= kThreads; ++i)
        threads.emplace_back([&, i] {
            if (wait({timeline}, {i}, UINT64_MAX) != VK_SUCCESS || value_of(timeline) < i)
                ++early;
            ++awake;
        });
    for (uint64_t i = 1; i <= kThreads; ++i)
        submit(device().queue(), {}, {{timeline, i}});
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(early, 0u);
    EXPECT_EQ(awake, kThreads);
}

TEST_F(NativeOrder, WaitsAreForOneOrForAll) {
    const VkSemaphore low = make_timeline(1), high = make_timeline(7);
    EXPECT_EQ(wait({low, high}, {2, 7}, 0), VK_TIMEOUT);
    EXPECT_EQ(wait({low, high}, {2, 7}, 0, VK_SEMAPHORE_WAIT_ANY_BIT), VK_SUCCESS);
    EXPECT_EQ(wait({low, high}, {2, 8}, 0, VK_SEMAPHORE_WAIT_ANY_BIT), VK_TIMEOUT);
    EXPECT_EQ(wait({low, high}, {1, 7}, 0), VK_SUCCESS);
}

TEST_F(NativeOrder, ABinarySemaphoreServesOneWait) {
    const VkSemaphore binary = make_semaphore(VK_SEMAPHORE_TYPE_BINARY);
    const VkSemaphore done = make_timeline();
    for (uint64_t turn = 1; turn <= 3; ++turn) {
        submit(device().queue(), {}, {{binary}});
        submit(device().queue(), {{binary}}, {{done, turn}});
        EXPECT_EQ(wait({done}, {turn}, UINT64_MAX), VK_SUCCESS);
    }
}

TEST_F(NativeOrder, AFenceIsSignalledByItsSubmissionUntilItIsReset) {
    const VkFenceCreateInfo create{.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
    VkFence fence = VK_NULL_HANDLE;
    ASSERT_EQ(vkCreateFence(device().handle(), &create, nullptr, &fence), VK_SUCCESS);
    const VkSemaphore go = make_timeline();
    submit(device().queue(), {{go, 1}}, {}, fence);
    EXPECT_EQ(vkWaitForFences(device().handle(), 1, &fence, VK_TRUE, 0), VK_TIMEOUT);
    signal(go, 1);
    EXPECT_EQ(vkWaitForFences(device().handle(), 1, &fence, VK_TRUE, UINT64_MAX), VK_SUCCESS);
    EXPECT_EQ(vkResetFences(device().handle(), 1, &fence), VK_SUCCESS);
    EXPECT_EQ(vkWaitForFences(device().handle(), 1, &fence, VK_TRUE, 0), VK_TIMEOUT);
    vkDestroyFence(device().handle(), fence, nullptr);
}

TEST_F(NativeOrder, TwoQueuesWaitForEachOther) {
    GpuDevice two({.select = "palpate native",
                   .validation = through_loader(),
                   .can_present = [](auto...) { return true; }}); // so that it has two
    GpuDevice second(two);
    ASSERT_NE(second.queue(), two.queue());
    Buffer buffer(two, "buffer", 4, Memory::read_back);
    const uint32_t words[] = {1}, others[] = {2};
    Commands before(two), after(second);
    before.fill(buffer, words);
    after.fill(buffer, others);
    after.wait_for(two.done_by(two.last_submitted() + 1));
    after.submit(); // stands before the work that it waits for
    before.submit();
    after.ticket().wait();
    EXPECT_EQ(buffer.mapped()[0], std::byte{2});
    EXPECT_TRUE(two.validation_messages().empty());
}

TEST_F(NativeOrder, TimestampsNeverFall) {
    constexpr uint32_t kStamps = 64;
    Buffer buffer(device(), "buffer", 1 << 16, Memory::device);
    const int64_t before_ns = profile::now_ns();
    RawCommands commands(device());
    for (uint32_t i = 0; i < kStamps; ++i) {
        vkCmdWriteTimestamp2(commands.handle(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                             commands.queries(), i);
        commands.barrier();
        vkCmdFillBuffer(commands.handle(), buffer.handle(), 0, VK_WHOLE_SIZE, i);
    }
    commands.run();
    commands.wait();
    std::vector<uint64_t> stamps(kStamps);
    ASSERT_EQ(
        vkGetQueryPoolResults(device().handle(), commands.queries(), 0, kStamps, 8 * kStamps,
                              stamps.data(), 8, VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        VK_SUCCESS);
    for (uint32_t i = 1; i < kStamps; ++i)
        EXPECT_GE(stamps[i], stamps[i - 1]);
    EXPECT_GT(stamps.back(), stamps.front());
    // They are those of the host's clock.
    EXPECT_GE(device().cpu_ns_of(stamps.front()).value(), before_ns);
    EXPECT_LE(device().cpu_ns_of(stamps.back()).value(), profile::now_ns());
}

TEST_F(NativeOrder, AQueryThatWasResetHasNoResult) {
    RawCommands commands(device());
    vkCmdWriteTimestamp2(commands.handle(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                         commands.queries(), 0);
    commands.run();
    commands.wait();
    uint64_t results[4] = {9, 9, 9, 9};
    EXPECT_EQ(
        vkGetQueryPoolResults(device().handle(), commands.queries(), 0, 2, sizeof results, results,
                              16, VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WITH_AVAILABILITY_BIT),
        VK_NOT_READY);
    EXPECT_EQ(results[1], 1u);
    EXPECT_EQ(results[3], 0u);
}

class NativeMemory : public NativeTest {
 protected:
    static std::pair<uint64_t, uint64_t> budget_and_use() {
        VkPhysicalDeviceMemoryBudgetPropertiesEXT budget{
            .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_BUDGET_PROPERTIES_EXT};
        VkPhysicalDeviceMemoryProperties2 memory{
            .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_PROPERTIES_2, .pNext = &budget};
        vkGetPhysicalDeviceMemoryProperties2(device().physical(), &memory);
        EXPECT_LE(budget.heapBudget[0], memory.memoryProperties.memoryHeaps[0].size);
        return {budget.heapBudget[0], budget.heapUsage[0]};
    }
};

TEST_F(NativeMemory, UseRisesAndFallsWithAllocations) {
    constexpr uint64_t kBytes = 3 << 20;
    device().wait_idle();
    const auto [budget, before] = budget_and_use();
    EXPECT_GT(budget, before);
    {
        const Buffer buffer(device(), "buffer", kBytes, Memory::device);
        EXPECT_GE(budget_and_use().second, before + kBytes);
        EXPECT_LE(budget_and_use().second, before + kBytes + 4096);
    }
    device().wait(device().last_submitted());
    EXPECT_EQ(device().retired_bytes(), 0u); // frees what was retired
    EXPECT_EQ(budget_and_use().second, before);
}

} // namespace
} // namespace palpate
