#include "haptics/servo/brick_lock.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "engine/volume/synthetic.h"

namespace palpate::haptics {
namespace {

Volume gyroid() {
    return synthetic::sample(synthetic::gyroid(10.0),
                             make_grid(glm::uvec3(128), glm::dvec3(1, 1, 2)), ScalarType::u8);
}

// These sanitizers take mlock() away from the program.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr uint64_t kLeastLocked_kib = 0;
#else
constexpr uint64_t kLeastLocked_kib = 32;
#endif

uint64_t locked_kib() { // of this process, as the kernel counts
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.rfind("VmLck:", 0) == 0)
            return std::stoull(line.substr(6));
    return 0;
}

TEST(BrickLock, HoldsTheBricksRoundTheToolAndLetsGoOfOthers) {
    const Volume volume = gyroid();
    const uint64_t before = locked_kib();
    {
        BrickLock lock;
        lock.update(volume, {16, 16, 32}, 5.0); // within the first brick
        EXPECT_EQ(lock.bricks(), 1u);
        ASSERT_EQ(lock.refused(), 0u) << "this needs RLIMIT_MEMLOCK of 1 MiB";
        EXPECT_EQ(lock.locked_bytes(), size_t{kBrickSamples});
        EXPECT_GE(locked_kib(), before + kLeastLocked_kib);
        lock.update(volume, {32, 32, 64}, 5.0); // the corner of eight
        EXPECT_EQ(lock.bricks(), 8u);
        lock.update(volume, {32, 16, 32}, 5.0); // a face between two
        EXPECT_EQ(lock.bricks(), 2u);
        EXPECT_EQ(lock.locked_bytes(), size_t{2} * kBrickSamples);
        lock.update(volume, {1000, 0, 0}, 5.0);
        EXPECT_EQ(lock.bricks(), 0u);
        EXPECT_EQ(lock.locked_bytes(), 0u);
        lock.update(volume, {0, 0, 0}, 5.0);
    }
    EXPECT_EQ(locked_kib(), before);
}

TEST(BrickLock, DistanceIsMillimetresOnUnevenSpacing) {
    const Volume volume = gyroid(); // z is 2 mm a sample: the next brick begins at 64 mm
    BrickLock lock;
    lock.update(volume, {16, 16, 57.0}, 6.0);
    EXPECT_EQ(lock.bricks(), 1u);
    lock.update(volume, {16, 16, 57.0}, 7.5);
    EXPECT_EQ(lock.bricks(), 2u);
}

} // namespace
} // namespace palpate::haptics
