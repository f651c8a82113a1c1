#include "engine/base/memory.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <memory>
#include <vector>

namespace palpate {
namespace {

TEST(Memory, IsWhatAMachineMayHave) {
    EXPECT_GE(physical_memory_bytes(), uint64_t{1} << 26);
    EXPECT_LE(physical_memory_bytes(), uint64_t{1} << 50);
}

// Blocks of volumes, pictures and meshes are freed in another order than they were made, among
// small ones that stay. None of theirs may be kept; without return_freed_memory() glibc keeps all.
TEST(Memory, LargeBlocksGoBackToTheSystem) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer has an allocator of its own";
#endif
    return_freed_memory();
    std::make_unique<char[]>(16 * kReturnedBlockBytes); // would raise glibc's limit
    const size_t before = mallinfo2().fordblks;
    std::vector<std::unique_ptr<char[]>> large, small;
    for (int i = 0; i < 64; ++i) {
        large.push_back(std::make_unique<char[]>(kReturnedBlockBytes + 4096 * size_t(i)));
        small.push_back(std::make_unique<char[]>(1000));
    }
    EXPECT_GE(mallinfo2().hblks, 64u);
    large.clear();
    EXPECT_EQ(mallinfo2().hblks, 0u);
    EXPECT_LE(mallinfo2().fordblks, before + kReturnedBlockBytes); // free, and kept
}

} // namespace
} // namespace palpate
