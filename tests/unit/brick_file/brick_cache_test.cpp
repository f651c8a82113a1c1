#include "engine/volume/brick_cache.h"

#include <gtest/gtest.h>

#include <random>
#include <thread>

namespace palpate {
namespace {

SamplesPtr brick_of(uint64_t key) {
    const std::shared_ptr<std::byte[]> bytes(new std::byte[8]);
    for (int i = 0; i < 8; ++i)
        bytes[i] = static_cast<std::byte>(key);
    return bytes;
}

TEST(BrickCache, DropsWhatWasUsedLongestAgo) {
    BrickCache cache(10, 8, 24); // room for three
    const auto get = [&](uint64_t key) { return cache.get(key, [&] { return brick_of(key); }); };
    get(0);
    get(1);
    get(2);
    get(0);                         // now 1 is the oldest
    const SamplesPtr held = get(3); // drops 1
    EXPECT_EQ(cache.stats().dropped, 1u);
    EXPECT_EQ(cache.stats().misses, 4u);
    get(0);
    get(2);
    get(3);
    EXPECT_EQ(cache.stats().misses, 4u); // all there
    get(1);
    EXPECT_EQ(cache.stats().misses, 5u);
    EXPECT_EQ(cache.stats().held_bytes, 24u);
    EXPECT_EQ(held[0], std::byte{3});
}

TEST(BrickCache, WhatIsHeldOutlivesItsPlace) {
    BrickCache cache(10, 8, 8); // room for one
    const SamplesPtr first = cache.get(5, [] { return brick_of(5); });
    cache.get(6, [] { return brick_of(6); });
    EXPECT_EQ(first[7], std::byte{5});
    EXPECT_EQ(cache.stats().held_bytes, 8u);
}

TEST(BrickCache, AThrowingLoadLeavesNothingBehind) {
    BrickCache cache(10, 8, 80);
    EXPECT_THROW(cache.get(2, []() -> SamplesPtr { throw SourceError("gone"); }), SourceError);
    EXPECT_EQ(cache.stats().held_bytes, 0u);
    EXPECT_EQ(cache.get(2, [] { return brick_of(2); })[0], std::byte{2});
}

TEST(BrickCache, ManyThreadsGetTheirOwnBricks) {
    BrickCache cache(64, 8, 80);
    std::atomic<int> wrong = 0;
    std::vector<std::jthread> threads;
    for (uint32_t seed = 0; seed < 4; ++seed)
        threads.emplace_back([&, seed] {
            std::mt19937 random(seed);
            for (int i = 0; i < 20000; ++i) {
                const uint64_t key = random() % 64;
                wrong +=
                    cache.get(key, [&] { return brick_of(key); })[3] != static_cast<std::byte>(key);
            }
        });
    threads.clear();
    EXPECT_EQ(wrong, 0);
    EXPECT_LE(cache.stats().held_bytes, 80u);
    EXPECT_EQ(cache.stats().hits + cache.stats().misses, 80000u);
}

} // namespace
} // namespace palpate
