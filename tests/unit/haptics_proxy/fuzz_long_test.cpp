#include <atomic>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

#include "tests/unit/haptics_proxy/fuzz.h"

// PALPATE_TICKS (10^8) sets how many ticks over all algorithms, PALPATE_SECONDS (3600) after how
// many seconds it ends even so, PALPATE_SEED (1) with which numbers. On all processors.
namespace palpate::haptics {
namespace {

uint64_t setting(const char* name, uint64_t otherwise) {
    const char* value = std::getenv(name);
    return value ? std::stoull(value) : otherwise;
}

TEST(FuzzLong, NoInputGivesAnythingButNumbersInAHundredMillionTicksOrAnHour) {
    using Clock = std::chrono::steady_clock;
    constexpr uint64_t kRun = 5000; // ticks of one algorithm from one seed
    const uint64_t ticks = setting("PALPATE_TICKS", 100'000'000);
    const uint64_t first = setting("PALPATE_SEED", 1);
    const auto end = Clock::now() + std::chrono::seconds(setting("PALPATE_SECONDS", 3600));
    const FuzzScenes scenes;
    std::atomic<uint64_t> next = 0;
    const auto work = [&] {
        for (uint64_t run; (run = next++) * kRun < ticks && Clock::now() < end;) {
            const auto all = algorithms();
            fuzz_algorithm(all[run % all.size()], scenes, first + run / all.size(), kRun);
            if (testing::Test::HasFatalFailure())
                return;
        }
    };
    std::vector<std::thread> threads;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
        threads.emplace_back(work);
    for (std::thread& thread : threads)
        thread.join();
    std::printf("    %llu ticks\n",
                static_cast<unsigned long long>(std::min(next.load() * kRun, ticks)));
}

} // namespace
} // namespace palpate::haptics
