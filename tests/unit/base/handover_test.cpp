#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "engine/base/mailbox.h"
#include "engine/base/ring.h"
#include "engine/base/wake.h"

// The handover between servo and editor with real threads; the thread sanitizer watches.
namespace palpate {
namespace {

struct Counted {
    static inline std::atomic<int> living = 0;
    std::array<uint64_t, 64> words{};
    explicit Counted(uint64_t n) {
        words.fill(n);
        ++living;
    }
    ~Counted() {
        words.fill(0xDEADDEADDEADDEAD);
        --living;
    }
};

TEST(Mailbox, GivesTheNewestAndFreesWhatNobodyReads) {
    {
        Mailbox<Counted> box(std::make_unique<const Counted>(1));
        auto reader = box.add_reader();
        EXPECT_EQ(reader.pin()->words[0], 1u);
        {
            const auto pin = reader.pin();
            for (uint64_t v = 2; v <= 5; ++v)
                box.publish(std::make_unique<const Counted>(v));
            EXPECT_EQ(pin->words[0], 1u);
            // 1 is read; the reader began before 2 came, so nothing later is freed either.
            EXPECT_EQ(box.waiting(), 4u);
            EXPECT_EQ(Counted::living, 5);
        }
        EXPECT_EQ(reader.pin()->words[0], 5u);
        box.collect();
        EXPECT_EQ(box.waiting(), 0u);
        EXPECT_EQ(Counted::living, 1);
        EXPECT_EQ(box.latest().words[0], 5u);
    }
    EXPECT_EQ(Counted::living, 0);
}

TEST(Mailbox, ReadersSeeWholeValuesThatOnlyGrowOlderOnes) {
    constexpr uint64_t kLast = 20000;
    Mailbox<Counted> box(std::make_unique<const Counted>(1));
    std::atomic<uint64_t> torn = 0, backwards = 0;
    const auto read = [&](Mailbox<Counted>::Reader reader) {
        for (uint64_t seen = 0; seen < kLast;) {
            const auto pin = reader.pin();
            const uint64_t first = pin->words.front();
            for (const uint64_t word : pin->words)
                torn += word != first;
            backwards += first < seen;
            seen = first;
        }
    };
    std::thread a(read, box.add_reader()), b(read, box.add_reader());
    for (uint64_t v = 2; v <= kLast; ++v)
        box.publish(std::make_unique<const Counted>(v));
    a.join();
    b.join();
    box.collect();
    EXPECT_EQ(torn, 0u);
    EXPECT_EQ(backwards, 0u);
    EXPECT_EQ(box.waiting(), 0u);
    EXPECT_EQ(Counted::living, 1);
}

TEST(Mailbox, PlacesOfReadersAreGivenBack) {
    Mailbox<int> box(std::make_unique<const int>(0));
    for (int i = 1; i <= 100; ++i) {
        auto a = box.add_reader();
        auto b = std::move(a);
        auto c = box.add_reader();
        box.publish(std::make_unique<const int>(i));
        EXPECT_EQ(*b.pin(), i);
        EXPECT_EQ(*c.pin(), i);
    }
    std::vector<Mailbox<int>::Reader> all;
    for (size_t i = 0; i < Mailbox<int>::kMaxReaders; ++i)
        all.push_back(box.add_reader());
    EXPECT_DEATH((void)box.add_reader(), "kMaxReaders");
}

TEST(Ring, RefusesWhenFullAndKeepsTheOrder) {
    Ring<int> ring(3);
    EXPECT_EQ(ring.capacity(), 4u);
    int value = -1;
    EXPECT_FALSE(ring.pop(value));
    EXPECT_EQ(value, -1);
    for (int round = 0; round < 5; ++round) {
        for (int i = 0; i < 4; ++i)
            EXPECT_TRUE(ring.push(10 * round + i));
        EXPECT_FALSE(ring.push(99));
        EXPECT_EQ(ring.size(), 4u);
        for (int i = 0; i < 4; ++i) {
            EXPECT_TRUE(ring.pop(value));
            EXPECT_EQ(value, 10 * round + i);
        }
        EXPECT_FALSE(ring.pop(value));
    }
}

TEST(Ring, EveryValueArrivesOnceAndInOrderBetweenThreads) {
    constexpr uint64_t kCount = 200000;
    Ring<std::array<uint64_t, 4>> ring(64);
    std::thread producer([&] {
        for (uint64_t i = 0; i < kCount;)
            if (ring.push({i, i, i, i}))
                ++i;
            else
                std::this_thread::yield();
    });
    uint64_t wrong = 0;
    for (uint64_t i = 0; i < kCount;) {
        std::array<uint64_t, 4> value{};
        if (!ring.pop(value)) {
            std::this_thread::yield();
            continue;
        }
        for (const uint64_t word : value)
            wrong += word != i;
        ++i;
    }
    producer.join();
    EXPECT_EQ(wrong, 0u);
    EXPECT_EQ(ring.size(), 0u);
}

TEST(Wake, AnswersFollowQuestionsBetweenThreads) {
    constexpr int kCount = 20000;
    Wake asked, answered;
    int question = 0, answer = 0; // no atomics: a wait sees what was written before its wake
    std::thread follower([&] {
        while (answer < kCount) {
            asked.wait();
            answer = question;
            answered.wake();
        }
    });
    for (int n = 1; n <= kCount; ++n) {
        question = n;
        asked.wake();
        answered.wait();
        ASSERT_EQ(answer, n);
    }
    follower.join();
}

TEST(Wake, AWakeBeforeAWaitEndsThatWaitAndSeveralAreOne) {
    Wake wake;
    wake.wake();
    wake.wake();
    EXPECT_TRUE(wake.wait());
    EXPECT_FALSE(wake.wait(Wake::Clock::now()));
    EXPECT_FALSE(wake.wait(Wake::Clock::time_point())); // long ago
}

TEST(Wake, AStopEndsAWait) {
    Wake wake;
    std::jthread follower([&](const std::stop_token& stop) {
        while (!stop.stop_requested())
            wake.wait(stop);
    });
    follower.request_stop();
    follower.join();
    std::stop_source stopped;
    stopped.request_stop();
    EXPECT_TRUE(wake.wait(stopped.get_token()));
}

// Followers come and go while a publisher wakes them; one that is there misses nothing.
TEST(Followers, ComeAndGoWhileTheyAreWoken) {
    Followers followers;
    std::atomic<int> published = 0, gone = 0;
    constexpr int kThreads = 3, kRounds = 500;
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t)
        threads.emplace_back([&] {
            for (int i = 0; i < kRounds; ++i) {
                Wake wake;
                const auto place = followers.add(wake);
                for (const int seen = published; published == seen;)
                    wake.wait();
            }
            ++gone;
        });
    while (gone < kThreads) {
        ++published;
        followers.wake();
    }
    for (std::thread& thread : threads)
        thread.join();
}

} // namespace
} // namespace palpate
